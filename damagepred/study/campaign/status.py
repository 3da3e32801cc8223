"""Status of a study: walls done, failed and left, and the estimate so far."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import xarray as xr

from damagepred.archive.cautions import STUDIED, study_cautions
from damagepred.archive.folder import StudyFolder
from damagepred.archive.provenance import mixture
from damagepred.archive.schema import CATEGORIES
from damagepred.enumerations import SOLVED, SampleStatus
from damagepred.formatting import duration
from damagepred.uq.capacity import sample_weights
from damagepred.uq.estimate import effective_samples, probability

READ = ("damage_category", "run_time", "limit_deflection", "environment", *STUDIED)
"""Results that the status is made of; the others are not read."""


@dataclass(frozen=True)
class StudyStatus:
    """Status of a study, ready to print.

    Attributes
    ----------
    total, done, failed, remaining : int
        Walls.
    lines : list of str
        In words.
    columns, rows
        Table of categories with the share of walls that end in them, and the share in them or worse with its 90 %
        confidence interval (Wilson) and the bounds if all failed walls were undamaged or damaged.
    """

    total: int
    done: int
    failed: int
    remaining: int
    lines: list[str]
    columns: list[str]
    rows: list[list[str]]


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
    columns = ["category", "walls", "share", "or worse", "90 % interval", "failed counted"]
    return StudyStatus(total, total - remaining, failed, remaining, lines, columns, _rows(ds, failed))


def watching(path: str | Path, every: float) -> Iterator[StudyStatus]:
    """Read the status of a study at intervals, until no wall is left to be solved.

    Parameters
    ----------
    path : str or Path
        Study folder.
    every : float
        Interval (s).
    """
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


def _rows(ds: xr.Dataset, failed: int) -> list[list[str]]:
    if "damage_category" not in ds:
        return []
    good = np.isin(ds["status"].values, SOLVED)
    worst = ds["damage_category"].values[good].reshape(good.sum(), -1).max(axis=1, initial=0)
    count = len(worst)
    if not count:
        return []
    every, lost = sample_weights(ds), ds["status"].values == SampleStatus.FAILED
    weight = every[good] if "weight" in ds else None
    replicates = int(ds.attrs.get("replicates", 1))
    label = np.flatnonzero(good) % replicates if replicates > 1 else None
    rows = []
    for category in range(int(ds.attrs["highest_category"]) + 1):
        here = probability(worst == category, weight=weight, replicate=label)
        beyond = probability(worst >= category, weight=weight, replicate=label)
        low = float(every[good] @ (worst >= category)) / (count + failed)
        high = low + float(every[lost].sum()) / (count + failed)
        bounds = f"{low:.3f} - {min(high, 1.0):.3f}" if failed else "-"
        rows.append(
            [
                f"{category} {CATEGORIES[category].replace('_', ' ')}",
                str(int((worst == category).sum())),
                f"{here.value:.3f}",
                f"{beyond.value:.3f}",
                f"{beyond.lower:.3f} - {beyond.upper:.3f}",
                bounds,
            ]
        )
    return rows
