"""Judging an archive again, under another damage table or other rules, without solving anything."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from damagepred.archive.schema import (
    BY_WALL,
    CATEGORIES,
    CATEGORY_VARIABLES,
    FLAG_FILL,
    VARIABLES,
    WORST_CATEGORY,
    name_categories,
    require,
)
from damagepred.arrays import BoolArray, FloatArray, Int8Array
from damagepred.damage import HAIRLINE, DamageTable, deviation_limits, load_table, read_table, sticking_limits
from damagepred.damage.deviation import largest_distortion
from damagepred.damage.joints import JointMap
from damagepred.damage.judge import Rules, Verdict, judge
from damagepred.damage.table import OWN_MEASURES, STATE_TAKES, TABLES
from damagepred.enumerations import ContactKind, ContactState, PathStatus, SampleStatus
from damagepred.errors import InputError
from damagepred.inputs.arguments import checked
from damagepred.inputs.input_files import read_toml
from damagepred.results.house import is_house, noun, of_all_walls, wall_dataset, wall_names
from damagepred.runtime.one_thread import one_blas_thread
from damagepred.scene import Damage
from damagepred.scene.described import build
from damagepred.uq.capacity import sample_weights


@checked
@one_blas_thread()
def judge_again(
    ds: xr.Dataset,
    *,
    table: str | Path | DamageTable | None = None,
    plasterboard: bool | None = None,
    count_rule: bool | None = None,
    group_distance: float | None = None,
    group_count: int | None = None,
    dpc_threshold: float | None = None,
    measure: str | None = None,
    band_gauge: float | None = None,
    band_threshold: float | None = None,
    footing_threshold: float | None = None,
    count_footing_gap: bool | None = None,
) -> xr.Dataset:
    """Judge a wall or a study again; rules that are not given stay as in the archive.

    A wall with its contacts is judged from these, by all rules. Of a study, which keeps a few numbers a wall, the
    widest crack and the widest group of 2 to 5 cracks are compared with the new limits, which comes to the same; the
    distance within which cracks make a group, and the opening from which the dpc counts as separated, are those it was
    run with. A path that ended at the last category of interest is not known beyond its end, unless it has reached the
    new table's highest category there: its category is -1 from there on, and ``highest_category`` is lowered to what
    all paths were followed to.

    Parameters
    ----------
    ds : xarray.Dataset
        As ``damagepred.solve``, ``open_study`` or ``read_dataset`` return it; not changed. Of a house all walls.
    table : {"as2870", "bre251"}, path or DamageTable, optional
        Limits; a path that ends in .toml names a file like the tables in ``data/damage``.
    plasterboard : bool, optional
        Whether the limits are raised for plasterboard.
    count_rule : bool, optional
        Whether groups of cracks count.
    group_distance, dpc_threshold, band_gauge, band_threshold, footing_threshold : float, optional
        See ``damagepred.scene.Damage`` (m); of a wall with its contacts only.
    group_count : int, optional
        Cracks that make a group; of a study 2 to 5.
    measure : {"joint", "band"}, optional
        Width that makes the category: of the widest crack (one joint) or crack band.
    count_footing_gap : bool, optional
        Whether a gap along the footing bed counts as a crack of a wall without a dpc.

    Returns
    -------
    xarray.Dataset
        With the new ``damage_category`` and its attributes, ``damage_category_band`` where the widths of crack bands
        are known, ``deviation_level`` and ``opening_sticking`` where their
        measures are archived, and the attribute ``judgement``, which names rules without archived values.

    Raises
    ------
    InputError
        If it is neither a wall nor a study, there is no such table, or the archive lacks the values of a rule.

    Examples
    --------
    >>> import damagepred
    >>> ds = damagepred.open_study("house.dp")
    >>> by_band = damagepred.judge_again(ds, measure="band")
    >>> bool((by_band["damage_category"] >= ds["damage_category"]).all())
    True
    """
    require(ds, ("damage_category", "crack_width_max"), "a wall or a study")
    own = archived_rules(ds)
    wanted: dict[str, Any] = {"count_rule": count_rule, "group_distance": group_distance, "group_count": group_count}
    wanted |= {"dpc_threshold": dpc_threshold, "footing_threshold": footing_threshold, "measure": measure}
    wanted |= {"band_gauge": band_gauge, "band_threshold": band_threshold, "count_footing_gap": count_footing_gap}
    given = {name: value for name, value in wanted.items() if value is not None}
    validated = Damage(**given)
    rules = own._replace(table=_table(own, table, plasterboard), **{name: getattr(validated, name) for name in given})
    judged = ds.copy()
    notes: list[str] = []
    if "contact_opening" not in ds:
        notes = _judge_numbers(judged, own, rules)
    elif not is_house(ds):
        _judge_wall(judged, rules)
    if is_house(ds):
        alike: dict[str, Any] = {"table": table, "plasterboard": plasterboard, **given}
        # the results of each wall; a house with its contacts then has the largest of all walls
        parts = [judge_again(wall_dataset(ds, name), **alike) for name in wall_names(ds)]
        results = [{name: part[name].values for name in BY_WALL if name in part} for part in parts]
        for name, value in of_all_walls(results).items():
            if name.startswith("wall_") or "contact" in ds.dims:
                short, variable = name.removeprefix("wall_"), VARIABLES[name]
                attributes = next((part[short].attrs for part in parts if short in part), variable.attributes())
                dims = ("sample", *variable.dims) if "sample" in ds.dims else variable.dims
                judged[name] = (dims, value, attributes | {"long_name": variable.long_name})
    name_categories(judged, rules.table.category_names, f"{rules.table.name}; {rules.table.source}")
    notes += _levels(judged)
    judged.attrs["damage_table"] = rules.table.name
    judged.attrs["damage_limits"] = json.dumps(asdict(rules.table))
    judged.attrs["damage_measure"] = rules.measure
    judged.attrs["count_footing_gap"] = int(rules.count_footing_gap)
    judged.attrs["judgement"] = "; ".join([f"judged again by {rules.table.name}", *notes])
    return judged


def archived_rules(ds: xr.Dataset) -> Rules:
    """Return the rules that an archive was judged by; without a scene in it, the defaults."""
    rules = Rules.from_settings(**asdict(Damage(**tomllib.loads(str(ds.attrs.get("scene", ""))).get("damage", {}))))
    if "damage_measure" in ds.attrs:  # judged again
        counted = bool(int(ds.attrs["count_footing_gap"]))
        rules = rules._replace(measure=str(ds.attrs["damage_measure"]), count_footing_gap=counted)
    name = ds.attrs.get("damage_table", rules.table.name)
    plain = [load_table(name) for name in TABLES]
    if limits := ds.attrs.get("damage_limits"):  # judged again
        return rules._replace(table=DamageTable.from_json(str(limits)))
    known = [rules.table, *plain, *(one.with_plasterboard() for one in plain if one.plasterboard_factor is not None)]
    return rules._replace(table=next((one for one in known if one.name == name), rules.table))


def _table(own: Rules, table: str | Path | DamageTable | None, plasterboard: bool | None) -> DamageTable:
    """Return the limits of the new judgement."""
    if table is None and plasterboard is None:
        return own.table
    if isinstance(table, DamageTable):
        plain = table
    elif table is not None and str(table).endswith(".toml"):  # or own states, as a scene has them under [damage]
        content = read_toml(table)
        given = content.get("damage", content)
        if isinstance(given, dict) and "state" in given:
            states = {key: value for key, value in given.items() if key in ("state", "function")}
            plain = Rules.from_settings(**asdict(build(Damage, states, str(table)))).table
        else:
            plain = read_table(table)
    elif table is not None:
        plain = load_table(str(table))
    elif own.table.measures:
        raise InputError("plasterboard: own damage states have no such allowance; leave it out, or give a table.")
    else:
        plain = next(t for t in map(load_table, TABLES) if own.table.name.startswith(t.name))
    eased = own.table.name != plain.name and own.table.name.startswith(plain.name)
    wanted = eased if plasterboard is None else plasterboard
    return plain.with_plasterboard() if wanted else plain


# -- one wall, from its contacts -------------------------------------------------------------------------------------


def _judge_wall(ds: xr.Dataset, rules: Rules) -> None:
    joints = JointMap.from_dataset(ds, with_blocks=True)
    shape = joints.contact_x.shape
    opening, slip, state = (ds[f"contact_{name}"].values for name in ("opening", "slip", "state"))
    distortion = _stored(ds, "", ("opening_distortion",))["opening_distortion"]
    verdicts = [
        judge(joints, o.reshape(shape), s.reshape(shape), c.reshape(shape), rules, d)
        for o, s, c, d in zip(opening, slip, state == ContactState.CRACKED, distortion)
    ]
    values = {name: np.array([getattr(v, name) for v in verdicts]) for name in Verdict._fields}
    for name in CATEGORY_VARIABLES:
        values[name] = values[name].astype(np.int8)
        if _collapsed(ds):
            first = int(ds.attrs.get("collapse_increment", ds.sizes["increment"] - 1))
            values[name][first:] = rules.table.highest
    for name, value in values.items():
        variable = VARIABLES[name]
        if name in ds or variable.dims == ("increment",):  # archives of older versions lack some, contacts hold them
            ds[name] = (variable.dims, value, ds[name].attrs if name in ds else variable.attributes())
    if "crack_width_worst" in ds:
        ds["crack_width_worst"].values[:] = np.maximum.accumulate(ds["crack_width_max"].values)
    for name, more in rules.attributes().items():
        if name in ds:
            ds[name].attrs.update(more)
    _worst_so_far(ds)


def _stored(ds: xr.Dataset, prefix: str, names: Sequence[str]) -> dict[str, FloatArray]:
    """Archived values by variable, of the shape of the category; distortion: the largest of all openings."""
    shape, values = ds[f"{prefix}damage_category"].shape, {}
    for name in names:
        if name == "opening_distortion" and "opening" not in ds.sizes:
            values[name] = np.zeros(shape)
        elif f"{prefix}{name}" in ds:
            found = np.asarray(ds[f"{prefix}{name}"].values, dtype=np.float64)
            values[name] = largest_distortion(found) if name == "opening_distortion" else found
    return values


def _worst_so_far(ds: xr.Dataset) -> list[str]:
    """Worst category of a history up to each increment; returns the variables left out."""
    if WORST_CATEGORY not in ds:
        return []
    if "increment" not in ds[WORST_CATEGORY].dims:
        del ds[WORST_CATEGORY]
        return [f"{WORST_CATEGORY} is left out: the archive holds the end of each movement alone"]
    was, category = ds[WORST_CATEGORY], ds["damage_category"].values
    found = np.where(category < 0, FLAG_FILL, np.maximum.accumulate(category, axis=-1))
    ds[WORST_CATEGORY] = (was.dims, found.astype(np.int8), was.attrs)
    return []


# -- a study, from the numbers it keeps ------------------------------------------------------------------------------


def _judge_numbers(ds: xr.Dataset, own: Rules, rules: Rules) -> list[str]:
    _require_stored(ds, own, rules)
    notes: list[str] = []
    before = ds.copy()
    for prefix in ("", "end_"):
        for name in CATEGORY_VARIABLES:
            if f"{prefix}{name}" in ds and f"{prefix}crack_width_max" in ds:
                if prefix and rules.table.rules != own.table.rules and _lacking(ds, prefix, rules):
                    del ds[f"{prefix}{name}"]
                    notes.append(f"{prefix}{name} is left out: the archive has these measures along the path alone")
                    continue
                found = _judge_columns(ds, before, prefix, name, own, rules)
                notes += found if name == "damage_category" else []
    notes += _worst_so_far(ds)
    if "crack_band_width_max" not in ds:
        notes.append("no crack bands: the archive does not hold their widths; replay solves a wall of it again")
    if "footing_opening_max" not in ds:
        notes.append("no gap along the footing bed: the archive does not hold it")
    if "crack_count" in ds and rules.table.counted_width != own.table.counted_width:
        del ds["crack_count"]
        notes.append("crack_count is left out: it counts cracks of another width")
    return notes


def _lacking(ds: xr.Dataset, prefix: str, rules: Rules) -> list[str]:
    """Archive variables that own states need and a dataset lacks."""
    needed = [OWN_MEASURES[measure] for measure, _ in rules.table.measures if measure != "value"]
    return [name for name in needed if name not in _stored(ds, prefix, needed)]


def _require_stored(ds: xr.Dataset, own: Rules, rules: Rules) -> None:
    """Refuse rules that need variables, or readings of them, which the archive does not hold."""
    if lacking := _lacking(ds, "", rules):
        raise InputError(f"states: this archive, of an older version, does not hold {', '.join(lacking)}.")
    if dict(rules.table.measures).get("count") and rules.table.counted_width != own.table.counted_width:
        raise InputError(
            f"states: count is of cracks of {1e3 * rules.table.counted_width:g} mm or more, and this archive counts "
            f"cracks of {1e3 * own.table.counted_width:g} mm; run the study with the states in [damage]."
        )
    for name in ("group_distance", "dpc_threshold", "band_gauge", "band_threshold", "footing_threshold"):
        if (wanted := getattr(rules, name)) != (archived := getattr(own, name)):
            raise InputError(
                f"{name} = {wanted:g}: this archive was judged with {archived:g} m and does not hold what another "
                "takes; a wall with its contacts does (solve -o, replay -o)."
            )
    for wanted, name, what in (
        (rules.measure == "band", "crack_band_width_max", "measure = 'band'"),
        (rules.count_footing_gap, "footing_opening_max", "count_footing_gap = true"),
    ):
        if wanted and not {name, f"end_{name}"} & {str(n) for n in ds.variables}:
            raise InputError(
                f"{what}: this archive, of an older version, does not hold {name}; run the study again, or judge walls "
                "of it with their contacts (replay -o)."
            )
    counts = ds["group_count"].values.tolist() if "group_count" in ds.variables else []
    count = rules.group_count
    if rules.count_rule and counts and count not in counts:
        raise InputError(f"group_count = {count}: this archive holds groups of {', '.join(map(str, counts))} cracks.")


def _judge_columns(ds: xr.Dataset, before: xr.Dataset, prefix: str, name: str, own: Rules, rules: Rules) -> list[str]:
    """Judge a study's paths, or the ends of its movements, again: one of the two categories."""
    by_band = name == "damage_category_band" or rules.measure == "band"
    was = before[f"{prefix}{name}"]
    same_limits, own = own.table.rules == rules.table.rules, own._replace(table=rules.table)
    same, other = same_limits and own == rules, same_limits and own == rules._replace(measure="joint")
    if (by_band or rules.table.measures) and (same or other):
        # found along the path itself; bands are never narrower than joints, so no path ended before it was known
        kept = before.get(f"{prefix}damage_category_band", was)
        ds[f"{prefix}{name}"] = (was.dims, kept.values.copy(), was.attrs)
        return []
    many = "sample" in was.dims
    rows = was.sizes["sample"] if many else 1
    old = was.values.reshape(rows, -1)
    width = _widths(ds, prefix, by_band, rules).reshape(old.shape)
    known, without_group = np.isfinite(width), 0
    if rules.table.measures:  # values that own states need; widths with the gap under the footing if it counts
        stored = _stored(before, prefix, STATE_TAKES)
        stored |= {f"crack_{kind}width_max": _widths(before, prefix, bool(kind), rules) for kind in ("", "band_")}
        new = rules.table.by_measures({key: value.reshape(old.shape) for key, value in stored.items()})
    else:
        group = np.full((rows, 1), np.nan if rules.count_rule else 0.0)  # width of the widest group that counts
        if rules.count_rule and f"{prefix}crack_group_width" in ds:
            position = int(np.flatnonzero(ds["group_count"].values == rules.group_count)[0])
            group = ds[f"{prefix}crack_group_width"].values[..., position].reshape(old.shape)
        without_group = int((known & np.isnan(group)).any(axis=1).sum())
        new = rules.table.by_width_and_group(width, group)
    new = np.where(known, new, FLAG_FILL).astype(np.int8)
    collapsed = ds["status"].values == SampleStatus.COLLAPSED if many else np.array([_collapsed(ds)])
    reached = _beyond_the_end(new, old, collapsed, rules.table.highest, same)
    open_end, followed = reached.size, int(reached.min(initial=rules.table.highest))
    ds[f"{prefix}{name}"] = (was.dims, new.reshape(was.shape), was.attrs)
    notes = []
    if without_group:
        notes.append(
            f"{without_group} of {rows} {noun(ds)}s are judged by their widest crack alone: the archive does not hold "
            "how wide groups of cracks are"
        )
    if not prefix and many and not same and name == "damage_category":
        ds.attrs["highest_category"] = max(followed, 1)
    if open_end and not same:
        where = "beyond the end of their paths" if old.shape[1] > 1 else "at the end of their movement"
        notes.append(
            f"of {open_end} of {rows} {noun(ds)}s the category is not known {where}: the study followed them to "
            f"category {int(old.max())} of {own.table.name} only; all are known up to category {followed}"
        )
    return notes


