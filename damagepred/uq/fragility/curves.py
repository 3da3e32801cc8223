"""Fragility curves with their bands, from a study."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Any, Literal, NamedTuple, get_args

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from damagepred.arrays import BoolArray, FloatArray
from damagepred.enumerations import SOLVED, SampleStatus
from damagepred.errors import InputError, require_confidence, require_count, require_number, require_one_of
from damagepred.inputs.arguments import checked
from damagepred.runtime.one_thread import one_blas_thread
from damagepred.uq import capacity
from damagepred.uq.estimate import normal_factor, wilson
from damagepred.uq.failure_bounds import failure_bounds_of
from damagepred.uq.fragility import bands, goodness
from damagepred.uq.fragility.describe import curves_dataset
from damagepred.uq.fragility.estimators import CompositeLikelihood, Estimator, estimators, fit_grouped
from damagepred.uq.fragility.fit import (
    AT_START,
    EXTRAPOLATED,
    FITTED,
    NEVER,
    WITH_CURVE,
    BoundedMedian,
    Fit,
    GroupedIntervals,
    StartShare,
    group_intervals,
    reasons_not_fitted,
)
from damagepred.uq.fragility.turnbull import Npmle, isotonic, turnbull
from damagepred.uq.intensity import chosen_intensity
from damagepred.uq.random_streams import RandomStream, generator

Model = Literal["separate", "common", "empirical"]
Columns = dict[str, NDArray[Any]]  # of the dataset, on (category,) or (category, intensity)

LEAST_REACHED, LEAST_WALLS = 15, 30
"""Effective walls that reached each category, and in all, below which curves of a common dispersion have no band.

