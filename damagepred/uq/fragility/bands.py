"""Confidence bands of lognormal curves and surfaces, of their medians and dispersions.

One rule: quantiles of the posterior (``posterior``) where few walls determine the curve, otherwise BCa of resampled
walls (Efron 1987, J. Am. Stat. Assoc. 82). BCa shifts the quantiles of the resamples by their bias and by the growth of
the error with the value; its acceleration comes from the influence of the walls on the fit instead of a jackknife.
Categories of paths that share a dispersion have no posterior, for their composite likelihood is no likelihood.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy import special

from damagepred.arrays import FloatArray
from damagepred.uq.fragility.estimators import CompositeLikelihood, Estimator
from damagepred.uq.fragility.posterior import effective_reached, sample_posterior
from damagepred.uq.fragility.resampling import Resampled, resample


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
    options = estimator.options
    composite = isinstance(estimator, CompositeLikelihood) and len(estimator.categories) > 1
    share = np.nan
    if composite or effective_reached(estimator) >= options.posterior_below:
        again = resample(estimator, resamples, random)
        share = len(again.replicates) / resamples
        # resamples without a fit lie to one side: the band of the others would be too narrow
        if composite or share >= options.fitted_share:
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
    estimate = draws.resampled.estimate
    best = _curve_quantities(estimate[:1], estimate[None, 1:] @ row, grid)[0]
    below = ((values < best).sum(axis=0) + 0.5 * (values == best).sum(axis=0) + 0.5) / (len(values) + 1)
    bias, z = special.ndtri(below), expanded_percentiles(tails, walls)[:, None]
    z = bias + (bias + z) / (1.0 - _acceleration(draws.resampled, row, grid) * (bias + z))
    return _quantiles(values, special.ndtr(z))


def expanded_percentiles(tails: FloatArray, walls: float) -> FloatArray:
    """Compute the normal quantiles of expanded percentiles of resampled fits (Hesterberg 2015, Am. Stat. 69).

    The standard deviation of resamples of n walls is too small by the root of (n - 1) / n, and its own uncertainty is
    left out: these give Student's interval of a mean.
    """
    n = max(walls, 2.0)
    return np.asarray(np.sqrt(n / (n - 1.0)) * special.stdtrit(n - 1.0, tails))


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
    g, h = fits.estimate[0], fits.estimate[1:] @ row
    with np.errstate(divide="ignore"):
        log_grid = np.where(grid > 0, np.log(grid), 0.0)
    by_g = np.concatenate(([-h / g**2, -1.0 / g**2], log_grid))
    by_h = np.concatenate(([1.0 / g, 0.0], np.full(len(grid), -1.0)))
    each = np.column_stack((fits.influence[:, 0], fits.influence[:, 1:] @ row)) * fits.cells.weight[:, None]
    count = fits.cells.number.astype(np.float64)
    second = np.einsum("c,ca,cb->ab", count, each, each)
    third = np.einsum("c,ca,cb,cd->abd", count, each, each, each, optimize=True)
    along = np.column_stack((by_g, by_h))
    spread = np.einsum("na,nb,ab->n", along, along, second)
    skew = np.einsum("na,nb,nd,abd->n", along, along, along, third)
    return skew / (6.0 * np.maximum(spread, 1e-300) ** 1.5)
