"""Lognormal curves by maximum likelihood: each category for itself, or with one dispersion for all, which never cross.

Where each wall is known at one movement alone, one dispersion is the ordinal probit model. Along paths the product of
the categories' likelihoods is maximised (a composite likelihood: Varin, Reid and Firth 2011, Statistica Sinica 21);
each curve is as consistent as a fit of its own, and the medians ascend, for no wall reaches a worse category first.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from functools import cached_property

import numpy as np
import scipy

from damagepred.arrays import FloatArray, Int8Array, IntArray
from damagepred.inputs.arguments import checked, require_alike
from damagepred.runtime.one_thread import one_blas_thread
from damagepred.uq.fragility.fit import FITTED, Fit, GroupedIntervals, group_equal, group_intervals, reasons_not_fitted
from damagepred.uq.fragility.likelihood import (
    LARGEST_DISPERSION,
    SMALLEST_DISPERSION,
    Likelihood,
    LinearBounds,
    likelihood,
    linear_bounds,
    maximise_likelihood,
    scores,
)


class Estimator(ABC):
    """Maximum likelihood estimate of lognormal curves that are fitted together."""

    rows: LinearBounds

    def __init__(self, categories: list[int], cells: GroupedIntervals) -> None:
        self.categories, self.cells = categories, cells

    @abstractmethod
    def maximise(self, weight: FloatArray, start: FloatArray | None = None) -> FloatArray:
        """Parameters of largest likelihood for weights of the groups, array (resamples, parameters)."""

    def row_weight(self, weight: FloatArray) -> FloatArray:
        """Weights of the likelihood's rows for weights of the groups."""
        return weight

    @cached_property
    def estimate(self) -> FloatArray:
        """The parameters for the walls as they are, array (parameters,)."""
        return self.maximise(self.cells.total[None])[0]

    def scores(self, parameters: FloatArray) -> FloatArray:
        """Gradient of the log-likelihood of one wall of each group, array (groups, parameters)."""
        return scores(parameters, self.rows)

    def hessian(self, parameters: FloatArray) -> FloatArray:
        """Second derivatives of the log-likelihood, array (parameters, parameters)."""
        return self._likelihood(parameters).hessian[0]

    def value(self, parameters: FloatArray) -> float:
        """Log-likelihood."""
        return float(self._likelihood(parameters).value[0])

    def _likelihood(self, parameters: FloatArray) -> Likelihood:
        return likelihood(parameters[None], self.rows, self.row_weight(self.cells.total[None]))

    def no_dispersion(self) -> str:
        """Why the likelihood has no maximum at a finite dispersion; empty if it has."""
        dispersion = 1.0 / self.estimate[0]
        if SMALLEST_DISPERSION < dispersion < LARGEST_DISPERSION:
            return ""
        return f"no finite dispersion explains the walls (it runs to {dispersion:.2g})"

    def fits(self) -> list[Fit]:
        """Curves of the categories."""
        if why := self.no_dispersion():
            return [Fit(np.nan, np.nan, why)] * len(self.categories)
        parameters = self.estimate
        return [Fit(float(np.exp(h / parameters[0])), float(1.0 / parameters[0]), FITTED) for h in parameters[1:]]


def estimators(cells: GroupedIntervals, common: bool = False, single: bool = False) -> list[Estimator]:
    """Estimators of the categories that can be fitted: one for each, or one for all."""
    good = [k for k, why in enumerate(reasons_not_fitted(cells, common)) if not why]
    if not common:
        return [CompositeLikelihood([k], cells.of(k)) for k in good]
    if not good:
        return []
    some = group_intervals(cells.lower[good], cells.upper[good], cells.weight, cells.number)
    return [(OrdinalProbit if single else CompositeLikelihood)(good, some)]


class CompositeLikelihood(Estimator):
    """Product of the categories' likelihoods of interval-censored capacities; of one category the likelihood itself."""

    def __init__(self, categories: list[int], cells: GroupedIntervals) -> None:
        super().__init__(categories, cells)
        size, count = len(categories), len(cells.number)
        if size == 1:
            self._sum = None
            lower, upper, kind = cells.lower[0], cells.upper[0], np.zeros(count, dtype=np.int8)
        else:
            # groups that differ only in other categories share a row of this one
            equal = [group_equal(np.stack((cells.lower[k], cells.upper[k]))) for k in range(size)]
            ends = np.cumsum([len(first) for first, _ in equal])
            lower = np.concatenate([cells.lower[k][first] for k, (first, _) in enumerate(equal)])
            upper = np.concatenate([cells.upper[k][first] for k, (first, _) in enumerate(equal)])
            kind = np.repeat(np.arange(size, dtype=np.int8), [len(first) for first, _ in equal])
            row = np.column_stack([which + end - len(first) for (first, which), end in zip(equal, ends)]).ravel()
            each = np.arange(0, size * count + 1, size)
            self._sum = scipy.sparse.csr_array((np.ones(size * count), row, each), shape=(count, int(ends[-1])))
        self.rows = linear_bounds(lower, upper, np.eye(size)[kind])
        self._start = _start(lower, upper, kind, size)

    def row_weight(self, weight: FloatArray) -> FloatArray:
        """Weights of the rows: groups that differ only in other categories share a row."""
        return weight if self._sum is None else np.asarray(weight @ self._sum)

    def maximise(self, weight: FloatArray, start: FloatArray | None = None) -> FloatArray:
        """Newton's method from the middles of the intervals."""
        begin = self._start if start is None else start
        return maximise_likelihood(self.rows, self.row_weight(weight), begin)

    def scores(self, parameters: FloatArray) -> FloatArray:
        """Gradient of one wall of each group: the sum over its rows, one for each category."""
        of_rows = super().scores(parameters)
        return of_rows if self._sum is None else np.asarray(self._sum @ of_rows)


