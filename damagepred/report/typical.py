"""Which wall of a study to look at: a typical one, and the worst."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import xarray as xr

from damagepred.formatting import length
from damagepred.uq.exceedance import category_capacities
from damagepred.uq.fragility import movement_measure


class Chosen(NamedTuple):
    """Two walls of a study.

    Attributes
    ----------
    typical, worst : int
        Their numbers.
    why_typical, why_worst : str
        By what they were chosen.
    """

    typical: int
    worst: int
    why_typical: str
    why_worst: str


def typical_and_worst(ds: xr.Dataset) -> Chosen | None:
    """Choose a typical wall and the worst of a study with paths.

    Typical is the wall of median capacity for the worst category that at least half of the walls have reached; where
    that is none, the wall whose widest crack at the end is the median. The worst reached the worst category first.

    Parameters
    ----------
    ds : xarray.Dataset
        A study.

    Returns
    -------
    Chosen or None
        None if no wall was solved.
    """
    measure = movement_measure(ds)
    found = {c: category_capacities(ds, c) for c in range(1, int(ds.attrs["highest_category"]) + 1)}
    reached = {c: np.isfinite(known.upper) for c, known in found.items()}
    if not len(found[1].sample):
        return None
    weight = found[1].weight
    often = [c for c, hit in reached.items() if np.average(hit, weights=weight) >= 0.5]
    some = [c for c, hit in reached.items() if hit.any()]
    width = np.nan_to_num(ds["crack_width_max"].values[found[1].sample], nan=-1.0).max(axis=1)
    if often:
        known = found[often[-1]]
        place = _median_place(known.upper, weight)
        typical = int(known.sample[place])
        why = f"which reached category {often[-1]} at a median {_named(measure)} of {length(known.upper[place])}"
    else:
        place = _median_place(width, weight)
        typical = int(found[1].sample[place])
        why = f"whose widest crack is the median, {length(width[place])}"
    if some:
        known = found[some[-1]]
        first = int(np.argmin(known.upper))
        worst, reason = (
            int(known.sample[first]),
            f"which reached category {some[-1]} first, at {length(known.upper[first])}",
        )
    else:
        worst = int(found[1].sample[np.argmax(width)])
        reason = f"whose widest crack is the widest, {length(float(width.max()))}"
    return Chosen(typical, worst, why, reason)


def _median_place(values: np.ndarray, weight: np.ndarray | None) -> int:
    """Return where the value in the middle of all is, by their weights."""
    order = np.argsort(values, kind="stable")
    upto = np.cumsum(np.ones(len(values)) if weight is None else weight[order])
    return int(order[np.searchsorted(upto, 0.5 * upto[-1] * (1 - 1e-12))])


def _named(measure: str) -> str:
    return measure.replace("_", " ")
