"""Ranks of numbers and of interval-censored capacities."""

from __future__ import annotations

import numpy as np

from damagepred.arrays import FloatArray


def ranks(values: FloatArray, weight: FloatArray | None = None) -> FloatArray:
    """Share of samples below each value, those of the same value counted half: between 0 and 1."""
    _, place = np.unique(values, return_inverse=True)
    here = np.bincount(place, weights=weight)
    upto = np.cumsum(here)
    return ((upto - 0.5 * here) / upto[-1])[place]


def interval_ranks(lower: FloatArray, upper: FloatArray, weight: FloatArray | None = None) -> FloatArray:
    """Generalised Wilcoxon scores of interval-censored capacities, between 0 and 1 (Peto and Peto 1972).

    A known capacity has its rank, by the product-limit estimate (Kaplan and Meier 1958) at the middles of intervals. A
    wall that was not damaged up to its own end has the expected rank of all capacities beyond that end. Where the
    capacity is independent of the end, the mean score at each end is 1/2: an input that only sets how far walls are
    followed has no correlation with these scores. Ranks of the scores do not have this property; take them as they are.

    Parameters
    ----------
    lower, upper : array (walls,)
        Capacities lie in (lower, upper]; infinite upper: not damaged up to lower.
    weight : array (walls,), optional
        Weights of the walls.
    """
    heavy = np.ones(len(lower)) if weight is None else weight
    event = np.isfinite(upper)
    time = np.where(event, 0.5 * (lower + upper), lower)
    marks, place = np.unique(time, return_inverse=True)
    damaged, all_ = (np.bincount(place, w, len(marks)) for w in (np.where(event, heavy, 0.0), heavy))
    at_risk = np.maximum(np.cumsum(all_[::-1])[::-1], 1e-300)
    sound = np.cumprod(np.clip(1.0 - damaged / at_risk, 0.0, 1.0))
    before = np.append(1.0, sound)[:-1]
    return 1.0 - 0.5 * np.where(event, (before + sound)[place], sound[place])
