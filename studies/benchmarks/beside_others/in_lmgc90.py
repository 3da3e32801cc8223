"""A case in LMGC90 through compas_lmgc90: non-smooth contact dynamics, rigid polyhedra, implicit in time.

The wrapper has polyhedra only: the wall is a slice as thick as it is, with four contact points to a joint instead of
two, that moves in three dimensions. LMGC90 holds one simulation for each process.
"""

from __future__ import annotations

import numpy as np
from compas_lmgc90 import _lmgc90
from record import Record, Wall, run

ALERT = 1e-3
"""Distance below which contact of a pair of blocks is detected (m)."""
FACES = [int(corner) for corner in "012023465476045051156162267273374340"]
"""Corners of the triangles of a block, counter-clockwise seen from outside; corners 0 to 3 in front, 4 to 7 behind."""


class Simulation:
    """The wall as LMGC90 has it: x along it, y through it, z upwards."""

    def __init__(self, case: dict, settings: dict) -> None:
        self.wall = Wall(case)
        self.case, self.dt, self.now = case, settings["dt"], 0.0
        self.count = len(self.wall.mass)
        self.solver = _lmgc90.LMGC90Solver()
        self.solver.initialize(self.dt, 0.5, False)
        self.solver.set_materials([case["density"]])
        self.solver.add_one_tact_behav("iqsc0", settings.get("law", "IQS_CLB"), [case["friction"]])
        self.solver.set_see_tables(ALERT)
        self.solver.set_nb_bodies(self.count + len(case["ground"]))
        for corners in case["blocks"]:
            self._add(corners, held=False)
        first, last = case["drop_from"], case["drop_until"]
        for i, (corners, drop) in enumerate(zip(case["ground"], case["drop"])):
            self._add(corners, held=True)
            for dof in range(1, 7):
                if drop and dof == 3:
                    at = [0.0, first, first + self.dt / 10, last - self.dt / 10, last, 1e3]
                    speed = [0.0, 0.0, -drop / (last - first), -drop / (last - first), 0.0, 0.0]
                    self.solver.set_drvdof(self.count + i + 1, dof, at + speed, True, True)
                else:
                    self.solver.set_drvdof(self.count + i + 1, dof, [0.0] * 6, True, False)
        self.solver.close_before_computing()
        begin = self.solver.get_initial_state()
        self.start, self.frame = np.array(begin.init_bodies), np.array(begin.init_body_frames).reshape(-1, 3, 3)
        self.result = None

    def _add(self, corners: list, held: bool) -> None:
        half, flat = self.case["thickness"] / 2, np.array(corners)
        x, z = flat.mean(axis=0)
        points = [(a - x, y, b - z) for y in (-half, half) for a, b in flat]
        faces = [corner + 1 for corner in FACES]
        coordinates = [float(v) for point in points for v in point]
        self.solver.set_one_polyr("s0001", [x, 0.0, z], faces, coordinates, 6 if held else 0, 0)

    def advance(self, record: Record) -> int:
        """Integrate over a time step."""
        record.start()
        self.result = self.solver.compute_one_step()
        record.stop()
        self.now += self.dt
        return 1

    def check(self) -> tuple[float, np.ndarray]:
        """Return the residual, and the vertical force of the ground on each of the lowest blocks (N)."""
        wall, result = self.wall, self.result
        force = np.zeros((self.count + len(self.case["ground"]), 3))
        base = np.zeros(self.count)
        if len(result.interaction_bodies):
            pairs = np.array(result.interaction_bodies) - 1
            at = np.array(result.interaction_coords)[:, ::2]
            on = np.array(result.interaction_force_global)[:, ::2]
            centre = np.array(result.bodies)[:, ::2]
            for side, sign in ((0, 1.0), (1, -1.0)):
                block = pairs[:, side]
                arm = at - centre[block]
                moment = arm[:, 0] * on[:, 1] - arm[:, 1] * on[:, 0]
                np.add.at(force, block, sign * np.column_stack((on, moment)))
                other = pairs[:, 1 - side] >= self.count
                np.add.at(base, block[other & (block < self.count)], sign * on[other & (block < self.count), 1])
        force = force[: self.count]
        force[:, 1] -= wall.weight
        return wall.residual(force), base[wall.lowest]

    def displacement(self) -> np.ndarray:
        """Return x, z and rotation in the plane of each block (n, 3)."""
        moved = (np.array(self.result.bodies) - self.start)[: self.count, ::2]
        # rows of a frame are the axes of inertia: how far they have turned in the plane
        frame = np.array(self.result.body_frames).reshape(-1, 3, 3)
        turn = (np.swapaxes(frame, 1, 2) @ self.frame)[: self.count]
        return np.column_stack((moved, np.arctan2(turn[:, 2, 0], turn[:, 0, 0])))


if __name__ == "__main__":
    run("0.1.11", Simulation)
