"""Confidence bands of lognormal curves, of their medians and dispersions.

- ``"percentile"``: quantiles of the resampled fits;
- ``"bca"``: the same, shifted for the bias that resampling shows and for how the error grows with the value (Efron
  1987, J. Am. Stat. Assoc. 82); its acceleration comes from the walls' influence on the fit instead of a jackknife;
- ``"profile"``: without resampling, the profile likelihood interval of each number: its range over the parameters
  whose log-likelihood is within half a limit of the maximum. The limit is n ln(1 + t^2 / (n - 1)), with n the effective
  number of walls (``effective_reached``) and Student's quantile t; of many walls it is that of chi-squared (1 degree of
  freedom). It is for walls of equal weight, and curves with a dispersion of their own.

Quantiles of resamples are expanded for small samples (``expanded_percentiles``). Where the effective number of walls of
a category is below ``FragilityOptions.posterior_below``, a BCa band is replaced by that of the posterior
(``damagepred.uq.fragility.posterior``).

Each number is treated as a function of g = 1/dispersion and h = ln(median)/dispersion.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy import special

from damagepred.arrays import FloatArray
from damagepred.errors import InputError
from damagepred.uq.fragility.estimators import CompositeLikelihood, Estimator
from damagepred.uq.fragility.likelihood import likelihood
from damagepred.uq.fragility.posterior import effective_reached
from damagepred.uq.fragility.resampling import Resampled


class Band(NamedTuple):
    """Limits of a curve: of its median, dispersion and probabilities (points,), lower ones first."""

    median: tuple[float, float]
    dispersion: tuple[float, float]
    probability: tuple[FloatArray, FloatArray]


def unknown_band(points: int) -> Band:
    """Return an unknown band: NaN throughout."""
    nothing = (np.nan, np.nan)
    return Band(nothing, nothing, (np.full(points, np.nan), np.full(points, np.nan)))


def _curve_quantities(g: FloatArray, h: FloatArray, grid: FloatArray) -> FloatArray:
    """Return ln(median), dispersion and probit of the probability at each movement, array (parameters, 2 + points)."""
    with np.errstate(divide="ignore"):
        along = g[:, None] * np.log(grid) - h[:, None]
    return np.column_stack((h / g, 1.0 / g, along))


def _band(low: FloatArray, high: FloatArray) -> Band:
    # the curve rises, so its pointwise limits are made to rise
    ends = [special.ndtr(np.maximum.accumulate(limit[2:])) for limit in (low, high)]
    return Band((float(np.exp(low[0])), float(np.exp(high[0]))), (float(low[1]), float(high[1])), (ends[0], ends[1]))


def resampled_band(kind: str, found: Resampled, place: int, grid: FloatArray, confidence: float, walls: float) -> Band:
    """Return the band of one category from resampled fits.

    Parameters
    ----------
    kind : {"percentile", "bca"}
        Kind of the bootstrap interval.
    found : Resampled
        Fits.
    place : int
        Place of the category among those fitted together.
    grid : array (points,)
        Movements.
    confidence : float
        Of the band.
    walls : float
        Effective number of walls, see ``expanded_percentiles``.
    """
    if len(found.replicates) < 2:
        return unknown_band(len(grid))
    again = np.sort(_curve_quantities(found.replicates[:, 0], found.replicates[:, 1 + place], grid), axis=0)
    normals = expanded_percentiles(np.array([0.5 * (1 - confidence), 0.5 * (1 + confidence)]), walls)[:, None]
    z = normals * np.ones(again.shape[1])
    if kind == "bca":
        best = _curve_quantities(found.estimate[:1], found.estimate[1 + place : 2 + place], grid)[0]
        below = ((again < best).sum(axis=0) + 0.5 * (again == best).sum(axis=0) + 0.5) / (len(again) + 1)
        bias = special.ndtri(below)
        z = bias + (bias + z) / (1.0 - _acceleration(found, place, grid) * (bias + z))
    return _quantiles(again, special.ndtr(z))


def expanded_percentiles(tails: FloatArray, walls: float) -> FloatArray:
    """Return the standard normals of the expanded percentiles of resampled fits (Hesterberg 2015, Am. Stat. 69).

    With them the percentile interval of a mean is Student's: the standard deviation of resamples of n walls is too
    small by the root of (n - 1) / n, and its own uncertainty is left out.

    Parameters
    ----------
    tails : array
        Probabilities of the interval's ends.
    walls : float
        Effective number n of walls; at least 2 are taken.
    """
    n = max(walls, 2.0)
    return np.asarray(np.sqrt(n / (n - 1.0)) * special.stdtrit(n - 1.0, tails))


def posterior_band(draws: FloatArray, place: int, grid: FloatArray, confidence: float) -> Band:
    """Return the band of one category from draws of the posterior, array (draws, parameters).

    Parameters
    ----------
    draws, place, grid, confidence
        See ``resampled_band``.
    """
    again = np.sort(_curve_quantities(draws[:, 0], draws[:, 1 + place], grid), axis=0)
    tails = np.array([0.5 * (1 - confidence), 0.5 * (1 + confidence)])[:, None] * np.ones(again.shape[1])
    return _quantiles(again, tails)


def _quantiles(again: FloatArray, tails: FloatArray) -> Band:
    """Return the band between quantiles of sorted numbers, at shares that differ from number to number."""
    at = tails * (len(again) - 1)
    under = np.clip(at.astype(np.int64), 0, len(again) - 2)
    columns = np.arange(again.shape[1])
    with np.errstate(invalid="ignore"):
        rest = again[under + 1, columns] - again[under, columns]
        limits = again[under, columns] + np.where(np.isfinite(rest), rest * (at - under), 0.0)
    return _band(limits[0], limits[1])


def _acceleration(found: Resampled, place: int, grid: FloatArray) -> FloatArray:
    """Return the acceleration of BCa: a sixth of the skewness of the walls' influence on each number."""
    g, h = found.estimate[0], found.estimate[1 + place]
    with np.errstate(divide="ignore"):
        log_grid = np.where(grid > 0, np.log(grid), 0.0)
    by_g = np.concatenate(([-h / g**2, -1.0 / g**2], log_grid))
    by_h = np.concatenate(([1.0 / g, 0.0], np.full(len(grid), -1.0)))
    each = found.influence[:, [0, 1 + place]] * found.cells.weight[:, None]
    count = found.cells.number.astype(np.float64)
    second = np.einsum("c,ca,cb->ab", count, each, each)
    third = np.einsum("c,ca,cb,cd->abd", count, each, each, each, optimize=True)
    along = np.column_stack((by_g, by_h))
    spread = np.einsum("na,nb,ab->n", along, along, second)
    skew = np.einsum("na,nb,nd,abd->n", along, along, along, third)
    return skew / (6.0 * np.maximum(spread, 1e-300) ** 1.5)


