"""Judging an archive again, under another damage table or other rules, without solving anything."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from damagepred.archive.schema import CATEGORIES, FLAG_FILL, SAMPLE_STATUS, VARIABLES, category_attributes
from damagepred.damage import (
    DamageTable,
    JointMap,
    Verdict,
    damage_table,
    deviation_limits,
    judge,
    kept_rules,
    load_table,
    read_table,
    sticking_limits,
)
from damagepred.damage.table import TABLES
from damagepred.errors import InputError
from damagepred.one_thread import one_blas_thread
from damagepred.scene import Damage

FloatArray = NDArray[np.float64]
Categories = NDArray[np.int8]

COLLAPSED = SAMPLE_STATUS.index("collapsed")

AT_ONCE = 1 << 16
"""Samples judged at once: enough to be quick, few enough to take little memory."""

CRACKED = VARIABLES["contact_state"].flags.index("cracked")


class Rules(NamedTuple):
    """By what an archive is judged.

    Attributes
    ----------
    table : DamageTable
        Limits, with the plasterboard allowance if that is wanted.
    settings : Damage
        The other rules; its ``table`` and ``plasterboard`` are not read.
    """

    table: DamageTable
    settings: Damage


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
) -> xr.Dataset:
    """Judge a wall or a study again; what is not given stays as the archive was judged by.

    A wall with its contacts is judged from these, by all rules. Of a study, which keeps a few numbers a wall, the
    widest crack and the widest group of 2 to 5 cracks are compared with the new limits, which comes to the same; the
    distance within which cracks make a group, and the opening from which the dpc counts as separated, are those it was
    run with. A path that ended at the last category of interest is not known beyond its end, unless it has reached the
    new table's highest category there: its category is -1 from there on, and ``highest_category`` is lowered to what
    all paths were followed to.

    Parameters
    ----------
    ds : xarray.Dataset
        As ``damagepred.solve``, ``open_study`` or ``read_dataset`` return it; not changed.
    table : {"as2870", "bre251"}, path or DamageTable, optional
        Limits; a path that ends in .toml names a file written like those in ``data/damage``.
    plasterboard : bool, optional
        Whether the limits are raised for plasterboard.
    count_rule : bool, optional
        Whether groups of cracks count.
    group_distance, dpc_threshold : float, optional
        See ``damagepred.scene.Damage`` (m); of a wall with its contacts only.
    group_count : int, optional
        Cracks that make a group; of a study 2 to 5.

    Returns
    -------
    xarray.Dataset
        With the new ``damage_category`` and what goes with it, ``deviation_level`` and ``opening_sticking`` where their
        measures are archived, and the attribute ``judgement``, which says what could not be told.

    Raises
    ------
    InputError
        If it is neither a wall nor a study, there is no such table, or the archive does not hold what a rule needs.
    """
    for name in ("damage_category", "crack_width_max"):
        if name not in ds:
            raise InputError(f"the dataset has no variable '{name}'; a wall or a study can be judged again.")
    own = archived_rules(ds)
    wanted = {"count_rule": count_rule, "group_distance": group_distance, "group_count": group_count,
              "dpc_threshold": dpc_threshold}  # fmt: skip
    given: dict[str, Any] = {name: value for name, value in wanted.items() if value is not None}
    settings = replace(own.settings, **given)
    rules = Rules(_table(own, table, plasterboard), settings)
    judged = ds.copy()
    if "contact_opening" in ds:
        notes = _judge_wall(judged, rules)
    else:
        notes = _judge_numbers(judged, own, rules)
    notes += _levels(judged)
    judged.attrs["damage_table"] = rules.table.name
    judged.attrs["judgement"] = "; ".join([f"judged again by {rules.table.name}", *notes])
    return judged


def archived_rules(ds: xr.Dataset) -> Rules:
    """Return the rules that an archive was judged by; without a scene in it, the usual ones.

    Parameters
    ----------
    ds : xarray.Dataset
        Of a wall or a study.
    """
    settings = Damage(**tomllib.loads(str(ds.attrs.get("scene", ""))).get("damage", {}))
    table = damage_table(settings)
    name = ds.attrs.get("damage_table", table.name)
    plain = [load_table(name) for name in TABLES]
    known = [table, *plain, *(one.with_plasterboard() for one in plain if one.plasterboard_factor is not None)]
    return Rules(next((one for one in known if one.name == name), table), settings)


def _table(own: Rules, table: str | Path | DamageTable | None, plasterboard: bool | None) -> DamageTable:
    """Return the limits that are asked for."""
    if table is None and plasterboard is None:
        return own.table
    if isinstance(table, DamageTable):
        plain = table
    elif table is not None:
        plain = read_table(Path(table)) if str(table).endswith(".toml") else load_table(str(table))
    else:
        plain = next(t for t in map(load_table, TABLES) if own.table.name.startswith(t.name))
    eased = own.table.name != plain.name and own.table.name.startswith(plain.name)
    wanted = eased if plasterboard is None else plasterboard
    return plain.with_plasterboard() if wanted else plain


# -- one wall, from its contacts -------------------------------------------------------------------------------------


def _judge_wall(ds: xr.Dataset, rules: Rules) -> list[str]:
    joints = JointMap.from_dataset(ds)
    shape = joints.contact_x.shape
    opening, slip, state = (ds[f"contact_{name}"].values for name in ("opening", "slip", "state"))
    verdicts = [
        judge(joints, o.reshape(shape), s.reshape(shape), (c == CRACKED).reshape(shape), rules.settings, rules.table)
        for o, s, c in zip(opening, slip, state)
    ]
    values = {name: np.array([getattr(v, name) for v in verdicts]) for name in Verdict._fields}
    values["damage_category"] = values["damage_category"].astype(np.int8)
    if ds.attrs.get("status") == "collapsed":
        fell = int(ds.attrs.get("collapse_increment", ds.sizes["increment"] - 1))
        values["damage_category"][fell:] = rules.table.highest
    for name, value in values.items():
        if name in ds:
            ds[name] = (ds[name].dims, value, ds[name].attrs)
    for name, more in kept_rules(rules.settings).items():
        if name in ds:
            ds[name].attrs.update(more)
    _name(ds, "damage_category", rules.table)
    return []


def _name(ds: xr.Dataset, name: str, table: DamageTable) -> None:
    attributes = category_attributes(table.category_names, f"{table.name}; {table.source}")
    if name != "damage_category":
        attributes["long_name"] = VARIABLES[name].long_name
    ds[name].attrs = attributes


# -- a study, from the numbers it keeps ------------------------------------------------------------------------------


def _judge_numbers(ds: xr.Dataset, own: Rules, rules: Rules) -> list[str]:
    _refuse_what_is_not_kept(ds, own.settings, rules)
    notes: list[str] = []
    for prefix in ("", "end_"):
        if f"{prefix}damage_category" in ds and f"{prefix}crack_width_max" in ds:
            notes += _judge_columns(ds, prefix, own, rules)
    for name in (f"{prefix}damage_category" for prefix in ("", "end_")):
        if name in ds:
            _name(ds, name, rules.table)
    if "crack_count" in ds and rules.table.limits[0] != own.table.limits[0]:
        del ds["crack_count"]
        notes.append("crack_count is left out: it counts cracks of another width")
    return notes


def _refuse_what_is_not_kept(ds: xr.Dataset, own: Damage, rules: Rules) -> None:
    for name in ("group_distance", "dpc_threshold"):
        if (asked := getattr(rules.settings, name)) != (had := getattr(own, name)):
            raise InputError(
                f"{name} = {asked:g}: this archive was judged with {had:g} m and does not hold what another takes; a "
                "wall with its contacts does (solve -o, replay -o)."
            )
    counts = ds["group_count"].values.tolist() if "group_count" in ds.variables else []
    asked = rules.settings.group_count
    if rules.settings.count_rule and counts and asked not in counts:
        raise InputError(f"group_count = {asked}: this archive holds groups of {', '.join(map(str, counts))} cracks.")


def _judge_columns(ds: xr.Dataset, prefix: str, own: Rules, rules: Rules) -> list[str]:
    """Judge a study's paths, or the ends of its movements, anew."""
    was = ds[f"{prefix}damage_category"]
    many = "sample" in was.dims
    rows = was.sizes["sample"] if many else 1
    old = was.values.reshape(rows, -1)
    width = ds[f"{prefix}crack_width_max"].values.reshape(old.shape)
    group = _group(ds, prefix, rules.settings, old.shape)
    status = ds["status"].values if many else np.array([COLLAPSED * (ds.attrs.get("status") == "collapsed")])
    same = own.table.limits == rules.table.limits and own.settings == rules.settings
    new = np.empty(old.shape, dtype=np.int8)
    without_group, open_end, followed = 0, 0, rules.table.highest
    for part in _parts(rows):
        groups = np.full((1, 1), np.nan) if group is None else group[part]
        lacking = np.isfinite(width[part]) & np.isnan(groups)
        without_group += int(lacking.any(axis=1).sum()) if rules.settings.count_rule else 0
        new[part] = np.where(np.isfinite(width[part]), rules.table.by_width_and_group(width[part], groups), FLAG_FILL)
        reached = _beyond_the_end(new[part], old[part], status[part] == COLLAPSED, rules.table.highest, same)
        open_end += reached.size
        followed = min(followed, int(reached.min(initial=followed)))
    ds[f"{prefix}damage_category"] = (was.dims, new.reshape(was.shape), was.attrs)
    notes = []
    if without_group:
        notes.append(
            f"{without_group} of {rows} walls are judged by their widest crack alone: the archive does not hold how "
            "wide groups of cracks are"
        )
    if not prefix and many and not same:
        ds.attrs["highest_category"] = max(followed, 1)
    if open_end and not same:
        where = "beyond the end of their paths" if old.shape[1] > 1 else "at the end of their movement"
        notes.append(
            f"of {open_end} of {rows} walls the category is not known {where}: the study followed them to category "
            f"{int(old.max())} of {own.table.name} only; all are known up to category {followed}"
        )
    return notes