def _widths(ds: xr.Dataset, prefix: str, by_band: bool, rules: Rules) -> FloatArray:
    """Return the widths (m) that make the category, of the variable's shape."""
    joint = np.asarray(ds[f"{prefix}crack_width_max"].values)
    others = (f"{prefix}{name}" for name in ("crack_band_width_max", "footing_opening_max"))
    band, gap = (np.asarray(ds[name].values) if name in ds else joint for name in others)
    return np.asarray(rules.widths(joint, band, gap, has_dpc=has_dpc(ds))[by_band], dtype=np.float64)


def _collapsed(wall: xr.Dataset) -> bool:
    return bool(wall.attrs.get("status") == PathStatus.COLLAPSED)


def _beyond_the_end(new: Int8Array, old: Int8Array, collapsed: BoolArray, highest: int, same: bool) -> Int8Array:
    """Fill in the categories after the last known state of paths (n, k); return those reached by paths of open end."""
    # a path that ended at its last category of interest is unknown beyond, unless that was the highest category, or the
    # rules are the archive's own
    steps = np.arange(new.shape[1])
    last = np.where(new >= 0, steps, -1).max(axis=1)
    beyond = steps > last[:, None]
    new[collapsed[:, None] & (steps >= np.maximum(last, 0)[:, None])] = highest
    ended = ~collapsed & (beyond & (old >= 0)).any(axis=1)
    reached = np.where(last >= 0, new[np.arange(len(new)), np.maximum(last, 0)], 0)
    there = np.int8(highest) if not same else old
    held = (ended & ((reached == highest) | same))[:, None] & beyond & (old >= 0)
    new[...] = np.where(held, there, new)
    return np.asarray(reached[ended & (reached < highest) & (not same)], dtype=np.int8)


