"""Settlement of the ground along a wall: forms, size, and the measures of its distortion."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from damagepred.arrays import FloatArray
from damagepred.scene.footing_profile import bell, gaussian

if TYPE_CHECKING:
    from damagepred.scene.movement import Movement

SETTLEMENTS = ("settle", "tilt", "trough", "step")
"""Shapes of ``[movement]`` whose size is ``settlement``; a table may have it, too."""
READ_WITH: dict[str, tuple[str, ...]] = {
    "settlement_is": (*SETTLEMENTS, "table"),
    "end": ("settle", "tilt", "step"),
    "position": ("settle", "trough", "step"),
    "reach": ("settle",),
    **dict.fromkeys(("trough_width", "tunnel_depth", "volume_loss", "tunnel_diameter"), ("trough",)),
    **dict.fromkeys(("table", "horizontal", "survey_error", "survey_seed"), ("table",)),
}
"""Shapes that read a key."""
DEPTH_OVER_WIDTH = 2.0
"""Depth of a tunnel over the trough width i, where only one is given: K = 0.5 in clay (O'Reilly and New 1982)."""
LEAST_IN_MIDDLE = 0.05
"""Least deviation of the middle from the line through the ends, over the largest deviation of a shape."""
ZERO = 1e-9  # size of a profile, over its largest value, that counts as 0 because of rounding
POINTS = 2001  # points along the wall at which a profile is measured


def require_settlement(movement: Movement) -> None:
    """Refuse keys that the shape does not read, and settlements without a size."""
    for key, shapes in READ_WITH.items():
        if getattr(movement, key) not in (None, ()) and movement.shape not in shapes:
            by = " or ".join(map(repr, shapes))
            raise ValueError(f"{key}: only read with shape = {by}; here shape = '{movement.shape}'")
    if movement.settlement is not None and movement.shape not in (*SETTLEMENTS, "table"):
        raise ValueError(
            f"settlement: goes with shape = {', '.join(map(repr, SETTLEMENTS))} or 'table'; shape = '{movement.shape}' "
            f"takes {'surface_movement in [mound]' if movement.shape == 'mound' else 'central_deflection'}"
        )
    if not movement.settles:
        if movement.settlement_is is not None:
            raise ValueError("settlement_is: is missing its settlement, such as settlement = '25 mm'")
        return
    if not movement.local:
        raise ValueError(
            f"kind = '{movement.kind}': with settlement the ground goes down ('settle') or up ('heave'); take one of "
            "these, or leave kind out"
        )
    if movement.central_deflection:
        raise ValueError(
            f"central_deflection = {movement.central_deflection:g} m: the size is settlement; leave out one of both"
        )
    if movement.shape == "settle" and movement.end and movement.position is not None:
        raise ValueError("end: is not read with position; leave out one of both")
    if movement.shape == "trough" and not (movement.trough_width or movement.tunnel_depth):
        raise ValueError(
            "trough_width: is missing; shape = 'trough' needs the distance i of the inflection point from the axis "
            "(m), or tunnel_depth"
        )
    lost = (movement.volume_loss, movement.tunnel_diameter)
    if any(lost) and not all(lost):
        raise ValueError("volume_loss: goes with tunnel_diameter; give both, or settlement")
    if all(lost) and (movement.stage or movement.seasons or movement.settlement is not None):
        raise ValueError("volume_loss: determines the settlement; leave out settlement, stages and seasons, or it")
    if movement.settlement is None and not any(lost) and movement.seasons is None:
        raise ValueError(f"settlement: is missing; shape = '{movement.shape}' needs its size, such as '25 mm'")
    if movement.shape == "tilt" and movement.settlement_is == "relative":
        raise ValueError("settlement_is = 'relative': a tilt is a straight line; take 'largest'")


def signed_size(value: FloatArray, position: FloatArray, measure: str | None) -> float:
    """Size of a profile by ``settlement_is``, with the sign of its largest value or deviation."""
    if measure == "relative":
        value = value - np.interp(position, position[[0, -1]], value[[0, -1]])
    largest = float(value[np.abs(value).argmax()])
    return math.copysign(float(np.ptp(value)), largest) if measure == "range" else largest


def settlement_form(movement: Movement, x: FloatArray, length: float) -> FloatArray:
    """Form of a shape, 1 at its largest; x (m)."""
    left, shape = movement.end != "right", movement.shape
    if shape == "tilt":
        return 1.0 - x / length if left else x / length
    if shape == "trough":
        return gaussian(x - axis(movement, length), trough(movement)[0])
    at = movement.position
    if shape == "step":
        at = length / 2.0 if at is None else at
        return np.where(x < at, 1.0, 0.0) if left else np.where(x > at, 1.0, 0.0)
    at = (0.0 if left else length) if at is None else at
    return bell(x - at, movement.reach or length / 2.0)


def axis(movement: Movement, length: float) -> float:
    """Position of a trough's axis along the wall (m)."""
    return length / 2.0 if movement.position is None else movement.position


def trough(movement: Movement) -> tuple[float, float]:
    """Width i of a trough and depth of its tunnel (m); one follows from the other."""
    width, depth = movement.trough_width, movement.tunnel_depth
    return width or (depth or 0.0) / DEPTH_OVER_WIDTH, depth or DEPTH_OVER_WIDTH * (width or 0.0)


def by_volume_loss(movement: Movement) -> float:
    """Largest settlement (m) of a trough: V_l pi D^2 / 4 over sqrt(2 pi) i (Peck 1969)."""
    lost = (movement.volume_loss or 0.0) * math.pi * (movement.tunnel_diameter or 0.0) ** 2 / 4.0
    return lost / (math.sqrt(2.0 * math.pi) * trough(movement)[0])


def profile_measures(vertical: FloatArray, horizontal: FloatArray, length: float, gauge: float) -> dict[str, float]:
    """Measures of a profile on equally spaced points of a wall; slopes and strains over a gauge length (m)."""
    x = np.linspace(0.0, length, len(vertical))
    gauge = min(gauge, length)
    start = np.linspace(0.0, length - gauge, len(vertical))

    def over_gauge(value: FloatArray) -> FloatArray:
        return (np.interp(start + gauge, x, value) - np.interp(start, x, value)) / gauge

    tilt = (vertical[-1] - vertical[0]) / length
    off_chord = vertical - np.interp(x, x[[0, -1]], vertical[[0, -1]])
    measures = {
        "differential_settlement": np.ptp(vertical),
        "deflection_ratio": np.abs(off_chord).max() / length,
        "angular_distortion": np.abs(over_gauge(vertical) - tilt).max(),
        "ground_tilt": abs(tilt),
        "horizontal_strain": np.abs(over_gauge(horizontal)).max(),
        "central_deflection": abs(np.interp(length / 2.0, x, off_chord)),
    }
    rounding = 1e-12 * np.abs(vertical).max(initial=0.0)  # of the line through the ends
    return {name: float(value) if value > rounding else 0.0 for name, value in measures.items()}
