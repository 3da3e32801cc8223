"""Confidence bands of lognormal curves and surfaces, of their medians and dispersions.

One rule: quantiles of the posterior where few walls determine the curve, otherwise BCa of resampled walls (Efron 1987,
J. Am. Stat. Assoc. 82), with the acceleration from the influence of the walls on the fit instead of a jackknife.
Curves of paths that share a dispersion have no posterior: their composite likelihood is not a probability density.

The prior d(ln median) d(dispersion) / dispersion gives exact confidence limits for capacities known exactly (Severini,
Mukerjee and Ghosh 2002, Biometrika 89). Where each wall is known at one movement alone, that prior would let the
dispersion run away, and Jeffreys' takes its place (Firth 1993, Biometrika 80). For each dispersion the likelihood is
close to a normal density in ln(median)/dispersion: draws by Laplace's approximation, corrected by importance weights.

Resamples draw numbers of equal walls. Where nearly every wall differs, one Newton step from the estimate gives each
resample's fit, with a relative error of one over the number of walls.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np
from scipy import special

from damagepred.arrays import FloatArray, IntArray
from damagepred.uq.fragility.estimators import CompositeLikelihood, Estimator
from damagepred.uq.fragility.fit import FEWEST_REACHED, GroupedIntervals
from damagepred.uq.fragility.likelihood import LARGEST_DISPERSION, SMALLEST_DISPERSION, Likelihood, likelihood

POSTERIOR_BELOW, FITTED_SHARE = 100, 0.95
"""Effective walls that reached a category, and share of the resamples that can be fitted, below which bands are
quantiles of the posterior, not BCa: intervals of 90 % then hold the truth in 85 % of the cases of studies/coverage or
more."""
POSTERIOR_DRAWS = 1500  # draws from the posterior
ONE_STEP_GROUPS, ONE_STEP_WALLS = 2000, 20_000
"""Groups of equal walls beyond which a resample is fitted by one Newton step from the estimate, and walls drawn for
such a step at most; its scatter is scaled by the root of their number."""
POSTERIOR_POINTS = 60  # dispersions to either side of the estimate at which the posterior density is computed
POSTERIOR_DROP = 25.0  # fall of the logarithm of that density from its maximum at which it ends (1)
STORED_DRAWS = 4_000_000  # counts of groups in resamples that are kept in memory at a time


def sample_posterior(estimator: Estimator, random: np.random.Generator) -> FloatArray:
    """Draw from the posterior of the parameters, array (draws, parameters)."""
    best, cells, single = estimator.estimate, estimator.cells, _is_current_status(estimator.cells)
    weight = cells.total * (cells.effective() / cells.total.sum())

    def weighted_likelihood(parameters: FloatArray) -> Likelihood:
        with np.errstate(over="ignore", invalid="ignore"):
            return likelihood(parameters, estimator.rows, np.broadcast_to(weight, (len(parameters), len(weight))))

    def log_prior(parameters: FloatArray, terms: Likelihood) -> FloatArray:
        if single:
            with np.errstate(invalid="ignore"):
                return np.asarray(0.5 * np.linalg.slogdet(-terms.hessian)[1])
        return np.asarray(-(others + 1.0) * np.log(parameters[:, 0]))

    others = len(best) - 1
    covariance = np.linalg.pinv(-weighted_likelihood(best[None]).hessian[0], hermitian=True)
    spread = np.sqrt(max(covariance[0, 0], 0.0)) / best[0]
    step = np.clip(8.0 * spread, 4.0, 12.0) / POSTERIOR_POINTS
    upwards, downwards = (
        list(_profile_points(best, direction * step, weighted_likelihood, log_prior)) for direction in (1.0, -1.0)
    )
    modes, density, precision = (np.array(values) for values in zip(*downwards[:0:-1], *upwards))
    log_g = np.log(modes[:, 0])
    density = np.exp(density - density.max())
    share = 0.5 * (density[1:] + density[:-1]) * np.diff(log_g)
    cumulative = np.append(0.0, np.cumsum(share)) / share.sum()
    # draws from the density, taken as uniform between the points, and from the normals at the nearest points
    count = POSTERIOR_DRAWS
    uniform = (np.arange(count) + random.random(count)) / count
    panel = np.clip(np.searchsorted(cumulative, uniform, side="right") - 1, 0, len(share) - 1)
    inside = (uniform - cumulative[panel]) / np.maximum(np.diff(cumulative)[panel], 1e-300)
    drawn_g = log_g[panel] + inside * np.diff(log_g)[panel]
    middle = modes[panel, 1:] + inside[:, None] * (modes[panel + 1, 1:] - modes[panel, 1:])
    factor = np.linalg.cholesky(np.linalg.inv(precision))[panel]
    normal = random.standard_normal((count, others))
    draws = np.column_stack((np.exp(drawn_g), middle + np.einsum("nij,nj->ni", factor, normal)))
    proposed = np.log(share[panel] / np.diff(log_g)[panel]) - 0.5 * (normal**2).sum(axis=1)
    proposed = proposed - np.log(np.einsum("nii->ni", factor)).sum(axis=1)
    drawn = weighted_likelihood(draws)
    log_weight = drawn.value + log_prior(draws, drawn) + drawn_g - proposed
    log_weight = np.where(np.isfinite(log_weight), log_weight, -np.inf)
    importance = np.exp(log_weight - log_weight.max())
    # systematic resampling: the expected number of copies of a draw is in proportion to its weight
    places = (np.arange(count) + random.random()) / count
    return draws[np.minimum(np.searchsorted(np.cumsum(importance) / importance.sum(), places), count - 1)]


def effective_reached(estimator: Estimator) -> float:
    """Smallest effective number of walls (Kish) that determine a category's curve: walls that reached it."""
    cells = estimator.cells
    # walls known at one movement: the smaller group of damaged and undamaged ones; of several categories half of all
    if _is_current_status(cells) and len(cells.lower) > 1:
        return 0.5 * cells.effective()
    counts = []
    for lower, upper in zip(cells.lower, cells.upper):
        reached = np.isfinite(upper)
        kinds = [reached, (lower > 0) & ~reached] if _is_current_status(cells) else [reached]
        counts += [cells.effective(kind) for kind in kinds]
    return min(counts, default=0.0)


