"""Lognormal curves: each category for itself, with a dispersion that all share, or from ordinal data.

With one dispersion for all categories curves cannot cross. Where each wall is known at one movement alone, this is the
ordinal probit (cumulative link) model, and the likelihood is that of the category each wall is in. Where each wall is
known along its path, a wall's capacities for several categories depend on each other in a way that no model here says;
what is maximised is the product of the categories' own likelihoods (a composite likelihood: Varin, Reid and Firth 2011,
Statistica Sinica 21). It is as right for each curve as a fit of its own, bands come from resampling whole walls, and
the medians stand in the categories' order: for a given dispersion the score of a median is the mean of E[e | wall] over
the walls, which grows with the bounds of the intervals, and no wall reaches a worse category before a lesser one.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse, special

from damagepred.errors import InputError
from damagepred.uq.fragility.capacities import Cells, alike, tally
from damagepred.uq.fragility.likelihood import (
    LARGEST,
    SMALLEST,
    Rows,
    likelihood,
    most_likely,
    rows_of,
    scores,
)

FloatArray = NDArray[np.float64]

FEWEST = 3
"""Walls that must have reached a category before a curve is fitted to it."""

FITTED = "fitted"


class Fit(NamedTuple):
    """A lognormal curve.

    Attributes
    ----------
    median, dispersion : float
        Median, and standard deviation of the logarithm; NaN if not fitted.
    status : str
        ``"fitted"``, or why not.
    """

    median: float
    dispersion: float
    status: str

    def probability(self, intensity: FloatArray) -> FloatArray:
        """Return the probability of having reached the category, NaN if not fitted."""
        with np.errstate(divide="ignore"):
            return special.ndtr(np.log(np.asarray(intensity) / self.median) / self.dispersion)


class CommonFit(NamedTuple):
    """Lognormal curves of one dispersion.

    Attributes
    ----------
    median : array (categories,)
        NaN where there is no curve.
    dispersion : float
        Of all.
    status : tuple of str
        ``"fitted"``, or why not.
    """

    median: FloatArray
    dispersion: float
    status: tuple[str, ...]


def fit_lognormal(lower: FloatArray, upper: FloatArray, count: FloatArray | None = None) -> Fit:
    """Fit a lognormal capacity to intervals by maximum likelihood.

    Parameters
    ----------
    lower, upper : array (n,)
        The capacity lies in (lower, upper]; upper infinite: censored; equal: known exactly.
    count : array (n,), optional
        How many walls each interval stands for.

    Raises
    ------
    InputError
        If a bound is NaN or an interval is empty.
    """
    low, high = np.asarray(lower, dtype=np.float64), np.asarray(upper, dtype=np.float64)
    weight = np.where((low <= 0) & np.isinf(high), 0.0, _weight(count, len(low)))  # what may be anything tells nothing
    kept = (weight > 0) | np.isnan(low + high)
    return fit_cells(tally(low[None, kept], high[None, kept], weight[kept]))[0]


def fit_common(lower: ArrayLike, upper: ArrayLike, count: ArrayLike | None = None) -> CommonFit:
    """Fit lognormal capacities of one dispersion to the intervals of several categories.

    Parameters
    ----------
    lower, upper : array (categories, walls)
        See ``fit_lognormal``; categories from the least to the worst.
    count : array (walls,), optional
        How many walls each stands for.

    Raises
    ------
    InputError
        If a bound is NaN or an interval is empty.
    """
    low, high = np.asarray(lower, dtype=np.float64), np.asarray(upper, dtype=np.float64)
    return _together(fit_cells(tally(low, high, _weight(count, low.shape[1])), common=True))


def fit_ordinal(
    movement: ArrayLike, category: ArrayLike, categories: Sequence[int], count: ArrayLike | None = None
) -> CommonFit:
    """Fit lognormal curves of one dispersion to walls that are each known at one movement (ordinal probit).

    Parameters
    ----------
    movement : array (walls,)
        Movement of each wall.
    category : array of int (walls,)
        Category it is in.
    categories : sequence of int
        For which there are to be curves, ascending.
    count : array (walls,), optional
        How many walls each stands for.
    """
    m, c = np.asarray(movement, dtype=np.float64), np.asarray(category)
    hit = c >= np.asarray(categories)[:, None]
    cells = tally(np.where(hit, 0.0, m), np.where(hit, m, np.inf), _weight(count, len(m)))
    return _together(fit_cells(cells, common=True, single=True))


def _weight(count: ArrayLike | None, size: int) -> FloatArray:
    return np.ones(size) if count is None else np.asarray(count, dtype=np.float64)


def _together(fits: Sequence[Fit]) -> CommonFit:
    scatter = [f.dispersion for f in fits if f.status == FITTED]
    return CommonFit(
        np.array([f.median for f in fits]), scatter[0] if scatter else np.nan, tuple(f.status for f in fits)
    )


def fit_cells(cells: Cells, common: bool = False, single: bool = False) -> list[Fit]:
    """Fit a curve to each category of counted walls; see ``estimators``."""
    found = [Fit(np.nan, np.nan, why) for why in reasons(cells, common)]
    for estimator in estimators(cells, common, single):
        for k, fit in zip(estimator.categories, estimator.fits()):
            found[k] = fit
    return found


def reasons(cells: Cells, common: bool = False) -> list[str]:
    """Say of each category why it has no curve; empty if nothing speaks against it.

    Parameters
    ----------
    cells : Cells
        Walls.
    common : bool
        Whether categories share a dispersion: then one may lack what tells its own.
    """
    found = []
    for lower, upper in zip(cells.lower, cells.upper):
        told = (cells.total > 0) & ((lower > 0) | np.isfinite(upper))
        found.append(_reason(lower[told], upper[told], np.maximum(cells.total, cells.number)[told], common))
    return found


def _reason(lower: FloatArray, upper: FloatArray, walls: FloatArray, common: bool) -> str:
    reached = np.isfinite(upper)
    if not reached.any():
        return "never reached"
    if (upper[reached] <= 0).any():
        return "reached by some walls before any movement"
    if walls[reached].sum() < FEWEST:
        return f"reached by fewer than {FEWEST} walls"
    if lower.max() <= upper.min():
        if common and lower.max() > 0:
            return ""
        if (lower[reached] == 0).all() and not reached.all():
            return "damaged and undamaged walls are parted by the movement alone: sample more walls"
        # every capacity could be one and the same number: the scatter is below what the increments resolve
        return "all walls within one increment: refine the increments"
    return ""


class Estimator(Protocol):
    """Finds the parameters (1/dispersion, and for each category ln(median)/dispersion) for given weights of cells."""

    categories: list[int]
    cells: Cells

    def at(self, weight: FloatArray, start: FloatArray | None = None) -> FloatArray:
        """Return parameters (resamples, 1 + categories) for weights (resamples, cells)."""

    def scores(self, at: FloatArray) -> FloatArray:
        """Return each cell's own gradient of the log-likelihood, array (cells, parameters)."""

    def curvature(self, at: FloatArray) -> FloatArray:
        """Return the curvature of the log-likelihood of all walls, array (parameters, parameters)."""

    def value(self, at: FloatArray) -> float:
        """Return the log-likelihood of all walls."""

    def best(self) -> FloatArray:
        """Return the parameters (1 + categories,) for all walls."""

    def fits(self) -> list[Fit]:
        """Return the curves of the categories."""