A limit on the first alone would pick unusual studies.
"""
CAUTION_BELOW = 10  # walls that reached a category below which its curve carries a caution
CRITERION_WALLS = 50_000  # walls beyond which every second, third ... is taken for Akaike's criterion
LARGEST_COUNT = 1_000_000  # resamples, and points of a curve, beyond which they are refused as a slip
EMPIRICAL = "empirical"  # status of a curve without a form


class _Request(NamedTuple):
    model: Model
    confidence: float
    bootstrap: int
    goodness: int
    seed: int
    categories: list[int]
    grid: FloatArray


@checked
@one_blas_thread()
def fit_fragility(
    ds: xr.Dataset,
    *,
    model: Model = "separate",
    intensity: str | None = None,
    categories: Sequence[int | str] | None = None,
    confidence: float = 0.9,
    bootstrap: int = 1000,
    goodness: int = 0,
    seed: int = 0,
    points: int = 501,
) -> xr.Dataset:
    """Fit a fragility curve for each damage category of a study.

    Parameters
    ----------
    ds : xarray.Dataset
        As ``open_study`` returns it: ``damage_category`` and the intensity on (sample, increment), or on (sample,)
        where each wall is known at its own movement alone; ``status`` on (sample,).
    model : {"separate", "common", "empirical"}
        Lognormal curves, each fitted for itself; with a dispersion that all share, so that they never cross (where each
        wall is known at one movement, the ordinal probit model); or no form at all (Turnbull).
    intensity : str, optional
        Measure of the movement, one of ``MEASURES`` or a variable of the dataset; by default the movement of the
        ground's surface where the study has mounds, otherwise the central deflection.
    categories : sequence of int or str, optional
        Numbers or names; by default all that the damage table has, from 1.
    confidence : float
        Of the bands, 0.9 for 5 to 95 %. They are of the posterior where fewer than 100 walls determine a curve,
        otherwise of resampled walls (BCa); see ``damagepred.uq.fragility.bands``.
    bootstrap : int
        Number of resamples of walls for the bands; 0 for no bands.
    goodness : int
        Simulated studies of the fitted curve at most, for the p-value of its misfit to the empirical one; 0: not
        judged. They end with the tenth that has at least the misfit of the study (Besag and Clifford 1991).
    seed : int
        Seed of the resampling.
    points : int
        Number of points of the curves.

    Returns
    -------
    xarray.Dataset
        ``probability``, ``probability_lower``, ``probability_upper``, ``empirical`` on (category, intensity);
        ``median``, ``dispersion`` with ``_lower`` and ``_upper``, ``reached``, ``not_reached``, ``failed``,
        ``fit_status``, ``fit_note``, ``share_at_start`` with both (walls that reached the category before any
        movement; median and dispersion are of the others), ``median_lower_bound``, ``median_extrapolated``, the bounds
        ``median_failed_undamaged`` and ``median_failed_damaged``, the Kolmogorov ``distance`` from the empirical curve,
        ``p_value`` of the misfit to it and ``resamples_fitted`` on (category,); where walls failed also the curves with
        all of them undamaged or damaged, ``probability_failed_undamaged`` and ``probability_failed_damaged``; as
        attributes Akaike's criterion of separate dispersions and of a common one, ``aic_separate`` and ``aic_common``,
        from ``aic_walls`` walls, and the ``movements`` of the increments where all walls have the same.

    Notes
    -----
    A curve ends where walls end. Where its median lies beyond the largest movement to which a wall was followed, its
    status is "extrapolated": ``median`` is NaN, ``median_lower_bound`` is that movement, and the number fitted is
    ``median_extrapolated``. Bounds beyond are infinite.

    A failed wall counts as far as it was followed: it had not reached the category by then, and nothing is known
    beyond. That is right if walls do not fail because they are weak or strong; the bounds are without that.

    Examples
    --------
    >>> import damagepred
    >>> curves = damagepred.fit_fragility(damagepred.open_study("house.dp"), bootstrap=20)
    >>> curves["category"].values.tolist()
    [1, 2, 3, 4]
    >>> (1e3 * curves["median"]).round(1).values.tolist()
    [nan, 1.4, 7.8, nan]
    """
    if "status" in ds and not np.isin(ds["status"].values, SOLVED).any():
        raise InputError("the study has no finished sample yet; run `damagepred study` first.")
    for needed in ("damage_category", "status"):
        if needed not in ds:
            raise InputError(
                f"the dataset has no variable '{needed}'; fragility needs a study as open_study returns it."
            )
    require_one_of("model", model, get_args(Model))
    name = chosen_intensity(ds, intensity)
    require_confidence(confidence)
    names = str(ds["damage_category"].attrs.get("flag_meanings", "")).split()
    every = range(1, capacity.highest_category(ds) + 1)
    wanted = [capacity.category_number(ds, c) for c in (every if categories is None else categories)]
    if not wanted:
        raise InputError("categories: are none; name one or more.")
    if any(b <= a for a, b in itertools.pairwise(wanted)):
        raise InputError(f"categories = {wanted}: must ascend, each given once.")
    capacity.require_categories(ds, wanted)
    require_count("seed", seed, 0)
    for what, number, least in (("bootstrap", bootstrap, 0), ("goodness", goodness, 0), ("points", points, 2)):
        require_count(what, number, least)
        require_number(what, number, least, LARGEST_COUNT)
    walls = capacity.read_capacities(ds, wanted, name)
    grid = np.linspace(0.0, walls.largest, points)
    request = _Request(model, confidence, bootstrap, goodness, seed, wanted, grid)
    columns, more = _curves(walls, request)
    attrs: dict[str, Any] = {
        "model": model,
        "confidence": confidence,
        "bootstrap_samples": bootstrap,
        "bootstrap_seed": seed,
        "intensity_measure": name,
        "samples": len(walls.sample),
        "samples_failed": int((ds["status"].values == SampleStatus.FAILED).sum()),
        "curves_cross": int(_cross(columns)),
        **more,
    }
    if walls.marks is not None:
        attrs["movements"] = walls.marks
    return curves_dataset(ds, columns, wanted, names, grid, name, attrs)


def _each_category(lower: FloatArray, upper: FloatArray, weight: FloatArray) -> list[GroupedIntervals]:
    """Equal intervals of each category alone, grouped."""
    return [group_intervals(low[None], high[None], weight) for low, high in zip(lower, upper)]


def _curves(walls: capacity.StudyCapacities, request: _Request) -> tuple[Columns, dict[str, float]]:
    """Columns of the dataset, and its attributes that belong to all curves together."""
    read = walls.capacities
    reached = np.isfinite(read.upper)
    columns: Columns = {
        "reached": reached.sum(axis=1),
        "not_reached": (~reached & ~read.failed).sum(axis=1),
        "failed": read.failed.sum(axis=1),
    }
    alone = _each_category(read.lower, read.upper, walls.weight)
    empirical = [_empirical(cells, walls.single) for cells in alone]
    columns["empirical"] = np.array([curve.probability(request.grid) for curve in empirical])
    if request.model == "empirical":
        return columns | _without_form(alone, walls, request), {}
    before, walls = read.upper <= 0, walls._replace(capacities=capacity.without_damaged_at_start(read))
    lower, upper = walls.capacities.lower, walls.capacities.upper
    if before.any():
        alone = _each_category(lower, upper, walls.weight)
        empirical = [_empirical(cells, walls.single) for cells in alone]
    common = request.model == "common"
    together = group_intervals(lower, upper, walls.weight) if common else None
    groups = [together] if together is not None else alone
    fits = [Fit(np.nan, np.nan, why) for cells in groups for why in reasons_not_fitted(cells, common)]
    limits, share = [bands.unknown_band(len(request.grid)) for _ in alone], np.full(len(alone), np.nan)
    for k, cells in enumerate(groups):
        for estimator in estimators(cells, common, walls.single):
            rows = estimator.categories if common else [k]
            for row, fit, limit in zip(rows, estimator.fits(), _bands(estimator, rows, share, request)):
                fits[row], limits[row] = fit, limit
    columns |= _columns_of(fits, limits, request.grid)
    columns |= _with_failed(walls, fits, request) | _judged(fits, empirical, walls, request)
    columns["resamples_fitted"] = share
    columns["fit_note"] = np.array([_note(fits[k], alone[k], walls, share[k], request) for k in range(len(fits))])
    _add_start_share(columns, before, walls.weight, request.confidence)
    _end_where_walls_end(columns, walls.largest)
    return columns, _criteria(fits, walls)


def _bands(estimator: Estimator, rows: list[int], share: FloatArray, request: _Request) -> list[bands.Band]:
    """Bands of categories fitted together; sets the share of the resamples that could be fitted."""
    unknown = [bands.unknown_band(len(request.grid))] * len(rows)
    if estimator.no_dispersion() or request.bootstrap == 0:
        return unknown
    walls = bands.effective_reached(estimator)
    if request.model == "common" and _too_few(estimator.cells, walls):
        return unknown
    random = generator(request.seed, RandomStream.BOOTSTRAP, request.categories[rows[0]])
    draws = bands.draw_parameters(estimator, request.bootstrap, random)
    share[rows] = draws.share
    return [bands.confidence_band(draws, row, request.grid, request.confidence, walls) for row in np.eye(len(rows))]


def _too_few(cells: GroupedIntervals, walls: float) -> bool:
    """Whether curves with a common dispersion have no band: it would cover the truth too rarely."""
    return walls < LEAST_REACHED or cells.effective() < LEAST_WALLS


def _columns_of(fits: list[Fit], limits: list[bands.Band], grid: FloatArray) -> Columns:
    columns: Columns = {
        "probability": np.array([f.probability(grid) for f in fits]),
        "median": np.array([f.median for f in fits]),
        "dispersion": np.array([f.dispersion for f in fits]),
        "fit_status": np.array([f.status for f in fits]),
    }
    for name in bands.Band._fields:
        for end, word in enumerate(("lower", "upper")):
            columns[f"{name}_{word}"] = np.array([getattr(limit, name)[end] for limit in limits])
    return columns


def _add_start_share(columns: Columns, before: BoolArray, weight: FloatArray, confidence: float) -> None:
    """Add the share of walls that reached a category before any movement: probability p0 + (1 - p0) Phi(...)."""
    start = [StartShare.of(row, weight, confidence) for row in before]
    columns["share_at_start"], columns["share_at_start_lower"], columns["share_at_start_upper"] = np.array(start).T
    for name in [name for name in columns if name.startswith("probability")]:
        columns[name] = np.array([p0.mixed(name, curve) for p0, curve in zip(start, columns[name])])
    words = "reached it before any movement; median and dispersion are of the others"
    notes = [f"{n} wall{'s' * (n > 1)} {words}" if n else "" for n in before.sum(axis=1).tolist()]
    columns["fit_note"] = np.array(["; ".join(filter(None, both)) for both in zip(notes, columns["fit_note"])])
    at_start = (columns["fit_status"] == NEVER) & before.any(axis=1)
    columns["fit_status"] = np.where(at_start, AT_START, columns["fit_status"])


def _end_where_walls_end(columns: Columns, largest: float) -> None:
    """Replace a median beyond the largest movement of the walls by NaN, with that movement as a lower bound."""
    bounded = BoundedMedian.of(columns["median"], columns["median_lower"], columns["median_upper"], largest)
    beyond = (columns["fit_status"] == FITTED) & np.isfinite(bounded.extrapolated)
    columns["fit_status"] = np.where(beyond, EXTRAPOLATED, columns["fit_status"])
    for name, value in bounded._asdict().items():
        columns["median" if name == "median" else f"median_{name}"] = value
    for end in ("undamaged", "damaged"):
        failed = columns[f"median_failed_{end}"]
        columns[f"median_failed_{end}"] = np.where(failed > largest * (1 + 1e-9), np.inf, failed)


def _empirical(cells: GroupedIntervals, single: bool, weight: FloatArray | None = None) -> Npmle:
    lower, upper, weight = cells.lower[0], cells.upper[0], cells.total if weight is None else weight
    return isotonic(lower, upper, weight) if single else turnbull(lower, upper, weight)


def _without_form(alone: list[GroupedIntervals], walls: capacity.StudyCapacities, request: _Request) -> Columns:
    """Empirical curves in place of the lognormal ones; their medians have quantiles of resampled walls."""
    rows = []
    for k, cells in enumerate(alone):
        curve = _empirical(cells, walls.single)
        random = generator(request.seed, RandomStream.BOOTSTRAP, request.categories[k])
        times = request.bootstrap if len(cells.number) <= bands.ONE_STEP_GROUPS or walls.single else 0
        weights = (bands.draw(cells, 1, random)[0] * cells.weight for _ in range(times))
        again = [_empirical(cells, walls.single, weight) for weight in weights]
        probability, median = curve.probability(request.grid), _finite(curve.quantile(0.5))
        row: dict[str, Any] = {
            "probability": probability,
            "median": median,
            "median_lower_bound": np.nan if np.isfinite(median) else curve.left[-1],
            "resamples_fitted": float(times > 0),
            "fit_note": "",
            "fit_status": EMPIRICAL if np.isfinite(cells.upper).any() else NEVER,
        }
        row |= dict.fromkeys(("dispersion", "dispersion_lower", "dispersion_upper", "distance", "p_value"), np.nan)
        limits, medians = np.full((2, len(request.grid)), np.nan), np.full(1, np.nan)
        if times > 1:
            curves = np.array([resampled.probability(request.grid) for resampled in again])
            limits = _shares_between(probability, curves, cells, request.confidence)
            medians = np.array([resampled.quantile(0.5) for resampled in again])
        for word, tail, limit in zip(("lower", "upper"), (1 - request.confidence, 1 + request.confidence), limits):
            row[f"probability_{word}"] = limit
            row[f"median_{word}"] = _finite(float(np.quantile(medians, 0.5 * tail, method="nearest")))
        rows.append(row)
    columns = {key: np.array([row[key] for row in rows]) for key in rows[0]} if rows else {}
    for name, (lower, upper) in zip(("undamaged", "damaged"), failure_bounds_of(walls)):
        each = _each_category(lower, upper, walls.weight)
        medians = np.array([_finite(_empirical(c, walls.single).quantile(0.5)) for c in each])
        columns[f"median_failed_{name}"] = medians
    return columns


def _shares_between(best: FloatArray, curves: FloatArray, cells: GroupedIntervals, confidence: float) -> FloatArray:
    """Pointwise Wilson limits of the empirical curve, for the number of walls with the variance of the resamples."""
    deviation = curves.std(axis=0, ddof=1)
    every = cells.effective()
    equivalent = np.minimum(best * (1 - best) / np.maximum(deviation, 1e-12) ** 2, every)
    count = np.where((deviation > 0) & (equivalent > 0), equivalent, every)
    factor = normal_factor(confidence)
    ends = np.array([wilson(p, n, factor) for p, n in zip(np.clip(best, 0.0, 1.0), count)]).T
    return np.where(np.arange(len(best)) == 0, best, ends)


def _finite(movement: float) -> float:
    """Movement, NaN if the category is not reached."""
    return movement if np.isfinite(movement) else np.nan


def _with_failed(walls: capacity.StudyCapacities, fits: list[Fit], request: _Request) -> Columns:
    """Medians and curves with all failed walls undamaged, and with all damaged."""
    columns: Columns = {}
    some = walls.capacities.failed.any()
    for name, (lower, upper) in zip(("undamaged", "damaged"), failure_bounds_of(walls)):
        again = fits
        if some and request.model == "common":
            again = fit_grouped(group_intervals(lower, upper, walls.weight), True, walls.single)
        elif some:
            again = [fit_grouped(c)[0] for c in _each_category(lower, upper, walls.weight)]
        columns[f"median_failed_{name}"] = np.array([f.median for f in again])
        if some:
            columns[f"probability_failed_{name}"] = np.array([f.probability(request.grid) for f in again])
    return columns


def _judged(fits: list[Fit], empirical: list[Npmle], walls: capacity.StudyCapacities, request: _Request) -> Columns:
    """Distances of the curves from the empirical ones, and the p-values of their misfit."""
    gap, chance = np.full((2, len(fits)), np.nan)
    for k, fit in enumerate(fits):
        if fit.status == FITTED:
            gap[k] = goodness.distance(fit, empirical[k])
            random = generator(request.seed, RandomStream.GOODNESS, request.categories[k])
            chance[k] = goodness.p_value(fit, walls, k, request.goodness, random)
    return {"distance": gap, "p_value": chance}


def _criteria(fits: list[Fit], walls: capacity.StudyCapacities) -> dict[str, float]:
    """Akaike's criterion of separate dispersions and of a common one, of the categories that have curves."""
    good = [k for k, fit in enumerate(fits) if fit.status == FITTED]
    if len(good) < 2:
        return {}
    some = slice(None, None, -(-len(walls.weight) // CRITERION_WALLS))
    lower, upper = walls.capacities.lower[good, some], walls.capacities.upper[good, some]
    cells = group_intervals(lower, upper, walls.weight[some])
    return {
        "aic_separate": goodness.akaike_criterion(cells, False),
        "aic_common": goodness.akaike_criterion(cells, True),
        "aic_walls": lower.shape[1],
    }


def _note(fit: Fit, cells: GroupedIntervals, walls: capacity.StudyCapacities, share: float, request: _Request) -> str:
    """Cautions for the reader of a curve."""
    if fit.status != FITTED:
        return ""
    common, reached = request.model == "common", np.isfinite(cells.upper[0])
    count = int(cells.number[reached].sum())
    at_once = int(cells.number[reached & (cells.lower[0] == 0)].sum())
    notes = []
    if count < CAUTION_BELOW:
        notes.append(f"rests on {count} walls that reached it")
    if request.bootstrap and common:
        effective = bands.effective_reached(CompositeLikelihood([0], cells))
        if _too_few(cells, effective):
            notes.append("no band: of so few walls it would be too narrow; take separate curves")
    if fit.median > walls.largest:
        notes.append("its median lies beyond the study's movement")
    if not walls.single and at_once > 0.5 * count:
        notes.append(f"{at_once} of {count} walls reached it in the first increment: refine the increments")
    if share < bands.FITTED_SHARE:
        band = "is too narrow" if common and not walls.single else "comes from the posterior"
        notes.append(f"only {share:.0%} of the resamples could be fitted: its band {band}")
    return "; ".join(notes)


def _cross(columns: Columns) -> bool:
    """Whether a worse category is anywhere more probable than a lesser one."""
    fitted = [p for p, s in zip(columns["probability"], columns["fit_status"]) if s in (*WITH_CURVE, EMPIRICAL)]
    return any(bool((worse > lesser + 1e-9).any()) for lesser, worse in itertools.pairwise(fitted))
