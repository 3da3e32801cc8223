"""The probability that a category is reached at a movement, and a category's median movement, from a study's walls."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy import special

from damagepred.errors import InputError
from damagepred.one_thread import one_blas_thread
from damagepred.uq.estimate import (
    ENOUGH_REPLICATES,
    Estimate,
    effective_samples,
    normal_factor,
    probability,
    student_factor,
)
from damagepred.uq.fragility import (
    COLLAPSED,
    COMPLETE,
    FAILED,
    capacities,
    fair_weights,
    fit_lognormal,
    movement_measure,
)
from damagepred.uq.fragility.bands import resampled_band
from damagepred.uq.fragility.capacities import read_capacities, tally
from damagepred.uq.fragility.estimators import estimators
from damagepred.uq.fragility.fit import FITTED, Fit
from damagepred.uq.fragility.models import fit_cells
from damagepred.uq.fragility.resampling import resample
from damagepred.uq.samplers import Stream, generator

FloatArray = NDArray[np.float64]

RESAMPLES = 100
"""Of the bootstrap for the error of a median."""


class Walls(NamedTuple):
    """What is known of walls that were run and did not fail, for one category.

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
    end : array (walls,)
        Movement to which each was to be followed.
    """

    sample: NDArray[np.int64]
    lower: FloatArray
    upper: FloatArray
    weight: FloatArray | None
    replicate: NDArray[np.int64] | None
    failed: int
    end: FloatArray


class Exceedance(NamedTuple):
    """Probability of a category or worse at a movement.

    Attributes
    ----------
    estimate : Estimate
        From the walls of which it is known; a wall that failed beyond the movement is one of them.
    failed : int
        Walls that failed before the movement, and had not reached the category.
    failed_undamaged, failed_damaged : float
        Estimate if all of those had not reached it by this movement, and if all had.
    not_followed : int
        Walls that were not followed as far as this movement, and had not reached the category; they count as not having
        reached it.
    """

    estimate: Estimate
    failed: int
    failed_undamaged: float
    failed_damaged: float
    not_followed: int


def walls(ds: xr.Dataset, category: int, intensity: str | None = None, keep_failed: bool = False) -> Walls:
    """Read what a study knows of one category.

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
    """
    if "damage_category" not in ds:
        nothing = np.empty(0)
        return Walls(np.empty(0, dtype=np.int64), nothing, nothing, None, None, 0, nothing)
    known = np.flatnonzero(np.isin(ds["status"].values, (COMPLETE, COLLAPSED, FAILED)))
    found = capacities(ds, category, intensity or movement_measure(ds))
    good = ~found.failed | keep_failed
    replicates = int(ds.attrs.get("replicates", 1))
    return Walls(
        known[good],
        found.lower[good],
        found.upper[good],
        np.asarray(ds["weight"].values[known[good]], dtype=np.float64) if "weight" in ds else None,
        known[good] % replicates if replicates >= ENOUGH_REPLICATES else None,
        int(found.failed.sum()),
        found.end[good],
    )


@one_blas_thread()
def exceedance(
    ds: xr.Dataset, category: int, at: float, *, confidence: float = 0.9, intensity: str | None = None
) -> Exceedance:
    """Estimate the probability that a category or a worse one is reached at a movement.

    A wall of which it is only known that it reached the category between two increments, with the movement between the
    two, counts for the share of that step which lies below the movement.

    Where a study keeps the end of each wall's own movement alone, no two walls are known at the same one: then the
    probability is that of the lognormal curve fitted to all walls, with its band.

    Parameters
    ----------
    ds : xarray.Dataset
        As ``open_study`` returns it.
    category : int
        The category.
    at : float
        Movement (m, or 1 for a deflection ratio).
    confidence : float
        Of the interval.
    intensity : str, optional
        Measure of the movement; by default the study's own.

    Raises
    ------
    InputError
        If the movement is not positive; of walls known at their own movements alone, if it lies beyond those, or there
        is no curve.
    """
    if not at > 0:
        raise InputError(f"at = {at:g}: must be greater than 0.")
    if "damage_category" in ds and ds["damage_category"].ndim == 1:
        return _from_curve(ds, category, at, confidence, intensity or movement_measure(ds))
    known = walls(ds, category, intensity, keep_failed=True)
    status = np.asarray(ds["status"].values)[known.sample] if len(known.sample) else np.empty(0)
    lost = (status == FAILED) & np.isinf(known.upper) & (known.lower < at * (1 - 1e-9))
    known, failed = _without(known, lost), int(lost.sum())
    hit = shares(known.lower, known.upper, at)
    estimate = probability(hit, weight=known.weight, replicate=known.replicate, confidence=confidence)
    count, value = len(hit), estimate.value
    beyond = count + failed
    low = value * count / beyond if beyond and count else 0.0
    high = (value * count + failed) / beyond if beyond and count else 1.0
    # a step's rounding is no reason to say that a wall was not followed
    short = int((np.isinf(known.upper) & (known.end < at * (1 - 1e-9))).sum())
    return Exceedance(estimate, failed, low, high, short)


def _without(known: Walls, lost: NDArray[np.bool_]) -> Walls:
    """Return what is known of the other walls."""
    kept = ~lost
    return known._replace(
        sample=known.sample[kept],
        lower=known.lower[kept],
        upper=known.upper[kept],
        weight=None if known.weight is None else known.weight[kept],
        replicate=None if known.replicate is None else known.replicate[kept],
        end=known.end[kept],
    )


def _from_curve(ds: xr.Dataset, category: int, at: float, confidence: float, intensity: str) -> Exceedance:
    """Return the probability at a movement from walls that are each known at their own, by their lognormal curve."""
    found = read_capacities(ds, [category], intensity)
    if at > found.largest * (1 + 1e-9):
        raise InputError(
            f"at = {at:g}: no wall was moved as far ({found.largest:g} at most), and a study that keeps each "
            "wall's own movement alone ([study] movement = 'sampled') tells nothing beyond."
        )
    lower, upper, failed, end = found.capacities

    def fitted(low: FloatArray, high: FloatArray) -> Fit:
        return fit_cells(tally(low, high, found.weight))[0]

    cells = tally(lower, upper, found.weight)
    fit = fit_cells(cells)[0]
    if fit.status != FITTED:
        raise InputError(
            f"P(category >= {category}) at {at:g}: the study knows each wall at its own movement alone, and its walls "
            f"give no curve to read the probability from: {fit.status}."
        )
    (estimator,) = estimators(cells)
    again = resample(estimator, estimator.best(), 3 * RESAMPLES, generator(0, Stream.BOOTSTRAP, category))
    grid = np.array([at])
    band = resampled_band("bca", again, 0, grid, confidence)
    spread = float(np.std(special.ndtr(again.again[:, 0] * np.log(at) - again.again[:, 1]), ddof=1))
    good = ~failed[0]
    value = float(fit.probability(grid)[0])
    estimate = Estimate(
        value, spread, float(band.probability[0][0]), float(band.probability[1][0]), confidence, int(good.sum()),
        effective_samples(found.weight[good]),
    )  # fmt: skip
    bounds = [value, value]
    if failed.any():
        ends = (fitted(np.where(failed, end, lower), upper), fitted(lower, np.where(failed, end, upper)))
        bounds = [float(one.probability(grid)[0]) for one in ends]
    return Exceedance(estimate, int(failed.sum()), bounds[0], bounds[1], 0)


def shares(lower: FloatArray, upper: FloatArray, at: float) -> FloatArray:
    """Return, of each wall's interval of capacity, the share that lies below a movement."""
    with np.errstate(invalid="ignore", divide="ignore"):
        inside = (at - lower) / (upper - lower)
    return np.where(upper <= at * (1 + 1e-12), 1.0, np.where(np.isinf(upper), 0.0, np.clip(inside, 0.0, 1.0)))