# -- deviation and sticking openings ---------------------------------------------------------------------------------


def _levels(ds: xr.Dataset) -> list[str]:
    """Add the levels of deviation from level and plumb and of sticking openings, where their measures are kept."""
    notes = []
    of_opening = tuple(f"opening_{name}" for name in ("distortion", "width_change", "diagonal_change"))
    tilted = "no deviation from level and plumb: the archive does not hold it"
    stuck = "no sticking doors and windows: the archive does not hold how their openings are distorted"
    for name, limits, measures, lacking in (
        ("deviation_level", deviation_limits(), ("tilt_max", "slope_max"), tilted),
        ("opening_sticking", sticking_limits(), of_opening, stuck),
    ):
        if not all(measure in ds for measure in measures):
            notes.append(lacking)
            continue
        comment = f"{limits.name}; {limits.source} ({limits.confidence})"
        level = limits.level(*(ds[measure].values for measure in measures))
        ds[name] = (ds[measures[0]].dims, level, VARIABLES[name].attributes() | {"comment": comment})
    return notes


class Share(NamedTuple):
    """Walls that have something in common, and their share of all by their weights."""

    walls: int
    share: float


def shares(ds: xr.Dataset) -> dict[int, Share]:
    """Return the number of walls whose worst category is each one; -1: unknown, as of walls that failed below it."""
    category = ds["damage_category"].values
    rows = category.shape[0] if "sample" in ds["damage_category"].dims else 1
    worst = category.reshape(rows, -1).max(axis=1)
    highest = int(ds.attrs.get("highest_category", len(CATEGORIES) - 1))
    if "sample" in ds["damage_category"].dims and "status" in ds:
        worst = np.where((ds["status"].values == SampleStatus.FAILED) & (worst < highest), -1, worst)
    weight = sample_weights(ds) if "sample" in ds.sizes else np.ones(rows)
    every = range(-1 if (worst < 0).any() else 0, max(highest, int(worst.max())) + 1)
    return {c: Share(int((worst == c).sum()), float(np.average(worst == c, weights=weight))) for c in every}


