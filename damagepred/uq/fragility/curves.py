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
from damagepred.errors import InputError, require_count, require_number
from damagepred.formatting import options_text
from damagepred.inputs.arguments import checked
from damagepred.runtime.one_thread import one_blas_thread
from damagepred.uq.capacity import (
    Capacities,
    StudyCapacities,
    category_number,
    highest_category,
    read_capacities,
    require_categories,
    without_damaged_at_start,
)
from damagepred.uq.estimate import effective_samples, normal_factor, wilson
from damagepred.uq.fragility import bands, goodness
from damagepred.uq.fragility.describe import curves_dataset
from damagepred.uq.fragility.estimators import CompositeLikelihood, Estimator, estimators
from damagepred.uq.fragility.fit import (
    AT_START,
    EXTRAPOLATED,
    FITTED,
    NEVER,
    WITH_CURVE,
    BoundedMedian,
    Fit,
    StartShare,
    reasons_not_fitted,
)
from damagepred.uq.fragility.grouped_data import GroupedIntervals, group_intervals
from damagepred.uq.fragility.models import fit_grouped, require_ascending
from damagepred.uq.fragility.options import DEFAULT, FragilityOptions
from damagepred.uq.fragility.posterior import effective_reached, sample_posterior
from damagepred.uq.fragility.resampling import draw, resample
from damagepred.uq.fragility.turnbull import Npmle, isotonic, turnbull
from damagepred.uq.intensity import chosen_intensity
from damagepred.uq.random_streams import Stream, generator

Model = Literal["separate", "common", "empirical"]
Bands = Literal["bca", "percentile", "profile"]

EMPIRICAL = "empirical"
"""Status of a curve that has no median and dispersion of a lognormal, because none is asked for."""


class _Request(NamedTuple):
    model: Model
    band: Bands
    confidence: float
    bootstrap: int
    goodness: int
    seed: int
    categories: list[int]
    grid: FloatArray
    options: FragilityOptions


