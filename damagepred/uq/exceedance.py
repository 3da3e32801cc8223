"""The probability that a category is reached by a movement, and a category's median movement, from a study's walls.

One estimate serves every command: redistribution to the right (Efron 1967; without intervals it is that of Kaplan and
Meier). A wall that was not followed as far as the movement, or failed before it, takes the share of those followed
further. That is right if walls are not followed less far because they are weak or strong.

The estimate is the mean of pseudo-values, one per wall (Andersen, Klein and Rosthoej 2003), here from the derivative by
the wall's weight: a wall of known state has its own hit, 0 or 1. Errors, scrambles of Sobol points and paired
differences follow from them as from hits.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Literal, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from damagepred.arrays import BoolArray, FloatArray, IntArray
from damagepred.enumerations import SOLVED
from damagepred.errors import InputError
from damagepred.runtime.one_thread import one_blas_thread
from damagepred.uq.capacity import (
    ROUNDING,
    category_number,
    censored_before,
    failure_bounds,
    probability_reached,
    read_capacities,
    require_categories,
)
from damagepred.uq.estimate import (
    ENOUGH_REPLICATES,
    Estimate,
    effective_samples,
    normal_factor,
    probability,
    student_factor,
)
from damagepred.uq.fragility import fit_fragility, fit_lognormal, normalised_weights
from damagepred.uq.fragility.bands import draw_parameters
from damagepred.uq.fragility.describe import probability_at
from damagepred.uq.fragility.estimators import estimators
from damagepred.uq.fragility.fit import WITH_CURVE
from damagepred.uq.fragility.grouped_data import group_intervals
from damagepred.uq.fragility.options import DEFAULT, FragilityOptions
from damagepred.uq.fragility.posterior import effective_reached
from damagepred.uq.intensity import attributes, chosen_intensity, intensity_values, movement_words, shown_measure
from damagepred.uq.movement_distribution import MovementDistribution, as_distribution
from damagepred.uq.random_streams import Stream, generator

PRIOR = 0.5
"""Walls added on either side for the precision of censored walls: one that reached the category just at the movement,
one that did not (Jeffreys' prior of a share)."""

LEAST_MISSING = 1e-6
"""Share of its own movement that a failed wall lacks at least."""

RESOLUTION = 1e-12
"""Smallest difference of a pseudo-value from 0 and 1 that is no rounding."""


class CategoryCapacities(NamedTuple):
    """Capacities for one category, of walls that were run.

    Attributes
    ----------
    sample : array of int (walls,)
        Their numbers.
    lower, upper : array (walls,)
        The movement at which the category was reached lies between; see ``damagepred.uq.capacity``.
    weight : array (walls,) or None
        Weight in importance sampling.
    replicate : array of int (walls,) or None
        Scramble of Sobol points each belongs to.
    failing : array of bool (walls,)
        Walls that failed before they reached the category.
    """

    sample: IntArray
    lower: FloatArray
    upper: FloatArray
    weight: FloatArray | None
    replicate: IntArray | None
    failing: BoolArray

    @property
    def followed(self) -> float:
        """Largest movement at which a wall is known."""
        return float(np.where(np.isinf(self.upper), self.lower, self.upper).max(initial=0.0))

    def part(self, which: NDArray[Any] | slice) -> CategoryCapacities:
        """Return some of the walls."""
        weight = None if self.weight is None else self.weight[which]
        replicate = None if self.replicate is None else self.replicate[which]
        return CategoryCapacities(
            self.sample[which], self.lower[which], self.upper[which], weight, replicate, self.failing[which]
        )


class Exceedance(NamedTuple):
    """Probability of a category or worse at a movement.

    Attributes
    ----------
    estimate : Estimate
        Estimate by redistribution to the right; its value is NaN where no wall was followed as far. ``samples`` are
        walls that did not fail before the movement.
    failed : int
        Walls that failed before the movement, and had not reached the category.
    failed_undamaged, failed_damaged : float
        Estimate if none of those had reached it by this movement, and if all had.
    not_followed : int
        Walls that were not followed as far as this movement, and had not reached the category.
    """

    estimate: Estimate
    failed: int
    failed_undamaged: float
    failed_damaged: float
    not_followed: int


def category_capacities(
    ds: xr.Dataset, category: int, intensity: str | None = None, at: MovementDistribution | None = None
) -> CategoryCapacities:
    """Capacities of a study's walls for one category; for the site as shares of each wall's own movement."""
    name = chosen_intensity(ds, intensity)
    require_categories(ds, [category])
    if "damage_category" not in ds:
        nothing = np.empty(0)
        return CategoryCapacities(np.empty(0, dtype=np.int64), nothing, nothing, None, None, np.empty(0, dtype=bool))
    own = at is not None and at.own
    walls = read_capacities(ds, [category], name, between=not own)
    lower, upper, failing = (field[0] for field in walls.capacities[:3])
    if own:
        moved, end = walls.capacities.end > 0, np.where(walls.capacities.end > 0, walls.capacities.end, 1.0)
        upper = np.where(moved | np.isinf(upper), upper / end, 0.0)
        lower = np.minimum(np.where(failing, np.minimum(lower / end, 1.0 - LEAST_MISSING), lower / end + ~moved), upper)
    replicates = int(ds.attrs.get("replicates", 1))
    return CategoryCapacities(
        walls.sample,
        lower,
        upper,
        walls.weight if "weight" in ds else None,
        walls.sample % replicates if replicates >= ENOUGH_REPLICATES else None,
        failing,
    )


def wanted_movement(ds: xr.Dataset, at: float | str | MovementDistribution, measure: str) -> MovementDistribution:
    """Movement that a study is asked for; refused if its measure differs, or walls have no ground of their own."""
    shown = shown_measure(movement_words(ds, measure), units := str(attributes(ds, measure)["units"]))
    wanted = as_distribution(at, units)
    wanted.require_measure(ds, measure)
    ends = own_movements(ds, measure) if wanted.own and "damage_category" in ds else np.empty(0)
    if ends.size and not has_own_ground(ds, measure):
        same = f"{shown.factor * ends[0]:.6g} {shown.unit}"
        raise InputError(
            f"at = site: all walls of this study have the same {shown.words}, {same}, and no ground of "
            f'their own; give a movement, such as "{same}".'
        )
    return wanted


def has_own_ground(ds: xr.Dataset, measure: str) -> bool:
    """Whether solved walls end at movements of their own."""
    ends = own_movements(ds, measure)
    return bool(ends.size and np.ptp(ends) > ROUNDING * ends.max())


def own_movements(ds: xr.Dataset, measure: str) -> FloatArray:
    """Largest movement of each solved wall, array (walls,)."""
    solved = np.isin(ds["status"].values, SOLVED)
    ends = intensity_values(ds, measure).reshape(ds.sizes["sample"], -1)[solved]
    return np.where(np.isfinite(ends), ends, 0.0).max(axis=1, initial=0.0)


class PseudoValues(NamedTuple):
    """Pseudo-values of a probability, and the precision of the interval that their scatter gives.

    Attributes
    ----------
    hit : array (walls,)
        Pseudo-values; their mean, weighted, is the probability. NaN where it is unknown.
    precision : float
        Effective number of walls over the one of Greenwood's variance, at most 1: early hits of many walls say less
        of a movement to which few were followed.
    share : float
        Effective number over the number of walls, for the interval where no wall or every wall reached the category.
    """

    hit: FloatArray
    precision: float = 1.0
    share: float = 1.0


class _Redistribution:
    """Redistribution to the right: walls at risk at the movements where others were last followed."""

    def __init__(self, lower: FloatArray, upper: FloatArray, weight: FloatArray, largest: float) -> None:
        self.lower, self.upper, self.weight = lower, upper, weight
        self.short = censored_before(lower, upper, largest)
        self.ends, which = np.unique(lower[self.short], return_inverse=True)
        self.leaving = np.bincount(which, weight[self.short], len(self.ends))
        self.end = np.where(np.isinf(upper), lower, upper)
        self.length = np.where(self.end > lower, self.end - lower, np.inf)
        self.first = np.searchsorted(self.ends, lower, side="right")
        self.last = np.maximum(np.searchsorted(self.ends, self.end), self.first)
        self.at_risk = self._undamaged_weight()

    def _undamaged_weight(self) -> FloatArray:
        """Weight of the walls still undamaged at each end, array (ends,); capacities are even in their intervals."""
        slope, exact = self.weight / self.length, self.upper == self.lower  # known exactly: damaged there

        def total(by: FloatArray, side: Literal["left", "right"], *values: FloatArray) -> list[FloatArray]:
            order = np.argsort(by, kind="stable")
            upto = np.searchsorted(by[order], self.ends, side=side)
            return [np.append(0.0, np.cumsum(value[order]))[upto] for value in values]

        passed, begun, rise = total(
            np.where(exact, np.nextafter(self.lower, -np.inf), self.lower), "left", self.weight, slope, slope * self.end
        )
        over, fall = total(self.end, "right", slope, slope * self.end)
        return self.weight.sum() - passed + np.maximum(rise - fall - self.ends * (begun - over), 0.0)

    def pseudo_values(self, at: float, prior: float = 0.0) -> tuple[FloatArray, float, FloatArray]:
        """Pseudo-values at a movement, the probability, and the pseudo-values of two more walls of ``prior``."""
        count = int(np.searchsorted(self.ends, at * (1 - ROUNDING)))
        before = self.at_risk[:count] + 2.0 * prior
        after = before - self.leaving[:count]
        if (after <= ROUNDING * self.weight.sum()).any():
            return np.full(len(self.lower), np.nan), np.nan, np.full(2, np.nan)
        step = 1.0 / before - 1.0 / after
        risk, moment = (np.append(0.0, np.cumsum(value)) for value in (step, self.ends[:count] * step))
        first, last = np.minimum(self.first, count), np.minimum(self.last, count)
        known = risk[first] + (self.end * (risk[last] - risk[first]) - moment[last] + moment[first]) / self.length
        short = self.short & (self.first <= count)
        known[short] += 1.0 / after[first[short] - 1]
        undamaged = np.where(short, 0.0, 1.0 - probability_reached(self.lower, self.upper, at))
        total, raised = self.weight.sum() + 2.0 * prior, float(np.prod(before / after))
        survival = raised * ((self.weight * undamaged).sum() + prior) / total
        hit = 1.0 - raised * undamaged - total * survival * known
        added = 1.0 - raised * np.array([0.0, 1.0]) - total * survival * risk[-1]
        for sure in (0.0, 1.0) if count else ():
            hit[np.abs(hit - sure) < RESOLUTION] = sure
        return hit, 1.0 - survival, added

    def mean(self, points: Sequence[float], prior: float = 0.0) -> tuple[FloatArray, float, FloatArray]:
        """Means of ``pseudo_values`` over movements."""
        hit, chance, added = zip(*(self.pseudo_values(movement, prior) for movement in points))
        return np.mean(hit, axis=0), float(np.mean(chance)), np.mean(added, axis=0)


def pseudo_values(known: CategoryCapacities, at: MovementDistribution) -> PseudoValues:
    """Pseudo-values of the probability of having reached the category; of several movements, their mean."""
    weight = np.ones(len(known.lower)) if known.weight is None else known.weight
    if not weight.any():
        return PseudoValues(np.zeros(len(weight)))
    weight = weight * (effective_samples(weight) / weight.sum())
    walls, total = _Redistribution(known.lower, known.upper, weight, at.largest), float(weight.sum())
    hit, chance, _ = walls.mean(at.points)
    if not len(walls.ends) or np.isnan(chance):
        return PseudoValues(hit)
    regular, likely, added = walls.mean(at.points, PRIOR)
    squares = float(weight @ (regular - likely) ** 2 + PRIOR * ((added - likely) ** 2).sum())
    effective = max(likely * (1.0 - likely) * (total + 2.0 * PRIOR) ** 2 / squares - 2.0 * PRIOR, PRIOR)
    scatter = float(weight @ (hit - chance) ** 2)
    sure = not ROUNDING < chance < 1.0 - ROUNDING or scatter <= ROUNDING
    plain = total if sure else chance * (1.0 - chance) * total**2 / scatter
    return PseudoValues(hit, min(effective / plain, 1.0), min(effective / total, 1.0))


def known_hits(known: CategoryCapacities, at: MovementDistribution, unknown: float) -> FloatArray:
    """Probability of each wall to have reached the category; ``unknown``, 0 or 1, for the bound beyond its path."""
    each = [
        np.where(
            censored_before(known.lower, known.upper, m), unknown, probability_reached(known.lower, known.upper, m)
        )
        for m in at.points
    ]
    return np.asarray(np.mean(each, axis=0))


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
    probability at a movement is that of the lognormal curve fitted to all walls, with its band.

    Parameters
    ----------
    ds : xarray.Dataset
        As ``open_study`` returns it.
    category : int or str
        Number or name of the category.
    at : float, str or MovementDistribution
        Movement (m, or 1 for a deflection ratio), a site class such as "H1", a distribution of the movement, or "site":
        each wall's own ground, to the end of its own movement; see ``damagepred.uq.movement_distribution``.
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
        beyond the study's movement; of walls known at their own movements alone, if there is no curve; for "site", if
        all walls have the same movement.

    Examples
    --------
    >>> import damagepred
    >>> found = damagepred.exceedance(damagepred.open_study("house.dp"), "slight", "3 mm")
    >>> round(found.estimate.value, 2), round(found.estimate.lower, 2), round(found.estimate.upper, 2)
    (0.92, 0.78, 0.97)
    """
    category = category_number(ds, category)
    measure = chosen_intensity(ds, intensity)
    wanted = wanted_movement(ds, at, measure)
    if "damage_category" in ds and ds["damage_category"].ndim == 1 and not wanted.own:
        if len(wanted.points) > 1:
            raise InputError(f"at = {wanted.name}: the study knows each wall at its own movement alone; ask for one.")
        return _from_curve(ds, category, wanted.largest, confidence, measure, options)
    known = category_capacities(ds, category, measure, wanted)
    return estimate_exceedance(known, require_followed(known, wanted), confidence)


def require_followed(known: CategoryCapacities, wanted: MovementDistribution) -> MovementDistribution:
    """Refuse a distribution of the movement of which a part lies beyond the study's walls; return the movement."""
    open_ended = np.isinf(known.upper).any()
    beyond = float(np.mean(np.asarray(wanted.points) > known.followed * (1 + ROUNDING))) * open_ended
    if len(wanted.points) > 1 and beyond:
        raise InputError(
            f"at = {wanted.name}: {beyond:.0%} of it lies beyond {known.followed:g}, the largest movement of the "
            "study's walls; run the study with a larger movement."
        )
    return wanted


def estimate_exceedance(
    known: CategoryCapacities, at: float | MovementDistribution, confidence: float = 0.9
) -> Exceedance:
    """Probability that walls have reached the category by a movement; of several movements, the mean.

    The interval is Wilson's, with the effective number of walls of Greenwood's variance (Dorey and Korn 1987). Where no
    wall was followed as far the estimate is NaN.
    """
    at = as_distribution(at)
    short = censored_before(known.lower, known.upper, at.largest)
    lost = short & known.failing
    estimate = estimate_of(known, pseudo_values(known, at), confidence)
    if np.isnan(estimate.value) and len(lost):
        followed = replace(at, points=tuple(np.minimum(at.points, known.followed)))
        least = estimate_of(known, pseudo_values(known, followed), confidence).lower
        estimate = estimate._replace(value=np.nan, error=np.nan, lower=least, upper=1.0)
        weight = np.ones(len(lost)) if known.weight is None else known.weight
        bounds = [min(float(np.mean(weight * known_hits(known, at, unknown))), 1.0) for unknown in (0.0, 1.0)]
    elif lost.any():
        intervals = failure_bounds(known.lower, known.upper, lost, at.largest, known.lower * (1 + 4 * ROUNDING))
        ends = [known._replace(lower=lower, upper=upper) for lower, upper in intervals]
        bounds = [min(estimate_of(end, pseudo_values(end, at), confidence).value, 1.0) for end in ends]
    else:
        bounds = [estimate.value, estimate.value] if len(lost) else [0.0, 1.0]
    estimate = estimate._replace(samples=int((~lost).sum()))
    return Exceedance(estimate, int(lost.sum()), bounds[0], bounds[1], int((short & ~lost).sum()))


def estimate_of(known: CategoryCapacities, values: PseudoValues, confidence: float) -> Estimate:
    """Mean of pseudo-values with its interval."""
    return probability(
        values.hit,
        weight=known.weight,
        replicate=known.replicate,
        confidence=confidence,
        precision=values.precision,
        share=values.share,
    )


def _from_curve(
    ds: xr.Dataset, category: int, at: float, confidence: float, intensity: str, options: FragilityOptions
) -> Exceedance:
    """Probability at a movement from walls that are each known at their own, by their lognormal curve."""
    curves = fit_fragility(
        ds,
        categories=[category],
        intensity=intensity,
        confidence=confidence,
        bootstrap=options.curve_resamples,
        options=options,
    )
    one, largest = curves.isel(category=0), float(curves["intensity"][-1])
    if at > largest * (1 + ROUNDING):
        raise InputError(
            f"at = {at:g}: no wall was moved as far ({largest:g} at most), and a study that keeps each wall's own "
            "movement alone ([study] movement = 'sampled') tells nothing beyond."
        )
    if str(one["fit_status"].values) not in WITH_CURVE:
        raise InputError(
            f"P(category >= {category}) at {at:g}: the study knows each wall at its own movement alone, and its walls "
            f"give no curve to read the probability from: {one['fit_status'].values}."
        )
    value, lower, upper = probability_at(curves, category, at)
    known, failed = category_capacities(ds, category, intensity), int(one["failed"])
    weight = np.ones(len(known.lower)) if known.weight is None else known.weight
    kish = effective_samples(weight[~known.failing])
    error = (upper - lower) / (2 * normal_factor(confidence))
    bounds = [value, value]
    if failed:
        ends = (one[f"probability_failed_{end}"].values for end in ("undamaged", "damaged"))
        bounds = [float(np.interp(at, one["intensity"].values, end)) for end in ends]
    return Exceedance(
        Estimate(value, error, lower, upper, confidence, len(weight) - failed, kish), failed, bounds[0], bounds[1], 0
    )


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
    known = category_capacities(ds, category, intensity)
    # walls damaged before any movement are no part of the curve of the others
    known = known._replace(upper=np.where(known.upper <= 0, np.inf, known.upper))
    found = _median_of(known, category, confidence, seed, options)
    if not found.value > known.followed * (1 + ROUNDING):
        return found
    return found._replace(value=known.followed, error=np.nan, lower=min(found.lower, known.followed), upper=np.inf)


def _median_of(
    known: CategoryCapacities, category: int, confidence: float, seed: int, options: FragilityOptions
) -> Estimate:
    """Median of the lognormal curve, wherever it lies."""
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
        draws = draw_parameters(estimator, options.median_resamples, generator(seed, Stream.BOOTSTRAP, category))
        logarithm = draws.parameters[:, 1] / draws.parameters[:, 0]
        if draws.resampled is None:
            lower, upper = np.exp(np.quantile(logarithm, [0.5 * (1 - confidence), 0.5 * (1 + confidence)]))
            return Estimate(fit, fit * float(logarithm.std()), float(lower), float(upper), confidence, count, kish)
        error = float(np.std(logarithm, ddof=1)) if len(logarithm) > 1 else np.nan
        factor = student_factor(confidence, effective_reached(estimator) - 1.0)
    if not np.isfinite(error):
        return Estimate(fit, np.nan, 0.0, np.inf, confidence, count, kish)
    return Estimate(
        fit, fit * error, fit * np.exp(-factor * error), fit * np.exp(factor * error), confidence, count, kish
    )


def _median(known: CategoryCapacities, heavy: FloatArray, options: FragilityOptions) -> float:
    used = heavy > 0
    counts = normalised_weights(heavy[used], known.upper[used])
    return fit_lognormal(known.lower[used], known.upper[used], counts, options=options).median
