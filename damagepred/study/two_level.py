"""A coarse wall beside each sampled one, where a pilot run shows that it pays.

Both are ordinary studies, in the folders ``fine.dp`` and ``coarse.dp``, of the same samples: values that hold for a
wall are the same, and joints of the coarse wall have the strength of the nearest joints of the fine one. Samples are
random ones: the errors stated need them to be independent.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from concurrent.futures import Executor
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from damagepred.archive.files import write_whole
from damagepred.archive.folder import open_study
from damagepred.errors import InputError
from damagepred.scene import Scene
from damagepred.study.settings import StudySettings
from damagepred.study.study import Study
from damagepred.uq.control_variate import PilotReport, read_pilot, two_level
from damagepred.uq.estimate import Estimate, probability
from damagepred.uq.exceedance import shares, walls

FloatArray = NDArray[np.float64]


class TwoLevel(NamedTuple):
    """What two levels say of a probability.

    Attributes
    ----------
    pilot : PilotReport
        Whether it pays.
    estimate : Estimate
        With the control variate if it pays, otherwise from the fine walls alone.
    fine, coarse : int
        Walls run.
    left_out : int
        Samples left out because one of the two walls failed.
    """

    pilot: PilotReport
    estimate: Estimate
    fine: int
    coarse: int
    left_out: int


def levels(settings: StudySettings) -> tuple[StudySettings, StudySettings]:
    """Return a study's fine and coarse form.

    Raises
    ------
    InputError
        If the study says nothing of a coarse wall, or the scene cannot take it.
    """
    coarse = settings.study.coarse
    if not coarse:
        raise InputError(
            "[study.coarse]: say in which the coarse wall differs, such as [study.coarse.wall] block_length = '480 mm'."
        )
    if settings.study.sampler == "table" or settings.study.importance:
        raise InputError("[study.coarse]: goes with random samples, drawn as stated; no table and no importance.")
    scene = Scene.from_dict(_merged(settings.scene.to_dict(), coarse), source="[study.coarse]")
    how = replace(
        settings.study, sampler="random", replicates=1, stop_when=None, time_budget=None, coarse={}, movement="path"
    )
    return replace(settings, study=how), replace(
        settings, scene=scene, study=replace(how, fields_from=settings.scene, store_fields=False)
    )


def _merged(scene: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    merged = dict(scene)
    for key, value in changes.items():
        before = merged.get(key)
        merged[key] = _merged(before or {}, value) if isinstance(value, Mapping) else value
    return merged


def run_two_level(
    settings: StudySettings,
    category: int,
    at: float,
    out: str | Path,
    *,
    pilot: int = 32,
    budget: float | None = None,
    workers: int = 1,
    executor: Executor | None = None,
    confidence: float = 0.9,
    on_pilot: Callable[[PilotReport], None] | None = None,
) -> TwoLevel:
    """Estimate the probability of a category at a movement with a coarse wall as control variate, if it pays.

    Parameters
    ----------
    settings : StudySettings
        With ``[study.coarse]``.
    category, at : int, float
        The category, or a worse one, and the movement (m).
    out : str or Path
        Folder for both studies; the same call goes on with what is there.
    pilot : int
        Samples of the pilot run. They count in the end.
    budget : float, optional
        Work in all, in fine walls; by default the study's number of samples.
    workers, executor
        See ``Study.run``.
    confidence : float
        Of the interval.
    on_pilot : callable, optional
        Called with the pilot's report before the rest is run.

    Raises
    ------
    InputError
        If there is no coarse wall, or the budget is below the pilot's cost.
    """
    fine, coarse = (Study(level) for level in levels(settings))
    folder = Path(out)
    budget = settings.study.samples if budget is None else budget

    def run(study: Study, name: str, samples: int) -> xr.Dataset:
        study.run(folder / name, samples, workers, executor)
        return open_study(folder / name)

    first = run(fine, "fine.dp", pilot), run(coarse, "coarse.dp", pilot)
    hits = [_hits(ds, category, at, pilot) for ds in first]
    good = np.isfinite(hits[0]) & np.isfinite(hits[1])
    cost = [float(np.nanmedian(ds["run_time"].values[:pilot])) for ds in first]
    report = read_pilot(hits[0][good], hits[1][good], *cost)
    if on_pilot is not None:
        on_pilot(report)
    count, beside = report.allocation(budget)
    count, beside = max(count, pilot), max(beside, pilot)
    sampled = run(fine, "fine.dp", count)
    y = _hits(sampled, category, at, count)
    if not report.pays:
        known = y[np.isfinite(y)]
        found = TwoLevel(report, probability(known, confidence=confidence), count, pilot, count - len(known))
    else:
        beside = max(beside, count + 2)
        x = _hits(run(coarse, "coarse.dp", beside), category, at, beside)
        both = np.isfinite(y) & np.isfinite(x[:count])
        further = x[count:]
        estimate = two_level(y[both], x[:count][both], further[np.isfinite(further)], confidence=confidence)
        found = TwoLevel(report, estimate, count, beside, int((~both).sum() + np.isnan(further).sum()))
    content: dict[str, Any] = {"category": category, "at": at, "fine": found.fine, "coarse": found.coarse}
    content |= {"left_out": found.left_out}
    content |= {"pilot": report._asdict(), "estimate": found.estimate._asdict()}
    text = json.dumps(content, indent=2) + "\n"
    write_whole(folder / "two_level.json", lambda p: p.write_text(text, encoding="utf-8"))
    return found


def _hits(ds: xr.Dataset, category: int, at: float, count: int) -> FloatArray:
    """Return, of the first walls, whether each had reached the category by the movement; NaN if it failed."""
    known = walls(ds, category)
    found = np.full(ds.sizes["sample"], np.nan)
    found[known.sample] = shares(known.lower, known.upper, at)
    return found[:count]
