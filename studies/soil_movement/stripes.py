"""Read the walls of a study at one surface movement y_s of their paths."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import xarray as xr
from scipy.stats import binomtest

from damagepred.enumerations import SampleStatus


def read_at(ds: xr.Dataset, movement: float) -> xr.Dataset:
    """Return a study with its paths up to a surface movement."""
    reached = ds["surface_movement"].values[0]
    return ds.isel(increment=slice(0, int(np.abs(reached - movement).argmin()) + 1))


def shares(ds: xr.Dataset, categories: int = 4, confidence: float = 0.9) -> list[dict[str, Any]]:
    """Return the number of walls that reached each category on their paths, with a Wilson interval."""
    worst = _worst(ds)
    # a wall that failed after it had reached a category counts; one that failed before is unknown
    lost = (ds["status"].values == SampleStatus.FAILED) & (ds["damage_category"].values[:, -1] < 0)
    known_paths = ds["status"].values <= SampleStatus.FAILED
    rows = []
    for category in range(1, categories + 1):
        known = known_paths & (~lost | (worst >= category))
        walls, reached = int(known.sum()), int((worst[known] >= category).sum())
        low, high = binomtest(reached, walls).proportion_ci(confidence, "wilson") if walls else (0.0, 1.0)
        rows.append(
            {
                "category": category,
                "walls": walls,
                "reached": reached,
                "share": reached / walls if walls else np.nan,
                "lower": float(low),
                "upper": float(high),
                "failed": int(lost.sum()),
            }
        )
    return rows


def by_thirds(ds: xr.Dataset, place: str, categories: int = 4) -> list[dict[str, Any]]:
    """Return the shares of walls in each category or worse, for the lower, middle and upper third of an input."""
    value, rows = ds[place].values, []
    ends = np.quantile(value, [0.0, 1 / 3, 2 / 3, 1.0])
    for number, (low, high) in enumerate(itertools.pairwise(ends)):
        here = (value >= low) & ((value < high) if number < 2 else (value <= high))
        part = ds.isel(sample=np.flatnonzero(here))
        rows += [{"input": place, "from": low, "to": high} | row for row in shares(part, categories)]
    return rows


def _worst(ds: xr.Dataset) -> np.ndarray:
    """Return the worst category of each wall on its path (sample,), -1 where it is unknown."""
    if "damage_category" not in ds:
        return np.full(ds.sizes["sample"], -1, dtype=np.int8)
    return np.asarray(ds["damage_category"].values.max(axis=1))
