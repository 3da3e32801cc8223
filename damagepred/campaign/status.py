"""Status of a study: done, failed and remaining walls, and the present estimate."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
import xarray as xr

from damagepred.archive.cautions import STUDIED, study_cautions
from damagepred.archive.folder import StudyFolder
from damagepred.archive.provenance import mixture
from damagepred.archive.schema import CATEGORIES
from damagepred.enumerations import SOLVED, SampleStatus
from damagepred.formatting import duration
from damagepred.uq.estimate import effective_samples
from damagepred.uq.exceedance import category_capacities, estimate_exceedance
from damagepred.uq.movement_distribution import SITE

READ = (
    *("damage_category", "crack_width_max", "surface_movement", "central_deflection", "load_displacement", "time"),
    *("run_time", "limit_deflection", "environment", *STUDIED),
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
    """Status of a study, ready to print."""

    total: int  # walls
    done: int
    failed: int
    remaining: int
    lines: list[str]  # in words
    categories: list[CategoryShare]  # empty without results

    @property
    def columns(self) -> list[str]:
        """Headings of the table of categories."""
        return ["category", "walls", "share", "or worse", "90 % interval", "failed counted"]

    @property
    def rows(self) -> list[list[str]]:
        """Cells of the table of categories."""
        return [
            [
                f"{c.category} {CATEGORIES[c.category].replace('_', ' ')}",
                str(c.walls),
                f"{c.share:.3f}",
                f"{c.or_worse:.3f}",
                f"{c.lower:.3f} - {c.upper:.3f}",
                f"{c.failed_undamaged:.3f} - {c.failed_damaged:.3f}" if self.failed else "-",
            ]
            for c in self.categories
        ]


def study_status(path: str | Path) -> StudyStatus:
    """Status of a study folder, finished or running."""
    folder = StudyFolder(path)
    ds = folder.results(READ)
    state = ds["status"].values
    total, failed = len(state), int((state == SampleStatus.FAILED).sum())
    remaining = int((state == SampleStatus.MISSING).sum())
    lines = [
        f"{ds.attrs['title']}: {total - remaining} of {total} walls done, {failed} failed, {remaining} remaining",
    ]
    if "run_time" in ds and np.isfinite(ds["run_time"].values).any():
        each = float(np.nanmean(ds["run_time"].values))
        lines.append(
            f"{duration(each)} a wall" + (f", about {duration(each * remaining)} of work left" if remaining else "")
        )
    if "weight" in ds and total > remaining:
        weight = np.asarray(ds["weight"].values, dtype=np.float64)[state != SampleStatus.MISSING]
        lines.append(f"importance sampling: {effective_samples(weight):.0f} effective walls; shares are weighted")
    lines += _limits(ds)
    lines += [f"caution: {sentence}" for sentence in (*study_cautions(ds), *mixture(ds))]
    for sample, record in ((i, folder.failure(i)) for i in sorted(folder.failed_samples())[:5]):
        lines.append(f"failed sample {sample}: {record['reason']}: {record['message']}")
    return StudyStatus(total, total - remaining, failed, remaining, lines, _category_shares(ds))


def watching(path: str | Path, every: float) -> Iterator[StudyStatus]:
    """Status of a study at intervals (s), until no wall is left to be solved."""
    while True:
        status = study_status(path)
        yield status
        if not status.remaining:
            return
        time.sleep(every)


def _limits(ds: xr.Dataset) -> list[str]:
    """Line on walls whose path ended at the limit of the rig."""
    if "limit_deflection" not in ds:
        return []
    ends = 1e3 * ds["limit_deflection"].values
    ends = ends[np.isfinite(ends)]
    if not ends.size:
        return []
    return [
        f"{ends.size} walls ended before the full movement, at {ends.min():.3g} to {ends.max():.3g} mm, where the "
        "jacks or supports carry no load any more; fits treat categories not reached there as censored"
    ]


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
