"""Default properties of the ground of a scene on a mound."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace
from functools import reduce

from damagepred.enumerations import LOCAL
from damagepred.scene.movement_stage import UP, Kind
from damagepred.scene.scene import Scene
from damagepred.scene.site import suction_depth
from damagepred.scene.soil import Suction


def _ground_values(scene: Scene) -> dict[str, str]:
    """Numbers that shape a mound, in words, by key."""
    if scene.movement.shape != "mound":
        return {}
    mound, soil, kind = scene.mound, scene.soil, scene.movement.kind
    name = LOCAL.get(mound.shape, "y_s")
    values = {"mound.surface_movement": f"{name} = {1e3 * mound.surface_movement:g} mm"}
    if scene.soil_layer:  # these determine y_s
        suction = scene.suction or Suction()
        values = {
            "suction.change": f"change of suction {suction.change:g} pF",
            "suction.cracked_share": f"cracked zone {suction.cracked_share:g} H_s deep",
            "suction.restraint": f"restraint {suction.restraint:g} - z / {suction.restraint_depth:g} m below it",
            "mound.suction_depth": f"H_s = {mound.suction_depth:g} m",
        }
    if "suction_depth" in mound.read_keys(scene.movement):
        values["mound.suction_depth"] = f"H_s = {mound.suction_depth:g} m"
    key = soil.stiffness_key(kind)
    values[f"soil.{key}"] = f"{key.removesuffix('_stiffness')} soil of {soil.stiffness(kind) / 1e3:g} kPa/m"
    return values


def ground_cautions(scene: Scene, sampled: Collection[str] = ()) -> list[str]:
    """Cautions on given or sampled values that others override, or that the movement does not read."""
    movement, mound, soil, cautions = scene.movement, scene.mound, scene.soil, []
    if movement.shape == "mound" and mound.shape in LOCAL and mound.shape != "table" and not movement.local:
        new: Kind = "heave" if movement.kind in UP else "settle"
        read, other = (
            f"soil.{soil.stiffness_key(kind)} = {soil.stiffness(kind) / 1e3:g} kPa/m" for kind in (movement.kind, new)
        )
        cautions.append(
            f"movement.kind = '{movement.kind}' is read as in older files: the ground goes "
            f"{'up' if new == 'heave' else 'down'} ({mound.shape}) on {read}; write '{new}', which reads {other}"
        )
    zone = scene.suction and scene.suction.climate_zone
    if zone and "mound.suction_depth" not in sampled and mound.suction_depth != suction_depth(zone):
        cautions.append(
            f"mound.suction_depth = {mound.suction_depth:g} m counts, and not the {suction_depth(zone):g} m of "
            f"suction.climate_zone = {zone}"
        )
    given = {*(scene.given or ()), *sampled}
    # given for both kinds
    swapped = {f"mound.{key}" for key in mound.read_keys(replace(movement, kind=movement.other))}
    if f"soil.{soil.stiffness_key(movement.kind)}" in given:
        swapped.add(f"soil.{soil.stiffness_key(movement.other)}")
    if idle := sorted(scene.unread() & given - (swapped if movement.shape == "mound" else set())):
        shape = f", mound.shape = '{mound.shape}'" if movement.shape == "mound" else ""
        where = f"movement.shape = '{movement.shape}', kind = '{movement.kind}'{shape}"
        cautions.append(f"{', '.join(idle)}: not read with {where}")
    return cautions


def _by_default(scene: Scene, values: Mapping[str, str], sampled: Collection[str]) -> list[str]:
    """Words of the keys with default values that are neither given in the file nor sampled."""
    stated = {*sampled, *(scene.given or ())}

    def is_default(key: str) -> bool:
        *tables, last = key.split(".")
        table = reduce(getattr, tables, scene)
        return table is None or getattr(table, last) == getattr(type(table)(), last)

    return [words for key, words in values.items() if key not in stated and is_default(key)]


def assumed_ground(scene: Scene, sampled: Collection[str] = ()) -> list[str]:
    """Assumed numbers of the ground, neither given nor sampled, in words."""
    return _by_default(scene, _ground_values(scene), sampled)


def assumed_seasons(scene: Scene, sampled: Collection[str] = ()) -> list[str]:
    """Assumed numbers of seasons, neither given nor sampled, in words."""
    seasons = scene.movement.seasons
    if seasons is None:
        return []
    key, unit = ("swing_share", "y_s") if scene.soil_layer else ("swing", "mm")
    swing = seasons.swing_share if scene.soil_layer else 1e3 * seasons.swing
    words = {
        key: f"a mean swing of {swing:g} {unit}",
        "swing_cov": f"a coefficient of variation of the swing of {seasons.swing_cov:g}",
        "correlation": f"a correlation of {seasons.correlation:g} with the year before",
        "trend": "no trend",
        "shift": "the same mean in wet years and dry years",
    }
    return _by_default(scene, {f"movement.seasons.{key}": text for key, text in words.items()}, sampled)


def assumed_slow_strains(scene: Scene, sampled: Collection[str] = ()) -> list[str]:
    """Assumed numbers of slow strains, neither given nor sampled, in words."""
    strain, creep, values = scene.strain, scene.creep, {}
    if strain is not None and strain.growth and scene.movement.stage:
        values["strain.growth_years"] = f"growth reached in {strain.growth_years:g} years"
        values["strain.growth_time"] = f"a time constant of growth of {strain.growth_time:g} years"
    if creep is not None:
        values["creep.coefficient"] = f"a creep coefficient of {creep.coefficient:g}"
    return _by_default(scene, values, sampled)


def ground_line(scene: Scene, sampled: Collection[str] = ()) -> str | None:
    """Sentence on the assumed properties of the ground, or None."""
    assumed = assumed_ground(scene, sampled)
    zone = None if scene.suction is None else scene.suction.climate_zone
    if zone is not None and "mound.suction_depth" not in sampled and scene.mound.suction_depth == suction_depth(zone):
        assumed = [words for words in assumed if not words.startswith("H_s")]
        assumed.append(f"H_s of climatic zone {zone} (secondary)")
    if not assumed:
        return None
    tables = "[suction], [mound] and [soil]" if scene.soil_layer else "[mound] and [soil]"
    return (
        f"ground: {scene.mound.shape} mound, {scene.movement.kind}; by default {', '.join(assumed)}. Give your site's "
        f"in {tables}: soil softer than the real one underestimates damage."
    )
