"""Distortion of openings, and the limits at which doors and windows stick."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from damagepred.arrays import FloatArray, Int8Array, IntArray
from damagepred.damage.levels import level_of
from damagepred.damage.limits import read_levels

OPPOSITE = ((0, 2), (1, 3))
"""Corners that a diagonal joins."""


class Distortion(NamedTuple):
    """Distortion of o openings; NaN for an opening with a single jamb.

    Attributes
    ----------
    opening_width_change : array (..., o)
        Change of width at the upper end of the jambs (m), widening positive.
    opening_distortion : array (..., o)
        Largest absolute change of the right angle at a corner (rad).
    opening_diagonal_change : array (..., o)
        Change of length of the diagonal that has shortened most, or lengthened least (m), lengthening positive.
    """

    opening_width_change: FloatArray
    opening_distortion: FloatArray
    opening_diagonal_change: FloatArray


class Frames(NamedTuple):
    """Corners of the openings, counter-clockwise from the lower left, and the blocks they move with; o openings.

    Attributes
    ----------
    block : array of int (o, 4)
        Block at the end of each jamb, or -1.
    arm : array (o, 4, 2)
        Position of the corner relative to the centroid of the block (m).
    corner : array (o, 4, 2)
        Position of the corner (m).
    """

    block: IntArray
    arm: FloatArray
    corner: FloatArray

    def distortion(self, displacement: FloatArray) -> Distortion:
        """Measure one state, or several.

        Parameters
        ----------
        displacement : array (..., n, 3)
            x, y (m) and rotation (rad, counter-clockwise) of the blocks; rotations count to first order.
        """
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
