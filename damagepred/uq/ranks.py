"""Ranks of numbers and of interval-censored capacities."""

from __future__ import annotations

import numpy as np

from damagepred.arrays import FloatArray
from damagepred.uq.fragility.turnbull import turnbull


def ranks(values: FloatArray, weight: FloatArray | None = None) -> FloatArray:
    """Return the share of samples below each value, those of the same value counted half: between 0 and 1.

    Parameters
    ----------
    values : array (samples,)
        Numbers.
    weight : array (samples,), optional
        What each counts for.
    """
    _, place = np.unique(values, return_inverse=True)
    here = np.bincount(place, weights=weight)
    upto = np.cumsum(here)
    return ((upto - 0.5 * here) / upto[-1])[place]


def interval_ranks(lower: FloatArray, upper: FloatArray, weight: FloatArray | None = None) -> FloatArray:
    """Return the expected rank of each wall by its interval-censored capacity.

    The mean of the empirical distribution function (Turnbull) at both ends of the interval. Walls that have not reached
    a category by the end of a movement that all share are tied at the top, walls of one increment in it; one that was
    followed less far stands lower than those, for all that is known.

    Parameters
    ----------
    lower, upper : array (walls,)
        Capacities lie in (lower, upper].
    weight : array (walls,), optional
        What each counts for.
    """
    found = turnbull(lower, upper, weight)
    below = found.probability(lower)
    exact = lower == upper
    if exact.any():
        step = np.append(0.0, np.cumsum(found.mass))
        below = np.where(exact, step[np.searchsorted(found.right, lower * (1 - 1e-9), side="right")], below)
    return 0.5 * (below + np.where(np.isinf(upper), 1.0, found.probability(np.where(np.isinf(upper), 0.0, upper))))
