"""Convergence of an estimate with the number of walls."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import xarray as xr

from damagepred.arrays import FloatArray, IntArray
from damagepred.uq.exceedance import category_capacities, estimate_exceedance


class Running(NamedTuple):
    """Running estimate of a probability from the first walls of a study.

    Attributes
    ----------
    counted : array of int (points,)
        Walls that count.
    value, lower, upper : array (points,)
        Estimate and confidence interval from these.
    """

    counted: IntArray
    value: FloatArray
    lower: FloatArray
    upper: FloatArray


def running_probability(
    ds: xr.Dataset,
    category: int,
    at: float,
    *,
    confidence: float = 0.9,
    intensity: str | None = None,
    points: int = 60,
) -> Running:
    """Estimate the probability of a category at a movement from increasing numbers of walls.

    Each interval holds for its number of walls alone, not for a study that stops at a chosen one (see
    ``damagepred.uq.stopping``).

    Parameters
    ----------
    ds : xarray.Dataset
        As ``open_study`` returns it, with paths.
    category : int
        Category or worse.
    at : float
        Movement (m, or 1 for a deflection ratio).
    confidence : float
        Of the intervals.
    intensity : str, optional
        Measure of the movement; by default the study's own.
    points : int
        Numbers of walls at most.
    """
    known = category_capacities(ds, category, intensity)
    total = len(known.lower)
    count = (
        np.unique(np.geomspace(min(2, total), total, points).round().astype(np.int64)) if total else np.empty(0, int)
    )
    found = [estimate_exceedance(known.part(slice(n)), at, confidence).estimate for n in count]
    return Running(
        count,
        np.array([e.value for e in found]),
        np.array([e.lower for e in found]),
        np.array([e.upper for e in found]),
    )
