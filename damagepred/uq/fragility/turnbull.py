"""The empirical curve: nonparametric maximum likelihood estimate of the distribution of censored capacities.

Only the innermost intervals have probability (Turnbull 1976, J. R. Stat. Soc. B 38). It follows from expectation and
maximisation, alternating with the iterative convex minorant (Wellner and Zhan 1997, J. Am. Stat. Assoc. 92), until the
largest directional derivative bounds the distance from the maximum (Gentleman and Geyer 1994, Biometrika 81).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from damagepred.arrays import FloatArray, IntArray
from damagepred.inputs.arguments import checked, require_alike

MOST_BOUNDS = 1000  # distinct bounds of intervals beyond which they are rounded to as many equal steps
MOST_ITERATIONS = 2000
TOLERANCE = 1e-8  # distance of the log-likelihood from its maximum, for each wall, at which iteration ends (1)


class Npmle(NamedTuple):
    """Probability of each innermost interval."""

    # (intervals,): the intervals (left, right]; ``right`` is infinite beyond all movements
    left: FloatArray
    right: FloatArray
    mass: FloatArray  # (intervals,): their probabilities; the sum is 1

    def probability(self, intensity: FloatArray) -> FloatArray:
        """Probability of having reached the category, counted at the right end of each interval."""
        steps = np.append(0.0, np.cumsum(self.mass))
        return np.minimum(steps[np.searchsorted(self.right, np.asarray(intensity) * (1 + 1e-9), side="right")], 1.0)

    def quantile(self, share: float) -> float:
        """Movement by which this share of walls has reached the category, infinite where the walls do not reach it."""
        index = int(np.searchsorted(np.cumsum(self.mass), share * (1 - 1e-9)))
        return float(self.right[min(index, len(self.right) - 1)]) if len(self.right) else np.inf


@checked
def turnbull(lower: FloatArray, upper: FloatArray, weight: FloatArray | None = None) -> Npmle:
    """Nonparametric maximum likelihood estimate of capacities in intervals (lower, upper], arrays (walls,)."""
    require_alike(lower=lower, upper=upper, weight=weight)
    lower, upper = np.asarray(lower, dtype=np.float64), np.asarray(upper, dtype=np.float64)
    weight = np.ones(len(lower)) if weight is None else np.asarray(weight, dtype=np.float64)
    keep = (weight > 0) & ((lower > 0) | np.isfinite(upper))
    lower, upper, weight = _rounded(lower[keep]), _rounded(upper[keep]), weight[keep]
    if not len(lower):
        return Npmle(np.zeros(1), np.full(1, np.inf), np.ones(1))
    low_ends, right = _innermost(lower, upper)
    # an interval spans those innermost ones that lie in it, from the first to before the last
    first = np.searchsorted(right, lower, side="right")
    first -= (lower == upper) & (first > 0) & (right[first - 1] == lower)
    last = np.searchsorted(right, upper, side="right")
    span, group = np.unique(np.column_stack((first, last)), axis=0, return_inverse=True)
    total = np.bincount(group.ravel(), weights=weight)
    return Npmle(low_ends, right, _maximise(span[:, 0], span[:, 1], total / total.sum(), len(low_ends)))


def _rounded(bound: FloatArray) -> FloatArray:
    """Round bounds to equal steps if more than ``MOST_BOUNDS`` of them differ."""
    finite = np.isfinite(bound)
    if len(np.unique(bound[finite])) <= MOST_BOUNDS:
        return bound
    step = bound[finite].max() / MOST_BOUNDS
    return np.where(finite, np.round(bound / step) * step, np.inf)


def _innermost(lower: FloatArray, upper: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Intervals from a lower bound to the next upper one with no bound between."""
    exact = np.unique(upper[lower == upper])
    low, high = np.unique(lower[lower < upper]), np.unique(upper)
    # at one place: the lower end of an exact capacity, then upper ends, then the lower ends of what begins beyond
    bounds = np.concatenate((exact, high, low))
    order = np.concatenate((np.zeros(len(exact)), np.ones(len(high)), np.full(len(low), 2.0)))
    is_upper = order == 1
    by = np.lexsort((order, bounds))
    bounds, is_upper = bounds[by], is_upper[by]
    first = np.flatnonzero(~is_upper[:-1] & is_upper[1:])
    return bounds[first], bounds[first + 1]


