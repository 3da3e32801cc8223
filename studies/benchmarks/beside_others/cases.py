"""The dry walls for all solvers: blocks, ground, friction and loading, as plain numbers.

A case is a dictionary that can be written as JSON, because the other solvers run in separate environments:

    name, size            which one
    blocks                corners of each block, counter-clockwise (m)
    ground                corners of each piece of ground; 2 mm apart, so that they do not touch each other
    drop                  settlement of each piece (m), between ``drop_from`` and ``drop_until`` (s)
    thickness, density, gravity, friction
    elastic_modulus, normal_stiffness, shear_stiffness, poisson_ratio   for solvers that use them (Pa, Pa/m)
    levels                residuals at which the clock is read
"""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import Any

from studies.benchmarks import walls

Case = dict[str, Any]

DATA = walls.read(Path(__file__).with_name("walls.toml"))
LENGTH, HEIGHT = DATA["brick"].values()
LEVELS: list[float] = DATA["levels"]
SIZES: dict[str, list[int]] = DATA["sizes"]
CASES = ("settling", "gap")
"""Under its own weight; where the ground drops under its middle."""
GAP, DEPTH, DROP = 2e-3, 0.2, 8e-3
"""Between pieces of ground, their depth, and how far one drops (m)."""


def box(left: float, bottom: float, right: float, top: float) -> list[list[float]]:
    """Return the corners of a rectangle."""
    return [[left, bottom], [right, bottom], [right, top], [left, top]]


def running_bond(units: int, courses: int) -> list[list[list[float]]]:
    """Return the bricks course by course, the lowest one of whole bricks."""
    blocks = []
    for course in range(courses):
        inner = [(i + 0.5 * (course % 2)) * LENGTH for i in range(1 - course % 2, units)]
        joints = itertools.pairwise([0.0, *inner, units * LENGTH])
        blocks += [box(a, course * HEIGHT, b, (course + 1) * HEIGHT) for a, b in joints]
    return blocks


def dry_wall(name: str, size: str) -> Case:
    """Return a case; the ground of "gap" drops under the middle of the wall, so that it has to arch."""
    units, courses, dropped = SIZES[size]
    ground, moves = [(-LENGTH, (units + 1) * LENGTH)], name == "gap"
    if moves:
        left = (units - dropped) // 2 * LENGTH
        right, half = left + dropped * LENGTH, GAP / 2
        ground = [(-LENGTH, left - half), (left + half, right - half), (right + half, (units + 1) * LENGTH)]
    return {
        "name": name,
        "size": size,
        "blocks": running_bond(units, courses),
        "ground": [box(a, -DEPTH, b, 0.0) for a, b in ground],
        "drop": [0.0, DROP, 0.0] if moves else [0.0],
        "drop_from": 0.25 * moves,
        "drop_until": 0.5 * moves,
        "levels": LEVELS,
        **DATA["material"],
    }
