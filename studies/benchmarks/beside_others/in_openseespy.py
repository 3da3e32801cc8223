"""A case in OpenSees through openseespy: elastic blocks of two finite elements each, contact springs at their nodes.

Every half brick is a four-node element (plane stress), every joint between two half bricks a pair of
``zeroLengthContact2D`` elements, no-tension springs with friction, with the stiffness of the mortar. Under
its own weight, and pushed, the wall is solved statically (Newton). Where the ground drops, blocks separate, and no
static step converges: there it is solved in time (Newmark, or central differences; damped).
"""

from __future__ import annotations

import itertools
import time

import numpy as np
import openseespy.opensees as ops
from record import Record, Wall, answer, read_case, settle

ALPHA = 300.0
"""Damping in proportion to mass (1/s) of runs in time."""


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
        for node, mass in self.load.items():
            ops.mass(node, mass, mass)
        self.half, self.ground = half, {}
        self._joints()
        self._on_ground()

    def _node(self, x: float, y: float) -> int:
        self.node += 1
        ops.node(self.node, float(x), float(y))
        return self.node

    def _contact(self, upper: int, lower: int, area: float, normal: tuple[float, float]) -> int:
        case = self.case
        self.element += 1
        ops.element(
            "zeroLengthContact2D",
            self.element,
            upper,
            lower,
            case["normal_stiffness"] * area,
            case["shear_stiffness"] * area,
            case["friction"],
            "-normal",
            *normal,
        )
        return self.element

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
            if len(common) < 2:
                continue
            if abs(high_a[1] - low_b[1]) < 1e-6:  # b lies on a
                area = self.half * thickness / 2
                for place in common:
                    self._contact(self.nodes[b][place], self.nodes[a][place], area, (0.0, 1.0))
            elif abs(high_a[0] - low_b[0]) < 1e-6:  # b stands to the right of a
                area = (high_a[1] - low_a[1]) * thickness / 2
                for place in common:
                    self._contact(self.nodes[b][place], self.nodes[a][place], area, (1.0, 0.0))

    def _on_ground(self) -> None:
        """Connect every node of the underside to a fixed node of the ground."""
        self.base: list[list[int]] = []
        for block in self.wall.lowest:
            own = sorted(p for p in self.nodes[block] if abs(p[1]) < 1e-9)
            x = self.wall.centre[block, 0]
            piece = next(
                i for i, g in enumerate(self.case["ground"]) if np.min(g, axis=0)[0] < x < np.max(g, axis=0)[0]
            )
            under = []
            for i, place in enumerate(own):
                node = self._node(*place)
                share = self.half * self.case["thickness"] / (2 if i in (0, len(own) - 1) else 1)
                self._contact(self.nodes[block][place], node, share, (0.0, 1.0))
                ops.fix(node, 1, 0 if self.case["drop"][piece] else 1)
                self.ground[node] = self.case["drop"][piece]
                under.append(node)
            self.base.append(under)

    def weigh(self, factor: float = 0.0) -> None:
        """Apply the weight, and with it a horizontal share of it if there is one."""
        if not factor:
            ops.timeSeries("Linear", 1)
            ops.pattern("Plain", 1, 1)
        for node, mass in self.load.items():
            weight = mass * self.case["gravity"]
            ops.load(node, factor * weight, 0.0 if factor else -weight)

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


def solved_by(tolerance: float, iterations: int) -> None:
    ops.constraints("Transformation")
    ops.numberer("RCM")
    ops.system("UmfPack")
    ops.test("NormUnbalance", tolerance, iterations)
    ops.algorithm("Newton")


def own_weight(case: dict, limit: float) -> dict:
    """Solve the wall under its own weight statically, once for each residual."""
    times, found = [], None
    for level in case["levels"]:
        began = time.process_time()
        model = Model(case)
        model.weigh()
        build = time.process_time() - began
        solved_by(level * model.wall.weight.mean(), 100)
        ops.integrator("LoadControl", 1.0)
        ops.analysis("Static")
        began = time.process_time()
        converged = ops.analyze(1) == 0
        seconds = time.process_time() - began
        residual = model.wall.residual(model.unbalanced())
        for _ in range(20):  # committing a step moves the points where contacts stick: iterate until it balances
            if residual <= level or not converged:
                break
            ops.integrator("LoadControl", 0.0)
            began = time.process_time()
            converged = ops.analyze(1) == 0
            seconds += time.process_time() - began
            residual = model.wall.residual(model.unbalanced())
        times.append(seconds if converged and residual <= level else None)
        found = {
            "build": build,
            "seconds": seconds,
            "steps": ops.testIter(),
            "residual": residual,
            "base": model.base_force(),
            "displacement": model.displacement(),
            "note": "" if converged else "static Newton did not converge",
        }
    return {**found, "settled": {"seconds": times}}


