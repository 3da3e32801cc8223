"""Walls drawn again (bootstrap): what the fit would have been for other walls of the same kind.

Walls that say the same are drawn together, by a multinomial number for each cell of them: a million walls whose paths
share their increments are no more work than a few hundred. Where nearly every wall says something of its own, there
are so many that one Newton step from the estimate, with the walls' scores weighted as they were drawn, gives each
resample's estimate to one part in the number of walls.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from damagepred.uq.fragility.capacities import Cells
from damagepred.uq.fragility.likelihood import LARGEST, SMALLEST
from damagepred.uq.fragility.models import FEWEST, Estimator

FloatArray = NDArray[np.float64]

MANY_CELLS = 20_000
"""From so many cells on, resamples are one Newton step from the estimate."""

_AT_ONCE = 4_000_000
"""Numbers of draws kept at a time."""


class Resampled(NamedTuple):
    """Parameters fitted to walls drawn again.

    Attributes
    ----------
    best : array (parameters,)
        For the walls themselves: 1/dispersion, and for each category ln(median)/dispersion.
    again : array (resamples, parameters)
        For those resamples that can be fitted.
    asked : int
        Resamples drawn.
    influence : array (cells, parameters)
        What one wall of a cell adds to the parameters.
    cells : Cells
        The walls.
    """

    best: FloatArray
    again: FloatArray
    asked: int
    influence: FloatArray
    cells: Cells


def resample(estimator: Estimator, best: FloatArray, resamples: int, random: np.random.Generator) -> Resampled:
    """Fit walls drawn again.

    Parameters
    ----------
    estimator : Estimator
        With the walls.
    best : array (parameters,)
        Its estimate.
    resamples : int
        How often.
    random : Generator
        Source of the draws.
    """
    cells = estimator.cells
    influence = estimator.scores(best) @ np.linalg.pinv(-estimator.curvature(best), hermitian=True)
    if len(cells.number) > MANY_CELLS:
        moved = [draw(cells, 1, random)[0] * cells.weight @ influence for _ in range(resamples)]
        # the scores of the walls themselves add up to nothing but rounding
        again = best + np.array(moved).reshape(resamples, len(best)) - cells.total @ influence
        return Resampled(best, again[again[:, 0] > 1.0 / LARGEST], resamples, influence, cells)
    found = []
    each = max(1, _AT_ONCE // len(cells.number))
    fewest = FEWEST if len(estimator.categories) == 1 else 1
    for first in range(0, resamples, each):
        drawn = draw(cells, min(each, resamples - first), random)
        enough = np.ones(len(drawn), dtype=bool)
        for lower, upper in zip(cells.lower, cells.upper):
            told = (lower > 0) | np.isfinite(upper)
            enough &= drawn @ np.isfinite(upper) >= fewest
            enough &= drawn @ (told & (lower > 0)) > 0
        if enough.any():
            found.append(estimator.at(drawn[enough] * cells.weight, best))
    again = np.concatenate(found) if found else np.empty((0, len(best)))
    with np.errstate(divide="ignore"):
        scatter = 1.0 / again[:, 0]
    return Resampled(best, again[(scatter > SMALLEST) & (scatter < LARGEST)], resamples, influence, cells)


def draw(cells: Cells, resamples: int, random: np.random.Generator) -> FloatArray:
    """Return how many walls of each cell there are in each resample, array (resamples, cells)."""
    walls, size = int(cells.number.sum()), len(cells.number)
    if size > MANY_CELLS and cells.number.max() == 1:
        return np.array([np.bincount(random.integers(size, size=walls), minlength=size) for _ in range(resamples)])
    return random.multinomial(walls, cells.number / walls, size=resamples).astype(np.float64)
