"""Deviation from level and plumb, and distortion of openings, at which doors and windows stick."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from damagepred.arrays import BoolArray, FloatArray, IntArray
from damagepred.damage.limits import deviation_limits


class Deviation(NamedTuple):
    """Largest slopes of a wall (1); NaN without courses."""

    tilt_max: FloatArray  # out of plumb: a brick of the wall proper relative to a brick about a gauge's length above it
    slope_max: FloatArray  # out of level: courses of the wall proper, over about a gauge's length
    base_slope_max: FloatArray  # out of level: the lowest course, which follows the footing


CLOSENESS = 1e-9  # tolerance for equal lengths, relative to the gauge: mirrored walls have mirrored pairs


class SightLines(NamedTuple):
    """Pairs of blocks about a gauge's length apart: l along courses, p up the wall proper."""

    left: IntArray  # (l,): blocks of one course
    right: IntArray
    length: FloatArray  # (l,): distance of the centroids (m)
    in_wall: BoolArray  # (l,): whether they belong to the wall proper, to the lowest course
    in_base: BoolArray
    lower: IntArray  # (p,): blocks one over the other
    upper: IntArray
    height: FloatArray  # (p,): difference of their heights (m)

    @classmethod
    def of_blocks(cls, x: FloatArray, y: FloatArray, course: IntArray, dpc_level: float = -np.inf) -> SightLines:
        """Pairs by centroids (m) and courses; blocks without a course (-1), as the footing's, are left out."""
        gauge = deviation_limits().gauge
        numbers = np.unique(course[course >= 0])
        courses = [row[np.argsort(x[row])] for row in (np.flatnonzero(course == number) for number in numbers)]
        along = [_along(x, row, gauge) for row in courses]
        lower, upper = _upward(x, y, [row for row in courses if y[row].mean() > dpc_level], gauge)
        left, right = (np.concatenate([pair[i] for pair in along] or [np.empty(0, np.int64)]) for i in (0, 1))
        in_base = course[left] == (numbers[0] if numbers.size else 0)
        lines = (left, right, x[right] - x[left], y[left] > dpc_level, in_base)
        return cls(*lines, lower, upper, y[upper] - y[lower])

    def deviation(self, displacement: FloatArray) -> Deviation:
        """Largest slopes in one or several states, from x, y of the centroids (..., n, 2 or 3) (m)."""
        along, up = displacement[..., 0], displacement[..., 1]
        slope = np.abs(up[..., self.right] - up[..., self.left]) / self.length
        tilt = np.abs(along[..., self.upper] - along[..., self.lower]) / self.height
        return Deviation(_largest(tilt), _largest(slope[..., self.in_wall]), _largest(slope[..., self.in_base]))


def _largest(values: FloatArray) -> FloatArray:
    return values.max(axis=-1) if values.shape[-1] else np.full(values.shape[:-1], np.nan)


def _along(x: FloatArray, row: IntArray, gauge: float) -> tuple[IntArray, IntArray]:
    """Pairs of one course: each block with the farthest one within the gauge on either side."""
    position = x[row]
    number = np.arange(len(row))
    within = gauge * (1 + CLOSENESS)
    rightmost = np.searchsorted(position, position + within, side="right") - 1
    leftmost = np.searchsorted(position, position - within, side="left")
    first, last = np.unique(np.stack((np.r_[number, leftmost], np.r_[rightmost, number])), axis=1)
    least = 0.5 * min(gauge, float(position[-1] - position[0])) * (1 - CLOSENESS)
    chosen = (last > first) & (position[last] - position[first] >= least)
    return row[first[chosen]], row[last[chosen]]


