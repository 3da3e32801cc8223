"""Probability of each site class of a soil log whose properties are uncertain."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from damagepred.campaign.settings import StudySettings
from damagepred.enumerations import LOCAL
from damagepred.scene import Scene, SoilLayer, Suction, site_class, site_classes, surface_movement
from damagepred.scene.scene import step_names

DRAWN = 1024  # draws of the soil, if a study has fewer samples


def surface_movements(settings: StudySettings, samples: int) -> list[float]:
    """Characteristic surface movement y_s of each sample of a study with a soil log (m)."""
    scene, values = settings.scene, settings.design().wall_values(samples)

    def drawn(table: str, field: str, given: float, sample: int) -> float:
        return float(values[key][sample]) if (key := f"{table}.{field}") in values else given

    def of_sample(i: int) -> float:
        layers = [
            SoilLayer(
                thickness=drawn(f"soil_layer.{n}", "thickness", layer.thickness, i),
                shrink_swell_index=drawn(f"soil_layer.{n}", "shrink_swell_index", layer.shrink_swell_index, i),
            )
            for n, layer in zip(step_names(scene.soil_layer), scene.soil_layer)
        ]
        given = scene.suction or Suction()
        names = ("change", "cracked_share", "restraint", "restraint_depth")
        values: dict[str, Any] = {name: drawn("suction", name, getattr(given, name), i) for name in names}
        suction = replace(given, **values)
        return surface_movement(layers, suction, drawn("mound", "suction_depth", scene.mound.suction_depth, i))

    return [of_sample(i) for i in range(samples)]


def site_line(scene: Scene, settings: StudySettings | None = None) -> str | None:
    """y_s, site class and probability of each class of a soil log, in a sentence; None without a log."""
    if not scene.soil_layer:
        return None
    suction, depth = scene.suction or Suction(), scene.mound.suction_depth
    y_s = surface_movement(scene.soil_layer, suction, depth)
    at_tree = scene.mound.shape in ("tree", "pipe")  # local movements have no site class
    line = f"soil log: {LOCAL[scene.mound.shape] if at_tree else 'y_s'} = {1e3 * y_s:.0f} mm"
    line += "" if at_tree else f", site class {site_class(y_s).name}"
    if suction.below_log and (end := sum(layer.thickness for layer in scene.soil_layer)) < depth:
        below = "the last layer goes on" if suction.below_log == "extend" else "nothing moves"
        line += f"; below the log, from {end:g} to {depth:g} m, {below} (suction.below_log)"
    soil = ("soil_layer", "suction")
    keys = settings.variables if settings is not None else ()
    uncertain = any(key.split(".")[0] in soil or key == "mound.suction_depth" for key in keys)
    if settings is None or not uncertain or at_tree:
        return line
    samples = max(settings.study.samples, DRAWN)
    classes = [site_class(y).name for y in surface_movements(settings, samples)]
    shares = {c.name: classes.count(c.name) / samples for c in site_classes()}
    listed = ", ".join(f"{name} {share:.2g}" for name, share in shares.items() if share > 0)
    return f"{line} at the means; probability of each class: {listed}"
