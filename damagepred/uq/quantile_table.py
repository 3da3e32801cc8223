"""Values of joints from standard normals, by piecewise polynomials where quantiles are slow to compute."""

from __future__ import annotations

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import ArrayLike
from scipy import special

from damagepred.arrays import FloatArray
from damagepred.uq.marginals import Marginal, Table, breaks, from_normal

TOLERANCE = 3e-10
"""Largest error of a value, relative to the largest next to it, or to a millionth of the standard deviation (1)."""
LARGEST_NORMAL = 6.0
"""Standard normals beyond are solved one by one: rarer than two in 10^9, and far beyond scipy is not reliable."""
INITIAL_CELL, NARROWEST_CELL = 0.5, 2e-4
"""Width of the cells in standard normals; without a good polynomial in the smallest, values are solved one by one."""
DEGREE = 7  # degree of the polynomials
CLOSED = (
    *("norm", "lognorm", "uniform", "weibull_min", "weibull_max", "gumbel_r", "gumbel_l", "expon", "logistic"),
    *("cauchy", "rayleigh", "pareto", "genextreme", "laplace"),
)
"""Distributions of scipy.stats whose quantiles are a formula; they need no table."""


class JointQuantile:
    """Turns standard normals into values of a distribution, like ``from_normal``."""

    def __init__(self, marginal: Marginal) -> None:
        self.marginal = marginal
        name = getattr(getattr(marginal, "dist", None), "name", "")
        self.quick = isinstance(marginal, Table) or name in CLOSED
        given = getattr(marginal, "kwds", {})
        self._lognormal = given if name == "lognorm" and given.keys() == {"s", "scale"} else None
        self._table: tuple[FloatArray, FloatArray] | None = None

    def __call__(self, z: ArrayLike) -> FloatArray:
        """Values that standard normals z (n,) stand for, array (n,)."""
        z = np.asarray(z, dtype=np.float64)
        if self._lognormal is not None:
            # through the probability of the nearer tail, as in from_normal: the very same values
            normal = np.copysign(special.ndtri(special.ndtr(-np.abs(z))), z)
            return np.asarray(np.exp(self._lognormal["s"] * normal) * self._lognormal["scale"])
        if self.quick:
            return from_normal(self.marginal, z)
        if self._table is None:
            self._table = _table(self.marginal)
        edges, coefficients = self._table
        # of a break, the value on its left: quantiles are continuous from there
        cell = np.clip(np.searchsorted(edges, z, side="left") - 1, 0, len(edges) - 2)
        low, high = edges[cell], edges[cell + 1]
        at = ((z - low) - (high - z)) / (high - low)
        values = coefficients[-1, cell]
        for power in range(len(coefficients) - 2, -1, -1):
            values = values * at + coefficients[power, cell]
        outside = np.isnan(values) | (np.abs(z) > LARGEST_NORMAL)
        if outside.any():
            values[outside] = from_normal(self.marginal, z[outside])
        return np.asarray(values)


def _table(marginal: Marginal) -> tuple[FloatArray, FloatArray]:
    """Edges of cells (n + 1,) and the coefficients of powers of the place in each from -1 to 1."""
    given, reach = breaks(marginal), LARGEST_NORMAL
    steps = round(2 * reach / INITIAL_CELL)
    edges = np.union1d(np.linspace(-reach, reach, steps + 1), given[np.abs(given) < reach])
    remaining, right = edges[:-1], edges[1:]
    node, between = chebyshev.chebpts1(DEGREE + 1), np.append(chebyshev.chebpts1(DEGREE + 3), (-0.9999, 0.9999))
    to_powers = np.linalg.inv(np.vander(node, increasing=True))
    least = 1e-6 * float(marginal.std())
    done_left, done_right, done = [], [], []
    while remaining.size:
        middle, half = (remaining + right) / 2, (right - remaining) / 2
        at = [(middle + np.outer(places, half)).ravel() for places in (node, between)]
        x, between_x = (from_normal(marginal, z).reshape(-1, len(half)) for z in at)
        powers = to_powers @ x
        constant = (x == x[0]).all(axis=0)  # an atom is its value, without rounding
        powers[:, constant] = 0.0
        powers[0, constant] = x[0, constant]
        error = np.abs(np.vander(between, DEGREE + 1, increasing=True) @ powers - between_x).max(axis=0)
        good = error <= TOLERANCE * np.maximum(np.abs(x).max(axis=0), least)
        given_up = ~good & (half < NARROWEST_CELL)
        powers[:, given_up] = np.nan
        settled = good | given_up
        done_left.append(remaining[settled])
        done_right.append(right[settled])
        done.append(powers[:, settled])
        left, middle, right = (ends[~settled] for ends in (remaining, middle, right))
        remaining, right = np.append(left, middle), np.append(middle, right)
    order = np.argsort(np.concatenate(done_left))
    edges, last = np.concatenate(done_left)[order], np.concatenate(done_right)[order[-1]]
    return np.append(edges, last), np.concatenate(done, axis=1)[:, order]
