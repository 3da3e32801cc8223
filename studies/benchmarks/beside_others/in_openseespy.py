"""A case in OpenSees through openseespy: elastic blocks of two finite elements each, contact springs at their nodes.

Every half brick is a four-node element (plane stress), every joint between two half bricks a pair of
``zeroLengthContact2D`` elements, no-tension springs with friction, with the stiffness of the mortar. The wall is solved
statically (Newton) under its own weight.
"""

from __future__ import annotations

import itertools
import time

import numpy as np
import openseespy.opensees as ops
from record import Wall, answer, read_case


class Model:
    """The wall as OpenSees has it."""

    def __init__(self, case: dict, half: float = 0.12) -> None:
        self.case, self.wall = case, Wall(case)
        ops.wipe()
        ops.model("basic", "-ndm", 2, "-ndf", 2)
        ops.nDMaterial("ElasticIsotropic", 1, case["elastic_modulus"], case["poisson_ratio"])
        self.node, self.element = 0, 0
        self.nodes: list[dict[tuple[float, float], int]] = []  # of each block, by place
        thickness = case["thickness"]
        self.load: dict[int, float] = {}
        for corners in self.wall.corners:
            (left, bottom), (right, top) = corners.min(axis=0), corners.max(axis=0)
            parts = round((right - left) / half)
            xs = np.linspace(left, right, parts + 1)
            own = {(round(x, 6), round(y, 6)): self._node(x, y) for y in (bottom, top) for x in xs}
            low, high = round(bottom, 6), round(top, 6)
            share = case["density"] * thickness * half * (top - bottom) / 4
            for a, b in itertools.pairwise(xs):
                four = [own[round(x, 6), y] for x, y in ((a, low), (b, low), (b, high), (a, high))]
                self.element += 1
                ops.element("quad", self.element, *four, thickness, "PlaneStress", 1)
                for node in four:
                    self.load[node] = self.load.get(node, 0.0) + share
            self.nodes.append(own)
        self.half = half
        self._joints()
        self._on_ground()

    def _node(self, x: float, y: float) -> int:
        self.node += 1
        ops.node(self.node, float(x), float(y))
        return self.node

    def _contact(self, upper: int, lower: int, area: float, normal: tuple[float, float]) -> None:
        case = self.case
        self.element += 1
        law = (case["normal_stiffness"] * area, case["shear_stiffness"] * area, case["friction"])
        ops.element("zeroLengthContact2D", self.element, upper, lower, *law, "-normal", *normal)

    def _joints(self) -> None:
        """Join nodes of different blocks that lie on each other: those of a bed joint and those of a head joint."""
        thickness = self.case["thickness"]
        box = [(np.min(list(own), axis=0), np.max(list(own), axis=0)) for own in self.nodes]
        at: dict[tuple[float, float], list[int]] = {}
        for block, own in enumerate(self.nodes):
            for place in own:
                at.setdefault(place, []).append(block)
        pairs = {(a, b) for blocks in at.values() for a in blocks for b in blocks if a < b}
        for a, b in sorted(pairs):
            (low_a, high_a), (low_b, _) = box[a], box[b]
            common = sorted(set(self.nodes[a]) & set(self.nodes[b]))
            on, beside = abs(high_a[1] - low_b[1]) < 1e-6, abs(high_a[0] - low_b[0]) < 1e-6
            if len(common) < 2 or not (on or beside):
                continue
            area = (self.half if on else high_a[1] - low_a[1]) * thickness / 2
            for place in common:
                normal = (0.0, 1.0) if on else (1.0, 0.0)
                self._contact(self.nodes[b][place], self.nodes[a][place], area, normal)

    def _on_ground(self) -> None:
        """Connect every node of the underside to a fixed node of the ground."""
        self.base: list[list[int]] = []
        for block in self.wall.lowest:
            own = sorted(p for p in self.nodes[block] if abs(p[1]) < 1e-9)
            under = []
            for i, place in enumerate(own):
                node = self._node(*place)
                share = self.half * self.case["thickness"] / (2 if i in (0, len(own) - 1) else 1)
                self._contact(self.nodes[block][place], node, share, (0.0, 1.0))
                ops.fix(node, 1, 1)
                under.append(node)
            self.base.append(under)

    def unbalanced(self) -> np.ndarray:
        """Return the residual force on each block (n, 3), without inertia."""
        ops.reactions()
        found = np.zeros((len(self.nodes), 3))
        for block, own in enumerate(self.nodes):
            for place, node in own.items():
                force = np.array(ops.nodeReaction(node))
                arm = np.array(place) - self.wall.centre[block]
                found[block] += (*force, arm[0] * force[1] - arm[1] * force[0])
        return found

    def base_force(self) -> np.ndarray:
        """Return the vertical force of the ground on each of the lowest blocks (N)."""
        ops.reactions()
        return np.array([sum(ops.nodeReaction(node)[1] for node in under) for under in self.base])

    def displacement(self) -> np.ndarray:
        """Return the mean displacement and rotation of each block (n, 3)."""
        found = np.zeros((len(self.nodes), 3))
        for block, own in enumerate(self.nodes):
            arm = np.array(list(own)) - self.wall.centre[block]
            moved = np.array([ops.nodeDisp(node) for node in own.values()])
            turn = (arm[:, 0] * moved[:, 1] - arm[:, 1] * moved[:, 0]).sum() / (arm**2).sum()
            found[block] = (*moved.mean(axis=0), turn)
        return found


def solved(case: dict, level: float) -> dict:
    """Solve the wall under its own weight statically, to a residual."""
    began = time.process_time()
    model = Model(case)
    ops.timeSeries("Linear", 1)
    ops.pattern("Plain", 1, 1)
    for node, mass in model.load.items():
        ops.load(node, 0.0, -mass * case["gravity"])
    ops.constraints("Transformation")
    ops.numberer("RCM")
    ops.system("UmfPack")
    ops.test("NormUnbalance", level * model.wall.weight.mean(), 100)
    ops.algorithm("Newton")
    found = {"build": time.process_time() - began, "seconds": 0.0, "note": ""}
    for load in (1.0, *[0.0] * 20):  # committing a step moves the points where contacts stick: until it balances
        ops.integrator("LoadControl", load)
        if load:
            ops.analysis("Static")
        began = time.process_time()
        converged = ops.analyze(1) == 0
        found["seconds"] += time.process_time() - began
        residual = model.wall.residual(model.unbalanced())
        if residual <= level or not converged:
            break
    found |= {"steps": ops.testIter(), "residual": residual, "base": model.base_force()}
    found["note"] = "" if converged else "static Newton did not converge"
    return found | {"displacement": model.displacement(), "settles": bool(converged and residual <= level)}


if __name__ == "__main__":
    case, _, _, path = read_case()
    runs = [solved(case, level) for level in case["levels"]]
    times = [run["seconds"] if run.pop("settles") else None for run in runs]
    answer(path, **runs[-1], settled=times, version=ops.version())