def estimators(cells: Cells, common: bool = False, single: bool = False) -> list[Estimator]:
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
    good = [k for k, why in enumerate(reasons(cells, common)) if not why]
    if not common:
        return [Composite([k], cells.of(k)) for k in good]
    if not good or all(_parted(cells, k) for k in good):
        return []
    some = tally(cells.lower[good], cells.upper[good], cells.weight, cells.number)
    return [Ordinal(good, some) if single else Composite(good, some)]


def _parted(cells: Cells, k: int) -> bool:
    told = (cells.total > 0) & ((cells.lower[k] > 0) | np.isfinite(cells.upper[k]))
    return bool(cells.lower[k][told].max() <= cells.upper[k][told].min())


class _Shared:
    """What both estimators share."""

    categories: list[int]
    cells: Cells
    rows: Rows

    _best: FloatArray | None = None

    def best(self) -> FloatArray:
        """Return the parameters for all walls."""
        if self._best is None:
            self._best = self.at(self.cells.total[None])[0]
        return self._best

    def at(self, weight: FloatArray, start: FloatArray | None = None) -> FloatArray:
        """Return the parameters for weights of the cells."""
        raise NotImplementedError

    def fits(self) -> list[Fit]:
        """Return the curves of the categories."""
        at = self.best()
        dispersion = 1.0 / at[0]
        if not SMALLEST < dispersion < LARGEST:
            why = f"no finite dispersion explains the walls (it runs to {dispersion:.2g})"
            return [Fit(np.nan, np.nan, why)] * len(self.categories)
        return [Fit(float(np.exp(h / at[0])), float(dispersion), FITTED) for h in at[1:]]