def has_dpc(ds: xr.Dataset) -> bool:
    """Whether an archived wall, or the walls of a study, have a dpc."""
    if "contact_kind" in ds:
        return bool((ds["contact_kind"].values == ContactKind.DPC).any())
    return "dpc" in tomllib.loads(str(ds.attrs.get("scene", "")))


def shown_gaps(ds: xr.Dataset) -> list[str]:
    """Gaps below the wall proper that tables and pictures of one wall show: ``dpc``, ``footing``."""
    dpc = has_dpc(ds)
    opened = "footing_opening_max" in ds and float(ds["footing_opening_max"].max()) > HAIRLINE
    known = "footing_opening_max" in ds and ContactKind.FOOTING_INTERFACE in ds["contact_kind"].values
    return ["dpc"] * dpc + ["footing"] * (known and (opened or not dpc))


def footing_gap_note(ds: xr.Dataset) -> str:
    """Note on an uncounted gap along the footing bed that would raise the category; empty without any."""
    rules = archived_rules(ds)
    if "footing_opening_max" not in ds or has_dpc(ds) or rules.count_footing_gap:
        return ""
    gap, category = np.nan_to_num(ds["footing_opening_max"].values), ds["damage_category"].values
    by_gap = rules.table.by_width(gap)
    higher = (by_gap > category) & (category >= 0)
    if not higher.any():
        return ""
    how = "it counts with [damage] count_footing_gap = true, or judge --footing-gap"
    if "sample" in ds["damage_category"].dims:
        rows = ds.sizes["sample"]
        some = int(higher.reshape(rows, -1).any(axis=1).sum())
        higher_than = "the gap along the bed on the footing is of a higher category than the cracks"
        return f"in {some} of {rows} {noun(ds)}s {higher_than}; {how}"
    worst = int(np.argmax(np.where(higher, gap, -1.0)))
    opens = f"the bed on the footing opens by {1e3 * float(gap[worst]):.3g} mm"
    return f"{opens}, which would be category {int(by_gap[worst])}; {how}"


def measure_in_words(ds: xr.Dataset) -> str:
    """Width that makes the categories of a wall, a study or its curves."""
    widths = {
        "joint": "widest crack, the opening of one joint",
        "band": "widest crack band, openings of joints added up",
    }
    words = widths[str(ds.attrs.get("damage_measure", "joint"))]
    return words + (", and the gap along the footing bed" if int(ds.attrs.get("count_footing_gap", 0)) else "")