@checked
@one_blas_thread()
def fit_fragility(
    ds: xr.Dataset,
    *,
    model: Model = "separate",
    intensity: str | None = None,
    categories: Sequence[int | str] | None = None,
    confidence: float = 0.9,
    band: Bands = "bca",
    bootstrap: int = 1000,
    goodness: int = 0,
    seed: int = 0,
    points: int = 501,
    options: FragilityOptions = DEFAULT,
) -> xr.Dataset:
    """Fit a fragility curve for each damage category of a study.

    Parameters
    ----------
    ds : xarray.Dataset
        As ``open_study`` returns it: ``damage_category`` and the intensity on (sample, increment), or on (sample,)
        where each wall is known at its own movement alone, or at those of ``stripes``; ``status`` on (sample,).
    model : {"separate", "common", "empirical"}
        Lognormal curves, each fitted for itself; with a dispersion that all share, so that they never cross (where each
        wall is known at one movement, the ordinal probit model); or no form at all (Turnbull).
    intensity : str, optional
        Measure of the movement, one of ``MEASURES`` or a variable of the dataset; by default the movement of the
        ground's surface where the study has mounds, otherwise the central deflection.
    categories : sequence of int or str, optional
        Numbers or names; by default all that the damage table has, from 1.
    confidence : float
        Of the band, 0.9 for 5 to 95 %.
    band : {"bca", "percentile", "profile"}
        Its kind, see ``damagepred.uq.fragility.bands``; the empirical curve has the percentile band. The band of the
        posterior replaces BCa where fewer than 100 walls determine a category's curve; the profile band replaces both
        where fewer than 95 % of the resamples can be fitted.
    bootstrap : int
        Number of resamples of walls for the band; 0 for none.
    goodness : int
        Simulated studies of the fitted curve, for the p-value of its misfit to the empirical one; 0: not judged.
    seed : int
        Of the resampling.
    points : int
        Number of points of the curves.
    options : FragilityOptions
        From how many walls on each kind of band is taken, and their resolution.

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

    Raises
    ------
    InputError
        If the dataset has no finished sample or not the variables needed.

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
    name = _check(ds, model, band, confidence, intensity)
    names = str(ds["damage_category"].attrs.get("flag_meanings", "")).split()
    wanted = (
        list(range(1, highest_category(ds) + 1)) if categories is None else [category_number(ds, c) for c in categories]
    )
    if not wanted:
        raise InputError("categories: are none; name one or more.")
    require_ascending(wanted)
    require_categories(ds, wanted)
    for what, number, least in (
        ("bootstrap", bootstrap, 0),
        ("goodness", goodness, 0),
        ("seed", seed, 0),
        ("points", points, 2),
    ):
        require_count(what, number, least)
        if what != "seed":
            require_number(what, number, least, options.largest_count)
    walls = read_capacities(ds, wanted, name)
    grid = np.linspace(0.0, walls.largest, points)
    request = _Request(model, band, confidence, bootstrap, goodness, seed, wanted, grid, options)
    columns, more = _curves(walls, request)
    attrs: dict[str, Any] = {
        "model": model,
        "band": "percentile" if model == "empirical" else band,
        "confidence": confidence,
        "bootstrap_samples": bootstrap,
        "bootstrap_seed": seed,
        "intensity_measure": name,
        "samples": len(walls.sample),
        "samples_failed": int((ds["status"].values == SampleStatus.FAILED).sum()),
        "curves_cross": int(_cross(columns)),
        "fragility_options": options_text(options),
        **more,
    }
    if walls.crossed:
        attrs["crossed"] = 1
    if walls.marks is not None:
        attrs["movements"] = walls.marks
    return curves_dataset(ds, columns, wanted, names, grid, name, attrs)


def _check(ds: xr.Dataset, model: str, band: str, confidence: float, intensity: str | None) -> str:
    """Check the arguments; return the name of the intensity."""
    if "status" in ds and not np.isin(ds["status"].values, SOLVED).any():
        raise InputError("the study has no finished sample yet; run `damagepred study` first.")
    for needed in ("damage_category", "status"):
        if needed not in ds:
            raise InputError(
                f"the dataset has no variable '{needed}'; fragility needs a study as open_study returns it."
            )
    for key, value, known in (("model", model, get_args(Model)), ("band", band, get_args(Bands))):
        if value not in known:
            raise InputError(f"{key} = {value!r}: must be one of {', '.join(known)}.")
    name = chosen_intensity(ds, intensity)
    if not 0 < confidence < 1:
        raise InputError(f"confidence = {confidence!r}: must lie between 0 and 1.")
    return name


def _curves(walls: StudyCapacities, request: _Request) -> tuple[dict[str, NDArray[Any]], dict[str, float]]:
    """Return the columns of the dataset, and its attributes that belong to all curves together."""
    kinds = range(len(request.categories))

    def of_each_category(found: Capacities) -> list[GroupedIntervals]:
        return [group_intervals(found.lower[k : k + 1], found.upper[k : k + 1], walls.weight) for k in kinds]

    columns = _counts(walls.capacities)
    alone = of_each_category(walls.capacities)
    options = request.options
    empirical = [_empirical(cells, walls.single, options) for cells in alone]
    columns["empirical"] = np.array([one.probability(request.grid) for one in empirical])
    if request.model == "empirical":
        return columns | _without_form(alone, walls, request), {}
    before, walls = walls.capacities.upper <= 0, walls._replace(capacities=without_damaged_at_start(walls.capacities))
    found = walls.capacities
    if before.any():
        alone = of_each_category(found)
        empirical = [_empirical(cells, walls.single, options) for cells in alone]
    common = request.model == "common"
    whole = group_intervals(found.lower, found.upper, walls.weight) if common else None
    fits = [
        Fit(np.nan, np.nan, why)
        for c in (alone if whole is None else [whole])
        for why in reasons_not_fitted(c, common, options)
    ]
    limits = [bands.unknown_band(len(request.grid)) for _ in kinds]
    share = np.full(len(limits), np.nan)
    for estimator, places in _parts(alone, whole, walls.single, request.options):
        for k, fit, limit, fitted in zip(places, *_with_bands(estimator, places, request)):
            fits[k], limits[k], share[k] = fit, limit, fitted
    columns |= _columns_of(fits, limits, request.grid)
    columns |= _failures(walls, fits, common, request) | _judged(fits, empirical, walls, request)
    columns["resamples_fitted"] = share
    columns["fit_note"] = np.array([_note(fits[k], alone[k], walls, share[k], common, request) for k in kinds])
    _add_start_share(columns, before, walls.weight, request.confidence)
    _end_where_walls_end(columns, walls.largest)
    return columns, _criteria(fits, walls, options)


def _add_start_share(
    columns: dict[str, NDArray[Any]], before: BoolArray, weight: FloatArray, confidence: float
) -> None:
    """Add the share of walls that reached a category before any movement: probability p0 + (1 - p0) Phi(...)."""
    start = [StartShare.of(row, weight, confidence) for row in before]
    columns["share_at_start"], columns["share_at_start_lower"], columns["share_at_start_upper"] = np.array(start).T
    for name in [name for name in columns if name.startswith("probability")]:
        columns[name] = np.array([p0.mixed(name, curve) for p0, curve in zip(start, columns[name])])
    notes = [
        f"{n} walls reached it before any movement; median and dispersion are of the others" if n else ""
        for n in before.sum(axis=1)
    ]
    columns["fit_note"] = np.array(["; ".join(filter(None, both)) for both in zip(notes, columns["fit_note"])])
    at_start = (columns["fit_status"] == NEVER) & before.any(axis=1)
    columns["fit_status"] = np.where(at_start, AT_START, columns["fit_status"])


def _end_where_walls_end(columns: dict[str, NDArray[Any]], largest: float) -> None:
    """Replace a median beyond the largest movement of the walls by NaN, with that movement as a lower bound."""
    found = BoundedMedian.of(columns["median"], columns["median_lower"], columns["median_upper"], largest)
    beyond = (columns["fit_status"] == FITTED) & np.isfinite(found.extrapolated)
    columns["fit_status"] = np.where(beyond, EXTRAPOLATED, columns["fit_status"])
    for name, value in found._asdict().items():
        columns["median" if name == "median" else f"median_{name}"] = value
    for end in ("undamaged", "damaged"):
        failed = columns[f"median_failed_{end}"]
        columns[f"median_failed_{end}"] = np.where(failed > largest * (1 + 1e-9), np.inf, failed)


def _counts(found: Capacities) -> dict[str, NDArray[Any]]:
    reached = np.isfinite(found.upper)
    return {
        "reached": reached.sum(axis=1),
        "not_reached": (~reached & ~found.failed).sum(axis=1),
        "failed": found.failed.sum(axis=1),
    }


def _parts(
    alone: list[GroupedIntervals], whole: GroupedIntervals | None, single: bool, options: FragilityOptions
) -> list[tuple[Estimator, list[int]]]:
    """Return the estimators, each with the places of its categories."""
    if whole is not None:
        return [(e, e.categories) for e in estimators(whole, True, single, options)]
    return [(e, [k]) for k, cells in enumerate(alone) for e in estimators(cells, options=options)]


def _with_bands(
    estimator: Estimator, places: list[int], request: _Request
) -> tuple[list[Fit], list[bands.Band], list[float]]:
    """Fit categories that share an estimator; return curves, bands and the share of resamples that could be fitted."""
    fits, none = estimator.fits(), [bands.unknown_band(len(request.grid))] * len(places)
    nothing = [np.nan] * len(places)
    if fits[0].status != FITTED:
        return fits, none, nothing
    count = effective_reached(estimator)
    possible = request.band != "profile" or bands.has_profile_band(estimator)
    if possible and _too_few(estimator.cells, count, request):
        return fits, none, nothing
    if request.band == "profile":
        return fits, [bands.profile_band(estimator, request.grid, request.confidence)], nothing
    if request.bootstrap == 0:
        return fits, none, nothing
    random = generator(request.seed, Stream.BOOTSTRAP, request.categories[places[0]])
    dependent = isinstance(estimator, CompositeLikelihood) and len(places) > 1
    if request.band == "bca" and not dependent and count < request.options.posterior_below:
        draws = sample_posterior(estimator, random)
        limits = [bands.posterior_band(draws, n, request.grid, request.confidence) for n in range(len(places))]
        return fits, limits, nothing
    again = resample(estimator, request.bootstrap, random)
    share = [len(again.replicates) / request.bootstrap] * len(places)
    if share[0] < request.options.fitted_share and bands.has_profile_band(estimator):
        # resamples without a fit lie to one side: the band of the others would be too narrow
        return fits, [bands.profile_band(estimator, request.grid, request.confidence)], share
    limits = [
        bands.resampled_band(request.band, again, n, request.grid, request.confidence, count)
        for n in range(len(places))
    ]
    return fits, limits, share


def _too_few(cells: GroupedIntervals, known: float, request: _Request) -> bool:
    """Whether the band of so few walls would cover the truth less often than its confidence."""
    if request.band != "bca":
        return known < request.options.fewest_resampled
    few = known < request.options.fewest_common or _effective(cells) < request.options.fewest_common_walls
    return request.model == "common" and few


def _effective(cells: GroupedIntervals) -> float:
    return effective_samples(np.repeat(cells.weight, cells.number))


def _columns_of(fits: list[Fit], limits: list[bands.Band], grid: FloatArray) -> dict[str, NDArray[Any]]:
    nothing = np.full(len(grid), np.nan)
    columns: dict[str, NDArray[Any]] = {
        "probability": np.array([f.probability(grid) if f.status == FITTED else nothing for f in fits]),
        "median": np.array([f.median for f in fits]),
        "dispersion": np.array([f.dispersion for f in fits]),
        "fit_status": np.array([f.status for f in fits]),
    }
    for name in bands.Band._fields:
        for end, word in enumerate(("lower", "upper")):
            columns[f"{name}_{word}"] = np.array([getattr(limit, name)[end] for limit in limits])
    return columns


def _empirical(
    cells: GroupedIntervals, single: bool, options: FragilityOptions, weight: FloatArray | None = None
) -> Npmle:
    lower, upper, weight = cells.lower[0], cells.upper[0], cells.total if weight is None else weight
    return isotonic(lower, upper, weight) if single else turnbull(lower, upper, weight, options=options)


def _without_form(alone: list[GroupedIntervals], walls: StudyCapacities, request: _Request) -> dict[str, NDArray[Any]]:
    """Return the empirical curves as the curves themselves, with percentile bands."""
    rows = []
    tails = [0.5 * (1 - request.confidence), 0.5 * (1 + request.confidence)]
    for k, cells in enumerate(alone):
        found = _empirical(cells, walls.single, request.options)
        random = generator(request.seed, Stream.BOOTSTRAP, request.categories[k])
        times = request.bootstrap if len(cells.number) <= request.options.one_step_groups or walls.single else 0
        drawn = (draw(cells, 1, random)[0] * cells.weight for _ in range(times))
        again = [_empirical(cells, walls.single, request.options, weight) for weight in drawn]
        row: dict[str, Any] = {"probability": found.probability(request.grid), "median": _middle(found)}
        curves = np.array([one.probability(request.grid) for one in again])
        medians = np.array([one.quantile(0.5) for one in again])
        ends = (
            _shares_between(row["probability"], curves, cells, request)
            if times > 1
            else [np.full(len(request.grid), np.nan)] * 2
        )
        for word, tail, end_ in zip(("lower", "upper"), tails, ends):
            row[f"probability_{word}"] = end_
            end = float(np.quantile(medians, tail, method="nearest")) if times > 1 else np.nan
            row[f"median_{word}"] = end if np.isfinite(end) else np.nan
            row[f"dispersion_{word}"] = np.nan
        row["median_lower_bound"] = np.nan if np.isfinite(row["median"]) else found.left[-1]
        reached = bool(np.isfinite(cells.upper).any())
        row |= {"dispersion": np.nan, "distance": np.nan, "p_value": np.nan, "resamples_fitted": float(times > 0)}
        row |= {"fit_note": "", "fit_status": EMPIRICAL if reached else NEVER}
        rows.append(row)
    columns = {key: np.array([row[key] for row in rows]) for key in rows[0]} if rows else {}
    for name, (lower, upper) in zip(("undamaged", "damaged"), _bounds(walls)):
        each = [group_intervals(lower[k : k + 1], upper[k : k + 1], walls.weight) for k in range(len(rows))]
        columns[f"median_failed_{name}"] = np.array(
            [_middle(_empirical(cells, walls.single, request.options)) for cells in each]
        )
    return columns


def _shares_between(
    best: FloatArray, curves: FloatArray, cells: GroupedIntervals, request: _Request
) -> list[FloatArray]:
    """Return pointwise Wilson limits of the empirical curve, for the number of walls with the resamples' variance.

    Where the resamples are all alike (no wall damaged, or all), it is the effective number of walls.
    """
    deviation = curves.std(axis=0, ddof=1)
    every = _effective(cells)
    equivalent = np.minimum(best * (1 - best) / np.maximum(deviation, 1e-12) ** 2, every)
    count = np.where((deviation > 0) & (equivalent > 0), equivalent, every)
    factor = normal_factor(request.confidence)
    ends = np.array([wilson(p, n, factor) for p, n in zip(np.clip(best, 0.0, 1.0), count)]).T
    return [np.where(np.arange(len(best)) == 0, best, end) for end in ends]


def _middle(found: Npmle) -> float:
    """Return the median movement, NaN where less than half of the walls reach the category."""
    median = found.quantile(0.5)
    return median if np.isfinite(median) else np.nan


def _bounds(walls: StudyCapacities) -> list[tuple[FloatArray, FloatArray]]:
    """Return the intervals with all failed walls undamaged to the end, and with all damaged where they failed."""
    found = walls.capacities
    if walls.single:
        following = np.broadcast_to(found.end, found.lower.shape)
    elif walls.marks is not None:
        following = walls.marks[np.minimum(np.searchsorted(walls.marks, found.lower, side="right"), walls.increments)]
    else:
        following = found.lower + found.end / walls.increments
    undamaged = np.where(found.failed, found.end, found.lower), found.upper
    return [undamaged, (found.lower, np.where(found.failed, np.maximum(following, found.lower), found.upper))]


def _failures(walls: StudyCapacities, fits: list[Fit], common: bool, request: _Request) -> dict[str, NDArray[Any]]:
    """Return medians and curves with all failed walls undamaged, and with all damaged."""
    columns: dict[str, NDArray[Any]] = {}
    grid, options = request.grid, request.options
    for name, (lower, upper) in zip(("undamaged", "damaged"), _bounds(walls)):
        again = fits
        if walls.capacities.failed.any():
            if common:
                again = fit_grouped(group_intervals(lower, upper, walls.weight), True, walls.single, options)
            else:
                rows = (group_intervals(lower[k : k + 1], upper[k : k + 1], walls.weight) for k in range(len(fits)))
                again = [fit_grouped(cells, options=options)[0] for cells in rows]
        columns[f"median_failed_{name}"] = np.array([f.median for f in again])
        if walls.capacities.failed.any():
            curves = [f.probability(grid) if f.status == FITTED else np.full(len(grid), np.nan) for f in again]
            columns[f"probability_failed_{name}"] = np.array(curves)
    return columns


def _judged(
    fits: list[Fit], empirical: list[Npmle], walls: StudyCapacities, request: _Request
) -> dict[str, NDArray[Any]]:
    """Return the distances of the curves from the empirical ones, and the p-values of their misfit."""
    gap, chance = np.full(len(fits), np.nan), np.full(len(fits), np.nan)
    for k, fit in enumerate(fits):
        if fit.status != FITTED:
            continue
        gap[k] = goodness.distance(fit, empirical[k])
        random = generator(request.seed, Stream.GOODNESS, request.categories[k])
        chance[k] = goodness.p_value(fit, walls, k, request.goodness, random, request.options)
    return {"distance": gap, "p_value": chance}


def _criteria(fits: list[Fit], walls: StudyCapacities, options: FragilityOptions) -> dict[str, float]:
    """Return Akaike's criterion of separate dispersions and of a common one, of the categories that have curves."""
    good = [k for k, fit in enumerate(fits) if fit.status == FITTED]
    if len(good) < 2:
        return {}
    some = slice(None, None, -(-len(walls.weight) // options.criterion_walls))
    lower, upper = walls.capacities.lower[good, some], walls.capacities.upper[good, some]
    cells = group_intervals(lower, upper, walls.weight[some])
    return {
        "aic_separate": goodness.akaike_criterion(cells, False, options),
        "aic_common": goodness.akaike_criterion(cells, True, options),
        "aic_walls": lower.shape[1],
    }


def _note(
    fit: Fit, cells: GroupedIntervals, walls: StudyCapacities, share: float, common: bool, request: _Request
) -> str:
    """Return cautions for the reader of a curve."""
    if fit.status != FITTED:
        return ""
    reached = np.isfinite(cells.upper[0])
    count = int(cells.number[reached].sum())
    at_once = int(cells.number[reached & (cells.lower[0] == 0)].sum())
    notes = []
    if count < request.options.caution_below:
        notes.append(f"rests on {count} walls that reached it")
    if request.bootstrap and _too_few(
        cells, effective_reached(CompositeLikelihood([0], cells, request.options)), request
    ):
        instead = "separate curves" if request.band == "bca" else "bca"
        notes.append(f"no band: of so few walls it would be too narrow; take {instead}")
    if fit.median > walls.largest:
        notes.append("its median lies beyond the study's movement")
    if not walls.single and at_once > 0.5 * count:
        notes.append(f"{at_once} of {count} walls reached it in the first increment: refine the increments")
    if share < request.options.fitted_share:
        by_profile = bands.profile_is_defined(1 + common, walls.weight)
        what = "is by profile likelihood" if by_profile else "is too narrow"
        notes.append(f"only {share:.0%} of the resamples could be fitted: its band {what}")
    return "; ".join(notes)


def _cross(columns: dict[str, NDArray[Any]]) -> bool:
    """Whether a worse category is anywhere more probable than a lesser one."""
    fitted = [p for p, s in zip(columns["probability"], columns["fit_status"]) if s in (*WITH_CURVE, EMPIRICAL)]
    return any(bool((worse > lesser + 1e-9).any()) for lesser, worse in itertools.pairwise(fitted))
