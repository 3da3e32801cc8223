"""Few walls: draws from the posterior of the parameters, with priors that match the frequentist coverage.

For capacities that are known exactly, or censored after a number of walls, quantiles of the posterior with the
right-invariant prior d(ln median) d(dispersion) / dispersion are exact confidence limits, of the median (Student's t),
of the dispersion (chi-squared) and of each probability, however few walls there are (Severini, Mukerjee and Ghosh 2002,
Biometrika 89). Likelihood ratios and resamples of a few walls are not: studies/coverage.

Where each wall is known at one movement alone, that prior would let the dispersion run away, and Jeffreys' takes its
place: the root of the determinant of the information, as in Firth's penalty (1993, Biometrika 80).

For each dispersion the likelihood is close to a normal density in ln(median)/dispersion. The dispersion is drawn from
its density by Laplace's approximation, the others from those normals; importance weights correct the draws.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

from damagepred.arrays import FloatArray, IntArray
from damagepred.uq.estimate import effective_samples
from damagepred.uq.fragility.estimators import Estimator
from damagepred.uq.fragility.grouped_data import GroupedIntervals
from damagepred.uq.fragility.likelihood import Likelihood, likelihood
from damagepred.uq.fragility.options import FragilityOptions


def sample_posterior(estimator: Estimator, random: np.random.Generator) -> FloatArray:
    """Draw from the posterior of the parameters, array (draws, parameters)."""
    best, options = estimator.estimate, estimator.options
    cells, single = estimator.cells, _is_current_status(estimator.cells)
    weight = cells.total * (_kish(cells.weight, cells.number) / cells.total.sum())

    def weighted_likelihood(parameters: FloatArray) -> Likelihood:
        with np.errstate(over="ignore", invalid="ignore"):
            return likelihood(
                parameters, estimator.rows, np.broadcast_to(weight, (len(parameters), len(weight))), options
            )

    def log_prior(parameters: FloatArray, terms: Likelihood) -> FloatArray:
        if single:
            with np.errstate(invalid="ignore"):
                return np.asarray(0.5 * np.linalg.slogdet(-terms.hessian)[1])
        return np.asarray(-(others + 1.0) * np.log(parameters[:, 0]))

    others = len(best) - 1
    spread = (
        np.sqrt(max(np.linalg.pinv(-weighted_likelihood(best[None]).hessian[0], hermitian=True)[0, 0], 0.0)) / best[0]
    )
    step = np.clip(8.0 * spread, 4.0, 12.0) / options.posterior_points
    upwards, downwards = (
        list(_profile_points(best, direction * step, weighted_likelihood, log_prior, options))
        for direction in (1.0, -1.0)
    )
    points = [*downwards[:0:-1], *upwards]
    log_g, density = (
        np.array([np.log(point.parameters[0]) for point in points]),
        np.array([point.density for point in points]),
    )
    modes, precision = np.array([point.parameters for point in points]), np.array([point.precision for point in points])
    density = np.exp(density - density.max())
    share = 0.5 * (density[1:] + density[:-1]) * np.diff(log_g)
    cumulative = np.append(0.0, np.cumsum(share)) / share.sum()
    # draws from the density, taken as uniform between the points, and from the normals at the nearest points
    count = options.posterior_draws
    uniform = (np.arange(count) + random.random(count)) / count
    panel = np.clip(np.searchsorted(cumulative, uniform, side="right") - 1, 0, len(share) - 1)
    inside = (uniform - cumulative[panel]) / np.maximum(np.diff(cumulative)[panel], 1e-300)
    drawn_g = log_g[panel] + inside * np.diff(log_g)[panel]
    middle = modes[panel, 1:] + inside[:, None] * (modes[panel + 1, 1:] - modes[panel, 1:])
    factor = np.linalg.cholesky(np.linalg.inv(precision))[panel]
    normal = random.standard_normal((count, others))
    draws = np.column_stack((np.exp(drawn_g), middle + np.einsum("nij,nj->ni", factor, normal)))
    proposed = (
        np.log(share[panel] / np.diff(log_g)[panel])
        - 0.5 * (normal**2).sum(axis=1)
        - np.log(np.einsum("nii->ni", factor)).sum(axis=1)
    )
    drawn = weighted_likelihood(draws)
    log_weight = drawn.value + log_prior(draws, drawn) + drawn_g - proposed
    log_weight = np.where(np.isfinite(log_weight), log_weight, -np.inf)
    importance = np.exp(log_weight - log_weight.max())
    # systematic resampling: the expected number of copies of a draw is in proportion to its weight
    places = (np.arange(count) + random.random()) / count
    return draws[np.minimum(np.searchsorted(np.cumsum(importance) / importance.sum(), places), count - 1)]


def effective_reached(estimator: Estimator) -> float:
    """Smallest effective number of walls (Kish) that determine a category's curve.

    These are the walls that reached it. Where each wall is known at one movement, they are the smaller group of damaged
    and undamaged walls; of several categories fitted together, half of all walls.
    """
    cells = estimator.cells
    if _is_current_status(cells) and len(cells.lower) > 1:
        return 0.5 * _kish(cells.weight, cells.number)
    counts = []
    for lower, upper in zip(cells.lower, cells.upper):
        reached = np.isfinite(upper)
        kinds = [reached, (lower > 0) & ~reached] if _is_current_status(cells) else [reached]
        counts += [_kish(cells.weight[kind], cells.number[kind]) for kind in kinds]
    return min(counts, default=0.0)


def _kish(weight: FloatArray, number: IntArray) -> float:
    return effective_samples(np.repeat(weight, number))


def _is_current_status(cells: GroupedIntervals) -> bool:
    """Whether each wall is known at one movement alone."""
    return bool((cells.lower[np.isfinite(cells.upper)] == 0).all())


class _Point(NamedTuple):
    """Maximum of the likelihood for one dispersion."""

    parameters: FloatArray
    density: float  # logarithm of the posterior density of ln(parameters[0]), up to a constant
    precision: FloatArray  # negative second derivatives of the log-likelihood by the other parameters


def _profile_points(
    best: FloatArray,
    step: float,
    of: Callable[[FloatArray], Likelihood],
    log_prior: Callable[[FloatArray, Likelihood], FloatArray],
    options: FragilityOptions,
) -> Iterator[_Point]:
    """Follow the profile likelihood from its maximum to larger or smaller dispersions, until the density is small."""
    parameters, most = best.copy(), -np.inf
    while 1.0 / options.largest_dispersion <= parameters[0] <= 1.0 / options.smallest_dispersion:
        current = of(parameters[None])
        for _ in range(50):
            way = np.linalg.pinv(-current.hessian[0, 1:, 1:], hermitian=True) @ current.gradient[0, 1:]
            if current.gradient[0, 1:] @ way <= 1e-8:
                break
            for _ in range(40):
                to = parameters + np.append(0.0, way)
                new = of(to[None])
                if new.value[0] >= current.value[0] - 1e-12:
                    break
                way = way / 2
            parameters, current = to, new
        precision = -current.hessian[0, 1:, 1:]
        if not np.isfinite(precision).all() or np.linalg.eigvalsh(precision).min() <= 0:
            return
        density = float((current.value + log_prior(parameters[None], current))[0] + np.log(parameters[0]))
        density -= 0.5 * float(np.linalg.slogdet(precision)[1])
        most = max(most, density)
        if not density >= most - options.posterior_drop:
            return
        yield _Point(parameters, density, precision)
        parameters = parameters * np.exp(step)  # the medians stay