def has_profile_band(estimator: Estimator) -> bool:
    """Whether there is a profile band: one category with its own dispersion, and walls of equal weight."""
    return isinstance(estimator, CompositeLikelihood) and profile_is_defined(
        len(estimator.categories), estimator.cells.weight
    )


def profile_is_defined(categories: int, weight: FloatArray) -> bool:
    """Whether there is one category, and all walls have the same weight.

    Parameters
    ----------
    categories : int
        Number of categories fitted together.
    weight : array (groups,)
        Weight of each wall of a group.
    """
    return categories == 1 and not np.ptp(weight) > 0


def profile_band(estimator: Estimator, grid: FloatArray, confidence: float) -> Band:
    """Return the band of one category by profile likelihood.

    Parameters
    ----------
    estimator : Estimator
        Of one category.
    grid : array (points,)
        Movements.
    confidence : float
        Of the band.

    Raises
    ------
    InputError
        If categories share a dispersion, or the weights of walls differ.
    """
    if not isinstance(estimator, CompositeLikelihood) or not has_profile_band(estimator):
        raise InputError(
            "band = 'profile': is for curves that are fitted each for itself (model = 'separate') to walls that count "
            "alike; take 'bca' or 'percentile'."
        )
    n = max(effective_reached(estimator), 2.0)
    # of n capacities known exactly this limit gives Student's interval of the median, and chi-squared's of many
    drop = n * np.log1p(special.stdtrit(n - 1.0, 0.5 * (1.0 + confidence)) ** 2 / (n - 1.0))
    contour = _likelihood_contour(estimator, float(drop))
    numbers = _curve_quantities(contour[:, 0], contour[:, 1], grid)
    return _band(numbers.min(axis=0), numbers.max(axis=0))


def _likelihood_contour(estimator: CompositeLikelihood, drop: float) -> FloatArray:
    """Return the parameters at which twice the log-likelihood is by ``drop`` below its maximum."""
    best, directions = estimator.estimate, estimator.options.profile_directions
    angle = np.linspace(0.0, 2 * np.pi, directions, endpoint=False)
    root = np.linalg.inv(np.linalg.cholesky(-estimator.hessian(best)))
    towards = np.column_stack((np.cos(angle), np.sin(angle))) @ root
    weight = np.broadcast_to(estimator.cells.total, (directions, len(estimator.cells.number)))
    most = estimator.value(best)
    with np.errstate(divide="ignore"):
        limit = np.where(towards[:, 0] < 0, 0.9999 * best[0] / -towards[:, 0], np.inf)  # the dispersion is positive
    far = np.minimum(np.full(directions, np.sqrt(drop)), limit)
    for _ in range(40):
        here = likelihood(best + far[:, None] * towards, estimator.rows, weight, estimator.options)
        loss, rate = 2.0 * (most - here.value), -2.0 * (here.gradient * towards).sum(axis=1)
        # the loss is convex along each line: Newton's method, from outside after the first step
        new = np.clip(far + (drop - loss) / np.maximum(rate, 1e-12), 0.3 * far, np.minimum(3.0 * far, limit))
        done = np.abs(new - far).max() <= 1e-9 * far.max()
        far = new
        if done:
            break
    return best + far[:, None] * towards
