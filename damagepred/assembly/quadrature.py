"""Where the contacts of an interface lie, and what share of it each stands for."""

from __future__ import annotations

import numpy as np

from damagepred.arrays import FloatArray


def quadrature(rule: str, count: int) -> tuple[FloatArray, FloatArray]:
    """Points in [-1/2, 1/2] and weights that sum to 1: equal parts ("midpoint"), or Gauss-Lobatto with both ends."""
    if rule == "midpoint":
        return (np.arange(count) + 0.5) / count - 0.5, np.full(count, 1.0 / count)
    if count < 2:
        raise ValueError("Lobatto quadrature needs at least 2 points")
    legendre = np.polynomial.legendre.Legendre.basis(count - 1)
    inner = np.sort(np.real(legendre.deriv().roots())) if count > 2 else np.empty(0)
    inner = 0.5 * (inner - inner[::-1])  # symmetric to the last digit
    points = np.concatenate(([-1.0], inner, [1.0]))
    weights = 1.0 / (count * (count - 1) * legendre(points) ** 2)
    return points / 2.0, weights / weights.sum()
