"""Estimates of a probability from samples, with their errors and intervals.

Three kinds of samples need three kinds of error:

- random ones, weighted or not: from the scatter of the samples;
- Sobol points from several independent scrambles (replicates): from the scatter of the replicates' means, by Student's
  distribution. The scatter of the samples themselves overstates it, for the points are spread evenly on purpose;
- one scramble or a Latin hypercube: as if the samples were random. That errs to the safe side, and no better is known.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy import special

from damagepred.arrays import BoolArray, FloatArray, IntArray
from damagepred.runtime.one_thread import one_blas_thread

ENOUGH_REPLICATES = 4  # replicates from which their means give the standard error


class Estimate(NamedTuple):
    """A number found by sampling."""

    value: float  # best estimate
    error: float  # standard error
    # ends of the confidence interval
    lower: float
    upper: float
    confidence: float  # its level
    samples: int  # samples that count
    effective_samples: float  # samples of equal weight with the same variance (Kish 1965): (sum w)^2 / sum w^2

    @property
    def half_width(self) -> float:
        """Half the width of the confidence interval."""
        return 0.5 * (self.upper - self.lower)


def effective_samples(weight: FloatArray) -> float:
    """Kish's effective number of samples of weights (samples,)."""
    squares = float((weight**2).sum())
    return float(weight.sum()) ** 2 / squares if squares > 0 else 0.0


def normal_factor(confidence: float) -> float:
    """Half width of a normal interval of this level, in standard errors."""
    return float(special.ndtri(0.5 + 0.5 * confidence))


def student_factor(confidence: float, freedom: float) -> float:
    """Half width of Student's interval of this level, in standard errors."""
    return float(special.stdtrit(max(freedom, 1.0), 0.5 + 0.5 * confidence))


def wilson(share: float, count: float, factor: float) -> tuple[float, float]:
    """Wilson's interval of a probability, from the share of hits among ``count`` samples, which need not be whole."""
    spread = factor**2 / count
    middle = (share + spread / 2) / (1 + spread)
    half = factor / (1 + spread) * np.sqrt(max(share * (1 - share), 0.0) / count + spread / (4 * count))
    return max(float(middle - half), 0.0), min(float(middle + half), 1.0)


@one_blas_thread()
def probability(
    hit: BoolArray | FloatArray,
    *,
    weight: FloatArray | None = None,
    replicate: IntArray | None = None,
    confidence: float = 0.9,
    precision: float = 1.0,
    share: float = 1.0,
) -> Estimate:
    """Estimate a probability."""
    hit = np.asarray(hit, dtype=np.float64)
    count = len(hit)
    heavy = np.ones(count) if weight is None else np.asarray(weight, dtype=np.float64)
    kish = effective_samples(heavy)
    if count == 0 or kish == 0:
        return Estimate(np.nan, np.nan, 0.0, 1.0, confidence, count, kish)
    value, error, freedom = _mean_and_error(heavy * hit, replicate)
    if not (0 < value < 1) or error == 0:
        # all samples agree: their variance gives no error
        lower, upper = wilson(min(max(value, 0.0), 1.0), share * min(kish, count), normal_factor(confidence))
        return Estimate(value, error, min(lower, value), max(upper, value), confidence, count, kish)
    if weight is not None:
        # the effective number of hits gives the degrees of freedom of a weighted estimate
        freedom = min(freedom, effective_samples(heavy * np.clip(hit, 0.0, 1.0)) - 1)
    # of whole samples no error is smaller than what half of one makes
    spread = max(error, 0.5 / count) if weight is None else error
    factor = normal_factor(confidence) if weight is None and replicate is None else student_factor(confidence, freedom)
    alike = value * (1 - value) / spread**2 if np.isfinite(spread) else 1.0
    if weight is None and replicate is None:
        alike *= count / max(count - 1, 1)  # hits alone: the number of samples itself
    lower, upper = wilson(value, precision * alike, factor)
    return Estimate(value, error, lower, upper, confidence, count, kish)


def _mean_and_error(values: FloatArray, replicate: IntArray | None) -> tuple[float, float, float]:
    """Mean, its standard error and the degrees of freedom of that."""
    count = len(values)
    if replicate is not None:
        labels, which = np.unique(replicate, return_inverse=True)
        if len(labels) >= ENOUGH_REPLICATES:
            share = np.bincount(which) / count
            means = np.bincount(which, weights=values) / (share * count)
            value = float(share @ means)
            groups = len(labels)
            return value, float(np.sqrt((share**2 @ (means - value) ** 2) * groups / (groups - 1))), groups - 1
    if count < 2:
        return float(values.mean()) if count else np.nan, np.inf, 1.0
    return float(values.mean()), float(values.std(ddof=1) / np.sqrt(count)), count - 1.0
