"""The cases of the study: the quantity that grows, its walls and sizes."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import zip_longest
from typing import NamedTuple

from damagepred.scene import BlockMaterial, Scene, Solver
from studies.benchmarks.skips.skips import bryant, part_of_test

ALIKE = 200
"""Blocks of the wall of which contacts, zones or increments grow."""
INCREMENTS = {"quasi_static": 20, "explicit": 4}
"""Increments of the movement, unless these grow."""
PATIENCE = 1_000_000
"""Limit of the explicit solver's cycles in an increment: large walls need more than the default."""
AS_MANY = 0.075
"""Size of cells (m) with which both solvers have 16 zones in a brick, the default of the quasi-static one."""
WEAK = BlockMaterial(cohesion=0.15e6, friction=0.75, tensile_strength=0.1e6)
"""Bricks of which some zones yield when a wall without a dpc dishes as far as the test."""


class Case(NamedTuple):
    """One point of a curve: the quantity that grows along it, its name in ``GROWING``, and the size of the quantity."""

    grows: str
    curve: str
    size: float


class Curve(NamedTuple):
    """Cases of one kind.

    Attributes
    ----------
    method : {"quasi_static", "explicit"}
        Solver.
    dpc : bool
        Whether the wall has a damp-proof course, along which it separates; without, it cracks.
    zoned : bool
        Whether its blocks are deformable.
    sizes : tuple of float
        From small to large.
    only_weight : bool
        Whether the path is the equilibrium under dead load alone, by the explicit solver.
    block : BlockMaterial
        Of the bricks.
    """

    method: str
    dpc: bool
    zoned: bool
    sizes: tuple[float, ...]
    only_weight: bool = False
    block: BlockMaterial = BlockMaterial()


MANY = (100, 200, 400, 816, 1600, 3200, 6400, 12800, 20_000)
"""Blocks."""
POINTS = (3, 4, 5, 7, 9)
"""Contacts for each interface."""
STEPS = (5, 10, 20, 40, 80, 160)
CELLS = (0.24, 0.12, 0.06, 0.04, 0.03)
"""Sizes of cells of four zones (m)."""
GROWING: dict[str, dict[str, Curve]] = {
    "blocks": {
        "quasi-static, dpc": Curve("quasi_static", True, False, MANY),
        "quasi-static, no dpc": Curve("quasi_static", False, False, MANY),
        "quasi-static, deformable, dpc": Curve("quasi_static", True, True, MANY[:6]),
        "quasi-static, deformable, no dpc": Curve("quasi_static", False, True, MANY[:4]),
        "explicit, dpc": Curve("explicit", True, False, MANY[:8]),
        "explicit, no dpc": Curve("explicit", False, False, MANY[:7]),
        "explicit, own weight": Curve("explicit", True, False, MANY[:8], only_weight=True),
        "explicit, deformable, dpc": Curve("explicit", True, True, (50, *MANY[:4])),
    },
    "contacts": {
        "quasi-static, dpc": Curve("quasi_static", True, False, POINTS),
        "quasi-static, no dpc": Curve("quasi_static", False, False, POINTS),
        "explicit, dpc": Curve("explicit", True, False, POINTS),
    },
    "zones": {
        "quasi-static, dpc": Curve("quasi_static", True, True, CELLS),
        "quasi-static, no dpc, some yield": Curve("quasi_static", False, True, CELLS[:2], block=WEAK),
        "explicit, dpc": Curve("explicit", True, True, CELLS[:4]),
    },
    "increments": {
        "quasi-static, dpc": Curve("quasi_static", True, False, STEPS),
        "quasi-static, no dpc": Curve("quasi_static", False, False, STEPS),
        "explicit, dpc": Curve("explicit", True, False, STEPS[:5]),
    },
}
"""Curves, by the quantity that grows along them."""


def all_cases() -> list[Case]:
    """Return the cases of all curves, the smallest of each first, then the next."""
    curves = [
        [Case(what, name, size) for size in curve.sizes]
        for what, curves in GROWING.items()
        for name, curve in curves.items()
    ]
    return [case for rank in zip_longest(*curves) for case in rank if case is not None]


def scene_of(case: Case, blocks: int | None = None) -> Scene:
    """Return the wall of a case, or the same wall of another size."""
    curve = GROWING[case.grows][case.curve]
    settings = Solver(
        method=curve.method,  # type: ignore[arg-type]
        blocks="deformable" if curve.zoned else "rigid",
        maximum_cycles=PATIENCE,
        symmetric_half=False,  # walls whose joints differ are not symmetric: the time of a whole wall matters
    )
    increments = INCREMENTS[curve.method]
    if curve.only_weight:
        settings = replace(settings, ramp_cycles=1)  # otherwise the ramp would dominate the time
    if case.grows == "contacts":
        settings = replace(settings, contacts_per_interface=int(case.size))
    elif case.grows == "blocks" and curve.zoned:
        settings = replace(settings, zone_size=AS_MANY)
    elif case.grows == "zones":
        settings = replace(settings, zone_size=case.size)
    elif case.grows == "increments":
        increments = int(case.size)
    count = blocks or (int(case.size) if case.grows == "blocks" else ALIKE)
    test = bryant("dishing").scene
    factor = math.sqrt(count / 816)  # about this number of bricks, at the deflection ratio of the test
    size = (
        step * round(whole / step * factor)
        for whole, step in ((test.wall.length, test.wall.block_length), (test.wall.height, test.wall.block_height))
    )
    scene = part_of_test(replace(test, dpc=test.dpc if curve.dpc else None), *size)
    return replace(scene, solver=settings, block=curve.block, movement=replace(scene.movement, increments=increments))