@one_blas_thread()
def median_movement(
    ds: xr.Dataset, category: int, *, confidence: float = 0.9, intensity: str | None = None, seed: int = 0
) -> Estimate:
    """Estimate the median movement at which a category is reached, from a lognormal curve.

    Failed walls count as far as they were followed, as in ``damagepred.fit_fragility``.

    Its error is that of the logarithm: by leaving out one replicate of Sobol points after the other where there are at
    least four, otherwise by resampling walls.

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
    """
    known = walls(ds, category, intensity, keep_failed=True)
    count = len(known.lower)
    heavy = np.ones(count) if known.weight is None else known.weight
    kish = effective_samples(heavy)
    fit = _median(known, heavy)
    if not np.isfinite(fit):
        return Estimate(np.nan, np.nan, 0.0, np.inf, confidence, count, kish)
    if known.replicate is not None:
        labels = np.unique(known.replicate)
        others = np.log([_median(known, heavy * (known.replicate != label)) for label in labels])
        groups = len(labels)
        error = float(np.sqrt((groups - 1) / groups * ((others - others.mean()) ** 2).sum()))
        factor = student_factor(confidence, groups - 1)
    else:
        error, factor = _resampled_error(known, heavy, seed, category), normal_factor(confidence)
    if not np.isfinite(error):
        return Estimate(fit, np.nan, 0.0, np.inf, confidence, count, kish)
    return Estimate(
        fit, fit * error, fit * np.exp(-factor * error), fit * np.exp(factor * error), confidence, count, kish
    )


def _resampled_error(known: Walls, heavy: FloatArray, seed: int, category: int) -> float:
    """Return the standard error of the median's logarithm from walls drawn again."""
    weight = fair_weights(heavy, known.upper)
    (estimator,) = estimators(tally(known.lower[None], known.upper[None], weight))
    found = resample(estimator, estimator.best(), RESAMPLES, generator(seed, Stream.BOOTSTRAP, category))
    return float(np.std(found.again[:, 1] / found.again[:, 0], ddof=1)) if len(found.again) > 1 else np.nan


def _median(known: Walls, heavy: FloatArray) -> float:
    used = heavy > 0
    counts = fair_weights(heavy[used], known.upper[used])
    return fit_lognormal(known.lower[used], known.upper[used], counts).median
