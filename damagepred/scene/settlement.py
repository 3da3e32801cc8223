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
    **dict.fromkeys(("horizontal", "survey_error", "survey_seed"), ("table",)),
}
"""Shapes that read a key."""
DEPTH_OVER_WIDTH = 2.0
"""Depth of a tunnel over the trough width i, where only one is given: K = 0.5 in clay (O'Reilly and New 1982)."""
LEAST_IN_MIDDLE = 0.05
"""Least deviation of the middle from the line through the ends, over the largest deviation of a shape."""
ZERO = 1e-9
"""Size of a profile, over its largest value, that counts as 0 because of rounding."""
POINTS = 2001
"""Points along the wall at which a profile is measured."""


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
