"""Replay of one sample of a study, bit for bit, with all its fields."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np
import xarray as xr

from damagepred.archive.folder import StudyFolder
from damagepred.archive.parts import Columns, read_part
from damagepred.archive.provenance import Environment, environment, from_table, why_bits_differ
from damagepred.assembly import NO_LIMITS
from damagepred.campaign.campaign import Campaign
from damagepred.campaign.sample import sampled_wall
from damagepred.errors import InputError
from damagepred.inputs.arguments import checked
from damagepred.one_wall.judged_path import Step
from damagepred.one_wall.solve import solve
from damagepred.runtime.one_thread import one_blas_thread
from damagepred.solvers.options import with_recorded_options

BIT_FOR_BIT = "bit for bit"
"""First words of the comparison of a sample that is the same."""

_PATH = ("sample", "increment")
"""Leading dimensions of what tells of the path, all of which is compared."""


@lru_cache(maxsize=4)
def _campaign(text: str) -> Campaign:
    """Return the study of a frozen text; many samples of few studies are replayed in one process."""
    return Campaign.from_text(text)


@checked
@one_blas_thread()
def replay(path: str | Path, sample: int, on_step: Callable[[Step], None] | None = None) -> tuple[xr.Dataset, str]:
    """Solve one sample again.

    Parameters
    ----------
    path : str or Path
        Study folder.
    sample : int
        Number of the sample.
    on_step : callable, optional
        Called with each increment.

    Returns
    -------
    dataset : xarray.Dataset
        As ``damagepred.solve`` returns it.
    comparison : str
        Whether it is bit for bit what the archive holds; if not, what of machine, version, commit, kernel hash,
        libraries and BLAS core differs.

    Raises
    ------
    InputError
        If there is no such study or sample.
    """
    folder = StudyFolder(path)
    folder.require()
    design = folder.design()
    if not 0 <= sample < design.sizes["sample"]:
        raise InputError(f"sample {sample}: {folder.path} has samples 0 to {design.sizes['sample'] - 1}.")
    study = _campaign(folder.study_text())
    values = {place: float(design[place].values[sample]) for place in study.design.wall}
    scene, fields = sampled_wall(study.settings, study.design, sample, values)
    if recorded := design.attrs.get("solver_options"):
        scene = replace(scene, solver=with_recorded_options(scene.solver, recorded))
    ds = solve(scene, fields=fields, on_failure="return", on_step=on_step, limits=NO_LIMITS)
    ds.attrs.update(title=f"{study.settings.title}: sample {sample}", sample=sample, seed=study.settings.study.seed)
    ds.attrs["study"] = study.settings.to_toml()
    return ds, _compare(folder, sample, ds)


def _compare(folder: StudyFolder, sample: int, ds: xr.Dataset) -> str:
    if (file := folder.part_of(sample)) is None:
        return f"sample {sample} has not come to a result in this study: nothing to compare with"
    try:
        part = read_part(file, study=folder.study_hash)
    except InputError as error:
        return f"there is nothing to compare with: {error}"
    row = int(np.flatnonzero(part["sample"].values == sample)[0])
    paths = {name: part[name].values[row] for name in part if name in ds and part[name].dims[:2] == _PATH}
    kept = {name: part[name].values[row] for name in part if name in ds and part[name].dims[:1] == _PATH[:1]}
    ends = {name: value for name, value in kept.items() if ds[name].dims[:1] == _PATH[1:] and name not in paths}
    steps = int(np.isfinite(paths["base_reaction"]).sum()) if paths else len(ds["increment"])
    # a study that keeps the end alone: where the path went to it
    reached = not ends or bool(np.isfinite(ends["base_reaction"]))
    differing = [
        name
        for name, found in paths.items()
        if not np.array_equal(found[:steps], ds[name].values[:steps], equal_nan=True)
    ]
    differing += [
        name
        for name, found in ends.items()
        if reached and not np.array_equal(found, ds[name].values[-1], equal_nan=True)
    ]
    if differing:
        why = why_bits_differ(_environment_of(part, row), environment())
        return f"differs from the archive in {', '.join(differing)}. {why}"
    return f"{BIT_FOR_BIT} what the archive holds for sample {sample}"


def _environment_of(part: Columns, row: int) -> Environment | None:
    """Return where a sample was solved; None where a part is of an older version and does not say."""
    if (column := part.get("environment")) is None:
        return None
    return from_table(column.attributes)[int(column.values[row])]
