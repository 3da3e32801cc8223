"""Result of a fit: a lognormal curve, or the reason why there is none."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy import special

from damagepred.arrays import BoolArray, FloatArray, IntArray
from damagepred.errors import InputError
from damagepred.inputs.arguments import checked, require_alike
from damagepred.uq.estimate import effective_samples, normal_factor, wilson

FEWEST_REACHED = 3  # walls that must have reached a category for a curve to be fitted to it


class GroupedIntervals(NamedTuple):
    """Groups (cells) of walls with equal intervals and weights."""

    # (categories, cells): their intervals
    lower: FloatArray
    upper: FloatArray
    weight: FloatArray  # (cells,): weight of one of their walls
    number: IntArray  # (cells,): number of walls

    @property
    def total(self) -> FloatArray:
        """Total weight of the walls of each cell."""
        return self.weight * self.number

    def effective(self, some: BoolArray | slice = slice(None)) -> float:
        """Effective number of walls (Kish) of some cells."""
        return effective_samples(np.repeat(self.weight[some], self.number[some]))

    def of(self, category: int) -> GroupedIntervals:
        """Cells of one category alone, by its place."""
        one = slice(category, category + 1)
        if len(self.lower) == 1:
            return self
        return group_intervals(self.lower[one], self.upper[one], self.weight, self.number)


def group_intervals(
    lower: FloatArray, upper: FloatArray, weight: FloatArray, count: IntArray | None = None
) -> GroupedIntervals:
    """Group walls of equal intervals and weights."""
    if np.isnan(lower).any() or np.isnan(upper).any() or (lower > upper).any():
        raise InputError("capacities must be intervals lower <= upper without NaN.")
    first, which = group_equal(np.vstack((lower, upper, weight)))
    walls = np.bincount(which, weights=count, minlength=len(first)).astype(np.int64)
    return GroupedIntervals(lower[:, first], upper[:, first], weight[first], walls)


def group_equal(columns: FloatArray) -> tuple[IntArray, IntArray]:
    """First column of each group of equal columns, and the group of each column."""
    order = np.lexsort(columns[::-1])
    ordered = columns[:, order]
    begins, which = np.ones(len(order), dtype=bool), np.empty(len(order), dtype=np.int64)
    begins[1:] = (ordered[:, 1:] != ordered[:, :-1]).any(axis=0)
    which[order] = np.cumsum(begins) - 1
    return order[begins], which


@checked
def normalised_weights(weight: FloatArray, upper: FloatArray) -> FloatArray:
    """Weights (walls,) scaled so that they add up to the number of the walls with a finite upper bound."""
    require_alike(weight=weight, upper=upper)
    weight, upper = np.asarray(weight, dtype=np.float64), np.asarray(upper, dtype=np.float64)
    if not (np.isfinite(weight).all() and (weight >= 0).all() and (weight > 0).any()):
        raise InputError("weight: must be finite, not negative, and not all 0.")
    reached = np.isfinite(upper) & (weight > 0)
    total = float(weight[reached].sum())
    return weight * (reached.sum() / total) if total > 0 else weight


FITTED = "fitted"
NEVER = "never reached"
EXTRAPOLATED = "extrapolated"
"""Status of a curve whose median lies beyond the largest movement to which a wall was followed."""

AT_START = "all walls that reached it had before any movement: there is no curve to fit"

WITH_CURVE = (FITTED, EXTRAPOLATED)  # curves that there are, as far as walls were followed


class Fit(NamedTuple):
    """A lognormal curve."""

    median: float
    dispersion: float  # standard deviation of the logarithm; both are NaN if not fitted
    status: str  # "fitted", or why not

    def probability(self, intensity: FloatArray) -> FloatArray:
        """Probability of having reached the category, NaN if not fitted."""
        with np.errstate(divide="ignore"):
            return special.ndtr(np.log(np.asarray(intensity) / self.median) / self.dispersion)


class StartShare(NamedTuple):
    """Share p0 of the walls that reached a category before any movement, with its Wilson interval."""

    share: float
    lower: float
    upper: float

    @classmethod
    def of(cls, before: BoolArray, weight: FloatArray, confidence: float) -> StartShare:
        """Estimate the share of the walls ``before`` any movement; the interval is empty where there is none."""
        if not before.any():
            return cls(0.0, 0.0, 0.0)
        share = float(before @ weight / weight.sum())
        return cls(share, *wilson(share, effective_samples(weight), normal_factor(confidence)))

    def mixed(self, name: str, curve: FloatArray) -> FloatArray:
        """p0 + (1 - p0) F for the curve F of the other walls; with the end of p0 that the name has, such as _lower."""
        p0 = {"lower": self.lower, "upper": self.upper}.get(name.rpartition("_")[2], self.share)
        return np.full_like(curve, p0) if self.share == 1.0 else p0 + (1.0 - p0) * curve


class BoundedMedian(NamedTuple):
    """Median with its interval, arrays; NaN beyond the movements to which walls were followed."""

    # NaN, and an infinite upper end, where the median lies beyond
    median: FloatArray
    lower: FloatArray
    upper: FloatArray
    # largest movement to which a wall was followed where the median lies beyond it, NaN elsewhere
    lower_bound: FloatArray
    extrapolated: FloatArray  # the fitted median where it lies beyond, NaN elsewhere

    @classmethod
    def of(cls, median: FloatArray, lower: FloatArray, upper: FloatArray, largest: float) -> BoundedMedian:
        """Bound fitted medians (NaN where there is none) by the largest movement to which a wall was followed."""
        beyond = median > largest * (1 + 1e-9)
        low = np.where(beyond, np.minimum(lower, largest), lower)
        return cls(
            np.where(beyond, np.nan, median),
            low,
            np.where(beyond & np.isfinite(low), np.inf, upper),
            np.where(beyond, largest, np.nan),
            np.where(beyond, median, np.nan),
        )


def reasons_not_fitted(cells: GroupedIntervals, common: bool = False) -> list[str]:
    """Reason why each category has no curve, "" if it can be fitted; with ``common`` dispersion one is enough."""
    if common and all(alone := reasons_not_fitted(cells)):
        return alone
    reasons = []
    for lower, upper in zip(cells.lower, cells.upper):
        used = (cells.total > 0) & ((lower > 0) | np.isfinite(upper))
        walls = np.maximum(cells.total, cells.number)[used]
        reasons.append(_reason(lower[used], upper[used], walls, common))
    return reasons


def _reason(lower: FloatArray, upper: FloatArray, walls: FloatArray, common: bool) -> str:
    reached = np.isfinite(upper)
    if not reached.any():
        return NEVER
    if (upper[reached] <= 0).any():
        return "reached by some walls before any movement"
    if walls[reached].sum() < FEWEST_REACHED:
        return f"reached by fewer than {FEWEST_REACHED} walls"
    if lower.max() <= upper.min():
        if common and lower.max() > 0:
            return ""
        if (lower[reached] == 0).all() and not reached.all():
            return "damaged and undamaged walls are parted by the movement alone: sample more walls"
        # every capacity could be one and the same number: the increments do not resolve the scatter
        return "all walls within one increment: refine the increments"
    return ""
