"""Read the runs of one wall on one footing at several surface movements y_s, each with the mound of its own y_s."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr
from scipy.stats import binomtest

FAILED, MISSING = 2, 3


def stripes(studies: Mapping[float, xr.Dataset]) -> xr.Dataset:
    """Return the walls of several studies as one: increments are the y_s of the studies, from 0 upwards.

    Sample i is the same wall in all of them. A wall counts at each y_s with the worst category up to there.

    Parameters
    ----------
    studies : mapping of float to xarray.Dataset
        The study of each y_s (m), as ``open_study`` returns it.
    """
    ends = dict(sorted(studies.items()))
    first = next(iter(ends.values()))
    count = min(ds.sizes["sample"] for ds in ends.values())
    start = first["damage_category"].values[:count, :1]
    last = [_worst(ds)[:count, None] for ds in ends.values()]
    status = np.array([ds["status"].values[:count] for ds in ends.values()])
    category = np.concatenate([start, *last], axis=1)
    unknown = category < 0
    category = np.maximum.accumulate(category, axis=1)
    category[unknown] = -1
    movement = np.broadcast_to([0.0, *ends], category.shape)
    merged = np.where((status == MISSING).any(axis=0), MISSING, np.where((status == FAILED).any(axis=0), FAILED, 0))
    both = ("sample", "increment")
    return xr.Dataset(
        {
            "damage_category": (both, category.astype(np.int8), first["damage_category"].attrs),
            "status": ("sample", merged.astype(np.int8), first["status"].attrs),
        },
        coords={"surface_movement": (both, movement.copy(), first["surface_movement"].attrs)},
        attrs=first.attrs,
    )


def shares(ds: xr.Dataset, categories: int = 4, confidence: float = 0.9) -> list[dict[str, Any]]:
    """Return how many walls reached which category at the end of one study, with a Wilson interval.

    Parameters
    ----------
    ds : xarray.Dataset
        Study of one y_s.
    categories : int
        Highest category.
    confidence : float
        Of the interval.
    """
    status, worst = ds["status"].values, _worst(ds)
    # a wall that failed after it had reached a category has reached it; before, it is not known
    rows = []
    for category in range(1, categories + 1):
        known = (status < FAILED) | ((status == FAILED) & (worst >= category))
        walls, reached = int(known.sum()), int((worst[known] >= category).sum())
        low, high = binomtest(reached, walls).proportion_ci(confidence, "wilson") if walls else (0.0, 1.0)
        rows.append(
            {"category": category, "walls": walls, "reached": reached, "share": reached / walls if walls else np.nan,
             "lower": float(low), "upper": float(high), "failed": int((status == FAILED).sum())}
        )  # fmt: skip
    return rows


def by_thirds(ds: xr.Dataset, place: str, categories: int = 4) -> list[dict[str, Any]]:
    """Return the shares of walls in each category or worse, for the lower, middle and upper third of an input.

    Parameters
    ----------
    ds : xarray.Dataset
        Study of one y_s.
    place : str
        Name of the input.
    categories : int
        Highest category.
    """
    value, rows = ds[place].values, []
    ends = np.quantile(value, [0.0, 1 / 3, 2 / 3, 1.0])
    for number, (low, high) in enumerate(itertools.pairwise(ends)):
        here = (value >= low) & ((value < high) if number < 2 else (value <= high))
        part = ds.isel(sample=np.flatnonzero(here))
        rows += [{"input": place, "from": low, "to": high} | row for row in shares(part, categories)]
    return rows


def _worst(ds: xr.Dataset) -> np.ndarray:
    """Return the worst category of each wall on its path (sample,), -1 where nothing of it is known."""
    if "damage_category" not in ds:
        return np.full(ds.sizes["sample"], -1, dtype=np.int8)
    worst = ds["damage_category"].values.max(axis=1)
    # of a failed wall only what it had reached is known; for the fit it counts as failed
    return np.asarray(worst)
