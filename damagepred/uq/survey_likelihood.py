"""Likelihood of observations for the states of solved walls.

A measured value is normal about the wall's own, with the survey's error and the model's discrepancy added in squares
(Kennedy and O'Hagan 2001); a limit is censored. All observations share the uncertain discrepancy, so their joint
likelihood is integrated over its distribution (Gauss-Hermite quadrature).

Readings of one quantity at several dates are a series: the model's discrepancy is the same at all of them, except for
a share of each reading's own, and the errors of the survey are independent.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from scipy import special

from damagepred.arrays import FloatArray
from damagepred.uq.discrepancy import Discrepancy
from damagepred.uq.history import years_from
from damagepred.uq.observations import (
    CrackObservation,
    LevelObservation,
    Observations,
    Reading,
    SlopeObservation,
    WindowObservation,
)

VAGUE_WIDTH = 1.6e-3, 1.7
"""Under another cause: median (m) and deviation of the logarithm of crack widths, 90 % of them from 0.1 to 25 mm (the
limits of the damage table). One place in two has no crack. Assumed, as all values of the vague model."""

VAGUE_SLOPE = 1.0 / 150.0
"""Under another cause: mean slope and tilt, and standard deviation of levels over their distance."""

VAGUE_CHANGE = 5e-3
"""Under another cause: standard deviation of the change of an opening's width (m); one opening in two sticks."""

OWN_SHARE = 0.1
"""Share of the model's discrepancy (standard deviation) that is each reading's own, not its series'. Assumed."""

COMMON_POINTS = 7  # points of the quadrature over the common discrepancy of a series with limits


class Fit(NamedTuple):
    """Agreement of states with an observation; ``misfit``: squared standard deviations, -2 ln p of a limit."""

    log_likelihood: FloatArray
    misfit: FloatArray

    def __add__(self, other: object) -> Fit:
        """Fit of two independent observations."""
        if not isinstance(other, Fit):
            return NotImplemented
        return Fit(self.log_likelihood + other.log_likelihood, self.misfit + other.misfit)


def measured(predicted: FloatArray, value: float, deviation: FloatArray | float) -> Fit:
    """Fit of a measured value; ``deviation`` is its standard deviation about the prediction."""
    misfit = ((predicted - value) / deviation) ** 2
    return Fit(-0.5 * misfit - np.log(deviation * math.sqrt(2.0 * math.pi)), misfit)


def censored(predicted: FloatArray, lower: float, upper: float, deviation: FloatArray | float) -> Fit:
    """Fit of a value known to lie between limits, which may be infinite."""
    a, b = (lower - predicted) / deviation, (upper - predicted) / deviation
    if math.isinf(lower) or math.isinf(upper):
        chance = special.ndtr(b if math.isinf(lower) else -a)
    else:
        flip = a > 0  # both in the upper tail, where differences of ndtr cancel
        chance = special.ndtr(np.where(flip, -a, b)) - special.ndtr(np.where(flip, -b, a))
    logarithm = np.log(np.maximum(chance, np.finfo(np.float64).tiny))
    return Fit(logarithm, -2.0 * logarithm)


@dataclass(frozen=True)
class CrackPrediction:
    """Value of a reading on each wall: width (m) of any crack, of the observed direction, and before the change."""

    any: FloatArray
    along: FloatArray
    before: CrackPrediction | None = None


def series_fit(series: Sequence[Reading], predicted: Sequence[CrackPrediction], model: Any) -> Fit:
    """Fit of the readings of one quantity; ``model``: discrepancy, or the terms of several (``stacked``)."""

    def fit(which: str) -> Fit:
        values = [getattr(p, which) for p in predicted]
        before = [None if p.before is None else getattr(p.before, which) for p in predicted]
        return _fit([_deviations(*reading, model) for reading in zip(series, values, before)])

    other = fit("any")
    if all(getattr(reading, "direction", None) is None for reading in series):
        return other
    # a mixture: the model's crack may run otherwise than the real one
    share = model.direction
    same = fit("along")
    both = np.logaddexp(np.log1p(-share) + same.log_likelihood, np.log(share) + other.log_likelihood)
    return Fit(both, np.minimum(same.misfit, other.misfit - 2.0 * np.log(share)))


def _deviations(reading: Reading, value: FloatArray, before: FloatArray | None, model: Any) -> tuple[Any, ...]:
    """Reading, its prediction, and the standard deviations that it shares with its series and has of its own."""
    discrepancy, error = _errors(reading, value, model)
    own = np.hypot(error, OWN_SHARE * discrepancy)
    if before is not None:
        value, discrepancy = value - before, discrepancy - _errors(reading, before, model)[0]
    return reading, value, math.sqrt(1.0 - OWN_SHARE**2) * discrepancy, own


