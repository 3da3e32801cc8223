"""Which wall of a study to look at: a typical one, and the worst."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import xarray as xr

from damagepred.enumerations import SampleStatus
from damagepred.formatting import length
from damagepred.uq.exceedance import category_capacities
from damagepred.uq.intensity import intensity_values, movement_measure, movement_words


class Chosen(NamedTuple):
    """Numbers of a typical and of the worst wall, and the criterion of each choice."""

    typical: int
    worst: int
    why_typical: str
    why_worst: str


def typical_and_worst(ds: xr.Dataset, at: float | None = None) -> Chosen | None:
    """Wall with the median of the widest crack, at a movement (m) or the end, and wall that is the worst first."""
    # a wall that ended before in the worst category or in collapse counts as wider, the earlier the wider; other walls
    # that were not followed as far are left out
    capacities = {c: category_capacities(ds, c) for c in range(1, int(ds.attrs["highest_category"]) + 1)}
    capacities = {c: known.part(~known.failing) for c, known in capacities.items()}
    some = [c for c, known in capacities.items() if np.isfinite(known.upper).any()]
    sample, weight = capacities[1].sample, capacities[1].weight
    if not len(sample):
        return None
    path = np.fmax.accumulate(ds["crack_width_max"].values[sample], axis=1)
    moved = np.where(np.isfinite(path), intensity_values(ds, movement_measure(ds))[sample], np.nan)
    width, last = np.fmax.reduce(path, axis=1), np.fmax.reduce(moved, axis=1)
    gone = np.fmax.reduce(ds["damage_category"].values[sample], axis=1) >= int(ds.attrs["highest_category"])
    gone |= ds["status"].values[sample] == SampleStatus.COLLAPSED
    where, short = "at the end of its movement", np.ones(len(sample), dtype=np.bool_)
    key = width.copy()
    if at is not None:
        where, short = f"at a {movement_words(ds)} of {length(at)}", last < at * (1 - 1e-9)
        key[:] = [np.interp(at, m[np.isfinite(m)], p[np.isfinite(m)]) for m, p in zip(moved, path)]
        key[short] = np.nan
    key[gone & short] = np.inf
    heavy = np.where(np.isnan(key), 0.0, 1.0 if weight is None else weight)
    if not heavy.any():
        return None
    order = np.lexsort((-last, np.nan_to_num(key, nan=np.inf, posinf=np.inf)))
    middle = int(order[np.searchsorted(np.cumsum(heavy[order]), 0.5 * heavy.sum() * (1 - 1e-12))])
    typical = int(sample[middle])
    why = f"whose widest crack {where} is the median of all samples, {length(key[middle])}"
    if np.isinf(key[middle]):
        why = f"the median of all samples {where}: it fell, or reached the worst category, at {length(last[middle])}"
    if not some:
        reason = f"whose widest crack is the widest, {length(float(width.max()))}"
        return Chosen(typical, int(sample[np.argmax(width)]), why, reason)
    known = capacities[some[-1]]
    first = int(np.argmin(known.upper))
    reason = f"which reached category {some[-1]} first, at {length(known.upper[first])}"
    return Chosen(typical, int(known.sample[first]), why, reason)