def _parts(rows: int) -> Iterator[slice]:
    for first in range(0, rows, AT_ONCE):
        yield slice(first, first + AT_ONCE)


def _group(ds: xr.Dataset, prefix: str, settings: Damage, shape: tuple[int, ...]) -> FloatArray | None:
    """Return the width of the widest group that counts, of the shape of the categories; None if it is not kept."""
    if not settings.count_rule:
        return np.zeros(shape[:1] + (1,) * (len(shape) - 1))
    name = f"{prefix}crack_group_width"
    if name not in ds:
        return None
    position = int(np.flatnonzero(ds["group_count"].values == settings.group_count)[0])
    return np.asarray(ds[name].values[..., position]).reshape(shape)


def _beyond_the_end(new: Categories, old: Categories, fell: NDArray[np.bool_], highest: int, same: bool) -> Categories:
    """Fill in what follows the last state known of each path (n, k); return what paths of open end had reached there.

    A wall that fell keeps the highest category; a path that ended because it had gone far enough is not known beyond,
    unless it had reached the highest category, or the rules are the archive's own.
    """
    steps = np.arange(new.shape[1])
    last = np.where(new >= 0, steps, -1).max(axis=1)
    beyond = steps > last[:, None]
    new[fell[:, None] & (steps >= np.maximum(last, 0)[:, None])] = highest
    ended = ~fell & (beyond & (old >= 0)).any(axis=1)
    reached = np.where(last >= 0, new[np.arange(len(new)), np.maximum(last, 0)], 0)
    there = np.int8(highest) if not same else old
    held = (ended & ((reached == highest) | same))[:, None] & beyond & (old >= 0)
    new[...] = np.where(held, there, new)
    return np.asarray(reached[ended & (reached < highest) & (not same)], dtype=np.int8)


