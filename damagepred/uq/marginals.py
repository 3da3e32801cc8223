"""Marginal distributions that scipy.stats lacks, with the methods of frozen ones: tables of values, and mixtures."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import scipy
from numpy.polynomial import chebyshev
from numpy.typing import ArrayLike
from scipy import special

from damagepred.arrays import FloatArray

Marginal = Any  # distribution with the methods cdf, sf, ppf, isf, mean and std of frozen distributions of scipy.stats


def from_normal(marginal: Marginal, z: FloatArray) -> FloatArray:
    """Turn standard normals into values of a marginal, without losing the upper tail to rounding."""
    if isinstance(marginal, Mixture):
        return marginal.quantile(z)
    z = np.asarray(z, dtype=np.float64)
    low = z < 0
    values = np.empty_like(z)
    values[low] = marginal.ppf(special.ndtr(z[low]))
    values[~low] = marginal.isf(special.ndtr(-z[~low]))
    return values


def breaks(marginal: Marginal) -> FloatArray:
    """Return the standard normals at which a marginal's value jumps or has a kink: array (breaks,), ordered."""
    return marginal.breaks if isinstance(marginal, Table | Mixture) else np.empty(0)


class Table:
    """Finitely many values with their probabilities."""

    def __init__(self, values: ArrayLike, weights: ArrayLike | None = None) -> None:
        given = np.asarray(values, dtype=np.float64)
        weight = np.ones_like(given) if weights is None else np.asarray(weights, dtype=np.float64)
        self.values, index = np.unique(given, return_inverse=True)
        total = np.bincount(index.ravel(), weights=weight)
        self.probabilities: FloatArray = total / total.sum()
        self._below = np.minimum(np.cumsum(self.probabilities), 1.0)
        self._above = np.append(np.cumsum(self.probabilities[::-1])[::-1][1:], 0.0)
        self._below[-1] = 1.0

    @property
    def breaks(self) -> FloatArray:
        """Standard normals at which the value changes."""
        below, above = self._below[:-1], self._above[:-1]  # each is exact where it is the smaller
        return np.where(below < 0.5, special.ndtri(below), -special.ndtri(above))

    def cdf(self, x: ArrayLike) -> FloatArray:
        """Probability of at most x."""
        return np.append(0.0, self._below)[np.searchsorted(self.values, x, side="right")]

    def sf(self, x: ArrayLike) -> FloatArray:
        """Probability of more than x."""
        return np.append(1.0, self._above)[np.searchsorted(self.values, x, side="right")]

    def ppf(self, q: ArrayLike) -> FloatArray:
        """Smallest value whose cdf is at least q."""
        return self.values[np.minimum(np.searchsorted(self._below, q, side="left"), len(self.values) - 1)]

    def isf(self, q: ArrayLike) -> FloatArray:
        """Smallest value whose sf is at most q."""
        return self.values[len(self.values) - np.searchsorted(self._above[::-1], q, side="right")]

    def mean(self) -> float:
        """Mean."""
        return float(self.probabilities @ self.values)

    def std(self) -> float:
        """Return the standard deviation."""
        return float(np.sqrt(self.probabilities @ (self.values - self.mean()) ** 2))

    def support(self) -> tuple[float, float]:
        """Smallest and the largest value."""
        return float(self.values[0]), float(self.values[-1])


