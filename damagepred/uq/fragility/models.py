"""Lognormal curves: each category for itself, with a dispersion that all share, or from ordinal data.

With one dispersion for all categories curves cannot cross. Where each wall is known at one movement alone, this is the
ordinal probit (cumulative link) model, and the likelihood is that of the category each wall is in. Where each wall is
known along its path, the dependence between its capacities for several categories is not modelled: the product of the
categories' likelihoods is maximised (a composite likelihood: Varin, Reid and Firth 2011, Statistica Sinica 21). Each
curve is as consistent as a fit of its own, bands come from resampling whole walls, and the medians stand in the
categories' order: for a given dispersion the score of a median is the mean of E[e | wall] over
the walls, which grows with the bounds of the intervals, and no wall reaches a worse category before a lesser one.
"""

from __future__ import annotations

import numpy as np

from damagepred.arrays import FloatArray
from damagepred.inputs.arguments import checked, require_alike
from damagepred.runtime.one_thread import one_blas_thread
from damagepred.uq.fragility.estimators import estimators
from damagepred.uq.fragility.fit import Fit, reasons_not_fitted
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
    weight = np.ones(len(low)) if count is None else np.asarray(count, dtype=np.float64)
    weight = np.where((low <= 0) & np.isinf(high), 0.0, weight)  # (0, inf] is no information
    kept = (weight > 0) | np.isnan(low + high)
    return fit_grouped(group_intervals(low[None, kept], high[None, kept], weight[kept]), options=options)[0]


def fit_grouped(
    cells: GroupedIntervals, common: bool = False, single: bool = False, options: FragilityOptions = DEFAULT
) -> list[Fit]:
    """Fit a curve to each category of counted walls; see ``estimators``."""
    fits = [Fit(np.nan, np.nan, why) for why in reasons_not_fitted(cells, common, options)]
    for estimator in estimators(cells, common, single, options):
        for k, fit in zip(estimator.categories, estimator.fits()):
            fits[k] = fit
    return fits
