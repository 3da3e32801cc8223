"""Default properties of the ground of a scene on a mound."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

from damagepred.scene.mound import Mound
from damagepred.scene.scene import Scene
from damagepred.scene.seasons import Seasons
from damagepred.scene.site import suction_depth
from damagepred.scene.soil import Soil
from damagepred.scene.soil_log import Suction
from damagepred.scene.strain import Creep, Strain


def _ground_values(scene: Scene, sampled: Collection[str] = ()) -> dict[str, str]:
    """Return the numbers that shape a mound and that a study does not sample, in words, by their place."""
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
    return {place: words for place, words in values.items() if place not in sampled}


def assumed_ground(scene: Scene, sampled: Collection[str] = ()) -> list[str]:
    """Return those of the numbers that shape the ground, in words, that are the defaults; see ``_ground_values``.

    Parameters
    ----------
    scene : Scene
        The wall.
    sampled : Collection[str]
        Places of the numbers that a study samples; these are left out.
    """
    usual: dict[str, Any] = {"mound": Mound(), "soil": Soil(), "suction": Suction()}

    def is_default(place: str) -> bool:
        table, key = place.split(".")
        return getattr(getattr(scene, table) or usual[table], key) == getattr(usual[table], key)

    return [words for place, words in _ground_values(scene, sampled).items() if is_default(place)]


def assumed_seasons(scene: Scene, sampled: Collection[str] = ()) -> list[str]:
    """Return those of the numbers that shape seasons, in words, that are the defaults.

    Parameters
    ----------
    scene : Scene
        The wall.
    sampled : Collection[str]
        Places of the numbers that a study samples; these are left out.
    """
    seasons, usual = scene.movement.seasons, Seasons()
    if seasons is None:
        return []
    words = {
        "swing": f"a mean swing of {1e3 * usual.swing:g} mm",
        "swing_share": f"a mean swing of {usual.swing_share:g} y_s",
        "swing_cov": f"a coefficient of variation of the swing of {usual.swing_cov:g}",
        "correlation": f"a correlation of {usual.correlation:g} with the year before",
        "trend": "no trend",
        "shift": "the same mean in wet years and dry years",
    }
    words.pop("swing" if scene.soil_layer else "swing_share")
    return [
        said
        for key, said in words.items()
        if getattr(seasons, key) == getattr(usual, key) and f"movement.seasons.{key}" not in sampled
    ]


def assumed_slow_strains(scene: Scene, sampled: Collection[str] = ()) -> list[str]:
    """Return those of the numbers that shape slow strains over time, in words, that are the defaults.

    Parameters
    ----------
    scene : Scene
        The wall.
    sampled : Collection[str]
        Places of the numbers that a study samples; these are left out.
    """
    strain, creep, usual = scene.strain, scene.creep, Strain()
    values: dict[str, tuple[bool, str]] = {}
    if strain is not None and strain.growth and scene.movement.stage:
        values["strain.growth_years"] = (
            strain.growth_years == usual.growth_years,
            f"growth reached in {usual.growth_years:g} years",
        )
        values["strain.growth_time"] = (
            strain.growth_time == usual.growth_time,
            f"a time constant of growth of {usual.growth_time:g} years",
        )
    if creep is not None:
        values["creep.coefficient"] = (
            creep.coefficient == Creep().coefficient,
            f"a creep coefficient of {Creep().coefficient:g}",
        )
    return [words for place, (default, words) in values.items() if default and place not in sampled]


def ground_line(scene: Scene, sampled: Collection[str] = ()) -> str | None:
    """Return one sentence on the assumed properties of the ground; None if there are none.

    Parameters
    ----------
    scene : Scene
        The wall.
    sampled : Collection[str]
        Places of the numbers that a study samples; these are left out.
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
