"""Numbers that are unlikely or impossible in their unit, with a suggestion."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import cache
from typing import Protocol

from damagepred.errors import InputError


class Numbered(Protocol):
    """Numbers by key with their SI units, such as a scene."""

    @property
    def numbers(self) -> Mapping[str, float]: ...  # noqa: D102

    @staticmethod
    def unit_of(place: str) -> str: ...  # noqa: D102


_LEAST = {
    **dict.fromkeys(("tensile_strength", "cohesion"), (10.0, 100.0, "MPa")),
    "compressive_strength": (1e3, 1e4, "MPa"),
    "steel_strength": (1e4, 1e6, "MPa"),
    **dict.fromkeys(("normal_stiffness", "shear_stiffness"), (1e4, 1e6, "N/mm3")),
    **dict.fromkeys(("swelling_stiffness", "shrinking_stiffness"), (1e4, 1e5, "kPa/m")),
    "elastic_modulus": (1e5, 1e6, "MPa"),
    "steel_modulus": (1e6, 1e8, "MPa"),
    "density": (50.0, 200.0, ""),
    **dict.fromkeys(("roof", "load.force"), (0.0, 100.0, "kN")),
    "line_load": (0.0, 100.0, "kN/m"),
    "pressure": (0.0, 20.0, "kPa"),
}
"""End of a key: numbers (SI) below which a value is impossible and unlikely, and the suggested unit. 0 is allowed.

A thousandth of the weakest masonry or softest clay is impossible: a mortar of 10 kPa crumbles in the hand, and a strip
footing sinks by metres into soil of 10 kPa/m.
"""

_MOST = {
    "friction": (5.0, 5.0),
    "density": (12e3, 9e3),
    # the ground and a loading move by millimetres
    **dict.fromkeys(("surface_movement", "movement.trend", "movement.swing", "movement.shift"), (2.0, 0.3)),
    **dict.fromkeys(("movement.settlement", "loading.displacement"), (2.0, 0.3)),
    # widths in joints and cracks, by millimetres
    **dict.fromkeys(("loading.opening", "dpc_threshold", "footing_threshold", "band_threshold"), (1.0, 0.1)),
    "control_joint.width": (5.0, 0.5),
    # parts of a wall
    "lintel_bearing": (5.0, 1.0),
    "segment_length": (50.0, 5.0),
    "group_distance": (500.0, 50.0),
    "band_gauge": (100.0, 20.0),
    # the ground around and below
    **dict.fromkeys(("mound.position", "movement.position"), (5000.0, 500.0)),
    **dict.fromkeys(("mound.reach", "movement.reach", "mound.edge_distance"), (500.0, 100.0)),
    **dict.fromkeys(("mound.dishing_edge_base", "trough_width", "tunnel_diameter", "tunnel_depth"), (500.0, 100.0)),
    **dict.fromkeys(("embedment", "suction_depth", "restraint_depth", "soil_layer.thickness"), (300.0, 30.0)),
}
"""End of a key, or table and key: numbers (SI), of either sign, above which a value is impossible and unlikely.

A length above its bound is millimetres without their unit: a soil layer of 400, a swing of 20.
5 is the tangent of 79 degrees; rough stone reaches about 1.5. No building material is denser than lead.
"""


def unlikely_values(scene: Numbered, means: Mapping[str, float] | None = None) -> list[str]:
    """Possible but unlikely numbers, each in a sentence with a suggestion."""
    sentences = []
    for key, value in {**scene.numbers, **(means or {})}.items():
        least, most = _limits(key, scene.unit_of(key), 1)
        if value and not (least <= value and abs(value) <= most):
            sentences.append(f"{_shown(key, value, scene.unit_of(key))}: did you mean {_meant(key, value)}?")
    return sentences


def require_possible(scene: Numbered, means: Mapping[str, float], source: str) -> None:
    """Refuse numbers of a scene, or means of variables, that no masonry and no soil has."""
    sentences = []
    for key, value in {**scene.numbers, **means}.items():
        least, most = _limits(key, unit := scene.unit_of(key), 0)
        if value and not (least <= value and abs(value) <= most):
            si = unit.replace("**", "").removesuffix("1")
            bound = f"0, or at least {least:g}" if value < least else f"at most {most:g}"
            where = f'[variables."{key}"]: mean of ' if key in means else ""
            sentences.append(
                f"{source}: {where}{_shown(key, value, unit)}: must be {f'{bound} {si}'.strip()}. "
                f"Did you mean {_meant(key, value)}?"
            )
    if sentences:
        raise InputError("\n".join(sentences))


@cache
def _limits(path: str, unit: str, which: int) -> tuple[float, float]:
    """Least and largest value of a number: 0 possible, 1 likely."""
    table, key = path.split(".")[0], path.split(".")[-1]
    ends = _LEAST if unit != "1" else {}  # a factor on a strength has no unit
    least, most = (
        next((limits[which] for end, limits in bounds.items() if f"{table}.{key}".endswith(end)), none)
        for bounds, none in ((ends, -math.inf), (_MOST, math.inf))
    )
    return float(least), float(most)


def _shown(key: str, value: float, unit: str) -> str:
    return f"{key} = {value:g}" + (f" {unit.replace('**', '')}" if unit != "1" else "")


def _meant(path: str, value: float) -> str:
    """Suggested value for an implausible number."""
    table, key = path.split(".")[0], path.split(".")[-1]
    if key == "density":
        factor = 1e3 if value < 10.0 else 1e3 / 9.81 if value < 200.0 else 1 / 9.81
        return f"'{value * factor:.0f} kg/m3'"
    if key.endswith("friction"):
        return f"{math.tan(math.radians(min(value, 89.0))):.2f}, the tangent of {value:g} degrees"
    if key.endswith("modulus") and value < 1e3:
        return f"'{value:g} GPa'"
    return f"'{value:g} {next((unit for end, (*_, unit) in _LEAST.items() if f'{table}.{key}'.endswith(end)), 'mm')}'"