def _maximise(first: IntArray, last: IntArray, weight: FloatArray, size: int) -> FloatArray:
    """Masses of largest likelihood; each row spans the intervals first <= j < last, weights add up to 1."""
    mass = np.full(size, 1.0 / size)
    for _ in range(MOST_ITERATIONS):
        mass = mass * _directional_derivative(mass, first, last, weight)  # expectation and maximisation
        mass = mass / mass.sum()
        mass = _icm_step(mass, first, last, weight)
        if _directional_derivative(mass, first, last, weight).max() - 1.0 <= TOLERANCE:
            break
    return mass


def _within(mass: FloatArray, first: IntArray, last: IntArray) -> FloatArray:
    reached = np.append(0.0, np.cumsum(mass))
    return np.maximum(reached[last] - reached[first], 1e-100)


def _directional_derivative(mass: FloatArray, first: IntArray, last: IntArray, weight: FloatArray) -> FloatArray:
    """Return the derivative of the log-likelihood by each mass; at the maximum it is 1 at masses, nowhere larger."""
    ratio = weight / _within(mass, first, last)
    size = len(mass) + 1
    return np.cumsum(np.bincount(first, ratio, size) - np.bincount(last, ratio, size))[:-1]


def _icm_step(mass: FloatArray, first: IntArray, last: IntArray, weight: FloatArray) -> FloatArray:
    """Do one step of the iterative convex minorant, shortened until the likelihood is no smaller."""
    from scipy.optimize import isotonic_regression

    size = len(mass)
    if size < 2:
        return mass
    reached = np.cumsum(mass)[:-1]
    within = _within(mass, first, last)
    ratio, square = weight / within, weight / within**2

    def at_ends(value: FloatArray, sign: float) -> FloatArray:
        return (np.bincount(last, value, size + 1) + sign * np.bincount(first, value, size + 1))[1:size]

    slope, curvature = at_ends(ratio, -1.0), at_ends(square, 1.0)
    curvature = np.maximum(curvature, 1e-12)
    to = np.clip(isotonic_regression(reached + slope / curvature, weights=curvature).x, 0.0, 1.0)
    before, fraction = float(weight @ np.log(within)), 1.0
    for _ in range(30):
        new = np.diff(np.concatenate(([0.0], reached + fraction * (to - reached), [1.0])))
        new = np.maximum(new, 0.0)
        inside = _within(new, first, last)
        # an observed interval must keep some probability: no EM step raises a probability of 0
        if inside.min() > 1e-14 and float(weight @ np.log(inside)) >= before:
            return new
        fraction /= 2
    return mass


def isotonic(lower: FloatArray, upper: FloatArray, weight: FloatArray) -> Npmle:
    """Empirical curve of walls known at one movement each: pooled adjacent violators (Ayer and others 1955)."""
    from scipy.optimize import isotonic_regression

    informative = (weight > 0) & ((lower > 0) | np.isfinite(upper))
    lower, upper, weight = lower[informative], upper[informative], weight[informative]
    reached = np.isfinite(upper)
    movement, index = np.unique(np.where(reached, upper, lower), return_inverse=True)
    if not len(movement):
        return Npmle(np.zeros(1), np.full(1, np.inf), np.ones(1))
    count = np.bincount(index.ravel(), weights=weight)
    share = np.bincount(index.ravel(), weights=weight * reached) / count
    steps = isotonic_regression(share, weights=count).x
    right = np.append(movement, np.inf)
    return Npmle(np.append(0.0, movement), right, np.diff(np.concatenate(([0.0], steps, [1.0]))))
