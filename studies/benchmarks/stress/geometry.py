"""Polygons with defects of drawings: coincident, collinear or close corners; blocks that hardly touch, or overlap."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from damagepred.assembly import Assembly
from damagepred.assembly.assembly import rectangle
from damagepred.scene import Dynamics, Joint, Solver
from damagepred.solvers import solve_path
from studies.benchmarks import walls
from studies.benchmarks.stress.case import STATIC, WAYS, Case, Check, Found

Corners = Sequence[Sequence[float]]
A, B = 0.24, 0.075
BOND = Joint(tensile_strength=1e9, cohesion=1e9)


def three(middle: Corners, deformable: bool) -> Assembly:
    """Return a stack of three blocks with a given middle block."""
    made = Assembly(joint=BOND)
    for corners in (rectangle(0.0, 0.0, A, B), middle, rectangle(0.0, 2 * B, A, 3 * B)):
        made.add_block(corners, zone_size=B if deformable else 0.0)
    made.rest_on_ground([0])
    return made


def as_if_clean(found: Found) -> Check:
    """Compare with the stack of clean rectangles."""
    deformable = found.model.mesh is not None
    own = Solver()
    exact = next(iter(solve_path(three(MIDDLES["clean"]["corners"], deformable).build(own), own, 1))).displacement
    return Check("clean drawing", float(np.abs(found.path[-1].displacement - exact).max() / np.abs(exact).max()))


MIDDLES = walls.read(Path(__file__).with_name("drawings.toml"))


def lies_lower(found: Found, by: float) -> Check:
    """Compare the drop of the upper two blocks with the gap below them."""
    moved = found.path[-1].displacement[1:, :2]
    return Check("gap", float(np.abs(moved - (0.0, -by)).max() / by), 1e-2)


def stays(found: Found) -> Check:
    """Compare with a stack at rest: a block balanced on its tip stays in unstable equilibrium."""
    return Check("symmetry", float(np.abs(found.path[-1].displacement).max() / B), 1e-4)


def cases() -> list[Case]:
    """Return all cases; a block that falls by statics lands on the block below in time."""
    floats = {"gap of 1 mm": partial(lies_lower, by=1e-3), "bears on a corner": stays}
    still = Dynamics(duration=0.3, outputs=6, damping="local", start="unstressed")
    made = []
    for name, drawing in MIDDLES.items():
        expect, make = drawing["expect"], partial(three, drawing["corners"])
        check = as_if_clean if expect == "stands" and name != "corner cut by 1e-7 m" else None
        made.append(Case("drawings", name, make, expect, check, ways=STATIC if name in floats else WAYS))
        if name in floats:
            again = replace(made[-1], name=f"{name}, in time", expect="", check=floats[name], ways=("in time, rigid",))
            made.append(replace(again, dynamics=lambda _: still))
    return made
