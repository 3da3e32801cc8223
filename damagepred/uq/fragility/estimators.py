"""What finds the parameters of lognormal curves for given weights of the walls: category by category, or together."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from scipy import sparse

from damagepred.arrays import FloatArray, Int8Array, IntArray
from damagepred.uq.fragility.fit import FITTED, Fit, reasons_not_fitted
from damagepred.uq.fragility.grouped_data import GroupedIntervals, group_equal, group_intervals
from damagepred.uq.fragility.likelihood import (
    LARGEST,
    SMALLEST,
    CategoryIntervals,
    LinearBounds,
    likelihood,
    linear_bounds,
    maximise_likelihood,
    scores,
)


class Estimator(Protocol):
    """Finds the parameters (1/dispersion, and for each category ln(median)/dispersion) for given weights of cells."""

    categories: list[int]
    cells: GroupedIntervals
    rows: LinearBounds | CategoryIntervals

    def row_weight(self, weight: FloatArray) -> FloatArray:
        """Return how often each of the ``rows`` counts for weights (resamples, cells)."""

    def at(self, weight: FloatArray, start: FloatArray | None = None) -> FloatArray:
        """Return parameters (resamples, 1 + categories) for weights (resamples, cells).

        Parameters
        ----------
        weight : array (resamples, groups)
            Number of walls of each group, weighted.
        start : array (parameters,), optional
            Where to begin.
        """

    def scores(self, at: FloatArray) -> FloatArray:
        """Return each cell's own gradient of the log-likelihood, array (cells, parameters)."""

    def hessian(self, at: FloatArray) -> FloatArray:
        """Return the curvature of the log-likelihood of all walls, array (parameters, parameters)."""

    def value(self, at: FloatArray) -> float:
        """Return the log-likelihood of all walls."""

    def best(self) -> FloatArray:
        """Return the parameters (1 + categories,) for all walls."""

    def fits(self) -> list[Fit]:
        """Return the curves of the categories."""


def estimators(cells: GroupedIntervals, common: bool = False, single: bool = False) -> list[Estimator]:
    """Return what fits the categories that can be fitted: one for each, or one for all.

    Parameters
    ----------
    cells : Cells
        Walls.
    common : bool
        One dispersion for all categories.
    single : bool
        Each wall is known at one movement alone.
    """
    good = [k for k, why in enumerate(reasons_not_fitted(cells, common)) if not why]
    if not common:
        return [CompositeLikelihood([k], cells.of(k)) for k in good]
    if not good:
        return []
    some = group_intervals(cells.lower[good], cells.upper[good], cells.weight, cells.number)
    return [OrdinalProbit(good, some) if single else CompositeLikelihood(good, some)]


class MaximumLikelihood:
    """What estimators share."""

    categories: list[int]
    cells: GroupedIntervals
    rows: LinearBounds | CategoryIntervals

    _best: FloatArray | None = None

    def best(self) -> FloatArray:
        """Return the parameters for all walls."""
        if self._best is None:
            self._best = self.at(self.cells.total[None])[0]
        return self._best

    def row_weight(self, weight: FloatArray) -> FloatArray:
        """Return how often each of the rows counts."""
        return weight

    def at(self, weight: FloatArray, start: FloatArray | None = None) -> FloatArray:
        """Return the parameters for weights of the cells.

        Parameters
        ----------
        weight : array (resamples, groups)
            Number of walls of each group, weighted.
        start : array (parameters,), optional
            Where to begin.
        """
        raise NotImplementedError

    def scores(self, at: FloatArray) -> FloatArray:
        """Return each cell's own gradient."""
        return scores(at, self.rows, len(self.cells.number))

    def hessian(self, at: FloatArray) -> FloatArray:
        """Return the curvature of the log-likelihood."""
        return likelihood(at[None], self.rows, self.row_weight(self.cells.total[None])).hessian[0]

    def value(self, at: FloatArray) -> float:
        """Return the log-likelihood."""
        return float(likelihood(at[None], self.rows, self.row_weight(self.cells.total[None])).value[0])

    def fits(self) -> list[Fit]:
        """Return the curves of the categories."""
        at = self.best()
        dispersion = 1.0 / at[0]
        if not SMALLEST < dispersion < LARGEST:
            why = f"no finite dispersion explains the walls (it runs to {dispersion:.2g})"
            return [Fit(np.nan, np.nan, why)] * len(self.categories)
        return [Fit(float(np.exp(h / at[0])), float(dispersion), FITTED) for h in at[1:]]


