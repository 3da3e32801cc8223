"""Status of a study: walls done, failed and left, and the estimate so far."""

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
"""Results that the status is made of; the others are not read."""


class CategoryShare(NamedTuple):
    """Share of walls by a damage category.

    Attributes
    ----------
    category : int
        Its number.
    walls : int
        Walls that end in it.
    share, or_worse : float
        Probability of it, and of it or worse, by the end of each wall's own movement; see ``damagepred.exceedance``.
    lower, upper : float
        90 % confidence interval of the latter.
    failed_undamaged, failed_damaged : float
        Share in it or worse if all failed walls were undamaged, and if all were damaged.
    """

    category: int
    walls: int
    share: float
    or_worse: float
    lower: float
    upper: float
    failed_undamaged: float
    failed_damaged: float


@dataclass(frozen=True)
class StudyStatus:
    """Status of a study, ready to print.

    Attributes
    ----------
    total, done, failed, remaining : int
        Walls.
    lines : list of str
        In words.
    categories : list of CategoryShare
        In their order; empty where nothing is known.
    """

    total: int
    done: int
    failed: int
    remaining: int
    lines: list[str]
    categories: list[CategoryShare]

    @property
    def columns(self) -> list[str]:
        """Heads of the table of categories."""
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
    """Read the status of a study.

    Parameters
    ----------
    path : str or Path
        Study folder; it may be running.

    Raises
    ------
    InputError
        If it is no study folder.
    """
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
    lines += [f"caution: {said}" for said in (*study_cautions(ds), *mixture(ds))]
    for sample, record in ((i, folder.failure(i)) for i in sorted(folder.failed_samples())[:5]):
        lines.append(f"failed sample {sample}: {record['reason']}: {record['message']}")
    return StudyStatus(total, total - remaining, failed, remaining, lines, _category_shares(ds))


def watching(path: str | Path, every: float) -> Iterator[StudyStatus]:
    """Status of a study at intervals (s), until no wall is left to be solved."""
    while True:
        found = study_status(path)
        yield found
        if not found.remaining:
            return
        time.sleep(every)


def _limits(ds: xr.Dataset) -> list[str]:
    """Return a line on walls on jacks whose path ended at the limit of the rig."""
    if "limit_deflection" not in ds:
        return []
    at = 1e3 * ds["limit_deflection"].values
    at = at[np.isfinite(at)]
    if not at.size:
        return []
    return [
        f"{at.size} walls ended before the full movement, at {at.min():.3g} to {at.max():.3g} mm, where the jacks or "
        "supports carry nothing any more; fits take what they had not reached there as not yet reached (censored)"
    ]


def _category_shares(ds: xr.Dataset) -> list[CategoryShare]:
    if "damage_category" not in ds or not (good := np.isin(ds["status"].values, SOLVED)).any():
        return []
    worst = ds["damage_category"].values[good].reshape(good.sum(), -1).max(axis=1, initial=0)
    highest = int(ds.attrs["highest_category"])
    found = [estimate_exceedance(category_capacities(ds, c, None, SITE), SITE) for c in range(1, highest + 1)]
    sure = found[0].estimate._replace(value=1.0, lower=1.0, upper=1.0)
    found = [found[0]._replace(estimate=sure, failed_undamaged=1.0, failed_damaged=1.0), *found]
    value = [one.estimate.value for one in found] + [0.0]
    return [
        CategoryShare(
            c,
            int((worst == c).sum()),
            value[c] - value[c + 1],
            *(one.estimate.value, one.estimate.lower, one.estimate.upper, one.failed_undamaged, one.failed_damaged),
        )
        for c, one in enumerate(found)
    ]
