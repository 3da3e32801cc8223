"""Polygons with defects of drawings: coincident, collinear or close corners; blocks that hardly touch, or overlap."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from damagepred.assembly import Assembly
from damagepred.assembly.assembly import rectangle
from damagepred.scene import Dynamics, Joint, Solver
from damagepred.solvers import solve_path
from studies.benchmarks.stress.case import NOT_LONG, STATIC, Case, Check, Found

Corners = Sequence[tuple[float, float]]
A, B = 0.24, 0.075
BOND = Joint(tensile_strength=1e9, cohesion=1e9)
CLEAN: Corners = [(0.0, B), (A, B), (A, 2 * B), (0.0, 2 * B)]


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
    exact = next(iter(solve_path(three(CLEAN, deformable).build(own), own, 1))).displacement
    return Check("clean drawing", float(np.abs(found.path[-1].displacement - exact).max() / np.abs(exact).max()))


MIDDLES: dict[str, tuple[str, Corners]] = {
    "clean": ("stands", CLEAN),
    "clockwise": ("stands", CLEAN[::-1]),
    "a corner twice": ("stands", [CLEAN[0], *CLEAN]),
    "all corners twice": ("stands", [c for c in CLEAN for _ in range(2)]),
    "first corner again at the end": ("stands", [*CLEAN, CLEAN[0]]),
    "a corner on an edge": ("stands", [CLEAN[0], (0.1, B), *CLEAN[1:]]),
    "many corners on an edge": ("stands", [*((A * i / 20, B) for i in range(20)), *CLEAN[1:]]),
    "corners 1e-13 m apart": ("stands", [CLEAN[0], (1e-13, B), *CLEAN[1:]]),
    "corners 1e-9 m apart": ("stands", [CLEAN[0], (1e-9, B), *CLEAN[1:]]),
    "corners 1e-6 m apart": ("stands", [CLEAN[0], (1e-6, B), *CLEAN[1:]]),
    "corners 1e-4 m apart": ("stands", [CLEAN[0], (1e-4, B), *CLEAN[1:]]),
    "edge 1e-12 m out of line": ("stands", [(0.0, B), (A, B + 1e-12), (A, 2 * B), (0.0, 2 * B - 1e-12)]),
    "edge bent by 1e-10 m": ("stands", [CLEAN[0], (0.1, B + 1e-10), *CLEAN[1:]]),
    "corner cut by 1e-7 m": ("stands", [(1e-7, B), (A, B), (A, 2 * B), (0.0, 2 * B), (0.0, B + 1e-7)]),
    "no area": ("refused", [(0.0, B), (A, B), (0.0, B)]),
    "two corners": ("refused", [(0.0, B), (A, B)]),
    "dented": ("refused", [(0.0, B), (A, B), (0.1, 1.5 * B), (A, 2 * B), (0.0, 2 * B)]),
    "crossed": ("refused", [(0.0, B), (A, 2 * B), (A, B), (0.0, 2 * B)]),
    "overlaps the one below": ("refused", [(0.0, 0.9 * B), (A, 0.9 * B), (A, 2 * B), (0.0, 2 * B)]),
    "not a number": ("refused", [(0.0, B), (A, float("nan")), (A, 2 * B), (0.0, 2 * B)]),
    "endless": ("refused", [(0.0, B), (float("inf"), B), (float("inf"), 2 * B), (0.0, 2 * B)]),
    "gap of 1e-12 m": ("stands", [(x, y + 1e-12 * (y == B)) for x, y in CLEAN]),
    "gap of 1 mm": ("falls", [(x, y + 1e-3 * (y == B)) for x, y in CLEAN]),
    "bears on a corner": ("falls", [(0.12, B), (A, 1.5 * B), (0.12, 2 * B), (0.0, 1.5 * B)]),
}
OTHER = {"corner cut by 1e-7 m"}
"""Stable drawings that differ slightly from the clean one."""


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
    for name, (expect, corners) in MIDDLES.items():
        make = partial(three, corners)
        check = as_if_clean if expect == "stands" and name not in OTHER else None
        made.append(Case("drawings", name, make, expect, check, ways=STATIC if name in floats else NOT_LONG))
        if name in floats:
            again = replace(made[-1], name=f"{name}, in time", expect="", check=floats[name], ways=("in time, rigid",))
            made.append(replace(again, dynamics=lambda _: still))
    return made
