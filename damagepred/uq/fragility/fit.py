"""Result of a fit: a lognormal curve, or the reason why there is none."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy import special

from damagepred.arrays import BoolArray, FloatArray
from damagepred.uq.estimate import effective_samples, normal_factor, wilson
from damagepred.uq.fragility.grouped_data import GroupedIntervals
from damagepred.uq.fragility.options import DEFAULT, FragilityOptions

FITTED = "fitted"

NEVER = "never reached"

EXTRAPOLATED = "extrapolated"
"""Status of a curve whose median lies beyond the largest movement to which a wall was followed."""

AT_START = "all walls that reached it had before any movement: there is no curve to fit"

WITH_CURVE = (FITTED, EXTRAPOLATED)
"""Curves that there are, as far as walls were followed."""


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


def reasons_not_fitted(cells: GroupedIntervals, common: bool = False, options: FragilityOptions = DEFAULT) -> list[str]:
    """Reason why each category has no curve, "" if it can be fitted; with ``common`` dispersion one is enough."""
    if common and all(alone := reasons_not_fitted(cells, options=options)):
        return alone
    reasons = []
    for lower, upper in zip(cells.lower, cells.upper):
        used = (cells.total > 0) & ((lower > 0) | np.isfinite(upper))
        walls = np.maximum(cells.total, cells.number)[used]
        reasons.append(_reason(lower[used], upper[used], walls, common, options.fewest_reached))
    return reasons


def _reason(lower: FloatArray, upper: FloatArray, walls: FloatArray, common: bool, fewest: int) -> str:
    reached = np.isfinite(upper)
    if not reached.any():
        return NEVER
    if (upper[reached] <= 0).any():
        return "reached by some walls before any movement"
    if walls[reached].sum() < fewest:
        return f"reached by fewer than {fewest} walls"
    if lower.max() <= upper.min():
        if common and lower.max() > 0:
            return ""
        if (lower[reached] == 0).all() and not reached.all():
            return "damaged and undamaged walls are parted by the movement alone: sample more walls"
        # every capacity could be one and the same number: the increments do not resolve the scatter
        return "all walls within one increment: refine the increments"
    return ""
