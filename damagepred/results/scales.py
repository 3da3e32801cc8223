"""Published scales and limits of damage side by side, and their agreement on the walls of an archive."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import xarray as xr

from damagepred.arrays import FloatArray, Int8Array
from damagepred.damage import deviation_limits, load_movement_limits, load_strain_table, load_table, sticking_limits
from damagepred.damage.limits import load_scale
from damagepred.damage.table import TABLES
from damagepred.enumerations import SampleStatus
from damagepred.errors import InputError, require_count
from damagepred.inputs.arguments import checked
from damagepred.results.house import is_house, wall_dataset, wall_names
from damagepred.results.rejudge import judge_again
from damagepred.results.simple_assessment import angular_distortion, simple_categories
from damagepred.scene.scene import archived_scene
from damagepred.uq.capacity import sample_weights


class _Judged(NamedTuple):
    name: str
    source: str
    confidence: str
    level: Int8Array  # of the shape of the categories; -1: unknown


@checked
def compare_scales(ds: xr.Dataset, increment: int | None = None) -> xr.Dataset:
    """Judge the stored states of walls by every scale that the archive allows, and compare the scales in pairs.

    Level 0 of a scale lies below its first limit. Scales of cracks and tilt judge the wall, scales of distortion and
    strain the movement of the ground under it. Levels of two scales need not mean the same, so pairs are compared by
    their first limits and by rank. A state that a scale does not know, after the end of a path, does not count.

    Parameters
    ----------
    ds : xarray.Dataset
        As ``damagepred.solve``, ``open_study`` or ``read_dataset`` return it; not changed.
    increment : int, optional
        Which state of each wall counts; by default all of them.

    Returns
    -------
    xarray.Dataset
        ``level`` of each scale and state, ``share_reached`` (the share of states beyond the first limit),
        ``agreement`` (the share of states that two scales both place beyond their first limit, or both below),
        ``rank_correlation`` (Kendall's tau-b of the levels, NaN where one does not vary) and ``states`` (that both
        know); samples count by their weights. The attribute ``left_out`` names the scales that the archive does not
        allow.

    Examples
    --------
    >>> import damagepred
    >>> found = damagepred.compare_scales(damagepred.open_study("house.dp"))
    >>> found["agreement"].dims
    ('scale', 'other')
    >>> float(found["agreement"].sel(scale="AS 2870-2011 Table C1", other="BRE Digest 251"))
    1.0
    """
    judged = _by_each_wall(ds) if is_house(ds) else _judged(ds)
    left_out = [f"{name} is not held" for name in ("psi", "tilt_max", "opening_distortion") if name not in ds]
    if not any("distortion" in one.name for one in judged):
        left_out.append("distortion and strain: no scene, or walls differ in size or kind of movement")
    unknown = [one.name for one in judged if (one.level < 0).all()]
    if len(unknown) < len(judged):
        left_out += [f"{name} is unknown in all states" for name in unknown]
        judged = [one for one in judged if one.name not in unknown]
    category = ds["wall_damage_category" if is_house(ds) else "damage_category"]
    last = category.sizes["increment"] - 1
    if increment is not None:
        require_count("increment", increment, 0)
        if increment > last:
            raise InputError(f"increment = {increment}: the archive's last increment is {last}.")
    chosen = slice(None) if increment is None else [increment]
    level = np.array([one.level for one in judged])
    states = level[..., chosen]
    weight = sample_weights(ds) if "sample" in ds.sizes else np.ones(1)
    weights = np.broadcast_to(weight[:, None], states.reshape(len(judged), len(weight), -1).shape[1:]).ravel()
    flat = states.reshape(len(judged), -1)
    known, beyond = flat >= 0, flat >= 1
    counted, first = (known * weights).sum(axis=1), (beyond * weights).sum(axis=1)
    reached = np.divide(first, counted, out=np.full(len(judged), np.nan), where=counted > 0)
    pairs = np.array([[_pair(a, b, weights) for b in flat] for a in flat])
    both = ("scale", "other")
    names, sources, confidences, _ = zip(*judged)
    return xr.Dataset(
        {
            "level": (("scale", *category.dims), level, {"long_name": "level on the scale; -1: unknown"}),
            "share_reached": ("scale", reached, {"units": "1", "long_name": "share of states beyond the first limit"}),
            "agreement": (both, pairs[..., 0], {"units": "1", "long_name": "share of states judged alike"}),
            "rank_correlation": (both, pairs[..., 1], {"units": "1", "long_name": "Kendall's tau-b of the levels"}),
            "states": (both, known.astype(np.int32) @ known.astype(np.int32).T, {"long_name": "states that both know"}),
        },
        coords={
            **{"scale": list(names), "other": list(names)},
            **{"source": ("scale", list(sources)), "confidence": ("scale", list(confidences))},
        },
        attrs={"title": str(ds.attrs.get("title", "")), "left_out": "; ".join(left_out)},
    )


def _judged(ds: xr.Dataset) -> list[_Judged]:
    judged = [(table, judge_again(ds, table=table)["damage_category"].values) for table in map(load_table, TABLES)]
    by_cracks = (_Judged(table.name, table.source, table.confidence, level) for table, level in judged)
    return [*by_cracks, *_by_wall(ds), *_by_ground(ds)]


def _by_each_wall(ds: xr.Dataset) -> list[_Judged]:
    """Judge each wall of a house; a wall without openings, for instance, has no level of some scales."""
    walls = [{one.name: one for one in _judged(wall_dataset(ds, name))} for name in wall_names(ds)]
    every = {name: one for wall in reversed(walls) for name, one in wall.items()}
    unknown = np.full(ds["damage_category"].shape, -1, dtype=np.int8)
    levels = {name: [wall[name].level if name in wall else unknown for wall in walls] for name in every}
    return [one._replace(level=np.stack(levels[name], axis=-1)) for name, one in every.items()]


def _pair(a: Int8Array, b: Int8Array, weights: FloatArray) -> tuple[float, float]:
    """Return the share of states judged alike, and Kendall's tau-b from the weighted table of levels."""
    known = (a >= 0) & (b >= 0)
    a, b, w = a[known], b[known], weights[known]
    total = w.sum()
    if not total:
        return np.nan, np.nan
    alike = float(w[(a >= 1) == (b >= 1)].sum() / total)
    table = np.zeros((int(a.max()) + 1, int(b.max()) + 1))
    np.add.at(table, (a, b), w)
    difference = sum(
        w * (table[i + 1 :, j + 1 :].sum() - table[i + 1 :, :j].sum()) for (i, j), w in np.ndenumerate(table)
    )  # concordant less discordant pairs
    untied = [(total**2 - (table.sum(axis=axis) ** 2).sum()) / 2 for axis in (0, 1)]
    product = untied[0] * untied[1]
    return alike, float(difference / np.sqrt(product)) if product > 1e-12 * total**4 else np.nan