def _upward(x: FloatArray, y: FloatArray, courses: list[IntArray], gauge: float) -> tuple[IntArray, IntArray]:
    """Pairs one over the other: each block with the nearest of the two highest courses within the gauge."""
    none = np.empty(0, dtype=np.int64)
    if len(courses) < 2:
        return none, none
    level = np.array([y[row].mean() for row in courses])
    apart = np.concatenate([np.diff(x[row]) for row in courses])
    askew = 0.2 * float(np.median(apart)) if apart.size else np.inf  # with one brick per course, each is above the last
    least = 0.5 * min(gauge, float(level[-1] - level[0]))
    lower, upper = [none], [none]
    for number, row in enumerate(courses):
        top = int(np.searchsorted(level, level[number] + gauge * (1 + CLOSENESS), side="right")) - 1
        within = [c for c in (top, top - 1) if c > number and level[c] - level[number] >= least * (1 - CLOSENESS)]
        if not within:
            continue
        above = np.concatenate([courses[c] for c in within])
        gap = np.abs(x[above][None, :] - x[row][:, None])
        # equal within rounding: take both blocks of one course, and the higher of two courses
        nearest = (gap <= gap.min(axis=1, keepdims=True) + CLOSENESS * gauge) & (gap <= askew + CLOSENESS * gauge)
        higher = nearest & (np.arange(len(above)) < len(courses[within[0]]))
        nearest &= higher | ~higher.any(axis=1, keepdims=True)
        below, over = np.nonzero(nearest)
        lower.append(row[below])
        upper.append(above[over])
    return np.concatenate(lower), np.concatenate(upper)


OPPOSITE = ((0, 2), (1, 3))  # corners that a diagonal joins


class Distortion(NamedTuple):
    """Distortion of o openings; NaN for an opening with a single jamb."""

    opening_width_change: FloatArray  # (..., o): at the upper end of the jambs (m), widening positive
    opening_distortion: FloatArray  # (..., o): largest absolute change of the right angle at a corner (rad)
    opening_diagonal_change: FloatArray  # (..., o): of the diagonal that has shortened most (m), lengthening positive


def largest_distortion(distortion: FloatArray) -> Any:
    """Largest distortion of the openings (..., o); 0 without any. Openings with a single jamb do not count."""
    unknown = np.isnan(distortion)
    return np.where(unknown, 0.0, distortion).max(axis=-1, initial=0.0)


class Frames(NamedTuple):
    """Corners of o openings, counter-clockwise from the lower left, and the blocks they move with."""

    block: IntArray  # (o, 4): block at the end of each jamb, or -1
    arm: FloatArray  # (o, 4, 2): position relative to the centroid of the block (m)
    corner: FloatArray  # (o, 4, 2): position (m)

    def distortion(self, displacement: FloatArray) -> Distortion:
        """Distortion in one or several states, from x, y (m) and rotation (rad) of the blocks (..., n, 3)."""
        moved = displacement[..., self.block, :]
        shift = moved[..., :2] + moved[..., 2:] * np.stack((-self.arm[..., 1], self.arm[..., 0]), axis=-1)
        has_both = (self.block >= 0).all(axis=1)
        edge, stretch = (np.roll(v, -1, axis=-2) - v for v in (self.corner, shift))
        with np.errstate(invalid="ignore", divide="ignore"):  # an opening with one jamb lacks corners
            turn = (edge[..., 0] * stretch[..., 1] - edge[..., 1] * stretch[..., 0]) / (edge**2).sum(axis=-1)
        angle = turn - np.roll(turn, 1, axis=-1)
        diagonals = []
        for first, second in OPPOSITE:
            before, change = (v[..., second, :] - v[..., first, :] for v in (self.corner, shift))
            diagonals.append(_length(before + change) - _length(before))
        measured = (shift[..., 2, 0] - shift[..., 3, 0], np.abs(angle).max(axis=-1), np.minimum(*diagonals))
        # the upper ends alone are enough for the width
        upper = (self.block[:, 2:] >= 0).all(axis=1)
        return Distortion(*(np.where(k, m, np.nan) for k, m in zip((upper, has_both, has_both), measured)))


def _length(vector: FloatArray) -> FloatArray:
    return np.asarray(np.hypot(vector[..., 0], vector[..., 1]))
