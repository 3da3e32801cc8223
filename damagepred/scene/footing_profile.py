"""Prescribed profiles of a footing: deflection over the deflection at mid-span, along the span."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from damagepred.arrays import FloatArray


def three_loads(xi: FloatArray) -> FloatArray:
    """Simply supported elastic beam under equal loads at the quarter points, 1 at mid-span; ``xi``: position.

    s = (384/19) [5 xi/32 - xi^3/4 + <xi - 1/4>^3/6] for xi <= 1/2, symmetric; the quarter points are at 27/38
    (Euler-Bernoulli).
    """
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