def _is_current_status(cells: GroupedIntervals) -> bool:
    """Whether each wall is known at one movement alone."""
    return bool((cells.lower[np.isfinite(cells.upper)] == 0).all())


def _profile_points(
    best: FloatArray,
    step: float,
    of: Callable[[FloatArray], Likelihood],
    log_prior: Callable[[FloatArray, Likelihood], FloatArray],
) -> Iterator[tuple[FloatArray, float, FloatArray]]:
    """Parameters along the profile likelihood, log posterior density of ln(1/dispersion), precision of the others."""
    parameters, most = best.copy(), -np.inf
    while 1.0 / LARGEST_DISPERSION <= parameters[0] <= 1.0 / SMALLEST_DISPERSION:
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
        if not density >= most - POSTERIOR_DROP:
            return
        yield parameters, density, precision
        parameters = parameters * np.exp(step)  # the medians stay


class Resampled(NamedTuple):
    """Bootstrap replicates of the parameters."""

    estimator: Estimator  # of the walls themselves
    replicates: FloatArray  # (resamples, parameters): of those resamples that can be fitted
    influence: FloatArray  # (groups, parameters): influence of one wall of a group on the parameters


def resample(estimator: Estimator, resamples: int, random: np.random.Generator) -> Resampled:
    """Fit resamples of the walls."""
    cells, best = estimator.cells, estimator.estimate
    influence = estimator.scores(best) @ np.linalg.pinv(-estimator.hessian(best), hermitian=True)
    if len(cells.number) > ONE_STEP_GROUPS:
        again = best + _one_step_estimates(influence * cells.weight[:, None], cells.number, resamples, random)
        return Resampled(estimator, again[again[:, 0] > 1.0 / LARGEST_DISPERSION], influence)
    fitted = []
    each = max(1, STORED_DRAWS // len(cells.number))
    fewest = FEWEST_REACHED if len(estimator.categories) == 1 else 1
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
    good = (dispersion > SMALLEST_DISPERSION) & (dispersion < LARGEST_DISPERSION)
    return Resampled(estimator, again[good], influence)


def _one_step_estimates(each: FloatArray, number: IntArray, resamples: int, random: np.random.Generator) -> FloatArray:
    """Newton steps of resamples, (resamples, parameters), from the influence of one wall of each group."""
    walls = int(number.sum())
    size = min(walls, ONE_STEP_WALLS)
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


class Band(NamedTuple):
    """Limits of a curve: of its median, dispersion and probabilities (points,), lower ones first."""

    median: tuple[float, float]
    dispersion: tuple[float, float]
    probability: tuple[FloatArray, FloatArray]


def unknown_band(points: int) -> Band:
    """Band of NaN."""
    nan = (np.nan, np.nan)
    return Band(nan, nan, (np.full(points, np.nan), np.full(points, np.nan)))


class ParameterDraws(NamedTuple):
    """Sampled parameters of a fit."""

    parameters: FloatArray  # (draws, parameters): 1/dispersion and the coefficients of ln(median)/dispersion
    resampled: Resampled | None  # fits of resampled walls; None: drawn from the posterior
    share: float  # share of the resamples that could be fitted; NaN if no walls were resampled


def draw_parameters(estimator: Estimator, resamples: int, random: np.random.Generator) -> ParameterDraws:
    """Parameters from the posterior of few walls, from resamples of many."""
    composite = isinstance(estimator, CompositeLikelihood) and len(estimator.categories) > 1
    share = np.nan
    if composite or effective_reached(estimator) >= POSTERIOR_BELOW:
        again = resample(estimator, resamples, random)
        share = len(again.replicates) / resamples
        # resamples without a fit lie to one side: the band of the others would be too narrow
        if composite or share >= FITTED_SHARE:
            return ParameterDraws(again.replicates, again, share)
    return ParameterDraws(sample_posterior(estimator, random), None, share)


def confidence_band(draws: ParameterDraws, row: FloatArray, grid: FloatArray, confidence: float, walls: float) -> Band:
    """Band of the curve with ln(median)/dispersion = ``row @ parameters[1:]``, from ``walls`` effective walls."""
    if len(draws.parameters) < 2:
        return unknown_band(len(grid))
    values = np.sort(_curve_quantities(draws.parameters[:, 0], draws.parameters[:, 1:] @ row, grid), axis=0)
    tails = np.array([0.5 * (1 - confidence), 0.5 * (1 + confidence)])
    if draws.resampled is None:
        return _quantiles(values, tails[:, None] * np.ones(values.shape[1]))
    estimate = draws.resampled.estimator.estimate
    best = _curve_quantities(estimate[:1], estimate[None, 1:] @ row, grid)[0]
    below = ((values < best).sum(axis=0) + 0.5 * (values == best).sum(axis=0) + 0.5) / (len(values) + 1)
    # expanded percentiles (Hesterberg 2015, Am. Stat. 69): resamples scatter too little by the root of (n - 1) / n
    n = max(walls, 2.0)
    bias, z = special.ndtri(below), np.sqrt(n / (n - 1.0)) * special.stdtrit(n - 1.0, tails)[:, None]
    z = bias + (bias + z) / (1.0 - _acceleration(draws.resampled, row, grid) * (bias + z))
    return _quantiles(values, special.ndtr(z))


def _curve_quantities(g: FloatArray, h: FloatArray, grid: FloatArray) -> FloatArray:
    """ln(median), dispersion and probit of the probability at each movement, array (draws, 2 + points)."""
    with np.errstate(divide="ignore"):
        probit = g[:, None] * np.log(grid) - h[:, None]
    return np.column_stack((h / g, 1.0 / g, probit))


def _quantiles(values: FloatArray, shares: FloatArray) -> Band:
    """Band between quantiles of sorted numbers, at shares that differ from number to number."""
    position = shares * (len(values) - 1)
    under = np.clip(position.astype(np.int64), 0, len(values) - 2)
    columns = np.arange(values.shape[1])
    with np.errstate(invalid="ignore"):
        rest = values[under + 1, columns] - values[under, columns]
        low, high = values[under, columns] + np.where(np.isfinite(rest), rest * (position - under), 0.0)
    # the curve rises, so its pointwise limits are made to rise
    ends = [special.ndtr(np.maximum.accumulate(limit[2:])) for limit in (low, high)]
    return Band((float(np.exp(low[0])), float(np.exp(high[0]))), (float(low[1]), float(high[1])), (ends[0], ends[1]))


def _acceleration(fits: Resampled, row: FloatArray, grid: FloatArray) -> FloatArray:
    """Acceleration of BCa: a sixth of the skewness of the walls' influence on each number."""
    estimate, cells = fits.estimator.estimate, fits.estimator.cells
    g, h = estimate[0], estimate[1:] @ row
    with np.errstate(divide="ignore"):
        log_grid = np.where(grid > 0, np.log(grid), 0.0)
    by_g = np.concatenate(([-h / g**2, -1.0 / g**2], log_grid))
    by_h = np.concatenate(([1.0 / g, 0.0], np.full(len(grid), -1.0)))
    each = np.column_stack((fits.influence[:, 0], fits.influence[:, 1:] @ row)) * cells.weight[:, None]
    count = cells.number.astype(np.float64)
    second = np.einsum("c,ca,cb->ab", count, each, each)
    third = np.einsum("c,ca,cb,cd->abd", count, each, each, each, optimize=True)
    along = np.column_stack((by_g, by_h))
    spread = np.einsum("na,nb,ab->n", along, along, second)
    skew = np.einsum("na,nb,nd,abd->n", along, along, along, third)
    return skew / (6.0 * np.maximum(spread, 1e-300) ** 1.5)
