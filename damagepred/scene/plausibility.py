"""Numbers that are unlikely or impossible in their unit, with the likely meaning."""

from __future__ import annotations

import math
from collections.abc import Mapping

from damagepred.errors import InputError
from damagepred.scene.scene import Scene

_LEAST = {
    "tensile_strength": (10.0, 100.0, "MPa"),
    "cohesion": (10.0, 100.0, "MPa"),
    "compressive_strength": (1e3, 1e4, "MPa"),
    "steel_strength": (1e4, 1e6, "MPa"),
    "normal_stiffness": (1e4, 1e6, "N/mm3"),
    "shear_stiffness": (1e4, 1e6, "N/mm3"),
    "swelling_stiffness": (1e4, 1e5, "kPa/m"),
    "shrinking_stiffness": (1e4, 1e5, "kPa/m"),
    "elastic_modulus": (1e5, 1e6, "MPa"),
    "steel_modulus": (1e6, 1e8, "MPa"),
    "density": (50.0, 200.0, ""),
    "roof": (0.0, 100.0, "kN"),
}
"""End of a key: numbers (SI) below which it is impossible and unlikely, and the unit likely meant. 0 is a choice.

A thousandth of the weakest masonry or softest clay and less is impossible: a mortar of 10 kPa crumbles in the hand, and
a strip footing sinks by metres into soil of 10 kPa/m.
"""

_MOST = {
    "friction": (5.0, 5.0),
    "density": (12e3, 9e3),
    "suction_depth": (300.0, 30.0),
    "control_joint.width": (5.0, 0.5),
    "dpc_threshold": (1.0, 0.1),
    "group_distance": (500.0, 50.0),
}
"""End of a key, or table and key: numbers (SI) above which it is impossible and unlikely.

5 is the tangent of 79 degrees; rough stone reaches about 1.5. Nothing that walls are built of is denser than lead.
"""


def unlikely_values(scene: Scene, means: Mapping[str, float] | None = None) -> list[str]:
    """Return numbers that are possible but unlikely, each in a sentence with what is likely meant."""
    found = []
    for place, value in {**scene.numbers, **(means or {})}.items():
        least, most = _limits(place, 1)
        if value and not least <= value <= most:
            found.append(f"{_shown(place, value)}: did you mean {_meant(place, value)}?")
    return found


def require_possible(scene: Scene, means: Mapping[str, float], source: str) -> None:
    """Refuse numbers of a scene, or means of variables in their place, that no masonry and no soil has."""
    found = []
    for place, value in {**scene.numbers, **means}.items():
        least, most = _limits(place, 0)
        if value and not least <= value <= most:
            unit = Scene.unit_of(place).replace("**", "").removesuffix("1")
            bound = f"0, or at least {least:g}" if value < least else f"at most {most:g}"
            where = f'[variables."{place}"]: mean of ' if place in means else ""
            found.append(
                f"{source}: {where}{_shown(place, value)}: must be {f'{bound} {unit}'.strip()}. "
                f"Did you mean {_meant(place, value)}?"
            )
    if found:
        raise InputError("\n".join(found))


def _limits(place: str, which: int) -> tuple[float, float]:
    """Least and most of a number: 0 possible, 1 likely."""
    table, key = place.split(".")[0], place.split(".")[-1]
    ends = _LEAST if Scene.unit_of(place) != "1" else {}  # a factor on a strength has no unit
    least = next((limits[which] for end, limits in ends.items() if key.endswith(end)), -math.inf)
    most = next((limits[which] for end, limits in _MOST.items() if f"{table}.{key}".endswith(end)), math.inf)
    return float(least), most


def _shown(place: str, value: float) -> str:
    unit = Scene.unit_of(place).replace("**", "")
    return f"{place} = {value:g}" + (f" {unit}" if unit != "1" else "")


def _meant(place: str, value: float) -> str:
    """Likely meaning of an unlikely number."""
    key = place.split(".")[-1]
    if key == "density":
        factor = 1e3 if value < 10.0 else 1e3 / 9.81 if value < 200.0 else 1 / 9.81
        return f"'{value * factor:.0f} kg/m3'"
    if key.endswith("friction"):
        return f"{math.tan(math.radians(min(value, 89.0))):.2f}, the tangent of {value:g} degrees"
    if key.endswith("modulus") and value < 1e3:
        return f"'{value:g} GPa'"
    return f"'{value:g} {next((unit for end, (*_, unit) in _LEAST.items() if key.endswith(end)), 'mm')}'"