def stepped(dt: float, halvings: int) -> int:
    """Integrate over a time step, with substeps where Newton's method diverges; return their number, 0 if none."""
    end, step, count = ops.getTime() + dt, dt, 0
    while ops.getTime() < end - 1e-12:
        if ops.analyze(1, min(step, end - ops.getTime())) == 0:
            count += 1
            step = min(dt, 2 * step)
            continue
        step /= 2
        if step < dt / 2**halvings:
            return 0
    return count


class InTime(Model):
    """The wall in time: weight at once, then the ground drops."""

    def __init__(self, case: dict, settings: dict) -> None:
        super().__init__(case)
        self.settings, self.explicit = settings, settings["scheme"] == "explicit"
        ops.timeSeries("Constant", 1)
        ops.pattern("Plain", 1, 1)
        for node, mass in self.load.items():
            ops.load(node, 0.0, -mass * case["gravity"])
        ops.timeSeries(
            "Path", 2, "-time", 0.0, case["drop_from"], case["drop_until"], 1e6, "-values", 0.0, 0.0, 1.0, 1.0
        )
        ops.pattern("Plain", 2, 2)
        for node, drop in self.ground.items():
            if drop:
                ops.sp(node, 2, -drop)
        ops.rayleigh(ALPHA, 0.0, 0.0, 0.0)
        if self.explicit:
            ops.constraints("Transformation")
            ops.numberer("Plain")
            ops.system("Diagonal")
            ops.algorithm("Linear")
            ops.integrator("CentralDifference")
        else:
            solved_by(1e-2 * min(case["levels"]) * self.wall.weight.mean(), 50)
            ops.integrator("Newmark", 0.6, 0.3025)
        ops.analysis("Transient")

    @property
    def now(self) -> float:
        """Time (s)."""
        return ops.getTime()

    def advance(self, record: Record) -> int:
        """Integrate to the next check; return the number of steps, 0 where none converges."""
        record.start()
        if self.explicit:
            every = self.settings["every"]
            steps = every if ops.analyze(every, self.settings["dt"]) == 0 else 0
        else:
            steps = stepped(self.settings["dt"], self.settings.get("halvings", 10))
        record.stop()
        return steps

    def check(self) -> tuple[float, np.ndarray]:
        """Return the residual, and the vertical force of the ground on each of the lowest blocks (N)."""
        return self.wall.residual(self.unbalanced()), self.base_force()


def pushed(case: dict, settings: dict, limit: float) -> dict:
    """Push the wall by a growing share of its weight until no static step, however small, converges."""
    began = time.process_time()
    model = Model(case)
    model.weigh()
    solved_by(1e-3 * model.wall.weight.mean(), 50)
    ops.integrator("LoadControl", 1.0)
    ops.analysis("Static")
    if ops.analyze(1):
        return {"note": "does not converge under its own weight"}
    ops.loadConst("-time", 0.0)
    ops.timeSeries("Linear", 2)
    ops.pattern("Plain", 2, 2)
    model.weigh(1.0)
    step, reached = 0.05, 0.0
    while step > settings["width"] / 2 and time.process_time() - began < limit and reached < 1.5:
        ops.integrator("LoadControl", step)
        if ops.analyze(1):
            step /= 2
        else:
            reached = ops.getTime()
    return {"seconds": time.process_time() - began, "low": reached, "high": reached + 2 * step}


def main() -> None:
    case, settings, path = read_case()
    limit = settings.pop("limit")
    if case["name"] == "tilt":
        found = pushed(case, settings, limit)
    elif any(case["drop"]):
        found = settle(case, limit, lambda: InTime(case, settings))
    else:
        found = own_weight(case, limit)
    answer(path, **found, version=ops.version())


if __name__ == "__main__":
    main()
