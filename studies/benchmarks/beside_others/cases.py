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
from typing import Any

Case = dict[str, Any]

LENGTH, HEIGHT = 0.24, 0.075  # of a brick (m), as in the paper's wall
SIZES = {"5x6": (5, 6), "10x12": (10, 12), "25x28": (25, 28), "3x12": (3, 12), "6x28": (6, 28)}
"""Bricks in a course, and courses; every other course has a half brick at either end."""
SIZES_OF = {
    "settling": ("5x6", "10x12", "25x28"),
    "gap": ("5x6", "10x12", "25x28"),
    "tilt": ("5x6", "3x12", "6x28"),
}
"""Cases of each wall: when pushed, only slender walls do more than slide."""
DROPPED = {"5x6": 3, "10x12": 4, "25x28": 9}
"""Bricks of the lowest course under whose middle the ground drops."""
GAP = 2e-3
DEPTH = 0.2
LEVELS = (1e-1, 1e-2, 1e-3, 1e-4)

MATERIAL: Case = {
    "thickness": 0.11,
    "density": 2000.0,
    "gravity": 9.81,
    "friction": 0.75,
    "elastic_modulus": 9000e6,
    "poisson_ratio": 0.19,
    "normal_stiffness": 82e9,
    "shear_stiffness": 36e9,
}
"""The paper's brick and joint, without bond."""


def box(left: float, bottom: float, right: float, top: float) -> list[list[float]]:
    """Return the corners of a rectangle."""
    return [[left, bottom], [right, bottom], [right, top], [left, top]]


def running_bond(units: int, courses: int) -> list[list[list[float]]]:
    """Return the bricks course by course, the lowest one of whole bricks."""
    blocks = []
    for course in range(courses):
        if course % 2:
            joints = [0.0, *((i + 0.5) * LENGTH for i in range(units)), units * LENGTH]
        else:
            joints = [i * LENGTH for i in range(units + 1)]
        blocks += [box(a, course * HEIGHT, b, (course + 1) * HEIGHT) for a, b in itertools.pairwise(joints)]
    return blocks


def settling(size: str) -> Case:
    """Return the wall under its own weight on rigid ground."""
    units, courses = SIZES[size]
    ground = [box(-LENGTH, -DEPTH, (units + 1) * LENGTH, 0.0)]
    return {
        "name": "settling",
        "size": size,
        "blocks": running_bond(units, courses),
        "ground": ground,
        "drop": [0.0],
        "drop_from": 0.0,
        "drop_until": 0.0,
        "levels": list(LEVELS),
        **MATERIAL,
    }


def gap(size: str, drop: float = 8e-3) -> Case:
    """Return the wall whose ground drops under its middle, so that it has to arch."""
    units, courses = SIZES[size]
    left = (units - DROPPED[size]) // 2
    right = left + DROPPED[size]
    ground = [
        box(-LENGTH, -DEPTH, left * LENGTH - GAP / 2, 0.0),
        box(left * LENGTH + GAP / 2, -DEPTH, right * LENGTH - GAP / 2, 0.0),
        box(right * LENGTH + GAP / 2, -DEPTH, (units + 1) * LENGTH, 0.0),
    ]
    return {
        "name": "gap",
        "size": size,
        "blocks": running_bond(units, courses),
        "ground": ground,
        "drop": [0.0, drop, 0.0],
        "drop_from": 0.25,
        "drop_until": 0.5,
        "levels": list(LEVELS),
        **MATERIAL,
    }


def tilt(size: str) -> Case:
    """Return the wall of ``settling``, to be pushed by a growing share of its weight, as on tilted ground."""
    return {**settling(size), "name": "tilt"}


CASES = {"settling": settling, "gap": gap, "tilt": tilt}
