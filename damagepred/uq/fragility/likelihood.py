"""The likelihood of censored lognormal capacities, and its maximum.

In all models a standard normal of each wall lies between two bounds that are linear in the parameters:
below @ p < e <= above @ p, where p[0] = 1/dispersion. Then the log-likelihood is concave in p (Burridge 1981, J. R.
Stat. Soc. B 43; Pratt 1981, J. Am. Stat. Assoc. 76): there is one maximum, and any start leads to it. The same Newton
method serves separate curves, curves of a common dispersion, ordinal data and surfaces, and many resamples at a time.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy import special

from damagepred.arrays import BoolArray, FloatArray, IntArray

_LOG_ZERO = -1e6  # finite number in place of the logarithm of 0
ROUNDING = 1e-14
"""Error of a log-likelihood over the sum of weights (1): a step that lowers it by less is still Newton's."""


class LinearBounds(NamedTuple):
    """Bounds of one standard normal a row."""

    # (rows, parameters): the normal lies above ``below @ p`` and not above ``above @ p``
    below: FloatArray
    above: FloatArray
    # (rows,): where there is no such bound; the row of ``below`` or ``above`` is 0 then
    no_below: BoolArray
    no_above: BoolArray
    exact: BoolArray  # (rows,): where it is ``above @ p`` itself: of a capacity known exactly

    def part(self, which: slice) -> LinearBounds:
        """Return some of the rows."""
        return LinearBounds(
            self.below[which], self.above[which], self.no_below[which], self.no_above[which], self.exact[which]
        )


def linear_bounds(lower: FloatArray, upper: FloatArray, regressors: FloatArray) -> LinearBounds:
    """Intervals of capacities as linear bounds: g ln(lower) - h . x < e <= g ln(upper) - h . x."""
    no_below, no_above, exact = lower <= 0, np.isinf(upper), lower == upper
    with np.errstate(divide="ignore"):
        low, high = np.where(no_below, 0.0, np.log(lower)), np.where(no_above, 0.0, np.log(upper))
    below, above = np.column_stack((low, -regressors)), np.column_stack((high, -regressors))
    below[no_below], above[no_above] = 0.0, 0.0
    return LinearBounds(below, above, no_below, no_above, exact)


SMALLEST_DISPERSION, LARGEST_DISPERSION = 1e-4, 20.0
"""Dispersions (1) beyond which there is no curve."""
LIKELIHOOD_ROWS = 200_000  # rows of the likelihood evaluated at a time: they fit into the processor's cache
COARSE_START_ROWS = 50_000  # rows from which the maximum is first sought with a fifth of this number of rows


class Likelihood(NamedTuple):
    """Logarithm of the likelihood (resamples,), its gradient (resamples, p) and curvature (resamples, p, p)."""

    value: FloatArray
    gradient: FloatArray
    hessian: FloatArray


