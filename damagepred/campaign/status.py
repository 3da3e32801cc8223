"""Status of a study: done, failed and remaining walls, and the present estimate."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
import xarray as xr

from damagepred.archive.cautions import STUDIED, study_cautions
from damagepred.archive.folder import StudyFolder
from damagepred.archive.provenance import mixture
from damagepred.enumerations import SOLVED, SampleStatus
from damagepred.formatting import counted
from damagepred.uq.estimate import effective_samples
from damagepred.uq.exceedance import category_capacities, estimate_exceedance
from damagepred.uq.movement_distribution import SITE

READ = (
    *("damage_category", "crack_width_max", "surface_movement", "settlement", "central_deflection"),
    *("load_displacement", "damaged_walls", "time", "run_time", "limit_deflection", "environment", *STUDIED),
)
"""Results that the status reads."""


class CategoryShare(NamedTuple):
    """Share of walls by a damage category."""

    category: int
    walls: int  # walls that end in it
    # probability of it, and of it or worse, by the end of each wall's own movement; see
    # ``damagepred.exceedance``
    share: float
    or_worse: float
    lower: float  # 90 % confidence interval of ``or_worse``
    upper: float
    failed_undamaged: float  # ``or_worse`` if all failed walls were undamaged, and if all were damaged
    failed_damaged: float


@dataclass(frozen=True)
class StudyStatus:
    """Status of a study."""

    title: str  # title of the study
    # numbers of walls
    total: int
    done: int
    failed: int
    remaining: int
    wall_seconds: float  # mean time of a wall (s); NaN where unknown
    effective_walls: float  # equally weighted walls of importance sampling; NaN without weights
    # deflections (m) at which jacks or supports carried no load any more, of the walls whose path ended there
    limits: list[float]
    failures: list[tuple[int, str, str]]  # sample, reason and message of the first failed walls
    categories: list[CategoryShare]  # shares of the categories in their order; empty where unknown
    cautions: list[str]  # cautions on the solution of the walls
    houses: bool = False  # whether each sample is a house


def study_status(path: str | Path) -> StudyStatus:
    """Status of a study folder, finished or running."""
    folder = StudyFolder(path)
    ds = folder.results(READ)
    state, houses = ds["status"].values, "damaged_walls" in ds
    total, failed = len(state), int((state == SampleStatus.FAILED).sum())
    remaining = int((state == SampleStatus.MISSING).sum())
    each, weighted, limits = np.nan, np.nan, np.empty(0)
    if "run_time" in ds and np.isfinite(ds["run_time"].values).any():
        each = float(np.nanmean(ds["run_time"].values))
    if "weight" in ds and total > remaining:
        weighted = effective_samples(np.asarray(ds["weight"].values, dtype=np.float64)[state != SampleStatus.MISSING])
    if "limit_deflection" in ds:
        limits = ds["limit_deflection"].values[np.isfinite(ds["limit_deflection"].values)]
    records = ((sample, folder.failure(sample)) for sample in sorted(folder.failed_samples())[:5])
    return StudyStatus(
        title=str(ds.attrs["title"]),
        total=total,
        done=total - remaining,
        failed=failed,
        remaining=remaining,
        wall_seconds=each,
        effective_walls=weighted,
        limits=limits.tolist(),
        failures=[(sample, str(record["reason"]), str(record["message"])) for sample, record in records],
        categories=_category_shares(ds),
        cautions=[counted(said, houses) for said in (*study_cautions(ds), *mixture(ds))],
        houses=houses,
    )


def _category_shares(ds: xr.Dataset) -> list[CategoryShare]:
    if "damage_category" not in ds or not (good := np.isin(ds["status"].values, SOLVED)).any():
        return []
    worst = ds["damage_category"].values[good].reshape(good.sum(), -1).max(axis=1, initial=0)
    highest = int(ds.attrs["highest_category"])
    curves = [estimate_exceedance(category_capacities(ds, c, None, SITE), SITE) for c in range(1, highest + 1)]
    certain = curves[0].estimate._replace(value=1.0, lower=1.0, upper=1.0)
    curves = [curves[0]._replace(estimate=certain, failed_undamaged=1.0, failed_damaged=1.0), *curves]
    value = [curve.estimate.value for curve in curves] + [0.0]
    return [
        CategoryShare(
            c,
            int((worst == c).sum()),
            value[c] - value[c + 1],
            *(e.estimate.value, e.estimate.lower, e.estimate.upper, e.failed_undamaged, e.failed_damaged),
        )
        for c, e in enumerate(curves)
    ]
