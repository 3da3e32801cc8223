"""Dry walls near collapse: polygons common to solvers and limit analysis."""

import itertools
from dataclasses import dataclass

import numpy as np

from damagepred import Assembly, BlockMaterial, Joint
from damagepred.arrays import FloatArray

Rectangle = list[tuple[float, float]]
DENSITY, THICKNESS, G = 2000.0, 0.2, 9.81


@dataclass(frozen=True)
class DryWall:
    """Blocks, some of which are fixed."""

    name: str
    blocks: list[Rectangle]
    friction: float
    held: tuple[int, ...] = (0,)
    push: str = "sideways"
    loaded: int = -1

    def weights(self) -> FloatArray:
        """Return the weight of each block (N), 0 for fixed blocks."""
        area = np.array([polygon_area(block) for block in self.blocks])
        area[list(self.held)] = 0.0
        return DENSITY * G * THICKNESS * area

    def loads(self) -> tuple[FloatArray, FloatArray]:
        """Return dead and live load (n, 3) of each block (N, N, N m)."""
        dead, live = np.zeros((len(self.blocks), 3)), np.zeros((len(self.blocks), 3))
        dead[:, 1] = -self.weights()
        if self.push == "sideways":
            live[:, 0] = self.weights()
        else:
            live[self.loaded, 1] = -self.weights().sum()
        return dead, live

    def assembly(self) -> Assembly:
        joint = Joint(tensile_strength=0.0, cohesion=0.0, friction=self.friction)
        wall = Assembly(thickness=THICKNESS, joint=joint, block=BlockMaterial(density=DENSITY))
        for block in self.blocks:
            wall.add_block(block)
        for block in self.held:
            wall.support(block)
        return wall


def polygon_area(corners: Rectangle) -> float:
    """Return the area (m2) of a counter-clockwise polygon."""
    x, y = np.array(corners).T
    return float((x * np.roll(y, -1) - np.roll(x, -1) * y).sum() / 2)


def box(left: float, bottom: float, width: float, height: float) -> Rectangle:
    """Return a rectangle."""
    return [(left, bottom), (left + width, bottom), (left + width, bottom + height), (left, bottom + height)]


def running_bond(courses: int, units: int, width: float, height: float, halves_first: bool) -> list[Rectangle]:
    """Return courses of whole units, every other one with a half unit at either end, on a base."""
    length = units * width
    blocks = [box(-0.5 * width, -height, length + width, height)]
    for course in range(courses):
        shifted = (course % 2 == 0) == halves_first
        inner = (np.arange(units) + 0.5) * width if shifted else np.arange(1, units) * width
        joints = [0.0, *inner.tolist(), length]
        blocks += [box(a, course * height, b - a, height) for a, b in itertools.pairwise(joints)]
    return blocks


def leaning(blocks: list[Rectangle], slope: float) -> list[Rectangle]:
    """Turn everything anticlockwise by an angle whose tangent is the slope."""
    c, s = np.cos(np.arctan(slope)), np.sin(np.arctan(slope))
    return [[(c * x - s * y, s * x + c * y) for x, y in block] for block in blocks]


def portal(courses: int, clear: float, width: float, height: float, lintel: float) -> list[Rectangle]:
    """Return two piers of single blocks and a lintel over both, on a base."""
    span = clear + 2 * width
    blocks = [box(-width, -height, span + 2 * width, height)]
    for left in (0.0, clear + width):
        blocks += [box(left, course * height, width, height) for course in range(courses)]
    return [*blocks, box(0.0, courses * height, span, lintel)]


def arch(voussoirs: int, inner: float, outer: float, spread: float) -> list[Rectangle]:
    """Return voussoirs from left to right over an opening angle (rad); the first and the last are the abutments."""
    step = spread / (voussoirs - 2)
    angle = np.pi / 2 + spread / 2 + step - step * np.arange(voussoirs + 1)

    def at(radius: float, i: int) -> tuple[float, float]:
        return float(radius * np.cos(angle[i])), float(radius * np.sin(angle[i]))

    return [[at(inner, i), at(inner, i + 1), at(outer, i + 1), at(outer, i)] for i in range(voussoirs)]


def tipping_slope(width: float, height: float, weight: float, stiffness: float) -> float:
    """Return the slope (tan) at which a block on an unbonded elastic joint tips, its rotation in the lever arm.

    A rotation θ presses the joint over a length c, N = k θ c²/2, so N acts at b/2 - c/3 from the middle. Its lever arm
    (h/2)(tan α + θ) is largest against that at θ = (a/h)^(2/3), a² = 2 N/(9 k). Small angles, and c < b.
    """
    squared = 2.0 * weight / (9.0 * stiffness)
    return (width - 3.0 * np.cbrt(squared * height)) / height
