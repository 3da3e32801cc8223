"""The probability that a category is reached at a movement, and a category's median movement, from a study's walls."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy import special

from damagepred.arrays import BoolArray, FloatArray, IntArray
from damagepred.enumerations import SOLVED, SampleStatus
from damagepred.errors import InputError
from damagepred.one_thread import one_blas_thread
from damagepred.uq.capacity import (
    category_number,
    censored_before,
    probability_reached,
    read_capacities,
    require_categories,
)
from damagepred.uq.estimate import (
    ENOUGH_REPLICATES,
    Estimate,
    effective_samples,
    probability,
    student_factor,
)
from damagepred.uq.fragility import capacities, fit_lognormal, movement_measure, normalised_weights
from damagepred.uq.fragility.bands import posterior_band, resampled_band
from damagepred.uq.fragility.estimators import estimators
from damagepred.uq.fragility.fit import FITTED, Fit
from damagepred.uq.fragility.grouped_data import group_intervals
from damagepred.uq.fragility.models import fit_grouped
from damagepred.uq.fragility.options import DEFAULT, FragilityOptions
from damagepred.uq.fragility.posterior import effective_reached, sample_posterior
from damagepred.uq.fragility.resampling import resample
from damagepred.uq.intensity import attributes, chosen_intensity
from damagepred.uq.movement_distribution import MovementDistribution, as_distribution
from damagepred.uq.random_streams import Stream, generator


class CategoryCapacities(NamedTuple):
    """Capacities for one category, of walls that were run and did not fail.

    Attributes
    ----------
    sample : array of int (walls,)
        Their numbers.
    lower, upper : array (walls,)
        The movement at which the category was reached lies between; see ``damagepred.uq.fragility.Capacities``.
    weight : array (walls,) or None
        Of importance sampling.
    replicate : array of int (walls,) or None
        Scramble of Sobol points each belongs to.
    failed : int
        Walls left out because they failed before they reached the category.
    failing : array of bool (walls,)
        Those that failed before they reached the category, if they are among them.
    """

    sample: IntArray
    lower: FloatArray
    upper: FloatArray
    weight: FloatArray | None
    replicate: IntArray | None
    failed: int
    failing: BoolArray

    def part(self, which: NDArray[Any] | slice) -> CategoryCapacities:
        """Return some of the walls."""
        return self._replace(
            sample=self.sample[which],
            lower=self.lower[which],
            upper=self.upper[which],
            weight=None if self.weight is None else self.weight[which],
            replicate=None if self.replicate is None else self.replicate[which],
            failing=self.failing[which],
        )


class Exceedance(NamedTuple):
    """Probability of a category or worse at a movement.

    Attributes
    ----------
    estimate : Estimate
        From the walls with a known state at the movement, those that failed beyond it included. Its value is NaN where
        no wall was followed as far.
    failed : int
        Walls that failed before the movement, and had not reached the category.
    failed_undamaged, failed_damaged : float
        Estimate if all of those had not reached it by this movement, and if all had, each with its weight.
    not_followed : int
        Walls that were not followed as far as this movement, and had not reached the category: unknown, see
        ``estimate_exceedance``.
    """

    estimate: Estimate
    failed: int
    failed_undamaged: float
    failed_damaged: float
    not_followed: int


def category_capacities(
    ds: xr.Dataset, category: int, intensity: str | None = None, keep_failed: bool = False
) -> CategoryCapacities:
    """Read the capacities of a study for one category.

    Parameters
    ----------
    ds : xarray.Dataset
        As ``open_study`` returns it.
    category : int
        Category that counts as reached from here upwards.
    intensity : str, optional
        Measure of the movement; by default the study's own.
    keep_failed : bool
        Whether failed walls are among them, known to be undamaged as far as they were followed.

    Raises
    ------
    InputError
        If the study has no such category or measure.
    """
    name = movement_measure(ds) if intensity is None else chosen_intensity(ds, intensity)
    require_categories(ds, [category])
    if "damage_category" not in ds:
        nothing = np.empty(0)
        return CategoryCapacities(np.empty(0, dtype=np.int64), nothing, nothing, None, None, 0, np.empty(0, dtype=bool))
    known = np.flatnonzero(np.isin(ds["status"].values, (*SOLVED, SampleStatus.FAILED)))
    found = capacities(ds, category, name)
    good = ~found.failed | keep_failed
    replicates = int(ds.attrs.get("replicates", 1))
    return CategoryCapacities(
        known[good],
        found.lower[good],
        found.upper[good],
        np.asarray(ds["weight"].values[known[good]], dtype=np.float64) if "weight" in ds else None,
        known[good] % replicates if replicates >= ENOUGH_REPLICATES else None,
        int(found.failed.sum()),
        found.failed[good],
    )


@one_blas_thread()
def exceedance(
    ds: xr.Dataset,
    category: int | str,
    at: float | str | MovementDistribution,
    *,
    confidence: float = 0.9,
    intensity: str | None = None,
    options: FragilityOptions = DEFAULT,
) -> Exceedance:
    """Estimate the probability that a category or a worse one is reached at a movement.

    Where the movement lies between the two increments at which a wall was below and in the category, the wall counts
    for the share of that step below the movement.

    Where a study keeps the end of each wall's own movement alone, no two walls are known at the same one: then the
    probability is that of the lognormal curve fitted to all walls, with its band.

    Parameters
    ----------
    ds : xarray.Dataset
        As ``open_study`` returns it.
    category : int or str
        Number or name of the category.
    at : float, str or MovementDistribution
        Movement (m, or 1 for a deflection ratio), a site class such as "H1", or a distribution of the movement; see
        ``damagepred.uq.movement_distribution``.
    confidence : float
        Of the interval.
    intensity : str, optional
        Measure of the movement; by default the study's own.
    options : FragilityOptions
        Options of the curve's fit.

    Raises
    ------
    InputError
        If the movement is not positive, or the study has no such category or measure; if a part of a distribution lies
        beyond the study's movement; of walls known at their own movements alone, if there is no curve.

    Examples
    --------
    >>> import damagepred
    >>> found = damagepred.exceedance(damagepred.open_study("house.dp"), "slight", "3 mm")
    >>> round(found.estimate.value, 2), round(found.estimate.lower, 2), round(found.estimate.upper, 2)
    (0.92, 0.78, 0.97)
    """
    category = category_number(ds, category)
    measure = chosen_intensity(ds, intensity)
    wanted = as_distribution(at, str(attributes(ds, measure)["units"]))
    wanted.require_measure(measure)
    if "damage_category" in ds and ds["damage_category"].ndim == 1:
        if len(wanted.points) > 1:
            raise InputError(f"at = {wanted.name}: the study knows each wall at its own movement alone; ask for one.")
        return _from_curve(ds, category, wanted.largest, confidence, measure, options)
    known = category_capacities(ds, category, measure, keep_failed=True)
    if len(wanted.points) > 1:
        followed = float(np.where(np.isinf(known.upper), known.lower, known.upper).max(initial=0.0))
        if beyond := float(np.mean(np.asarray(wanted.points) > followed * (1 + 1e-9))):
            raise InputError(
                f"at = {wanted.name}: {beyond:.0%} of it lies beyond {followed:g}, the largest movement of the study's "
                "walls; run the study with a larger movement."
            )
    return estimate_exceedance(known, wanted, confidence)


def estimate_exceedance(
    known: CategoryCapacities, at: float | MovementDistribution, confidence: float = 0.9
) -> Exceedance:
    """Estimate the probability that walls have reached the category by a movement.

    Parameters
    ----------
    known : CategoryCapacities
        What is known of them.
    at : float or MovementDistribution
        Movement (m, or 1 for a deflection ratio); of several, the mean of the probabilities.
    confidence : float
        Of the interval.

    Notes
    -----
    A wall that was not followed as far counts for the share of those, among walls that were followed further than it,
    which reached the category by then (redistribution to the right: Efron 1967, the Kaplan-Meier estimate). The
    interval does without that: its lower end is that of none of them having reached it, its upper end that of all.
    Where no wall was followed as far there is no such share, and the estimate is NaN.
    """
    movements = (at,) if isinstance(at, float | int) else at.points
    lost = censored_before(known.lower, known.upper, movements[-1]) & known.failing
    lower, upper = known.lower[~lost], known.upper[~lost]
    weight = np.ones(len(lost)) if known.weight is None else known.weight
    hits = [probability_reached(lower, upper, movement) for movement in movements]
    shorts = [censored_before(lower, upper, movement) for movement in movements]
    hit, short = np.mean(hits, axis=0), np.any(shorts, axis=0)
    unknown_share = np.mean(shorts, axis=0)
    expected = np.mean([_redistributed(h, lower, weight[~lost], s) for h, s in zip(hits, shorts)], axis=0)

    def of(hits: FloatArray) -> Estimate:
        found = probability(
            hits,
            weight=None if known.weight is None else weight[~lost],
            replicate=None if known.replicate is None else known.replicate[~lost],
            confidence=confidence,
        )
        if known.weight is None or not lost.any() or not weight[~lost].any():
            return found
        # over all walls, the failed ones with the mean of the others: between the two bounds for any weights
        scale = float(np.mean(~lost) * (1 + weight[lost].sum() / weight[~lost].sum()))
        value, error, lower, upper = (scale * number for number in found[:4])
        return found._replace(value=value, error=error, lower=min(lower, 1.0), upper=min(upper, 1.0))

    estimate = of(expected)
    none, every = (np.where(np.isnan(expected), known_share, expected) for known_share in (hit, hit + unknown_share))
    if short.any():
        ends = of(hit).lower, of(hit + unknown_share).upper
        estimate = estimate._replace(lower=ends[0], upper=ends[1])
    if np.isnan(expected).any():
        estimate = estimate._replace(value=np.nan, error=np.nan, upper=1.0)
    if not len(lost):
        return Exceedance(estimate, 0, 0.0, 1.0, 0)
    low = float((weight[~lost] * none).sum()) / len(lost)
    high = float((weight[~lost] * every).sum() + weight[lost].sum()) / len(lost)
    return Exceedance(estimate, int(lost.sum()), min(low, 1.0), min(high, 1.0), int(short.sum()))


def _redistributed(hit: FloatArray, lower: FloatArray, weight: FloatArray, short: BoolArray) -> FloatArray:
    """Return hits in which a wall that was not followed takes the share of those followed further; NaN if none was."""
    found = hit.copy()
    order = np.argsort(-lower, kind="stable")
    heavy, hits, done = 0.0, 0.0, 0
    for last in np.unique(lower[short])[::-1]:
        upto = int(np.searchsorted(-lower[order], -last, side="right"))
        further = order[done:upto]
        own = further[short[further] & (lower[further] == last)]
        others = further[~(short[further] & (lower[further] == last))]
        heavy, hits = heavy + weight[others].sum(), hits + float((weight[others] * found[others]).sum())
        found[own] = hits / heavy if heavy > 0 else np.nan
        if heavy > 0:
            heavy, hits = heavy + weight[own].sum(), hits + float((weight[own] * found[own]).sum())
        done = upto
    return found


def _from_curve(
    ds: xr.Dataset, category: int, at: float, confidence: float, intensity: str, options: FragilityOptions
) -> Exceedance:
    """Return the probability at a movement from walls that are each known at their own, by their lognormal curve."""
    require_categories(ds, [category])
    found = read_capacities(ds, [category], intensity)
    if at > found.largest * (1 + 1e-9):
        raise InputError(
            f"at = {at:g}: no wall was moved as far ({found.largest:g} at most), and a study that keeps each "
            "wall's own movement alone ([study] movement = 'sampled') tells nothing beyond."
        )
    lower, upper, failed, end = found.capacities

    def fitted(low: FloatArray, high: FloatArray) -> Fit:
        return fit_grouped(group_intervals(low, high, found.weight), options=options)[0]

    cells = group_intervals(lower, upper, found.weight)
    fit = fit_grouped(cells, options=options)[0]
    if fit.status != FITTED:
        raise InputError(
            f"P(category >= {category}) at {at:g}: the study knows each wall at its own movement alone, and its walls "
            f"give no curve to read the probability from: {fit.status}."
        )
    (estimator,) = estimators(cells, options=options)
    grid, random, count = np.array([at]), generator(0, Stream.BOOTSTRAP, category), effective_reached(estimator)
    if count < options.posterior_below:
        drawn = sample_posterior(estimator, random)
        band = posterior_band(drawn, 0, grid, confidence)
    else:
        again = resample(estimator, options.curve_resamples, random)
        drawn, band = again.replicates, resampled_band("bca", again, 0, grid, confidence, count)
    spread = float(np.std(special.ndtr(drawn[:, 0] * np.log(at) - drawn[:, 1]), ddof=1))
    good = ~failed[0]
    value = float(fit.probability(grid)[0])
    estimate = Estimate(
        value,
        spread,
        float(band.probability[0][0]),
        float(band.probability[1][0]),
        confidence,
        int(good.sum()),
        effective_samples(found.weight[good]),
    )
    bounds = [value, value]
    if failed.any():
        ends = (fitted(np.where(failed, end, lower), upper), fitted(lower, np.where(failed, end, upper)))
        bounds = [float(one.probability(grid)[0]) for one in ends]
    return Exceedance(estimate, int(failed.sum()), bounds[0], bounds[1], 0)


@one_blas_thread()
def median_movement(
    ds: xr.Dataset,
    category: int,
    *,
    confidence: float = 0.9,
    intensity: str | None = None,
    seed: int = 0,
    options: FragilityOptions = DEFAULT,
) -> Estimate:
    """Estimate the median movement at which a category is reached, from a lognormal curve.

    Failed walls count as far as they were followed, as in ``damagepred.fit_fragility``.

    Its error is that of the logarithm: by leaving out one replicate of Sobol points after the other where there are at
    least four, otherwise by resampling walls. Where fewer than 100 walls determine it, error and interval are those of
    the posterior (``damagepred.uq.fragility.posterior``). Where it lies beyond the largest movement to which a wall was
    followed, the value is that movement, a lower bound, and the interval has no upper end.

    Parameters
    ----------
    ds : xarray.Dataset
        As ``open_study`` returns it.
    category : int
        The category.
    confidence : float
        Of the interval.
    intensity : str, optional
        Measure of the movement; by default the study's own.
    seed : int
        Of the resampling.
    options : FragilityOptions
        Options of the curve's fit.
    """
    known = category_capacities(ds, category, intensity, keep_failed=True)
    # walls damaged before any movement are no part of the curve of the others
    known = known._replace(upper=np.where(known.upper <= 0, np.inf, known.upper))
    largest = float(np.where(np.isinf(known.upper), known.lower, known.upper).max(initial=0.0))
    found = _median_of(known, category, confidence, seed, options)
    if not found.value > largest * (1 + 1e-9):
        return found
    return found._replace(value=largest, error=np.nan, lower=min(found.lower, largest), upper=np.inf)


def _median_of(
    known: CategoryCapacities, category: int, confidence: float, seed: int, options: FragilityOptions
) -> Estimate:
    """Return the median of the lognormal curve, wherever it lies."""
    count = len(known.lower)
    heavy = np.ones(count) if known.weight is None else known.weight
    kish = effective_samples(heavy)
    fit = _median(known, heavy, options)
    if not np.isfinite(fit):
        return Estimate(np.nan, np.nan, 0.0, np.inf, confidence, count, kish)
    if known.replicate is not None:
        labels = np.unique(known.replicate)
        others = np.log([_median(known, heavy * (known.replicate != label), options) for label in labels])
        groups = len(labels)
        error = float(np.sqrt((groups - 1) / groups * ((others - others.mean()) ** 2).sum()))
        factor = student_factor(confidence, groups - 1)
    else:
        weight = normalised_weights(heavy, known.upper)
        (estimator,) = estimators(group_intervals(known.lower[None], known.upper[None], weight), options=options)
        walls, random = effective_reached(estimator), generator(seed, Stream.BOOTSTRAP, category)
        if walls < options.posterior_below:
            drawn = sample_posterior(estimator, random)
            logarithm = drawn[:, 1] / drawn[:, 0]
            lower, upper = np.exp(np.quantile(logarithm, [0.5 * (1 - confidence), 0.5 * (1 + confidence)]))
            return Estimate(fit, fit * float(logarithm.std()), float(lower), float(upper), confidence, count, kish)
        again = resample(estimator, options.median_resamples, random).replicates
        error = float(np.std(again[:, 1] / again[:, 0], ddof=1)) if len(again) > 1 else np.nan
        factor = student_factor(confidence, walls - 1.0)
    if not np.isfinite(error):
        return Estimate(fit, np.nan, 0.0, np.inf, confidence, count, kish)
    return Estimate(
        fit, fit * error, fit * np.exp(-factor * error), fit * np.exp(factor * error), confidence, count, kish
    )


def _median(known: CategoryCapacities, heavy: FloatArray, options: FragilityOptions) -> float:
    used = heavy > 0
    counts = normalised_weights(heavy[used], known.upper[used])
    return fit_lognormal(known.lower[used], known.upper[used], counts, options=options).median
