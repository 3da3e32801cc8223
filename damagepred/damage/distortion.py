"""Distortion of openings, and the limits at which doors and windows stick."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from damagepred.arrays import FloatArray, Int8Array, IntArray
from damagepred.damage.limits import level_of, read_levels

OPPOSITE = ((0, 2), (1, 3))
"""Corners that a diagonal joins."""


class Distortion(NamedTuple):
    """Distortion of o openings; NaN for an opening with a single jamb."""

    opening_width_change: FloatArray  # (..., o): at the upper end of the jambs (m), widening positive
    opening_distortion: FloatArray  # (..., o): largest absolute change of the right angle at a corner (rad)
    opening_diagonal_change: FloatArray  # (..., o): of the diagonal that has shortened most (m), lengthening positive


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


class StickingLimits(NamedTuple):
    """Limits of distortion at which doors and windows stick; from ``data/damage/opening_distortion.toml``."""

    name: str
    source: str
    confidence: str  # (``data_files.CONFIDENCE``)
    level_names: tuple[str, ...]  # names of levels 0, 1, ...
    # smallest distortion (rad), loss of width (m) and shortening of a diagonal (m) of levels 1, 2, ...
    angle: tuple[float, ...]
    narrowing: tuple[float, ...]
    diagonal: tuple[float, ...]

    def level(self, distortion: FloatArray, width_change: FloatArray, diagonal_change: FloatArray) -> Int8Array:
        """Level of openings, element by element: the highest of the three measures; -1 where unknown."""
        measured = (distortion, -np.asarray(width_change), -np.asarray(diagonal_change))
        levels = [
            level_of(value, limits) for limits, value in zip((self.angle, self.narrowing, self.diagonal), measured)
        ]
        unknown = np.minimum.reduce(levels) < 0
        return np.where(unknown, -1, np.maximum.reduce(levels)).astype(np.int8)


@lru_cache(maxsize=1)
def sticking_limits() -> StickingLimits:
    """Limits of distortion at which doors and windows stick.

    Examples
    --------
    >>> from damagepred import damage
    >>> damage.sticking_limits().narrowing
    (0.003, 0.006)
    """
    content, levels = read_levels("opening_distortion")
    return StickingLimits(
        content["name"],
        " ".join(content["source"].split()),
        content["confidence"],
        tuple(level["name"] for level in levels),
        *(tuple(float(level[name]) for level in levels[1:]) for name in ("angle", "narrowing", "diagonal")),
    )