class Mixture:
    """One of several distributions, chosen by chance: sound and weak units of one wall."""

    def __init__(self, parts: Sequence[Any], weights: ArrayLike) -> None:
        self.parts = tuple(parts)
        weight = np.asarray(weights, dtype=np.float64)
        self.weights: FloatArray = weight / weight.sum()
        atoms = [p.values for p in self.parts if isinstance(p, Table)]
        self.atoms: FloatArray = np.unique(np.concatenate(atoms)) if atoms else np.empty(0)
        # below it the cdf is exact, above it the sf
        self._middle = float(np.median([component.ppf(0.5) for component in self.parts]))
        ends = np.array([end for component in self.parts for end in component.support()])
        marks = np.unique(np.append(ends[np.isfinite(ends)], self.atoms))
        # an atom is taken by all normals between its two scores
        self._atom_from, self._atom_to = self._score(np.nextafter(self.atoms, -np.inf)), self._score(self.atoms)
        scores = np.concatenate((self._score(np.nextafter(marks, -np.inf)), self._score(marks)))
        self.breaks: FloatArray = np.unique(scores[np.isfinite(scores)])
        self._grid_z = np.linspace(-6.0, 6.0, 1201)
        self._grid_x = self._quantile(self._grid_z, *self._bracket(self._grid_z))
        self._near = scipy.interpolate.PchipInterpolator(self._grid_z, self._grid_x)

    def cdf(self, x: ArrayLike) -> FloatArray:
        """Probability of at most x."""
        return np.asarray(sum(w * component.cdf(x) for w, component in zip(self.weights, self.parts)))

    def sf(self, x: ArrayLike) -> FloatArray:
        """Probability of more than x."""
        return np.asarray(sum(w * component.sf(x) for w, component in zip(self.weights, self.parts)))

    def ppf(self, q: ArrayLike) -> FloatArray:
        """Smallest value whose cdf is at least q."""
        return self.quantile(special.ndtri(q))

    def isf(self, q: ArrayLike) -> FloatArray:
        """Smallest value whose sf is at most q."""
        return self.quantile(-special.ndtri(q))

    def mean(self) -> float:
        """Mean."""
        return float(sum(w * component.mean() for w, component in zip(self.weights, self.parts)))

    def std(self) -> float:
        """Return the standard deviation."""
        mean = self.mean()
        each = zip(self.weights, self.parts)
        squares = (w * (part.std() ** 2 + (part.mean() - mean) ** 2) for w, part in each)
        return float(np.sqrt(sum(squares)))

    def support(self) -> tuple[float, float]:
        """Smallest and the largest value."""
        low, high = zip(*(component.support() for component in self.parts))
        return float(min(low)), float(max(high))

    def quantile(self, z: ArrayLike) -> FloatArray:
        """Values that standard normals stand for."""
        given = np.atleast_1d(np.asarray(z, dtype=np.float64))
        flat = given.ravel()
        cell = np.searchsorted(self._grid_z, flat)
        inside = (cell > 0) & (cell < len(self._grid_z))
        values = np.empty_like(flat)
        between, wanted = cell[inside], flat[inside]
        values[inside] = self._quantile(wanted, self._grid_x[between - 1], self._grid_x[between], self._near(wanted))
        values[~inside] = self._quantile(flat[~inside], *self._bracket(flat[~inside]))
        return values.reshape(np.shape(z))

    def _score(self, x: FloatArray) -> FloatArray:
        below = x < self._middle
        score = np.empty_like(x)
        score[below] = special.ndtri(self.cdf(x[below]))
        score[~below] = -special.ndtri(self.sf(x[~below]))
        return score

    def _bracket(self, z: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Least and the greatest of the parts' own quantiles, between which the mixture's lies."""
        each = np.array([from_normal(component, z) for component in self.parts]).reshape(len(self.parts), -1)
        return each.min(axis=0), each.max(axis=0)

    def _quantile(self, z: FloatArray, low: FloatArray, high: FloatArray, near: FloatArray | None = None) -> FloatArray:
        """Values with normal scores z between bounds, by the Illinois method safeguarded by bisection."""
        x = np.where(np.isneginf(z), low, high)
        is_atom = np.zeros(len(z), dtype=bool)
        for atom, first, last in zip(self.atoms, self._atom_from, self._atom_to):
            inside = (z > first) & (z <= last)
            x[inside], is_atom[inside] = atom, True
        open_ = np.flatnonzero(~is_atom & (low < high) & np.isfinite(z))
        a, b, wanted = low[open_], high[open_], z[open_]
        at_a, at_b = self._score(a) - wanted, self._score(b) - wanted
        for turn in range(200):
            if not open_.size:
                break
            if turn == 0 and near is not None:
                middle = near[open_]
            else:
                with np.errstate(invalid="ignore", divide="ignore"):
                    middle = b - at_b * (b - a) / (at_b - at_a)
            halve = ~np.isfinite(middle) | (middle <= a) | (middle >= b) | (turn % 8 == 7)
            middle = np.where(halve, 0.5 * a + 0.5 * b, middle)
            value = self._score(middle) - wanted
            done = (np.abs(value) <= 1e-12) | (middle <= a) | (middle >= b)
            x[open_] = middle
            above = value >= 0
            # illinois: an end that stays twice counts half
            at_a, at_b = np.where(above, 0.5 * at_a, value), np.where(above, value, 0.5 * at_b)
            a, b = np.where(above, a, middle), np.where(above, middle, b)
            open_ = open_[~done]
            a, b, at_a, at_b, wanted = (v[~done] for v in (a, b, at_a, at_b, wanted))
        return x


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