class Composite(_Shared):
    """Intervals of capacities, the categories' likelihoods multiplied; with one category the likelihood itself.

    Parameters
    ----------
    categories : list of int
        Places of the categories among all.
    cells : Cells
        Walls, with these categories alone.
    """

    def __init__(self, categories: list[int], cells: Cells) -> None:
        self.categories, self.cells = categories, cells
        size = len(categories)
        if size == 1:
            self._sum = None
            lower, upper, regressors = cells.lower[0], cells.upper[0], np.ones((len(cells.number), 1))
        else:
            # cells that differ in other categories alone share a row of this one
            parts, places, done = [], [], 0
            for k in range(size):
                first, which = alike(np.stack((cells.lower[k], cells.upper[k])))
                one = np.column_stack((cells.lower[k][first], cells.upper[k][first]))
                parts.append(np.column_stack((one, np.tile(np.eye(size)[k], (len(one), 1)))))
                places.append(which + done)
                done += len(one)
            lower, upper, *more = np.concatenate(parts).T
            regressors = np.column_stack(more)
            place = np.concatenate(places)
            of = np.tile(np.arange(len(cells.number)), size)
            self._sum = sparse.csr_array((np.ones(len(place)), (of, place)), shape=(len(cells.number), done))
        self.rows = rows_of(lower, upper, regressors)
        self._start = _start(lower, upper, regressors)

    def _of_rows(self, weight: FloatArray) -> FloatArray:
        return weight if self._sum is None else np.asarray(weight @ self._sum)

    def at(self, weight: FloatArray, start: FloatArray | None = None) -> FloatArray:
        """Return the parameters for weights of the cells."""
        return most_likely(self.rows, self._of_rows(weight), self._start if start is None else start)[0]

    def scores(self, at: FloatArray) -> FloatArray:
        """Return each cell's own gradient."""
        found = scores(at, self.rows)
        return found if self._sum is None else np.asarray(self._sum @ found)

    def curvature(self, at: FloatArray) -> FloatArray:
        """Return the curvature of the log-likelihood."""
        return likelihood(at[None], self.rows, self._of_rows(self.cells.total[None])).curvature[0]

    def value(self, at: FloatArray) -> float:
        """Return the log-likelihood."""
        return float(likelihood(at[None], self.rows, self._of_rows(self.cells.total[None])).value[0])


def _start(lower: FloatArray, upper: FloatArray, regressors: FloatArray) -> FloatArray:
    """Return parameters from the middles of the intervals."""
    with np.errstate(divide="ignore"):
        low, high = np.log(lower), np.log(upper)
    with np.errstate(invalid="ignore"):
        middle = np.where(np.isinf(high), low, np.where(np.isinf(low), high - 0.7, (low + high) / 2))
    told = np.isfinite(middle)
    middle, groups = middle[told], regressors[told]
    mean = (groups.T @ middle) / np.maximum(groups.sum(axis=0), 1)
    spread = np.clip(np.sqrt(np.mean((middle - groups @ mean) ** 2)), 0.05, 3.0)
    return np.append(1.0, mean) / spread


class Ordinal(_Shared):
    """Walls that are each known at one movement: the likelihood of the category each is in.

    Parameters
    ----------
    categories : list of int
        Places of the categories among all.
    cells : Cells
        Walls, with these categories alone; each interval reaches from 0 or to infinity.
    """

    def __init__(self, categories: list[int], cells: Cells) -> None:
        self.categories = categories
        movement = np.where(np.isfinite(cells.upper), cells.upper, cells.lower).max(axis=0)
        told = movement > 0
        self.cells = Cells(cells.lower[:, told], cells.upper[:, told], cells.weight[told], cells.number[told])
        self._movement = movement[told]
        self._level = np.isfinite(self.cells.upper).sum(axis=0)
        self._composite = Composite(categories, self.cells)
        self.rows = self._rows(self._level, len(categories))

    def _rows(self, level: NDArray[np.int64], size: int) -> Rows:
        x = np.log(self._movement)[:, None]
        pick = np.vstack((np.zeros(size), np.eye(size), np.zeros(size)))
        below, above = np.hstack((x, -pick[level + 1])), np.hstack((x, -pick[level]))
        no_below, no_above = level == size, level == 0
        below[no_below], above[no_above] = 0.0, 0.0
        return Rows(below, above, no_below, no_above, np.zeros(len(level), dtype=bool))

    def at(self, weight: FloatArray, start: FloatArray | None = None) -> FloatArray:
        """Return the parameters for weights of the cells."""
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
            found, _ = most_likely(self._rows(level, int(merged[-1]) + 1), weight[who], begin[who][:, kept])
            at[who, 0], at[who, 1:] = found[:, 0], found[:, 1 + merged]
        return at

    def scores(self, at: FloatArray) -> FloatArray:
        """Return each cell's own gradient."""
        return scores(at, self.rows)

    def curvature(self, at: FloatArray) -> FloatArray:
        """Return the curvature of the log-likelihood."""
        return likelihood(at[None], self.rows, self.cells.total[None]).curvature[0]

    def value(self, at: FloatArray) -> float:
        """Return the log-likelihood."""
        return float(likelihood(at[None], self.rows, self.cells.total[None]).value[0])


def require_ascending(categories: Sequence[int]) -> None:
    """Check that categories are given from the least to the worst, each once.

    Raises
    ------
    InputError
        If they are not.
    """
    if any(b <= a for a, b in itertools.pairwise(categories)):
        raise InputError(f"categories = {list(categories)}: must ascend, each given once.")