def _by_wall(ds: xr.Dataset) -> Iterator[_Judged]:
    """Judge by measures of the wall other than its widest crack; a collapsed wall has the highest level."""
    collapsed = np.zeros(ds["damage_category"].shape, dtype=bool)
    if "status" in ds:
        collapsed |= (ds["status"].values == SampleStatus.COLLAPSED)[:, None]
    for scale in map(load_scale, ("psi", "tilt")):
        if scale.measure in ds:
            values = ds[scale.measure].values
            level = scale.level(values)
            level[collapsed & np.isnan(values)] = len(scale.limits)
            yield _Judged(scale.name, scale.source, scale.confidence, level)
    again = judge_again(ds)
    for name, limits in (("deviation_level", deviation_limits()), ("opening_sticking", sticking_limits())):
        if name in again:
            worst = again[name].max("opening") if "opening" in again[name].dims else again[name]
            filled = np.where(collapsed & (worst.values < 0), np.int8(2), worst.values)
            yield _Judged(limits.name, limits.source, limits.confidence, filled.astype(np.int8))


def _by_ground(ds: xr.Dataset) -> Iterator[_Judged]:
    """Judge by the movement of the ground: the strain of a deep beam, its distortion and its deflection ratio."""
    places = ("wall.length", "wall.height", "block.poisson_ratio", "movement.kind")
    if "scene" not in ds.attrs or "deflection_ratio" not in ds or any(place in ds.variables for place in places):
        return
    scene = archived_scene(ds.attrs)
    ratio, shape = ds["deflection_ratio"].values, ds["damage_category"].shape
    strain = load_strain_table()
    category = np.broadcast_to(simple_categories(ds)["simple_category"].values, shape)
    yield _Judged(f"{strain.name}, {strain.source}", strain.source, strain.confidence, category)
    measured = ds.get("angular_distortion")
    distortion = ratio * angular_distortion(scene, 1.0) if measured is None else measured.values
    values = {"deflection_ratio": ratio, "angular_distortion": distortion}
    known = [limit for limit in load_movement_limits() if limit.kind in (None, scene.bending)]
    for author, measure in dict.fromkeys((limit.author, limit.measure) for limit in known):
        own = [limit for limit in known if (limit.author, limit.measure) == (author, measure)]
        limits = np.array([limit.value(scene.wall.length, scene.wall.height) for limit in own])
        level = (values[measure][..., None] > limits * (1 + 1e-12)).sum(axis=-1)
        level = np.where(np.isnan(values[measure]), -1, level).astype(np.int8)
        about = "; ".join(limit.about for limit in own)
        sure = "assumed" if any(limit.confidence == "assumed" for limit in own) else own[0].confidence
        name = f"{measure.replace('_', ' ')}, {author}"
        yield _Judged(name, f"{author}: {about}", sure, np.broadcast_to(level, shape))
