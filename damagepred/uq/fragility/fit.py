"""What a fit comes to: a lognormal curve, or why there is none."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy import special

from damagepred.arrays import FloatArray
from damagepred.uq.fragility.capacities import Cells

FEWEST = 3
"""Walls that must have reached a category before a curve is fitted to it."""

FITTED = "fitted"

EXTRAPOLATED = "extrapolated"
"""Status of a curve whose median lies beyond the largest movement to which a wall was followed."""

DRAWN = (FITTED, EXTRAPOLATED)
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


def reasons(cells: Cells, common: bool = False) -> list[str]:
    """Say of each category why it has no curve; empty if nothing speaks against it.

    Parameters
    ----------
    cells : Cells
        Walls.
    common : bool
        Whether categories share a dispersion: then one may lack what tells its own, as long as another has it.
    """
    if common and all(reasons(cells)):
        return reasons(cells)
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
