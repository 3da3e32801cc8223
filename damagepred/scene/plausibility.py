"""Numbers that a scene takes but that are unlikely in their unit, with what is likely meant."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from damagepred.scene.reading import plain
from damagepred.scene.scene import Scene

_TOO_SMALL = {
    "tensile_strength": (100.0, "MPa"),
    "cohesion": (100.0, "MPa"),
    "compressive_strength": (1e4, "MPa"),
    "normal_stiffness": (1e6, "N/mm3"),
    "shear_stiffness": (1e6, "N/mm3"),
    "swelling_stiffness": (1e5, "kPa/m"),
    "shrinking_stiffness": (1e5, "kPa/m"),
    "roof": (100.0, "kN"),
}
"""Key, number (SI) below which it is unlikely, and the unit likely meant."""

_TOO_LARGE = {"suction_depth": 30.0, "control_joint.width": 0.5, "dpc_threshold": 0.1, "group_distance": 50.0}
"""Key, and length (m) above which millimetres are likely meant."""


def unlikely_values(scene: Scene, means: Mapping[str, float] | None = None) -> list[str]:
    """Return numbers that are possible but unlikely, each in a sentence with what is likely meant.

    Parameters
    ----------
    scene : Scene
        The wall.
    means : mapping of str to float, optional
        Means of what a study samples, by place; they stand for the scene's own.
    """
    values = {place: value for place, value in _numbers(plain(scene)).items() if value} | dict(means or {})
    found = []
    for place, value in values.items():
        if meant := _meant(place, float(value)):
            unit = Scene.unit_of(place)
            shown = f"{value:g}" if unit == "1" else f"{value:g} {unit.replace('**', '')}"
            found.append(f"{place} = {shown}: did you mean {meant}?")
    return found


def _numbers(tables: Any, place: str = "") -> dict[str, float]:
    """Return the numbers of nested tables by their place."""
    if isinstance(tables, Mapping):
        found: dict[str, float] = {}
        for key, part in tables.items():
            found |= _numbers(part, f"{place}.{key}" if place else str(key))
        return found
    if isinstance(tables, list):
        return _numbers({str(i): part for i, part in enumerate(tables)}, place)
    return {place: tables} if isinstance(tables, float) else {}


def _meant(place: str, value: float) -> str:
    """Return what is likely meant by an unlikely number, nothing if it is likely or not known."""
    table, key = place.split(".")[0], place.split(".")[-1]
    least, unit = _TOO_SMALL.get(key, (0.0, ""))
    if 0.0 < value < least:
        return f"'{value:g} {unit}'"
    if key == "elastic_modulus" and value < 1e6:
        return f"'{value:g} {'GPa' if value < 1e3 else 'MPa'}'"
    if key == "density" and (0.0 < value < 200.0 or value > 9e3):
        factor = 1e3 if value < 10.0 else 1e3 / 9.81 if value < 200.0 else 1 / 9.81
        return f"'{value * factor:.0f} kg/m3'"
    if key.endswith("friction") and value > 5.0:
        return f"{math.tan(math.radians(min(value, 89.0))):.2f}, the tangent of {value:g} degrees"
    if value > _TOO_LARGE.get(key, _TOO_LARGE.get(f"{table}.{key}", math.inf)):
        return f"'{value:g} mm'"
    return ""
