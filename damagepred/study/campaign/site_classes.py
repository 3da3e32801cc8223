"""Probability of each site class of a soil log whose properties are uncertain."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from damagepred.scene import Scene, SoilLayer, Suction, site_class, site_classes, surface_movement
from damagepred.study.settings import StudySettings

DRAWN = 1024
"""Draws of the soil, if a study has fewer samples."""


def surface_movements(settings: StudySettings, samples: int) -> list[float]:
    """Return the characteristic surface movement y_s of each sample of a study with a soil log (m).

    Parameters
    ----------
    settings : StudySettings
        The study; its variables of ``soil_layer``, ``suction`` and ``mound.suction_depth`` count.
    samples : int
        How many samples.
    """
    scene, values = settings.scene, settings.design().wall_values(samples)

    def drawn(table: str, field: str, given: float, sample: int) -> float:
        return float(values[place][sample]) if (place := f"{table}.{field}") in values else given

    def of_sample(i: int) -> float:
        layers = [
            SoilLayer(
                thickness=drawn(f"soil_layer.{n}", "thickness", layer.thickness, i),
                shrink_swell_index=drawn(f"soil_layer.{n}", "shrink_swell_index", layer.shrink_swell_index, i),
            )
            for n, layer in enumerate(scene.soil_layer)
        ]
        given = scene.suction or Suction()
        names = ("change", "cracked_share", "restraint", "restraint_depth")
        values: dict[str, Any] = {name: drawn("suction", name, getattr(given, name), i) for name in names}
        suction = replace(given, **values)
        return surface_movement(layers, suction, drawn("mound", "suction_depth", scene.mound.suction_depth, i))

    return [of_sample(i) for i in range(samples)]


def site_line(scene: Scene, settings: StudySettings | None = None) -> str | None:
    """Return y_s and the site class of a soil log in a sentence, and the probability of each class; None without a log.

    Parameters
    ----------
    scene : Scene
        The wall, its variables at their means.
    settings : StudySettings, optional
        The study, if it is one.
    """
    if not scene.soil_layer:
        return None
    y_s = surface_movement(scene.soil_layer, scene.suction or Suction(), scene.mound.suction_depth)
    line = f"soil log: y_s = {1e3 * y_s:.0f} mm, site class {site_class(y_s).name}"
    uncertain = settings is not None and any(
        place.split(".")[0] in ("soil_layer", "suction") or place == "mound.suction_depth"
        for place in settings.variables
    )
    if settings is None or not uncertain:
        return line
    samples = max(settings.study.samples, DRAWN)
    found = [site_class(y).name for y in surface_movements(settings, samples)]
    shares = {c.name: found.count(c.name) / samples for c in site_classes()}
    told = ", ".join(f"{name} {share:.2g}" for name, share in shares.items() if share > 0)
    return f"{line} at the means; probability of each class: {told}"
