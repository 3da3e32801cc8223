"""Values of joints from standard normals, quickly also where a distribution's quantiles are slow to find.

A sample needs thousands of quantiles of each field. Those of most distributions take microseconds each, some far more;
as functions of the standard normal they are smooth between a few breaks, and a polynomial on each of some dozen cells
gives them as well.
"""

from __future__ import annotations

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import ArrayLike

from damagepred.arrays import FloatArray
from damagepred.uq.marginals import Marginal, Table, breaks, from_normal

TOLERANCE = 3e-10
"""Largest error of a value, relative to the largest next to it, or to a millionth of the standard deviation."""

REACH = 6.0
"""Standard normals beyond are rarer than two in 10^9: they are done one by one. (Far beyond, quantiles of scipy are not
reliable.)"""

FIRST_CELL = 0.5
SMALLEST_CELL = 2e-4
"""Width in standard normals; cells as small as this that have no good polynomial are done one by one, too."""

DEGREE = 7

CLOSED = frozenset(
    {
        "norm",
        "lognorm",
        "uniform",
        "weibull_min",
        "weibull_max",
        "gumbel_r",
        "gumbel_l",
        "expon",
        "logistic",
        "cauchy",
        "rayleigh",
        "pareto",
        "genextreme",
        "laplace",
    }
)
"""Distributions of scipy.stats whose quantiles are a formula; they need no table."""


class JointQuantile:
    """Turns standard normals into values of a distribution, like ``from_normal``.

    Parameters
    ----------
    marginal : Marginal
        The distribution.
    """

    def __init__(self, marginal: Marginal) -> None:
        self.marginal = marginal
        self.quick = isinstance(marginal, Table) or getattr(getattr(marginal, "dist", None), "name", "") in CLOSED
        self._table: tuple[FloatArray, FloatArray] | None = None

    def __call__(self, z: ArrayLike) -> FloatArray:
        """Return the values: array like z.

        Parameters
        ----------
        z : array (n,)
            Standard normals.
        """
        z = np.asarray(z, dtype=np.float64)
        if self.quick:
            return from_normal(self.marginal, z)
        if self._table is None:
            self._table = _table(self.marginal)
        edges, coefficients = self._table
        # of a break, the value on its left: quantiles are continuous from there
        cell = np.clip(np.searchsorted(edges, z, side="left") - 1, 0, len(edges) - 2)
        low, high = edges[cell], edges[cell + 1]
        at = ((z - low) - (high - z)) / (high - low)
        found = coefficients[DEGREE, cell]
        for power in range(DEGREE - 1, -1, -1):
            found = found * at + coefficients[power, cell]
        alone = np.isnan(found) | (np.abs(z) > REACH)
        if alone.any():
            found[alone] = from_normal(self.marginal, z[alone])
        return np.asarray(found)


def _table(marginal: Marginal) -> tuple[FloatArray, FloatArray]:
    """Return the edges of cells (n + 1,) and the coefficients of powers of the place in each from -1 to 1 (8, n).

    Cells are halved until their polynomial is as good as it is to be; coefficients are NaN where it never is.
    """
    given = breaks(marginal)
    steps = round(2 * REACH / FIRST_CELL)
    edges = np.union1d(np.linspace(-REACH, REACH, steps + 1), given[np.abs(given) < REACH])
    left, right = edges[:-1], edges[1:]
    node, between = chebyshev.chebpts1(DEGREE + 1), np.append(chebyshev.chebpts1(DEGREE + 3), (-0.9999, 0.9999))
    to_powers = np.linalg.inv(np.vander(node, increasing=True))
    least = 1e-6 * float(marginal.std())
    done_left, done_right, done = [], [], []
    while left.size:
        middle, half = (left + right) / 2, (right - left) / 2
        x, between_x = (
            from_normal(marginal, (middle + np.outer(places, half)).ravel()).reshape(len(places), -1)
            for places in (node, between)
        )
        powers = to_powers @ x
        level = (x == x[0]).all(axis=0)  # atoms are what they are, without rounding
        powers[:, level] = 0.0
        powers[0, level] = x[0, level]
        error = np.abs(np.vander(between, DEGREE + 1, increasing=True) @ powers - between_x).max(axis=0)
        good = error <= TOLERANCE * np.maximum(np.abs(x).max(axis=0), least)
        given_up = ~good & (half < SMALLEST_CELL)
        powers[:, given_up] = np.nan
        settled = good | given_up
        done_left.append(left[settled])
        done_right.append(right[settled])
        done.append(powers[:, settled])
        left, right = np.append(left[~settled], middle[~settled]), np.append(middle[~settled], right[~settled])
    order = np.argsort(np.concatenate(done_left))
    return (
        np.append(np.concatenate(done_left)[order], np.concatenate(done_right)[order[-1]]),
        np.concatenate(done, axis=1)[:, order],
    )
