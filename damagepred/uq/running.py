"""Convergence of an estimate with the number of walls."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import xarray as xr

from damagepred.arrays import FloatArray, IntArray
from damagepred.uq.exceedance import category_capacities, estimate_exceedance, wanted_movement
from damagepred.uq.intensity import chosen_intensity
from damagepred.uq.movement_distribution import MovementDistribution


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
    at: float | str | MovementDistribution,
    *,
    confidence: float = 0.9,
    intensity: str | None = None,
    points: int = 60,
) -> Running:
    """Estimate the probability of a category at a movement from increasing numbers of walls of a study with paths.

    Each interval holds for its number of walls alone, not for a study that stops at a chosen one (see
    ``damagepred.uq.stopping``). The last one is that of ``damagepred.exceedance``.
    """
    measure = chosen_intensity(ds, intensity)
    wanted = wanted_movement(ds, at, measure)
    known = category_capacities(ds, category, measure, wanted)
    total = len(known.lower)
    count = (
        np.unique(np.geomspace(min(2, total), total, points).round().astype(np.int64)) if total else np.empty(0, int)
    )
    found = [estimate_exceedance(known.part(slice(n)), wanted, confidence).estimate for n in count]
    return Running(count, *(np.array([getattr(e, key) for e in found]) for key in ("value", "lower", "upper")))