def likelihood(parameters: FloatArray, rows: LinearBounds, weight: FloatArray) -> Likelihood:
    """Log-likelihood of several sets of parameters, each for its own weights, with its derivatives."""
    resamples, size = parameters.shape
    value, gradient = np.zeros(resamples), np.zeros((resamples, size))
    hessian = np.zeros((resamples, size, size))
    step = max(1, LIKELIHOOD_ROWS // resamples)
    for first in range(0, weight.shape[1], step):
        chunk = slice(first, first + step)
        some, w = rows.part(chunk), weight[:, chunk]
        term, by_low, by_high, low_low, low_high, high_high = _row_log_likelihood(parameters, some)
        value += (w * term).sum(axis=1)
        gradient += (w * by_high) @ some.above + (w * by_low) @ some.below
        hessian += _hessian(some, w * low_low, w * low_high, w * high_high)
        if some.exact.any():
            exact = w @ some.exact
            gradient[:, 0] += exact / parameters[:, 0]
            hessian[:, 0, 0] -= exact / parameters[:, 0] ** 2
    return Likelihood(value, gradient, hessian)


def scores(parameters: FloatArray, rows: LinearBounds) -> FloatArray:
    """Gradient of the log-likelihood of each row, array (rows, parameters)."""
    gradients = np.empty_like(rows.below)
    for first in range(0, len(gradients), LIKELIHOOD_ROWS):
        chunk = slice(first, first + LIKELIHOOD_ROWS)
        some = rows.part(chunk)
        _, by_low, by_high, *_ = _row_log_likelihood(parameters[None], some)
        gradients[chunk] = by_high[0][:, None] * some.above + by_low[0][:, None] * some.below
        gradients[chunk, 0] += some.exact / parameters[0]
    return gradients


def _hessian(rows: LinearBounds, low_low: FloatArray, low_high: FloatArray, high_high: FloatArray) -> FloatArray:
    """Sum up the rows' second derivatives, weighted (resamples, rows); array (resamples, p, p)."""
    below, above = rows.below, rows.above
    if len(low_low) == 1:
        mixed = (below * low_high[0][:, None]).T @ above
        squares = (below * low_low[0][:, None]).T @ below + (above * high_high[0][:, None]).T @ above
        return (squares + mixed + mixed.T)[None]
    size = below.shape[1]
    mixed = (low_high @ _products(below, above)).reshape(-1, size, size)
    alike = low_low @ _products(below, below) + high_high @ _products(above, above)
    return alike.reshape(-1, size, size) + mixed + mixed.swapaxes(1, 2)


def _products(first: FloatArray, second: FloatArray) -> FloatArray:
    return (first[:, :, None] * second[:, None, :]).reshape(len(first), -1)


def _row_log_likelihood(parameters: FloatArray, rows: LinearBounds) -> tuple[FloatArray, ...]:
    """Log-likelihood of rows (resamples, rows), its derivatives by lower and upper bound, and by pairs of them."""
    a, b = parameters @ rows.below.T, parameters @ rows.above.T
    low, high = np.where(rows.no_below, -np.inf, a), np.where(rows.no_above, np.inf, b)
    exact = rows.exact[None, :]
    with np.errstate(divide="ignore", invalid="ignore"):
        between = np.where(exact, 0.0, _log_interval_probability(low, high))
        # density at either end over the probability between, 0 at an infinite end
        p, q = (np.exp(np.minimum(-0.5 * z**2 - 0.5 * np.log(2 * np.pi) - between, 700.0)) for z in (low, high))
    p, q = np.where(exact, 0.0, p), np.where(exact, 0.0, q)
    term = np.where(exact, np.log(parameters[:, :1]) - 0.5 * b**2 - 0.5 * np.log(2 * np.pi), between)
    return term, -p, np.where(exact, -b, q), a * p - p**2, p * q, np.where(exact, -1.0, -b * q - q**2)


def _log_interval_probability(a: FloatArray, b: FloatArray) -> FloatArray:
    """Log(Phi(b) - Phi(a)) without cancellation in either tail."""
    flip = a > 0
    low, high = np.where(flip, -b, a), np.where(flip, -a, b)
    log_high, log_low = special.log_ndtr(high), special.log_ndtr(low)
    with np.errstate(divide="ignore", invalid="ignore"):
        difference = log_high + np.log1p(-np.exp(np.minimum(log_low - log_high, 0.0)))
    return np.maximum(np.where(np.isnan(difference), _LOG_ZERO, difference), _LOG_ZERO)


def maximise_likelihood(rows: LinearBounds, weight: FloatArray, start: FloatArray) -> FloatArray:
    """Parameters of the largest likelihood, array (resamples, parameters), by Newton's method."""
    resamples, count = weight.shape
    smallest, largest = SMALLEST_DISPERSION, LARGEST_DISPERSION
    parameters = np.array(np.broadcast_to(start, (resamples, rows.below.shape[1])), dtype=np.float64)
    if count > COARSE_START_ROWS and resamples == 1:
        stride = count // (COARSE_START_ROWS // 5)
        parameters = maximise_likelihood(rows.part(slice(None, None, stride)), weight[:, ::stride], parameters)
        parameters[:, 0] = np.clip(parameters[:, 0], 1.0 / largest, 1.0 / smallest)
    total = weight.sum(axis=1)
    current = likelihood(parameters, rows, weight)
    active = np.arange(resamples)
    for _ in range(200):
        now = Likelihood(*(part[active] for part in current))
        # to the maximum of the second-order expansion; of the least length where it is flat
        step = (np.linalg.pinv(-now.hessian, hermitian=True) @ now.gradient[:, :, None])[:, :, 0]
        too_far = parameters[active, 0] + step[:, 0] <= 0  # the dispersion is positive; it may well grow tenfold
        step[too_far] *= (0.9 * parameters[active, 0] / np.where(too_far, -step[:, 0], 1.0))[too_far, None]
        moved, fraction = _line_search(parameters, current, step, active, rows, weight)
        predicted = fraction * (now.gradient * step).sum(axis=1)
        dispersion = 1.0 / parameters[active, 0]
        done = ~moved | (predicted <= ROUNDING * total[active]) | (dispersion <= smallest) | (dispersion >= largest)
        active = active[~done]
        if not active.size:
            break
    return parameters


def _line_search(
    parameters: FloatArray,
    current: Likelihood,
    step: FloatArray,
    active: IntArray,
    rows: LinearBounds,
    weight: FloatArray,
) -> tuple[BoolArray, FloatArray]:
    """Halve the steps until the likelihood is no smaller; return whether each was taken, and its fraction."""
    moved, fraction = np.zeros(len(active), dtype=bool), np.ones(len(active))
    open_ = np.arange(len(active))
    for _ in range(60):
        who = active[open_]
        to = parameters[who] + fraction[open_, None] * step[open_]
        new = likelihood(to, rows, weight[who])
        good = new.value >= current.value[who] - ROUNDING * weight[who].sum(axis=1)
        parameters[who[good]] = to[good]
        for mine, theirs in zip(current, new):
            mine[who[good]] = theirs[good]
        moved[open_[good]] = True
        open_ = open_[~good]
        if not open_.size:
            break
        fraction[open_] /= 2
    return moved, fraction
