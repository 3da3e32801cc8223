"""The cases of the study: the quantity that grows, its walls and sizes."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import zip_longest
from typing import Any, NamedTuple

from damagepred.scene import BlockMaterial, Scene, Solver
from studies.benchmarks.skips.scenes import bryant, part_of_test

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
    """One point of a curve.

    Attributes
    ----------
    grows : str
        Quantity that grows along the curve: see ``GROWING``.
    curve : str
        Name of the curve: walls and solver.
    size : float
        Size of the quantity.
    """

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
QUICK = [
    Case("blocks", "quasi-static, dpc", 30),
    Case("blocks", "quasi-static, dpc", 60),
    Case("blocks", "explicit, own weight", 30),
    Case("blocks", "explicit, own weight", 60),
    Case("contacts", "quasi-static, no dpc", 4),
]
"""Cases of the quick form."""


def all_cases(grows: list[str] | None = None) -> list[Case]:
    """Return the cases of all curves, the smallest of each first, then the next."""
    curves = [
        [Case(what, name, size) for size in curve.sizes]
        for what, curves in GROWING.items()
        for name, curve in curves.items()
        if grows is None or what in grows
    ]
    return [case for rank in zip_longest(*curves) for case in rank if case is not None]


def curve_of(case: Case) -> Curve:
    """Return the curve of a case."""
    return GROWING[case.grows][case.curve]


def scene_of(case: Case, blocks: int | None = None) -> Scene:
    """Return the wall of a case, or the same wall of another size."""
    curve = curve_of(case)
    method: Any = curve.method
    settings = Solver(
        method=method,
        blocks="deformable" if curve.zoned else "rigid",
        maximum_cycles=PATIENCE,
        # walls whose joints differ are not symmetric: the time of a whole wall matters
        symmetric_half=False,
    )
    increments = INCREMENTS[method]
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
    scene = test_wall(count, curve.dpc)
    return replace(scene, solver=settings, block=curve.block, movement=replace(scene.movement, increments=increments))


def test_wall(blocks: int, dpc: bool) -> Scene:
    """Return the test wall with about this number of bricks, at the deflection ratio of the test."""
    test = bryant("dishing").scene
    brick, course = test.wall.block_length, test.wall.block_height
    factor = math.sqrt(blocks / 816)
    length = brick * round(test.wall.length / brick * factor)
    height = course * round(test.wall.height / course * factor)
    return part_of_test(replace(test, dpc=test.dpc if dpc else None), length, height)
