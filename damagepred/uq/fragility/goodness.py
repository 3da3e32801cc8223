"""How well lognormal curves fit: against the empirical curve, and whether one dispersion is enough for all."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator

import numpy as np

from damagepred.arrays import FloatArray
from damagepred.uq.capacity import StudyCapacities
from damagepred.uq.fragility.estimators import CompositeLikelihood, fit_grouped
from damagepred.uq.fragility.fit import FITTED, Fit, GroupedIntervals, group_intervals
from damagepred.uq.fragility.turnbull import Npmle, turnbull


def distance(fit: Fit, empirical: Npmle) -> float:
    """Largest distance of a curve from the empirical one, where the latter is determined (Kolmogorov)."""
    reached = np.append(0.0, np.cumsum(empirical.mass))
    gaps = [np.abs(fit.probability(empirical.left) - reached[:-1])]
    finite = np.isfinite(empirical.right)
    gaps.append(np.abs(fit.probability(empirical.right[finite]) - reached[1:][finite]))
    return float(np.concatenate(gaps).max())


LARGEST_JUDGED = 20_000  # walls beyond which the fit is not judged: no form fits as closely as they can tell
ENOUGH_LARGER = 10  # simulated misfits at least as large as the study's after which no more are simulated


def _likelihood_ratio_statistic(fit: Fit, intervals: GroupedIntervals) -> float:
    """Twice the log-likelihood ratio of the empirical curve over a fitted one, of one category."""
    lower, upper, weight = intervals.lower[0], intervals.upper[0], intervals.total
    empirical = turnbull(lower, upper, weight)

    def negative_log_likelihood(probability: Callable[[FloatArray], FloatArray]) -> float:
        high = np.where(np.isinf(upper), 1.0, probability(np.where(np.isinf(upper), 1.0, upper)))
        return -float(weight @ np.log(np.maximum(high - probability(lower), 1e-12)))

    return 2.0 * (negative_log_likelihood(fit.probability) - negative_log_likelihood(empirical.probability))


def p_value(fit: Fit, walls: StudyCapacities, k: int, repetitions: int, random: np.random.Generator) -> float:
    """Probability that walls of the fitted curve have at least the misfit of these (parametric bootstrap)."""
    if repetitions == 0 or len(walls.weight) > LARGEST_JUDGED or np.ptp(walls.weight) > 0:
        return np.nan
    lower, upper = walls.capacities.lower[k], walls.capacities.upper[k]
    statistic = _likelihood_ratio_statistic(fit, group_intervals(lower[None], upper[None], walls.weight))
    return sequential_p_value(statistic, _simulated_statistics(fit, walls, k, repetitions, random))


def sequential_p_value(statistic: float, simulated: Iterable[float]) -> float:
    """Share of simulated statistics at least as large, until ``ENOUGH_LARGER`` are (Besag and Clifford 1991).

    Conservative; of n simulated statistics, p-values below ``ENOUGH_LARGER`` / n are the same as of all n.
    """
    larger = count = 0
    for count, value in enumerate(simulated, 1):
        larger += value >= statistic
        if larger == ENOUGH_LARGER:
            return larger / count
    return (larger + 1) / (count + 1)


def _simulated_statistics(
    fit: Fit, walls: StudyCapacities, k: int, repetitions: int, random: np.random.Generator
) -> Iterator[float]:
    """Misfits of simulated studies to their own fitted curves; a study without a curve is left out."""
    upper = walls.capacities.upper[k]
    followed = np.where(np.isinf(upper), walls.capacities.lower[k], walls.capacities.end)
    for _ in range(repetitions):
        capacity = fit.median * np.exp(fit.dispersion * random.standard_normal(len(upper)))
        low, high = _grouped_by_increments(capacity, followed, walls, upper)
        cells = group_intervals(low[None], high[None], walls.weight)
        again = fit_grouped(cells)[0]
        if again.status == FITTED:
            yield _likelihood_ratio_statistic(again, cells)


def _grouped_by_increments(
    capacity: FloatArray, followed: FloatArray, walls: StudyCapacities, upper: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Intervals that the study's increments would give simulated capacities."""
    if walls.single:
        movement = np.where(np.isfinite(upper), upper, followed)
        hit = capacity <= movement
        return np.where(hit, 0.0, movement), np.where(hit, movement, np.inf)
    if walls.marks is not None and np.isfinite(walls.marks).all():
        marks = np.maximum.accumulate(walls.marks)
        step_number = np.searchsorted(marks, capacity)
        low, high = np.append(marks, marks[-1])[step_number - 1], np.append(marks, np.inf)[step_number]
    else:
        step = walls.capacities.end / walls.increments
        low = np.minimum(np.floor(capacity / step), walls.increments) * step
        high = np.where(capacity > walls.capacities.end, np.inf, low + step)
    beyond = high > followed * (1 + 1e-9)
    return np.where(beyond, np.minimum(low, followed), low), np.where(beyond, np.inf, high)


def akaike_criterion(cells: GroupedIntervals, common: bool) -> float:
    """Akaike's criterion of the product of the categories' likelihoods; a smaller one is better."""
    # a wall's categories depend on each other, so Takeuchi's trace takes the place of the number of parameters (Varin
    # and Vidoni 2005, Biometrika 92)
    places = list(range(len(cells.lower)))
    parts = [(places, cells)] if common else [([k], cells.of(k)) for k in places]
    total = 0.0
    for estimator in (CompositeLikelihood(*part) for part in parts):
        if estimator.no_dispersion():
            return np.nan
        parameters = estimator.estimate
        each = estimator.scores(parameters) * estimator.cells.weight[:, None]
        spread = (each * estimator.cells.number[:, None]).T @ each
        covariance = np.linalg.pinv(-estimator.hessian(parameters), hermitian=True)
        total += 2.0 * float(np.trace(covariance @ spread)) - 2 * estimator.value(parameters)
    return total