def _start(lower: FloatArray, upper: FloatArray, kind: Int8Array, kinds: int) -> FloatArray:
    """Return initial parameters from the middles of the intervals."""
    with np.errstate(divide="ignore", invalid="ignore"):
        low, high = np.log(lower), np.log(upper)
        middle = np.where(np.isinf(high), low, np.where(np.isinf(low), high - 0.7, (low + high) / 2))
    bounded = np.isfinite(middle)
    middle, kind = middle[bounded], kind[bounded]
    mean = np.bincount(kind, middle, kinds) / np.maximum(np.bincount(kind, minlength=kinds), 1)
    spread = np.clip(np.sqrt(np.mean((middle - mean[kind]) ** 2)), 0.05, 3.0)
    return np.append(1.0, mean) / spread


class OrdinalProbit(Estimator):
    """Ordinal probit model: the category of each wall at its one movement; intervals begin at 0 or have no end."""

    def __init__(self, categories: list[int], cells: GroupedIntervals) -> None:
        movement = np.where(np.isfinite(cells.upper), cells.upper, cells.lower).max(axis=0)
        moved = movement > 0
        lower, upper = cells.lower[:, moved], cells.upper[:, moved]
        super().__init__(categories, GroupedIntervals(lower, upper, cells.weight[moved], cells.number[moved]))
        self._movement = movement[moved]
        self._level = np.isfinite(upper).sum(axis=0)
        self._composite = CompositeLikelihood(categories, self.cells)
        self.rows = self._rows(self._level, len(categories))

    def _rows(self, level: IntArray, size: int) -> LinearBounds:
        x = np.log(self._movement)[:, None]
        pick = np.vstack((np.zeros(size), np.eye(size), np.zeros(size)))
        below, above = np.hstack((x, -pick[level + 1])), np.hstack((x, -pick[level]))
        no_below, no_above = level == size, level == 0
        below[no_below], above[no_above] = 0.0, 0.0
        return LinearBounds(below, above, no_below, no_above, np.zeros(len(level), dtype=bool))

    def maximise(self, weight: FloatArray, start: FloatArray | None = None) -> FloatArray:
        """Newton's method from the composite likelihood, without empty categories."""
        size = len(self.categories)
        begin = self._composite.maximise(weight, start)
        parameters = np.empty_like(begin)
        there = np.column_stack([(weight[:, self._level == level] > 0).any(axis=1) for level in range(size + 1)])
        patterns, which = np.unique(there, axis=0, return_inverse=True)
        for n, present in enumerate(patterns):
            who = np.flatnonzero(which.ravel() == n)
            # where no wall is in a category and not in the next, their curves are one
            merged = np.append(0, np.cumsum(present[1:-1]))
            kept = np.append(0, 1 + np.unique(merged, return_index=True)[1])
            level = np.append(0, merged + 1)[self._level]
            rows = self._rows(level, int(merged[-1]) + 1)
            merged_parameters = maximise_likelihood(rows, weight[who], begin[who][:, kept])
            parameters[who, 0], parameters[who, 1:] = merged_parameters[:, 0], merged_parameters[:, 1 + merged]
        return parameters


@checked
@one_blas_thread()
def fit_lognormal(lower: FloatArray, upper: FloatArray, count: FloatArray | None = None) -> Fit:
    """Lognormal capacity in intervals (lower, upper], arrays (n,), by maximum likelihood; infinite upper: censored."""
    require_alike(lower=lower, upper=upper, count=count)
    low, high = np.asarray(lower, dtype=np.float64), np.asarray(upper, dtype=np.float64)
    weight = np.ones(len(low)) if count is None else np.asarray(count, dtype=np.float64)
    weight = np.where((low <= 0) & np.isinf(high), 0.0, weight)  # (0, inf] is no information
    kept = (weight > 0) | np.isnan(low + high)
    return fit_grouped(group_intervals(low[None, kept], high[None, kept], weight[kept]))[0]


def fit_grouped(cells: GroupedIntervals, common: bool = False, single: bool = False) -> list[Fit]:
    """Fit a curve to each category of counted walls; see ``estimators``."""
    fits = [Fit(np.nan, np.nan, why) for why in reasons_not_fitted(cells, common)]
    for estimator in estimators(cells, common, single):
        for k, fit in zip(estimator.categories, estimator.fits()):
            fits[k] = fit
    return fits
