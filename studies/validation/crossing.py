"""Shares of variance of a case's causes, by crossed walls: Sobol's indices of groups of inputs.

A cause is a group of variables, the random numbers of single joints, or which of some studies is run. Two walls of the
base sample exchange one cause at a time, so that each cause meets different values of all others.
"""

from __future__ import annotations

import csv
import hashlib
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import cache
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr
from SALib.analyze import sobol

from damagepred.analyses.function import StudyFunction
from damagepred.arrays import FloatArray, IntArray
from damagepred.campaign.settings import StudySettings
from damagepred.uq.samplers import unit_points

JOINTS, STUDIES = "joints", "studies"
"""Words that stand, in a cause, for the random numbers of single joints, and for the choice of a study."""


def variance_shares(
    studies: Sequence[StudySettings],
    causes: Mapping[str, Sequence[str]],
    outputs: Sequence[str],
    size: int,
    folder: Path,
    workers: int,
) -> xr.Dataset:
    """Return Sobol's indices of the causes of the largest value of the first output along the path.

    The studies have the same variables and are equally likely; each variable belongs to one cause. Size times
    (causes + 2) walls are solved.
    """
    first = StudyFunction(studies[0], outputs)
    if unknown := {*first.inputs} ^ {place for places in causes.values() for place in places} - {JOINTS, STUDIES}:
        raise ValueError(f"belongs to no cause, or is no variable: {', '.join(sorted(unknown))}")
    unit = unit_points("sobol", 2 * (len(first.inputs) + 1), size, studies[0].study.seed)
    both = np.concatenate(np.split(unit, 2, axis=1))
    values, chosen = first.from_unit(both[:, :-1]), (both[:, -1] * len(studies)).astype(np.int64)
    number = np.arange(2 * size)
    first_wall, other_wall = (np.repeat(half[:, None], len(causes), axis=1) for half in np.split(number, 2))
    each = (np.where(np.arange(len(causes)) == k, other_wall, first_wall) for k in range(len(causes)))
    rows = np.stack((first_wall, *each, other_wall), axis=1).reshape(-1, len(causes))
    column = {place: k for k, places in enumerate(causes.values()) for place in places}
    walls = np.column_stack([values[rows[:, column[place]], i] for i, place in enumerate(first.inputs)])
    joints, study = rows[:, column[JOINTS]], chosen[rows[:, column[STUDIES]]]
    text = "".join(one.to_toml() for one in studies)
    digest = hashlib.sha256((text + repr((sorted(causes.items()), size))).encode()).hexdigest()[:12]
    peak = _solved(folder / f"crossed_{digest}.csv", (studies, tuple(outputs)), walls, joints, study, workers)
    return _indices(peak, list(causes)).assign_attrs(walls=len(peak), mean=peak.mean(), cov=peak.std() / peak.mean())


def _indices(peak: FloatArray, causes: list[str]) -> xr.Dataset:
    """Return Sobol's indices of the causes by SALib, with intervals of 90 % from 500 resamples."""
    problem = {"num_vars": len(causes), "names": causes, "bounds": [[0.0, 1.0]] * len(causes)}
    options: dict[str, Any] = {"calc_second_order": False, "num_resamples": 500, "conf_level": 0.9, "seed": 0}
    indices = sobol.analyze(problem, peak, **options)
    columns = {}
    for name, key in (("first_order", "S1"), ("total", "ST")):
        value, reach = indices[key], indices[f"{key}_conf"]
        columns |= {name: value, f"{name}_lower": value - reach, f"{name}_upper": value + reach}
    return xr.Dataset({name: ("variable", column) for name, column in columns.items()}, {"variable": causes})


def _solved(
    file: Path, asked: tuple[Sequence[StudySettings], tuple[str, ...]], walls: FloatArray, joints: IntArray,
    study: IntArray, workers: int,
) -> FloatArray:  # fmt: skip
    """Return the largest output of each wall; those in the file are not solved again."""
    found = np.full(len(walls), np.nan)
    if file.exists():
        known = pd.read_csv(file)
        found[known["wall"]] = known["value"]
    left = np.flatnonzero(np.isnan(found))
    with (
        file.open("a", newline="", encoding="utf-8") as out,
        ProcessPoolExecutor(workers, get_context("spawn"), _set_studies, asked) as pool,
    ):
        writer = csv.writer(out)
        if not out.tell():
            writer.writerow(("wall", "value"))
        jobs = zip(left, pool.map(_largest, walls[left], joints[left], study[left]), strict=True)
        for done, (wall, value) in enumerate(jobs, start=1):
            found[wall] = value
            writer.writerow((wall, repr(value)))
            out.flush()
            if done % 64 == 0 or done == len(left):
                print(f"{file.stem}: {len(walls) - len(left) + done} of {len(walls)} walls", flush=True)
    return found


_ASKED: list[tuple[Sequence[StudySettings], tuple[str, ...]]] = []


def _set_studies(studies: Sequence[StudySettings], outputs: tuple[str, ...]) -> None:
    _ASKED[:] = [(studies, outputs)]


@cache
def _function(study: int) -> StudyFunction:
    studies, outputs = _ASKED[0]
    return StudyFunction(studies[study], outputs, "path")


def _largest(wall: FloatArray, joints: int, study: int) -> float:
    ds = _function(int(study))(wall, int(joints))
    return float(np.nanmax(ds[_ASKED[0][1][0]].values))


def table(shares: xr.Dataset) -> str:
    """Return the shares as a table of Markdown."""
    lines = ["| cause | alone | with all its interactions |", "|---|---|---|"]
    for cause in shares["variable"].values:
        one = shares.sel(variable=cause)
        cells = [
            f"{float(one[name]):.2f} ({float(one[f'{name}_lower']):.2f} to {float(one[f'{name}_upper']):.2f})"
            for name in ("first_order", "total")
        ]
        lines.append(f"| {cause} | {cells[0]} | {cells[1]} |")
    return "\n".join(lines)
