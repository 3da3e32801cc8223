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
    """Distortion of o openings; NaN where an opening has one jamb only.

    Attributes
    ----------
    opening_width_change : array (..., o)
        Change of width at the upper end of the jambs (m), widening positive.
    opening_distortion : array (..., o)
        Largest change of the right angle at a corner (rad), either way.
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
        Block at the end of each jamb, -1 where there is none.
    arm : array (o, 4, 2)
        Place of the corner relative to that block's centroid (m).
    corner : array (o, 4, 2)
        Place of the corner (m).
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
        with np.errstate(invalid="ignore", divide="ignore"):  # an opening with one jamb has no corners to speak of
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
    """Limits of distortion at which doors and windows stick; from ``data/damage/opening_distortion.toml``.

    Attributes
    ----------
    name, source, confidence : str
        Their source, and the level of confidence (``data_files.CONFIDENCE``).
    level_names : tuple of str
        Of level 0, 1, ...
    angle, narrowing, diagonal : tuple of float
        Smallest distortion (rad), loss of width (m) and shortening of a diagonal (m) of level 1, 2, ...
    """

    name: str
    source: str
    confidence: str
    level_names: tuple[str, ...]
    angle: tuple[float, ...]
    narrowing: tuple[float, ...]
    diagonal: tuple[float, ...]

    def level(self, distortion: FloatArray, width_change: FloatArray, diagonal_change: FloatArray) -> Int8Array:
        """Return the level of openings, element by element: the highest that one measure makes; -1 where unknown.

        Parameters
        ----------
        distortion, width_change, diagonal_change : array
            As ``Distortion`` has them.
        """
        measured = (distortion, -np.asarray(width_change), -np.asarray(diagonal_change))
        found = [
            level_of(value, limits) for limits, value in zip((self.angle, self.narrowing, self.diagonal), measured)
        ]
        unknown = np.minimum.reduce(found) < 0
        return np.where(unknown, -1, np.maximum.reduce(found)).astype(np.int8)


@lru_cache(maxsize=1)
def sticking_limits() -> StickingLimits:
    """Read the limits of distortion at which doors and windows stick.

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
        tuple(one["name"] for one in levels),
        *(tuple(float(one[name]) for one in levels[1:]) for name in ("angle", "narrowing", "diagonal")),
    )