class CompositeLikelihood(MaximumLikelihood):
    """Intervals of capacities, the categories' likelihoods multiplied; with one category the likelihood itself.

    Parameters
    ----------
    categories : list of int
        Places of the categories among all.
    cells : Cells
        Walls, with these categories alone.
    """

    def __init__(self, categories: list[int], cells: GroupedIntervals) -> None:
        self.categories, self.cells = categories, cells
        size, count = len(categories), len(cells.number)
        if size == 1:
            self._sum = None
            lower, upper, kind = cells.lower[0], cells.upper[0], np.zeros(count, dtype=np.int8)
            self.rows = linear_bounds(lower, upper, np.ones((count, 1)))
        else:
            # cells that differ in other categories alone share a row of this one
            found = [group_equal(np.stack((cells.lower[k], cells.upper[k]))) for k in range(size)]
            ends = np.cumsum([len(first) for first, _ in found])
            lower = np.concatenate([cells.lower[k][first] for k, (first, _) in enumerate(found)])
            upper = np.concatenate([cells.upper[k][first] for k, (first, _) in enumerate(found)])
            kind = np.repeat(np.arange(size, dtype=np.int8), [len(first) for first, _ in found])
            place = np.column_stack([which + end - len(first) for (first, which), end in zip(found, ends)]).ravel()
            each = np.arange(0, size * count + 1, size)
            self._sum = sparse.csr_array((np.ones(size * count), place, each), shape=(count, int(ends[-1])))
            self.rows = CategoryIntervals(lower, upper, kind, size)
        self._start = _start(lower, upper, kind, size)

    def row_weight(self, weight: FloatArray) -> FloatArray:
        """Return how often each of the rows counts: cells that differ in other categories alone share one."""
        return weight if self._sum is None else np.asarray(weight @ self._sum)

    def at(self, weight: FloatArray, start: FloatArray | None = None) -> FloatArray:
        """Return the parameters for weights of the cells.

        Parameters
        ----------
        weight : array (resamples, groups)
            Number of walls of each group, weighted.
        start : array (parameters,), optional
            Where to begin.
        """
        return maximise_likelihood(self.rows, self.row_weight(weight), self._start if start is None else start)[0]

    def scores(self, at: FloatArray) -> FloatArray:
        """Return each cell's own gradient."""
        count = len(self.cells.number) if self._sum is None else self._sum.shape[1]
        found = scores(at, self.rows, count)
        return found if self._sum is None else np.asarray(self._sum @ found)


def _start(lower: FloatArray, upper: FloatArray, kind: Int8Array, kinds: int) -> FloatArray:
    """Return parameters from the middles of the intervals."""
    with np.errstate(divide="ignore", invalid="ignore"):
        low, high = np.log(lower), np.log(upper)
        middle = np.where(np.isinf(high), low, np.where(np.isinf(low), high - 0.7, (low + high) / 2))
    told = np.isfinite(middle)
    middle, kind = middle[told], kind[told]
    mean = np.bincount(kind, middle, kinds) / np.maximum(np.bincount(kind, minlength=kinds), 1)
    spread = np.clip(np.sqrt(np.mean((middle - mean[kind]) ** 2)), 0.05, 3.0)
    return np.append(1.0, mean) / spread


class OrdinalProbit(MaximumLikelihood):
    """Walls that are each known at one movement: the likelihood of the category each is in.

    Parameters
    ----------
    categories : list of int
        Places of the categories among all.
    cells : Cells
        Walls, with these categories alone; each interval reaches from 0 or to infinity.
    """

    def __init__(self, categories: list[int], cells: GroupedIntervals) -> None:
        self.categories = categories
        movement = np.where(np.isfinite(cells.upper), cells.upper, cells.lower).max(axis=0)
        told = movement > 0
        self.cells = GroupedIntervals(
            cells.lower[:, told], cells.upper[:, told], cells.weight[told], cells.number[told]
        )
        self._movement = movement[told]
        self._level = np.isfinite(self.cells.upper).sum(axis=0)
        self._composite = CompositeLikelihood(categories, self.cells)
        self.rows = self._rows(self._level, len(categories))

    def _rows(self, level: IntArray, size: int) -> LinearBounds:
        x = np.log(self._movement)[:, None]
        pick = np.vstack((np.zeros(size), np.eye(size), np.zeros(size)))
        below, above = np.hstack((x, -pick[level + 1])), np.hstack((x, -pick[level]))
        no_below, no_above = level == size, level == 0
        below[no_below], above[no_above] = 0.0, 0.0
        return LinearBounds(below, above, no_below, no_above, np.zeros(len(level), dtype=bool))

    def at(self, weight: FloatArray, start: FloatArray | None = None) -> FloatArray:
        """Return the parameters for weights of the cells.

        Parameters
        ----------
        weight : array (resamples, groups)
            Number of walls of each group, weighted.
        start : array (parameters,), optional
            Where to begin.
        """
        size = len(self.categories)
        begin = self._composite.at(weight, start)
        at = np.empty_like(begin)
        there = np.column_stack([(weight[:, self._level == level] > 0).any(axis=1) for level in range(size + 1)])
        patterns, which = np.unique(there, axis=0, return_inverse=True)
        for n, present in enumerate(patterns):
            who = np.flatnonzero(which.ravel() == n)
            # where no wall is in a category and not in the next, their curves are one
            merged = np.append(0, np.cumsum(present[1:-1]))
            kept = np.append(0, 1 + np.unique(merged, return_index=True)[1])
            level = np.append(0, merged + 1)[self._level]
            found, _ = maximise_likelihood(self._rows(level, int(merged[-1]) + 1), weight[who], begin[who][:, kept])
            at[who, 0], at[who, 1:] = found[:, 0], found[:, 1 + merged]
        return at
