"""Profiles of footing and ground, over their largest or mid-span displacement."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np

from damagepred.arrays import FloatArray


def three_loads(xi: FloatArray) -> FloatArray:
    """Simply supported elastic beam (Euler-Bernoulli) under equal loads at the quarter points, 1 at mid-span."""
    near = np.minimum(xi, 1.0 - xi)
    return (384.0 / 19.0) * (5.0 * near / 32.0 - near**3 / 4.0 + np.maximum(near - 0.25, 0.0) ** 3 / 6.0)


def arc(xi: FloatArray, ratio: float) -> FloatArray:
    """Circular arc through both ends, rising 1 at mid-span; ``ratio``: rise over chord, below 1/2."""
    if ratio < 1e-6:  # the circle's radius loses all digits; its limit is the parabola
        return 4.0 * xi * (1.0 - xi)
    radius = 1.0 / (8.0 * ratio) + ratio / 2.0
    offset = xi - 0.5
    # radius - sqrt(radius^2 - offset^2), without cancellation
    drop = offset**2 / (radius + np.sqrt(radius**2 - offset**2))
    return 1.0 - drop / ratio


def through_points(table: Sequence[Sequence[float]], xi: FloatArray) -> FloatArray:
    """Monotone cubic (PCHIP) through points (position, value) with increasing positions."""
    from scipy.interpolate import PchipInterpolator

    position, fraction = np.array(table).T
    return np.asarray(PchipInterpolator(position, fraction)(xi), dtype=np.float64)


def require_positions(name: str, points: Sequence[Sequence[float]], least: int) -> None:
    """Check the positions of a table of points, from one end of the wall to the other (ValueError)."""
    if len(points) < least:
        raise ValueError(f"{name}: needs at least {least} points [position, fraction], from position 0 to 1")
    position = [p for p, _ in points]
    if position[0] != 0 or position[-1] != 1 or any(b <= a for a, b in itertools.pairwise(position)):
        raise ValueError(f"{name}: positions must rise from 0 to 1 (fractions of the wall's length)")


def bell(away: FloatArray, reach: float) -> FloatArray:
    """Wet patch about a leaking pipe: (1 + cos(pi d / reach)) / 2, level in the middle and at its rim (own choice)."""
    return 0.5 * (1.0 + np.cos(np.pi * np.minimum(np.abs(away) / reach, 1.0)))


def gaussian(away: FloatArray, inflection: float) -> FloatArray:
    """Trough across a tunnel: exp(-d^2 / (2 i^2)) (Peck 1969); i = K z_0, K = 0.4 to 0.5 in clay (O'Reilly and New)."""
    return np.exp(-0.5 * (away / inflection) ** 2)
