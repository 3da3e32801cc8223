"""Lognormal curves: each category for itself, with a dispersion that all share, or from ordinal data.

With one dispersion for all categories curves cannot cross. Where each wall is known at one movement alone, this is the
ordinal probit (cumulative link) model, and the likelihood is that of the category each wall is in. Where each wall is
known along its path, a wall's capacities for several categories depend on each other in a way that no model here says;
what is maximised is the product of the categories' own likelihoods (a composite likelihood: Varin, Reid and Firth 2011,
Statistica Sinica 21). It is as right for each curve as a fit of its own, bands come from resampling whole walls, and
the medians stand in the categories' order: for a given dispersion the score of a median is the mean of E[e | wall] over
the walls, which grows with the bounds of the intervals, and no wall reaches a worse category before a lesser one.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from damagepred.arguments import checked, require_alike
from damagepred.arrays import FloatArray
from damagepred.errors import InputError
from damagepred.one_thread import one_blas_thread
from damagepred.uq.fragility.estimators import estimators
from damagepred.uq.fragility.fit import FITTED, CommonFit, Fit, reasons_not_fitted
from damagepred.uq.fragility.grouped_data import GroupedIntervals, group_intervals
from damagepred.uq.fragility.options import DEFAULT, FragilityOptions


@checked
@one_blas_thread()
def fit_lognormal(
    lower: FloatArray, upper: FloatArray, count: FloatArray | None = None, *, options: FragilityOptions = DEFAULT
) -> Fit:
    """Fit a lognormal capacity to intervals by maximum likelihood.

    Parameters
    ----------
    lower, upper : array (n,)
        The capacity lies in (lower, upper]; upper infinite: censored; equal: known exactly.
    count : array (n,), optional
        Number of walls of each interval.
    options : FragilityOptions
        Options of the fit.

    Raises
    ------
    InputError
        If a bound is NaN or an interval is empty.
    """
    require_alike(lower=lower, upper=upper, count=count)
    low, high = np.asarray(lower, dtype=np.float64), np.asarray(upper, dtype=np.float64)
    weight = np.where((low <= 0) & np.isinf(high), 0.0, _weight(count, len(low)))  # (0, inf] is no information
    kept = (weight > 0) | np.isnan(low + high)
    return fit_grouped(group_intervals(low[None, kept], high[None, kept], weight[kept]), options=options)[0]


@checked
@one_blas_thread()
def fit_common(
    lower: ArrayLike, upper: ArrayLike, count: ArrayLike | None = None, *, options: FragilityOptions = DEFAULT
) -> CommonFit:
    """Fit lognormal capacities of one dispersion to the intervals of several categories.

    Parameters
    ----------
    lower, upper : array (categories, walls)
        See ``fit_lognormal``; categories from the least to the worst.
    count : array (walls,), optional
        Number of walls of each column.
    options : FragilityOptions
        Options of the fit.

    Raises
    ------
    InputError
        If a bound is NaN or an interval is empty.
    """
    require_alike(lower=lower, upper=upper)
    low, high = np.asarray(lower, dtype=np.float64), np.asarray(upper, dtype=np.float64)
    if low.ndim != 2:
        raise InputError(f"lower, upper: must have the shape (categories, walls), have {low.shape}.")
    cells = group_intervals(low, high, _weight(count, low.shape[1]))
    return _together(fit_grouped(cells, common=True, options=options))


@checked
@one_blas_thread()
def fit_ordinal(
    movement: ArrayLike,
    category: ArrayLike,
    categories: Sequence[int],
    count: ArrayLike | None = None,
    *,
    options: FragilityOptions = DEFAULT,
) -> CommonFit:
    """Fit lognormal curves of one dispersion to walls that are each known at one movement (ordinal probit).

    Parameters
    ----------
    movement : array (walls,)
        Movement of each wall.
    category : array of int (walls,)
        Category it is in.
    categories : sequence of int
        For which there are to be curves, ascending.
    count : array (walls,), optional
        Number of walls of each row.
    options : FragilityOptions
        Options of the fit.
    """
    m, c = np.asarray(movement, dtype=np.float64), np.asarray(category)
    hit = c >= np.asarray(categories)[:, None]
    cells = group_intervals(np.where(hit, 0.0, m), np.where(hit, m, np.inf), _weight(count, len(m)))
    return _together(fit_grouped(cells, common=True, single=True, options=options))


def _weight(count: ArrayLike | None, size: int) -> FloatArray:
    return np.ones(size) if count is None else np.asarray(count, dtype=np.float64)


def _together(fits: Sequence[Fit]) -> CommonFit:
    dispersion = [f.dispersion for f in fits if f.status == FITTED]
    return CommonFit(
        np.array([f.median for f in fits]), dispersion[0] if dispersion else np.nan, tuple(f.status for f in fits)
    )


def fit_grouped(
    cells: GroupedIntervals, common: bool = False, single: bool = False, options: FragilityOptions = DEFAULT
) -> list[Fit]:
    """Fit a curve to each category of counted walls; see ``estimators``.

    Parameters
    ----------
    cells : GroupedIntervals
        Walls.
    common : bool
        Whether all categories share a dispersion.
    single : bool
        Whether each wall is known at one movement alone.
    options : FragilityOptions
        Options of the fits.
    """
    found = [Fit(np.nan, np.nan, why) for why in reasons_not_fitted(cells, common, options)]
    for estimator in estimators(cells, common, single, options):
        for k, fit in zip(estimator.categories, estimator.fits()):
            found[k] = fit
    return found


def require_ascending(categories: Sequence[int]) -> None:
    """Check that categories are given from the least to the worst, each once.

    Raises
    ------
    InputError
        If they are not.
    """
    if any(b <= a for a, b in itertools.pairwise(categories)):
        raise InputError(f"categories = {list(categories)}: must ascend, each given once.")
