"""Dataset of a posterior: movement, causes, future damage, history and crack maps."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr
from scipy import special

from damagepred.analyses.inference_options import InferenceOptions
from damagepred.analyses.posterior_states import States
from damagepred.analyses.posterior_tables import LARGEST_ODDS, UNCERTAIN
from damagepred.analyses.stored_walls import StoredWalls
from damagepred.arrays import FloatArray, IntArray
from damagepred.results.house import wall_places
from damagepred.scene.scene import archived_scene
from damagepred.uq.capacity import highest_category, sampled
from damagepred.uq.estimate import effective_samples
from damagepred.uq.history import years_from
from damagepred.uq.observations import Observations

_MOVED_BY = {
    "central_deflection": ("movement", "central_deflection"),
    "surface_movement": ("mound", "surface_movement"),
    "settlement": ("movement", "settlement"),
}
"""Table and key of a scene with the largest value of a measure."""

DATES = 61  # dates of the drawn movement


def movement_cdf(walls: StoredWalls, weight: FloatArray, points: FloatArray) -> FloatArray:
    """Posterior distribution function of the movement at some points, uniform between the edges of each increment."""
    used = weight > 1e-12 * max(weight.max(), 1e-300)
    low, high, heavy = walls.edges[:, :-1][used], walls.edges[:, 1:][used], weight[used]
    width = np.maximum(high - low, 1e-300)
    return np.array([heavy @ np.clip((x - low) / width, 0.0, 1.0) for x in points]) / max(heavy.sum(), 1e-300)


def _reached(
    walls: StoredWalls, rows: IntArray, heavy: FloatArray, target: FloatArray, highest: int
) -> tuple[FloatArray, FloatArray, FloatArray, float]:
    """Probability of each category or worse at movements of weighted walls, its bounds, and the share known there."""
    category = walls.ds["damage_category"].values
    increment = np.nanargmin(np.abs(walls.movement[rows] - target[:, None]), axis=1)
    # the nearest increment, unless the path ends before the movement
    has_result = (target <= walls.edges[rows, -1] * (1 + 1e-9)) & (category[rows, increment] >= 0)
    worst = np.maximum(category.max(axis=1), 0)[rows]
    reached = np.where(has_result, category[rows, increment], worst)[:, None] >= np.arange(1, highest + 1)
    known = float(heavy[has_result].sum())
    among = heavy[has_result] @ reached[has_result] / known if known else np.full(highest, np.nan)
    return among, heavy @ reached, heavy @ (reached | ~has_result[:, None]), known


def _probabilities(name: str, dim: str, chances: Sequence[tuple[Any, ...]]) -> xr.Dataset:
    """Probabilities of categories with their bounds, one row for each value of a dimension."""
    *values, known = zip(*chances)
    ends = dict(zip(("", "_lower", "_upper"), values))
    found = {f"{name}_probability{end}": ((dim, "category"), np.array(v), {"units": "1"}) for end, v in ends.items()}
    return xr.Dataset({**found, f"{name}_known": (dim, np.array(known), {"units": "1"})})


def _unknown(highest: int) -> tuple[Any, ...]:
    return (*np.full((3, highest), np.nan), 0.0)


def _future(walls: StoredWalls, weight: FloatArray, options: InferenceOptions, highest: int) -> xr.Dataset:
    """Probability of each category or worse after further movement, on (further, category)."""
    rows, columns = np.nonzero(weight > 0)
    heavy, now = weight[rows, columns] / max(weight.sum(), 1e-300), walls.movement[rows, columns]
    targets = [now + share * walls.largest for share in options.further]
    chances = [_reached(walls, rows, heavy, to, highest) if len(rows) else _unknown(highest) for to in targets]
    return _probabilities("future", "further", chances)


def over_time(
    walls: StoredWalls, seen: Observations, states: States, options: InferenceOptions, highest: int
) -> xr.Dataset:
    """Rate, kind of history, and movement at dates before and after the last visit, with categories; of one study."""
    last, kinds = seen.dates[-1], seen.prior.kind
    until = seen.prior.forecast_dates(last)
    end, first = years_from(last, [until[-1], seen.dates[0]])
    dates = np.unique([*np.linspace(first - max(0.25 * (end - first), 1.0), end, DATES), *years_from(last, seen.dates)])
    year, units = np.timedelta64(round(365.25 * 86400), "s"), f"{walls.units} year-1"
    days = {"until": until, "visit": seen.dates}
    coordinates: dict[str, Any] = {name: np.array(values, dtype="datetime64[ns]") for name, values in days.items()}
    coordinates["date"] = (np.datetime64(last, "s") + dates * year).astype("datetime64[ns]")
    if states.drawn is None:
        rate, kind, paths = np.full(1, np.nan), np.full(len(kinds), np.nan), np.full((1, len(dates)), np.nan)
        later, chances = np.full((1, len(until)), np.nan), [_unknown(highest)] * len(until)
    else:
        rows, columns, draw = states.drawn
        place = np.random.default_rng(0).random(len(rows))  # anywhere between the edges of the increment
        now = walls.edges[rows, columns] + place * (walls.edges[rows, columns + 1] - walls.edges[rows, columns])
        rate, share = now * states.past.slope[draw], np.full(len(rows), 1.0 / len(rows))
        kind = np.bincount(states.past.kind[draw].astype(np.int64), minlength=len(kinds)) / len(draw)
        paths = now[:, None] * states.past.at(dates)[1][draw]
        reached, moved, _ = states.past.at(years_from(last, until))
        later = now[:, None] * moved[draw]
        chances = [_reached(walls, rows, share, now * each, highest) for each in reached[draw].T]
    alone = np.full((len(seen.dates), len(options.quantiles)), np.nan)
    for row, log in zip(alone, states.visits):
        if log is not None and np.isfinite(log).any():
            row[:] = _quantiles(walls, np.exp(log - special.logsumexp(log)), options)
    of = {"units": walls.units}
    return (
        _probabilities("forecast", "until", chances)
        .assign(
            history_posterior=("kind", kind, {"units": "1"}),
            rate_quantile=("quantile", np.quantile(rate, options.quantiles), {"units": units}),
            forecast_quantile=(("until", "quantile"), np.quantile(later, options.quantiles, axis=0).T, of),
            history_quantile=(("date", "quantile"), np.quantile(paths, options.quantiles, axis=0).T, of),
            visit_quantile=(("visit", "quantile"), alone, of),
        )
        .assign_coords(kind=list(kinds), **coordinates)
    )


def _quantiles(walls: StoredWalls, weight: FloatArray, options: InferenceOptions) -> FloatArray:
    """Quantiles of the movement."""
    grid = np.linspace(0.0, walls.largest, 1001)
    cdf = movement_cdf(walls, weight, grid)
    return np.interp(options.quantiles, cdf, grid) if cdf[-1] > 0 else np.full(len(options.quantiles), np.nan)


def _path_end(
    walls: StoredWalls, weight: FloatArray, quantiles: FloatArray, future: xr.Dataset, options: InferenceOptions
) -> tuple[float, str]:
    """Share of the posterior at the end of the paths, and advice on longer paths ("" if not needed)."""
    end = np.fmax.reduce(walls.edges, axis=1)
    at_end = (walls.edges[:, 1:] >= end[:, None] * (1 - 1e-9)) & (weight > 0)
    cut = float(weight[at_end].sum())
    ahead = [name for name in ("future", "forecast") if f"{name}_known" in future]
    doubt = max(float((future[f"{n}_probability_upper"] - future[f"{n}_probability_lower"]).max()) for n in ahead)
    if not max(doubt, cut) > UNCERTAIN or not weight.any():
        return cut, ""
    shown = walls.shown
    longest = end >= walls.largest * (1 - 1e-9)
    if weight[~longest].sum() > 0.5 * weight.sum():
        return cut, (
            f'follow samples further, with stop_at_category = "none" under [study]: most of them end before '
            f"{shown.factor * walls.largest:.3g} {shown.unit} (damage category reached, own movement, or failure)"
        )
    farthest = quantiles[-1] + max(options.further) * walls.largest
    if "forecast_quantile" in future:
        farthest = max(farthest, float(future["forecast_quantile"].max()))
    target = float(f"{farthest:.2g}")
    advice = f"run samples to {shown.factor * target:.3g} {shown.unit}"
    settings, more = walls.settings, f"{walls.name}_farther"
    table, key = _MOVED_BY.get(walls.measure, ("", ""))
    movement = settings.scene.movement
    further = settings.scene.soil_layer or getattr(settings.scene, "source", ())
    if not table or movement.stage or further or f"{table}.{key}" in settings.variables:
        return cut, f"{advice} in a separate study, and infer from it"
    count = round(movement.increment_count * target / walls.largest)
    return cut, (
        f"{advice}: sed -e 's/^{key} = .*/{key} = {target:g}/' -e 's/^increments = .*/increments = {count}/' "
        f"{walls.path.name}/study.toml > {more}.toml && damagepred study {more}.toml, and infer from {more}.dp"
    )


def posterior_dataset(
    studies: Sequence[StoredWalls],
    seen: Observations,
    options: InferenceOptions,
    weights: Sequence[FloatArray],
    cause: FloatArray,
    prior: FloatArray,
    evidence: FloatArray,
    states: Sequence[States],
) -> xr.Dataset:
    """Dataset of the posterior of some studies."""
    misfits, replayed = np.array([each.misfit for each in states]), [each.replayed for each in states]
    steps, among = max(weight.shape[1] for weight in weights), special.softmax(np.log(prior[:-1]) + evidence[:-1])
    highest = min(highest_category(walls.ds) for walls in studies)
    units = {walls.units for walls in studies}
    unit = {"units": units.pop()} if len(units) == 1 else {"comment": "in movement_units of each study"}
    values: dict[str, Any] = {"posterior": [], "movement": []}
    quantiles, futures = [], []
    for walls, weight, share, each in zip(studies, weights, among, states):
        pad = ((0, 0), (0, steps - weight.shape[1]))
        values["posterior"].append(np.pad(share * weight, pad))
        values["movement"].append(np.pad(walls.movement, pad, constant_values=np.nan))
        quantiles.append(_quantiles(walls, weight, options))
        futures.append(_future(walls, weight, options, highest))
        if seen.dates:
            futures[-1] = futures[-1].merge(over_time(walls, seen, each, options, highest))
    effective = np.array([min(effective_samples(w.sum(axis=1)), each.effective) for w, each in zip(weights, states)])
    resemblance = special.chdtrc(seen.count, misfits.sum(axis=1))
    usable = (effective >= options.fewest_effective) & (resemblance >= options.resemblance)
    with np.errstate(divide="ignore"):
        odds = np.clip(cause / (1.0 - cause), 1.0 / LARGEST_ODDS, LARGEST_ODDS)
    usable = np.append(usable, usable.any())
    cut, advice = zip(*(_path_end(*args, options) for args in zip(studies, weights, quantiles, futures)))
    state, origins = ("sample", "increment"), seen.discrepancy.origins()
    ds = xr.Dataset(
        {
            "posterior": (state, np.concatenate(values["posterior"]), {"units": "1"}),
            "movement": (state, np.concatenate(values["movement"]), unit),
            **{
                f"{who}_{name}": (dims, value[some], {"units": "1"})
                for name, value in (("prior", prior), ("posterior", cause))
                for who, dims, some in (("cause", "study", slice(-1)), ("another_cause", (), -1))
            },
            "posterior_odds": ("study", np.where(usable, odds, np.nan)[:-1], {"units": "1"}),
            "another_cause_odds": ((), odds[-1] if usable[-1] else np.nan, {"units": "1"}),
            "log_evidence": ("study", evidence[:-1], {"units": "1"}),
            "effective_samples": ("study", effective, {"units": "1"}),
            "replayed": ("study", np.array(replayed), {"units": "1"}),
            "least_misfit": ("study", misfits.sum(axis=1), {"units": "1"}),
            "misfit_of_observation": (("study", "observation"), misfits, {"units": "1"}),
            "resemblance": ("study", resemblance, {"units": "1", "long_name": "probability of a larger misfit"}),
            "resembles": (
                "study",
                (resemblance >= options.resemblance).astype(np.int8),
                {"flag_values": np.array([0, 1], dtype=np.int8), "flag_meanings": "no yes"},
            ),
            "movement_cut": ("study", np.array(cut), {"units": "1"}),
            "advice": ("study", list(advice)),
            "movement_quantile": (("study", "quantile"), np.array(quantiles), unit),
            "movement_measure": ("study", [walls.measure for walls in studies]),
            "movement_words": ("study", [walls.shown.words for walls in studies]),
            "movement_units": ("study", [walls.units for walls in studies]),
            "study_scene": ("study", [str(walls.ds.attrs["scene"]) for walls in studies]),
            "movement_largest": ("study", [walls.largest for walls in studies], unit),
            "study_of_sample": ("sample", np.repeat(np.arange(len(weights)), [len(w) for w in weights])),
            "sample_in_study": ("sample", np.concatenate([np.arange(len(w)) for w in weights])),
        },
        {
            "study": [walls.name for walls in studies],
            "observation": seen.names,
            "quantile": list(options.quantiles),
            "further": ("further", list(options.further), {"units": "1"}),
            "category": np.arange(1, highest + 1),
        },
        {
            "title": "back-analysis",
            **sampled(studies[0].ds),
            "observations": seen.count,
            "discrepancy_points": options.discrepancy_points,
            "fewest_effective": options.fewest_effective,
            "least_resemblance": options.resemblance,
            **{f"discrepancy_{name}": getattr(seen.discrepancy, name) for name in origins},
            **{f"discrepancy_interval_{name}": interval for name, (interval, _) in origins.items()},
            **{f"discrepancy_confidence_{name}": confidence for name, (_, confidence) in origins.items()},
        },
    )
    ds = ds.merge(xr.concat(futures, "study"))
    if any(replayed):
        ds = ds.assign(_crack_maps(studies, weights, options))
    last = [(table, series[-1]) for table, series in seen.series if series[-1].since is None]
    local = [crack for table, crack in last if table == "crack" and crack.x is not None]
    on_map = dict(zip(studies[0].walls, wall_places(archived_scene(studies[0].ds.attrs))))
    places = [(*(on_map[c.wall] + c.place), c.width or c.wider_than or c.narrower_than or 0.0) for c in local]
    if places:
        names = ("observed_x", "observed_y", "observed_width")
        ds = ds.assign({name: ("observed", np.array(v), {"units": "m"}) for name, v in zip(names, zip(*places))})
        ways = [">" if crack.wider_than else "<" if crack.narrower_than else "" for crack in local]
        ds = ds.assign(observed_limit=("observed", ways))
    if levels := [level for table, level in last if table == "level"]:
        points = [[on_map[wall] + (x, y) for wall, x, y in each.ends] for each in levels]
        ends = np.column_stack((np.reshape(points, (-1, 4)), [each.difference for each in levels])).T
        parts = ("x", "y", "to_x", "to_y", "difference")
        ds = ds.assign({f"level_{part}": ("level", v, {"units": "m"}) for part, v in zip(parts, ends)})
    return ds


def _crack_maps(
    studies: Sequence[StoredWalls], weights: Sequence[FloatArray], options: InferenceOptions
) -> dict[str, tuple[Any, ...]]:
    """Probability that a crack runs through each cell of the elevation, for each study, and middles of the cells."""
    scenes, cell = [archived_scene(study.ds.attrs) for study in studies], options.map_cell
    places = [wall_places(scene) for scene in scenes]
    ends = np.concatenate([p + [(s.wall.length, s.wall.height) for s in c.scenes] for p, c in zip(places, scenes)])
    low = min(float(place[:, 1].min()) for place in places)
    columns, rows = (max(1, int(np.ceil(end / cell))) for end in ends.max(axis=0) - (0.0, low))
    shape = rows, columns
    limits = options.map_width, shape, options.negligible
    walls = zip(studies, weights, places)
    maps = [each.crack_map(weight, cell, *limits, place - (0.0, low)) for each, weight, place in walls]
    middle = [start + (np.arange(n) + 0.5) * cell for start, n in zip((low, 0.0), shape)]
    return {
        "crack_probability": (("study", "map_y", "map_x"), np.array(maps), {"wider_than": options.map_width}),
        "map_y": ("map_y", middle[0], {"units": "m"}),
        "map_x": ("map_x", middle[1], {"units": "m"}),
    }
