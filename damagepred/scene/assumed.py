"""Default properties of the ground of a scene on a mound."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from functools import reduce

from damagepred.scene.scene import Scene
from damagepred.scene.site import suction_depth
from damagepred.scene.soil_log import Suction


def _ground_values(scene: Scene) -> dict[str, str]:
    """Return the numbers that shape a mound, in words, by their place."""
    if scene.movement.shape != "mound":
        return {}
    mound, soil, kind = scene.mound, scene.soil, scene.movement.kind
    name = "y_s" if mound.shape in ("walsh", "mitchell") else "largest movement"
    values = {"mound.surface_movement": f"{name} = {1e3 * mound.surface_movement:g} mm"}
    if scene.soil_layer:  # y_s follows from these
        suction = scene.suction or Suction()
        values = {
            "suction.change": f"change of suction {suction.change:g} pF",
            "suction.cracked_share": f"cracked zone {suction.cracked_share:g} H_s deep",
            "suction.restraint": f"restraint {suction.restraint:g} - z / {suction.restraint_depth:g} m below it",
            "mound.suction_depth": f"H_s = {mound.suction_depth:g} m",
        }
    by_depth = (mound.shape == "walsh" and kind == "doming" and mound.edge_distance is None) or (
        mound.shape == "mitchell" and mound.exponent is None
    )
    if by_depth:
        values["mound.suction_depth"] = f"H_s = {mound.suction_depth:g} m"
    stiffness = "soil.swelling_stiffness" if kind == "dishing" else "soil.shrinking_stiffness"
    word = stiffness.removeprefix("soil.").removesuffix("_stiffness")
    values[stiffness] = f"{word} soil of {soil.stiffness(kind) / 1e3:g} kPa/m"
    return values


def _by_default(scene: Scene, values: Mapping[str, str], sampled: Collection[str]) -> list[str]:
    """Return those words whose place has its default, and is not sampled."""

    def is_default(place: str) -> bool:
        *tables, key = place.split(".")
        table = reduce(getattr, tables, scene)
        return table is None or getattr(table, key) == getattr(type(table)(), key)

    return [words for place, words in values.items() if place not in sampled and is_default(place)]


def assumed_ground(scene: Scene, sampled: Collection[str] = ()) -> list[str]:
    """Return those of the numbers that shape the ground, in words, that are the defaults; see ``_ground_values``.

    Parameters
    ----------
    scene : Scene
        The wall.
    sampled : Collection[str]
        Places of the numbers that a study samples; these are left out.
    """
    return _by_default(scene, _ground_values(scene), sampled)


def assumed_seasons(scene: Scene, sampled: Collection[str] = ()) -> list[str]:
    """Return those of the numbers that shape seasons, in words, that are the defaults.

    Parameters
    ----------
    scene, sampled
        See ``assumed_ground``.
    """
    seasons = scene.movement.seasons
    if seasons is None:
        return []
    mean = (
        {"swing_share": f"{seasons.swing_share:g} y_s"}
        if scene.soil_layer
        else {"swing": f"{1e3 * seasons.swing:g} mm"}
    )
    words = {
        **{key: f"a mean swing of {value}" for key, value in mean.items()},
        "swing_cov": f"a coefficient of variation of the swing of {seasons.swing_cov:g}",
        "correlation": f"a correlation of {seasons.correlation:g} with the year before",
        "trend": "no trend",
        "shift": "the same mean in wet years and dry years",
    }
    return _by_default(scene, {f"movement.seasons.{key}": said for key, said in words.items()}, sampled)


def assumed_slow_strains(scene: Scene, sampled: Collection[str] = ()) -> list[str]:
    """Return those of the numbers that shape slow strains over time, in words, that are the defaults.

    Parameters
    ----------
    scene, sampled
        See ``assumed_ground``.
    """
    strain, creep, values = scene.strain, scene.creep, {}
    if strain is not None and strain.growth and scene.movement.stage:
        values["strain.growth_years"] = f"growth reached in {strain.growth_years:g} years"
        values["strain.growth_time"] = f"a time constant of growth of {strain.growth_time:g} years"
    if creep is not None:
        values["creep.coefficient"] = f"a creep coefficient of {creep.coefficient:g}"
    return _by_default(scene, values, sampled)


def ground_line(scene: Scene, sampled: Collection[str] = ()) -> str | None:
    """Return one sentence on the assumed properties of the ground; None if there are none.

    Parameters
    ----------
    scene, sampled
        See ``assumed_ground``.
    """
    assumed = assumed_ground(scene, sampled)
    zone = None if scene.suction is None else scene.suction.climate_zone
    if zone is not None and "mound.suction_depth" not in sampled and scene.mound.suction_depth == suction_depth(zone):
        assumed = [
            *(said for said in assumed if not said.startswith("H_s")),
            f"H_s of climatic zone {zone} (secondary)",
        ]
    if not assumed:
        return None
    tables = "[suction], [mound] and [soil]" if scene.soil_layer else "[mound] and [soil]"
    return (
        f"ground: {scene.mound.shape} mound, {scene.movement.kind}; by default {', '.join(assumed)}. Give your site's "
        f"in {tables}: softer soil than it has spares the wall."
    )
