"""Scores of predicted distributions against observations: CRPS, PIT, coverage, and the interval of a sample's scatter.

A prediction is an ensemble: the values of a quantity over the samples of a study.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from damagepred.arrays import FloatArray
from damagepred.errors import InputError


def _ensemble(ensemble: ArrayLike) -> FloatArray:
    values = np.sort(np.asarray(ensemble, dtype=np.float64).ravel())
    if values.size < 2 or not np.isfinite(values).all():
        raise InputError("ensemble: needs at least 2 finite values.")
    return values


def crps(ensemble: ArrayLike, observed: ArrayLike) -> FloatArray:
    """Continuous ranked probability score of each observation, unbiased (Gneiting and Raftery 2007); 0 is perfect."""
    x, y = _ensemble(ensemble), np.atleast_1d(np.asarray(observed, dtype=np.float64))
    n = x.size
    spread = 2.0 * float((2.0 * np.arange(n) - n + 1.0) @ x) / (n * (n - 1.0))
    return np.abs(x[:, None] - y).mean(axis=0) - 0.5 * spread


def pit(ensemble: ArrayLike, observed: ArrayLike) -> FloatArray:
    """Probability integral transform of each observation: uniform if it is right; equal members count half."""
    x, y = _ensemble(ensemble), np.atleast_1d(np.asarray(observed, dtype=np.float64))
    sides = (np.searchsorted(x, y, side=side) for side in ("left", "right"))
    return np.asarray(sum(sides) / (2.0 * x.size), dtype=np.float64)


def coverage(ensemble: ArrayLike, observed: ArrayLike, share: float) -> float:
    """Share of observations within the central interval of the predicted distribution."""
    if not 0.0 < share < 1.0:
        raise InputError(f"share = {share:g}: must be between 0 and 1.")
    low, high = np.quantile(_ensemble(ensemble), [0.5 - 0.5 * share, 0.5 + 0.5 * share])
    y = np.atleast_1d(np.asarray(observed, dtype=np.float64))
    return float(((y >= low) & (y <= high)).mean())


def cov_interval(cov: float, count: int, confidence: float = 0.95) -> tuple[float, float]:
    """Chi-square interval of a coefficient of variation, estimated from a sample of lognormal values."""
    from scipy.stats import chi2

    if not (cov >= 0 and count >= 2 and 0.0 < confidence < 1.0):
        raise InputError("cov_interval: needs cov of at least 0, count of at least 2, and confidence between 0 and 1.")
    variance, freedom = np.log1p(cov**2), count - 1
    ends = variance * freedom / chi2.ppf([0.5 + 0.5 * confidence, 0.5 - 0.5 * confidence], freedom)
    low, high = np.sqrt(np.expm1(ends)).tolist()
    return low, high
