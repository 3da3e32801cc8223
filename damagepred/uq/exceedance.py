"""The probability that a category is reached by a movement, from a study's walls.

One estimate serves every command: redistribution to the right (Efron 1967; without intervals, Kaplan and Meier). A wall
that was not followed as far takes the share of those followed further. This is unbiased if the end of a path does not
depend on the strength of its wall. The estimate is the mean of pseudo-values, one per wall (Andersen, Klein and
Rosthoej 2003).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from damagepred.arrays import BoolArray, FloatArray, IntArray
from damagepred.enumerations import SOLVED
from damagepred.errors import InputError
from damagepred.runtime.one_thread import one_blas_thread
from damagepred.uq import capacity
from damagepred.uq.estimate import (
    ENOUGH_REPLICATES,
    Estimate,
    effective_samples,
    normal_factor,
    probability,
)
from damagepred.uq.failure_bounds import failure_bounds
from damagepred.uq.fragility import fit_fragility
from damagepred.uq.fragility.describe import probability_at
from damagepred.uq.fragility.fit import WITH_CURVE
from damagepred.uq.intensity import (
    attributes,
    chosen_intensity,
    in_unit,
    intensity_values,
    movement_words,
    shown_measure,
)
from damagepred.uq.movement_distribution import MovementDistribution, as_distribution

PRIOR = 0.5
"""Walls added on either side for the precision of censored walls: one that reached the category just at the movement,
one that did not (Jeffreys' prior of a share)."""

LEAST_MISSING = 1e-6  # share of its own movement that a failed wall lacks at least
RESOLUTION = 1e-12  # smallest difference of a pseudo-value from 0 and 1 that is no rounding
CURVE_RESAMPLES = 300  # resamples for the error of a probability that is read from a curve


class CategoryCapacities(NamedTuple):
    """Capacities for one category, of walls that were run."""

    sample: IntArray  # (walls,): their numbers
    # (walls,): the movement at which the category was reached lies between; see ``damagepred.uq.capacity``
    lower: FloatArray
    upper: FloatArray
    weight: FloatArray | None  # (walls,): weight in importance sampling
    replicate: IntArray | None  # (walls,): scramble of Sobol points each belongs to
    failing: BoolArray  # (walls,): walls that failed before they reached the category

    @property
    def heavy(self) -> FloatArray:
        """Weights, 1 without importance sampling."""
        return np.ones(len(self.lower)) if self.weight is None else self.weight

    @property
    def followed(self) -> float:
        """Largest movement at which a wall is known."""
        return float(np.where(np.isinf(self.upper), self.lower, self.upper).max(initial=0.0))

    def part(self, which: NDArray[Any] | slice) -> CategoryCapacities:
        """Return some of the walls."""
        columns: list[Any] = [None if column is None else column[which] for column in self]
        return CategoryCapacities(*columns)


class Exceedance(NamedTuple):
    """Probability of a category or worse at a movement."""

    # estimate by redistribution to the right; its value is NaN where no wall was followed as far. ``samples`` are walls
    # that did not fail before the movement
    estimate: Estimate
    failed: int  # walls that failed before the movement, and had not reached the category
    # estimate with all of those undamaged at this movement, and with all damaged
    failed_undamaged: float
    failed_damaged: float
    not_followed: int  # walls that were not followed as far as this movement, and had not reached the category


def category_capacities(
    ds: xr.Dataset, category: int, intensity: str | None = None, at: MovementDistribution | None = None
) -> CategoryCapacities:
    """Capacities of a study's walls for one category; for the site as shares of each wall's own movement."""
    name = chosen_intensity(ds, intensity)
    capacity.require_categories(ds, [category])
    if "damage_category" not in ds:
        nothing = np.empty(0)
        return CategoryCapacities(np.empty(0, dtype=np.int64), nothing, nothing, None, None, np.empty(0, dtype=bool))
    by_site = at is not None and at.own
    walls = capacity.read_capacities(ds, [category], name, between=not by_site)
    lower, upper, failing = (field[0] for field in walls.capacities[:3])
    if by_site:
        moved, end = walls.capacities.end > 0, np.where(walls.capacities.end > 0, walls.capacities.end, 1.0)
        upper = np.where(moved | np.isinf(upper), upper / end, 0.0)
        lower = np.minimum(np.where(failing, np.minimum(lower / end, 1.0 - LEAST_MISSING), lower / end + ~moved), upper)
    replicates = int(ds.attrs.get("replicates", 1))
    weight = walls.weight if "weight" in ds else None
    replicate = walls.sample % replicates if replicates >= ENOUGH_REPLICATES else None
    return CategoryCapacities(walls.sample, lower, upper, weight, replicate, failing)


def wanted_movement(ds: xr.Dataset, at: float | str | MovementDistribution, measure: str) -> MovementDistribution:
    """Movement that a study is asked for; refused if its measure differs, or walls have no ground of their own."""
    shown = shown_measure(movement_words(ds, measure), units := str(attributes(ds, measure)["units"]))
    wanted = as_distribution(at, units)
    wanted.require_measure(ds, measure)
    ends = own_movements(ds, measure) if wanted.own and "damage_category" in ds else np.empty(0)
    if ends.size and not has_own_ground(ds, measure):
        same = f"{shown.factor * ends[0]:.6g} {shown.unit}"
        raise InputError(
            f"at = site: all samples of this study have the same {shown.words}, {same}, and no ground of "
            f'their own; give a movement, such as "{same}".'
        )
    return wanted


def has_own_ground(ds: xr.Dataset, measure: str) -> bool:
    """Whether solved walls end at movements of their own."""
    ends = own_movements(ds, measure)
    return bool(ends.size and np.ptp(ends) > capacity.ROUNDING * ends.max())


def own_movements(ds: xr.Dataset, measure: str) -> FloatArray:
    """Largest movement of each solved wall, array (walls,)."""
    solved = np.isin(ds["status"].values, SOLVED)
    ends = intensity_values(ds, measure).reshape(ds.sizes["sample"], -1)[solved]
    return np.where(np.isfinite(ends), ends, 0.0).max(axis=1, initial=0.0)


class PseudoValues(NamedTuple):
    """Pseudo-values of a probability, and the precision of the interval that their scatter gives."""

    hit: FloatArray  # (walls,): pseudo-values; their mean, weighted, is the probability. NaN where it is unknown
    # effective number of walls over Greenwood's variance, at most 1: early hits of many walls inform less on a
    # movement to which few were followed
    precision: float = 1.0
    # effective number over the number of walls, for the interval where no wall or every wall reached the category
    share: float = 1.0


class _Redistribution:
    """Redistribution to the right: walls at risk at the movements where others were last followed."""

    def __init__(self, lower: FloatArray, upper: FloatArray, weight: FloatArray, largest: float) -> None:
        self.lower, self.upper, self.weight = lower, upper, weight
        self.short = capacity.censored_before(lower, upper, largest)
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

        def total(by: FloatArray, *values: FloatArray) -> list[FloatArray]:
            order = np.argsort(by, kind="stable")
            upto = np.searchsorted(by[order], self.ends)
            return [np.append(0.0, np.cumsum(value[order]))[upto] for value in values]

        begins = np.where(exact, np.nextafter(self.lower, -np.inf), self.lower)
        passed, begun, rise = total(begins, self.weight, slope, slope * self.end)
        over, fall = total(self.end, slope, slope * self.end)
        return self.weight.sum() - passed + np.maximum(rise - fall - self.ends * (begun - over), 0.0)

    def pseudo_values(self, movement: float, prior: float = 0.0) -> tuple[FloatArray, float, FloatArray]:
        """Pseudo-values at a movement, the probability, and the pseudo-values of two more walls of ``prior``."""
        count = int(np.searchsorted(self.ends, movement * (1 - capacity.ROUNDING)))
        before = self.at_risk[:count] + 2.0 * prior
        after = before - self.leaving[:count]
        if (after <= capacity.ROUNDING * self.weight.sum()).any():
            return np.full(len(self.lower), np.nan), np.nan, np.full(2, np.nan)
        step = 1.0 / before - 1.0 / after
        risk, moment = (np.append(0.0, np.cumsum(value)) for value in (step, self.ends[:count] * step))
        first, last = np.minimum(self.first, count), np.minimum(self.last, count)
        walls = risk[first] + (self.end * (risk[last] - risk[first]) - moment[last] + moment[first]) / self.length
        short = self.short & (self.first <= count)
        walls[short] += 1.0 / after[first[short] - 1]
        undamaged = np.where(short, 0.0, 1.0 - capacity.probability_reached(self.lower, self.upper, movement))
        total, raised = self.weight.sum() + 2.0 * prior, float(np.prod(before / after))
        survival = raised * ((self.weight * undamaged).sum() + prior) / total
        hit = 1.0 - raised * undamaged - total * survival * walls
        added = 1.0 - raised * np.array([0.0, 1.0]) - total * survival * risk[-1]
        for sure in (0.0, 1.0) if count else ():
            hit[np.abs(hit - sure) < RESOLUTION] = sure
        return hit, 1.0 - survival, added

    def mean(self, points: Sequence[float], prior: float = 0.0) -> tuple[FloatArray, float, FloatArray]:
        """Means of ``pseudo_values`` over movements."""
        hit, chance, added = zip(*(self.pseudo_values(movement, prior) for movement in points))
        return np.mean(hit, axis=0), float(np.mean(chance)), np.mean(added, axis=0)


def pseudo_values(known: CategoryCapacities, movement: MovementDistribution) -> PseudoValues:
    """Pseudo-values of the probability of having reached the category; of several movements, their mean."""
    weight = known.heavy
    if not weight.any():
        return PseudoValues(np.zeros(len(weight)))
    weight = weight * (effective_samples(weight) / weight.sum())
    walls, total = _Redistribution(known.lower, known.upper, weight, movement.largest), float(weight.sum())
    hit, chance, _ = walls.mean(movement.points)
    if not len(walls.ends) or np.isnan(chance):
        return PseudoValues(hit)
    regular, likely, added = walls.mean(movement.points, PRIOR)
    squares = float(weight @ (regular - likely) ** 2 + PRIOR * ((added - likely) ** 2).sum())
    effective = max(likely * (1.0 - likely) * (total + 2.0 * PRIOR) ** 2 / squares - 2.0 * PRIOR, PRIOR)
    scatter = float(weight @ (hit - chance) ** 2)
    sure = not capacity.ROUNDING < chance < 1.0 - capacity.ROUNDING or scatter <= capacity.ROUNDING
    plain = total if sure else chance * (1.0 - chance) * total**2 / scatter
    return PseudoValues(hit, min(effective / plain, 1.0), min(effective / total, 1.0))


def known_hits(walls: CategoryCapacities, movement: MovementDistribution, unknown: float) -> FloatArray:
    """Probability of each wall to have reached the category; ``unknown``, 0 or 1, for the bound beyond its path."""

    def hit(m: float) -> FloatArray:
        short = capacity.censored_before(walls.lower, walls.upper, m)
        return np.where(short, unknown, capacity.probability_reached(walls.lower, walls.upper, m))

    return np.asarray(np.mean([hit(m) for m in movement.points], axis=0))


@one_blas_thread()
def exceedance(
    ds: xr.Dataset,
    category: int | str,
    at: float | str | MovementDistribution,
    *,
    confidence: float = 0.9,
    intensity: str | None = None,
) -> Exceedance:
    """Estimate the probability that a category or a worse one is reached at a movement.

    Where the movement lies between the two increments at which a wall was below and in the category, the wall counts
    for the share of that step below the movement.

    Where a study keeps the end of each wall's own movement alone, no two walls are known at the same one: then the
    probability at a movement comes from the lognormal curve fitted to all walls, with its band.

    Parameters
    ----------
    ds : xarray.Dataset
        Study, as ``open_study`` returns it.
    category : int or str
        Number or name of the category.
    at : float, str or MovementDistribution
        Movement (m, or 1 for a deflection ratio), a site class such as "H1", a distribution of the movement, or "site":
        each wall's own ground, to the end of its own movement; see ``damagepred.uq.movement_distribution``.
    confidence : float
        Confidence level of the interval.
    intensity : str, optional
        Measure of the movement; by default the study's own.

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
    category = capacity.category_number(ds, category)
    measure = chosen_intensity(ds, intensity)
    wanted = wanted_movement(ds, at, measure)
    if "damage_category" in ds and ds["damage_category"].ndim == 1 and not wanted.own:
        if len(wanted.points) > 1:
            raise InputError(f"at = {wanted.name}: the study has each sample at its own movement alone; ask for one.")
        return _from_curve(ds, category, wanted.largest, confidence, measure)
    walls = category_capacities(ds, category, measure, wanted)
    followed = require_followed(walls, wanted, str(attributes(ds, measure)["units"]))
    return estimate_exceedance(walls, followed, confidence)


def require_followed(walls: CategoryCapacities, wanted: MovementDistribution, units: str) -> MovementDistribution:
    """Movement asked for; refused if it is a distribution of which a part lies beyond the study's walls."""
    open_ended = np.isinf(walls.upper).any()
    beyond = float(np.mean(np.asarray(wanted.points) > walls.followed * (1 + capacity.ROUNDING))) * open_ended
    if len(wanted.points) > 1 and beyond:
        raise InputError(
            f"at = {wanted.name}: {beyond:.0%} of it lies beyond {in_unit(walls.followed, units)}, the largest "
            "movement of the study; run the study with a larger movement."
        )
    return wanted


def estimate_exceedance(
    walls: CategoryCapacities, at: float | MovementDistribution, confidence: float = 0.9
) -> Exceedance:
    """Probability that walls have reached the category by a movement; of several movements, the mean."""
    at = as_distribution(at)  # the interval: Wilson's, for the variance of Greenwood (Dorey and Korn 1987)
    short = capacity.censored_before(walls.lower, walls.upper, at.largest)
    lost = short & walls.failing
    estimate = estimate_of(walls, pseudo_values(walls, at), confidence)
    if np.isnan(estimate.value) and len(lost):
        followed = replace(at, points=tuple(np.minimum(at.points, walls.followed)))
        least = estimate_of(walls, pseudo_values(walls, followed), confidence).lower
        estimate = estimate._replace(value=np.nan, error=np.nan, lower=least, upper=1.0)
        bounds = [min(float(np.mean(walls.heavy * known_hits(walls, at, unknown))), 1.0) for unknown in (0.0, 1.0)]
    elif lost.any():
        beyond = walls.lower * (1 + 4 * capacity.ROUNDING)
        intervals = failure_bounds(walls.lower, walls.upper, lost, at.largest, beyond)
        ends = [walls._replace(lower=lower, upper=upper) for lower, upper in intervals]
        bounds = [min(estimate_of(end, pseudo_values(end, at), confidence).value, 1.0) for end in ends]
    else:
        bounds = [estimate.value, estimate.value] if len(lost) else [0.0, 1.0]
    estimate = estimate._replace(samples=int((~lost).sum()))
    return Exceedance(estimate, int(lost.sum()), bounds[0], bounds[1], int((short & ~lost).sum()))


def estimate_of(walls: CategoryCapacities, values: PseudoValues, confidence: float) -> Estimate:
    """Mean of pseudo-values with its interval."""
    shares = {"confidence": confidence, "precision": values.precision, "share": values.share}
    return probability(values.hit, weight=walls.weight, replicate=walls.replicate, **shares)


def _from_curve(ds: xr.Dataset, category: int, movement: float, confidence: float, intensity: str) -> Exceedance:
    """Probability at a movement from walls that are each known at their own, by their lognormal curve."""
    how: dict[str, Any] = {"confidence": confidence, "bootstrap": CURVE_RESAMPLES}
    curves = fit_fragility(ds, categories=[category], intensity=intensity, **how)
    curve, largest = curves.isel(category=0), float(curves["intensity"][-1])
    units = str(attributes(ds, intensity)["units"])
    asked, moved = in_unit(movement, units), in_unit(largest, units)
    if movement > largest * (1 + capacity.ROUNDING):
        raise InputError(
            f"at = {asked}: no sample was moved as far ({moved} at most), and a study that keeps each sample's "
            "own movement alone ([study] movement = 'sampled') has no information beyond."
        )
    if str(curve["fit_status"].values) not in WITH_CURVE:
        raise InputError(
            f"P(category >= {category}) at {asked}: the study has each sample at its own movement alone, and its "
            f"samples give no curve to read the probability from: {curve['fit_status'].values}."
        )
    value, lower, upper = probability_at(curves, category, movement)
    walls, failed = category_capacities(ds, category, intensity), int(curve["failed"])
    kish = effective_samples(walls.heavy[~walls.failing])
    error = (upper - lower) / (2 * normal_factor(confidence))
    bounds = [value, value]
    if failed:
        ends = (curve[f"probability_failed_{end}"].values for end in ("undamaged", "damaged"))
        bounds = [float(np.interp(movement, curve["intensity"].values, end)) for end in ends]
    estimate = Estimate(value, error, lower, upper, confidence, len(walls.lower) - failed, kish)
    return Exceedance(estimate, failed, bounds[0], bounds[1], 0)
