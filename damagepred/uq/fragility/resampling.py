"""Bootstrap of fragility fits: estimates from walls drawn with replacement.

The number of walls drawn from each group of equal walls is multinomial: a million walls whose paths share their
increments cost no more than a few hundred. Where nearly every wall differs, the walls are many: one Newton step from
the estimate, with the scores weighted as drawn, then gives each resample's estimate with a relative error of one over
the number of walls.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from damagepred.arrays import FloatArray, IntArray
from damagepred.uq.fragility.estimators import Estimator
from damagepred.uq.fragility.grouped_data import GroupedIntervals
from damagepred.uq.fragility.options import FragilityOptions


class Resampled(NamedTuple):
    """Bootstrap replicates of the parameters."""

    # (parameters,): of the walls themselves: 1/dispersion, and for each category ln(median)/dispersion
    estimate: FloatArray
    replicates: FloatArray  # (resamples, parameters): of those resamples that can be fitted
    influence: FloatArray  # (groups, parameters): influence of one wall of a group on the parameters
    cells: GroupedIntervals  # the walls


def resample(estimator: Estimator, resamples: int, random: np.random.Generator) -> Resampled:
    """Fit resamples of the walls."""
    cells, best, options = estimator.cells, estimator.estimate, estimator.options
    influence = estimator.scores(best) @ np.linalg.pinv(-estimator.hessian(best), hermitian=True)
    if len(cells.number) > options.one_step_groups:
        again = best + _one_step_estimates(influence * cells.weight[:, None], cells.number, resamples, random, options)
        return Resampled(best, again[again[:, 0] > 1.0 / options.largest_dispersion], influence, cells)
    fitted = []
    each = max(1, options.stored_draws // len(cells.number))
    fewest = options.fewest_reached if len(estimator.categories) == 1 else 1
    for first in range(0, resamples, each):
        drawn = draw(cells, min(each, resamples - first), random)
        enough = np.ones(len(drawn), dtype=bool)
        for lower, upper in zip(cells.lower, cells.upper):
            enough &= drawn @ np.isfinite(upper) >= fewest
            enough &= drawn @ (lower > 0) > 0
        if enough.any():
            fitted.append(estimator.maximise(drawn[enough] * cells.weight, best))
    again = np.concatenate(fitted) if fitted else np.empty((0, len(best)))
    with np.errstate(divide="ignore"):
        dispersion = 1.0 / again[:, 0]
    good = (dispersion > options.smallest_dispersion) & (dispersion < options.largest_dispersion)
    return Resampled(best, again[good], influence, cells)


def _one_step_estimates(
    each: FloatArray, number: IntArray, resamples: int, random: np.random.Generator, options: FragilityOptions
) -> FloatArray:
    """Newton steps of resamples, (resamples, parameters), from the influence of one wall of each group."""
    walls = int(number.sum())
    size = min(walls, options.one_step_walls)
    mean = number @ each / walls
    ends = np.cumsum(number)
    means = np.empty((resamples, each.shape[1]))
    for row in means:
        drawn = random.integers(walls, size=size)
        row[:] = each[drawn if walls == len(number) else np.searchsorted(ends, drawn, side="right")].mean(axis=0)
    return (means - mean) * walls * np.sqrt(size / walls)


def draw(cells: GroupedIntervals, resamples: int, random: np.random.Generator) -> FloatArray:
    """Return the number of walls of each group in each resample, array (resamples, groups)."""
    walls = int(cells.number.sum())
    return random.multinomial(walls, cells.number / walls, size=resamples).astype(np.float64)
