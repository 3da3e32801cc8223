"""Walls drawn again (bootstrap): what the fit would have been for other walls of the same kind.

Walls that say the same are drawn together, by a multinomial number for each cell of them: a million walls whose paths
share their increments are no more work than a few hundred. Where nearly every wall says something of its own, there
are so many that one Newton step from the estimate, with the walls' scores weighted as they were drawn, gives each
resample's estimate to one part in the number of walls.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from damagepred.arrays import FloatArray, IntArray
from damagepred.uq.fragility.estimators import Estimator
from damagepred.uq.fragility.fit import FEWEST
from damagepred.uq.fragility.grouped_data import GroupedIntervals
from damagepred.uq.fragility.likelihood import LARGEST, SMALLEST

MANY_CELLS = 2000
"""From so many cells on, resamples are one Newton step from the estimate."""

_DRAWN = 20_000
"""Walls drawn for such a step at most: its scatter is that of a mean, and falls with the root of their number."""

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
    cells: GroupedIntervals


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
    influence = estimator.scores(best) @ np.linalg.pinv(-estimator.hessian(best), hermitian=True)
    if len(cells.number) > MANY_CELLS:
        again = best + _one_step_estimates(influence * cells.weight[:, None], cells.number, resamples, random)
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


def _one_step_estimates(each: FloatArray, number: IntArray, resamples: int, random: np.random.Generator) -> FloatArray:
    """Return what walls drawn again add to the parameters beyond what the walls themselves do.

    Parameters
    ----------
    each : array (cells, parameters)
        What one wall adds.
    number : array of int (cells,)
        How many walls there are.
    resamples : int
        How often.
    random : Generator
        Source of the draws.
    """
    walls = int(number.sum())
    size = min(walls, _DRAWN)
    mean = number @ each / walls
    ends = np.cumsum(number)
    found = np.empty((resamples, each.shape[1]))
    for row in found:
        drawn = random.integers(walls, size=size)
        row[:] = each[drawn if walls == len(number) else np.searchsorted(ends, drawn, side="right")].mean(axis=0)
    return (found - mean) * walls * np.sqrt(size / walls)


def draw(cells: GroupedIntervals, resamples: int, random: np.random.Generator) -> FloatArray:
    """Return how many walls of each cell there are in each resample, array (resamples, cells).

    Parameters
    ----------
    cells : GroupedIntervals
        Walls.
    resamples : int
        Number of resamples.
    random : Generator
        Source of the draws.
    """
    walls = int(cells.number.sum())
    return random.multinomial(walls, cells.number / walls, size=resamples).astype(np.float64)
