"""The cases of the study: the quantity that grows, its walls and sizes."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import zip_longest
from pathlib import Path
from typing import NamedTuple

from damagepred.scene import BlockMaterial, Scene, Solver
from studies.benchmarks import walls

ALIKE = 200
"""Blocks of the wall of which contacts, zones or increments grow."""
INCREMENTS = {"quasi_static": 20, "explicit": 4}
"""Increments of the movement, unless these grow."""
PATIENCE = 1_000_000
"""Limit of the explicit solver's cycles in an increment: large walls need more than the default."""
AS_MANY = 0.075
"""Size of cells (m) with which both solvers have 16 zones in a brick, the default of the quasi-static one."""


class Case(NamedTuple):
    """One point of a curve: the quantity that grows along it, its name in ``GROWING``, and the size of the quantity."""

    grows: str
    curve: str
    size: float


class Curve(NamedTuple):
    """Solver, sizes, dpc (along which a wall separates), deformable blocks, dead load alone, strength of bricks."""

    method: str
    sizes: list[float]
    dpc: bool = True
    zoned: bool = False
    only_weight: bool = False
    block: dict[str, float] | None = None


GROWING = {
    what: {name: Curve(**table) for name, table in curves.items()}
    for what, curves in walls.read(Path(__file__).with_name("curves.toml")).items()
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
    test = walls.scene({"base": "bryant_dishing", "without": [] if curve.dpc else ["dpc"]})
    factor = math.sqrt(count / 816)  # about this number of bricks, at the deflection ratio of the test
    size = (
        step * round(whole / step * factor)
        for whole, step in ((test.wall.length, test.wall.block_length), (test.wall.height, test.wall.block_height))
    )
    scene = walls.changed(walls.part_of_test(test, *size), {"movement": {"increments": increments}})
    return replace(scene, solver=settings, block=BlockMaterial(**curve.block or {}))  # type: ignore[arg-type]