# -- what is no crack ------------------------------------------------------------------------------------------------


def _levels(ds: xr.Dataset) -> list[str]:
    """Add the levels of deviation from level and plumb and of sticking openings, where their measures are kept."""
    notes = []
    if "tilt_max" in ds and "slope_max" in ds:
        limits = deviation_limits()
        _put_level(ds, "deviation_level", limits.level(ds["tilt_max"].values, ds["slope_max"].values), "tilt_max")
        _say_source(ds, "deviation_level", limits.name, limits.source, limits.confidence)
    else:
        notes.append("no deviation from level and plumb: the archive does not hold it")
    if "opening_distortion" in ds:
        sticking = sticking_limits()
        measured = (ds[f"opening_{name}"].values for name in ("distortion", "width_change", "diagonal_change"))
        _put_level(ds, "opening_sticking", sticking.level(*measured), "opening_distortion")
        _say_source(ds, "opening_sticking", sticking.name, sticking.source, sticking.confidence)
    else:
        notes.append("no sticking doors and windows: the archive does not hold how their openings are distorted")
    return notes


def _put_level(ds: xr.Dataset, name: str, level: Categories, like: str) -> None:
    ds[name] = (ds[like].dims, level, VARIABLES[name].attributes())


def _say_source(ds: xr.Dataset, name: str, title: str, source: str, confidence: str) -> None:
    ds[name].attrs["comment"] = f"{title}; {source} ({confidence})"


def shares(ds: xr.Dataset) -> dict[int, int]:
    """Return how many walls reach each category at worst, by category; -1 stands for walls of which nothing is known.

    Parameters
    ----------
    ds : xarray.Dataset
        A study, or one wall.
    """
    category = ds["damage_category"].values
    rows = category.shape[0] if "sample" in ds["damage_category"].dims else 1
    worst = category.reshape(rows, -1).max(axis=1)
    found, count = np.unique(worst, return_counts=True)
    known = dict.fromkeys(range(int(ds.attrs.get("highest_category", len(CATEGORIES) - 1)) + 1), 0)
    return known | {int(c): int(n) for c, n in zip(found, count)}