def _fit(readings: Sequence[tuple[Any, ...]]) -> Fit:
    """Fit of readings with one common standard normal (Sherman and Morrison 1950; quadrature for limits)."""
    values = [(reading.observed, *rest) for reading, *rest in readings if reading.observed is not None]
    limits = [(reading.limits, *rest) for reading, *rest in readings if reading.observed is None]
    if len(readings) == 1:
        for value, mean, shared, own in values:
            return measured(mean, value, np.hypot(shared, own))
        for (lower, upper), mean, shared, own in limits:
            return censored(mean, lower, upper, np.hypot(shared, own))
    squares: Any = 0.0
    cross = along = logs = squares  # of residuals, of residual and common deviation, of the latter, of variances
    for value, mean, shared, own in values:
        own = np.maximum(own, np.finfo(np.float64).tiny)
        gap, common = (value - mean) / own, shared / own
        squares, cross, along = squares + gap**2, cross + gap * common, along + common**2
        logs = logs + 2.0 * np.log(own)
    rest = 1.0 + along
    misfit = squares - cross**2 / rest
    log = -0.5 * (misfit + logs + np.log(rest) + len(values) * math.log(2.0 * math.pi))
    if not limits:
        return Fit(log, misfit)
    chances = []
    for node, weight in zip(*np.polynomial.hermite_e.hermegauss(COMMON_POINTS)):
        common = cross / rest + node / np.sqrt(rest)
        terms = [
            censored(m + shared * common, low, high, np.maximum(own, 1e-12)) for (low, high), m, shared, own in limits
        ]
        chances.append(math.log(weight / math.sqrt(2.0 * math.pi)) + sum(term.log_likelihood for term in terms))
    chance: Any = special.logsumexp(chances, axis=0)
    return Fit(log + chance, misfit - 2.0 * chance)


def _errors(reading: Any, value: FloatArray, model: Any) -> tuple[FloatArray, float]:
    """Standard deviations of the model's discrepancy at a predicted value, and of the reading."""
    match reading:
        case CrackObservation():
            return np.sqrt(model.width**2 + (model.width_share * value) ** 2), reading.error
        case WindowObservation(sticks=None):
            return model.distortion_share * value, reading.error
        case WindowObservation():
            return model.distortion_share * np.maximum(value, 1.0), 0.0
    return (model.level if isinstance(reading, LevelObservation) else model.slope) + 0.0 * value, reading.error


def _vague(reading: Any, model: Discrepancy) -> tuple[float, float]:
    """Log likelihood of a reading under another cause, and standard deviation of the change in a year."""
    match reading:
        case CrackObservation():
            middle, deviation = VAGUE_WIDTH
            if reading.width is not None:
                error = math.hypot(reading.error, model.width)
                whole = math.exp(-0.5 * (reading.width / error) ** 2) / (error * math.sqrt(0.5 * math.pi))
                z = math.log(reading.width / middle) / deviation
                open_ = math.exp(-0.5 * z**2) / (reading.width * deviation * math.sqrt(2.0 * math.pi))
                chance = 0.5 * (whole + open_)
            else:  # any width fits a change
                ends = np.maximum(reading.limits, 0.0) if reading.change is None else (0.0, np.inf)
                below = [0.5 * (x > 0) + 0.5 * special.ndtr(np.log(max(x, 1e-300) / middle) / deviation) for x in ends]
                chance = float(below[1] - below[0])
            other = 1.0 - model.direction  # one of four directions, or the model's runs otherwise
            return math.log(chance * (1.0 if reading.direction is None else 1.0 - 0.75 * other)), middle
        case SlopeObservation():
            return -reading.value / VAGUE_SLOPE - math.log(VAGUE_SLOPE), VAGUE_SLOPE
        case WindowObservation(width_change=None):
            return math.log(0.5), VAGUE_CHANGE
    level = isinstance(reading, LevelObservation)
    scatter = VAGUE_CHANGE
    if level:  # around a corner, at most to it and on
        along = reading.x + reading.to_x if reading.to_wall else reading.to_x - reading.x
        scatter = VAGUE_SLOPE * math.hypot(along, reading.to_y - reading.y)
    spread = math.hypot(scatter, math.hypot(reading.error, model.level if level else 0.0))
    return float(measured(np.zeros(1), reading.observed, spread).log_likelihood[0]), scatter


def vague_log_likelihood(seen: Observations) -> float:
    """Log likelihood under another cause: each quantity for itself, as vague as surveys are."""
    return sum(_vague_series(found, seen.discrepancy) for _, found in seen.series)


def _vague_series(series: Sequence[Any], model: Discrepancy) -> float:
    """Log likelihood under another cause of the readings of one quantity (a random walk back from the last)."""
    values = [reading for reading in series if reading.since is None]
    total = _vague(values[-1], model)[0] if values else 0.0
    for walk in (values, [reading for reading in series if reading.since is not None]):
        *found, last = [reading for reading in walk if reading.observed is not None] or [None]
        if last is None or (last.since is None and last is not values[-1]):
            continue
        day, value, error = (last.date, last.observed, last.error) if last.since is None else (last.since, 0.0, 0.0)
        found += [last] if last.since is not None else []
        years = np.abs(years_from(day, [reading.date for reading in found]))
        scatter = _vague(last, model)[1]
        covariance = scatter**2 * np.minimum.outer(years, years) + error**2
        covariance += np.diag(np.array([max(reading.error, 1e-9) for reading in found]) ** 2)
        gap = np.array([reading.observed for reading in found]) - value
        size = np.linalg.slogdet(2.0 * math.pi * covariance)[1]
        total -= 0.5 * float(gap @ np.linalg.solve(covariance, gap) + size)
    return total
