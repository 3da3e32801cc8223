"""Replay of one sample of a study, with all its fields."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np
import xarray as xr

from damagepred.archive.folder import StudyFolder
from damagepred.archive.parts import read_part
from damagepred.archive.provenance import environment, from_table, why_bits_differ
from damagepred.assembly import NO_LIMITS
from damagepred.campaign.campaign import Campaign
from damagepred.campaign.sample import sampled_wall
from damagepred.errors import InputError
from damagepred.inputs.arguments import checked
from damagepred.one_wall.judged_path import Step
from damagepred.one_wall.solve import solve
from damagepred.runtime.one_thread import one_blas_thread
from damagepred.solvers.options import with_recorded_options

BIT_FOR_BIT = "bit for bit"  # first words of the comparison of an identical sample
_PATH = ("sample", "increment")  # leading dimensions of the compared results of a path
_campaign = lru_cache(maxsize=4)(Campaign.from_text)  # one process replays many samples of few studies


@checked
@one_blas_thread()
def replay(path: str | Path, sample: int, on_step: Callable[[Step], None] | None = None) -> tuple[xr.Dataset, str]:
    """One sample solved again, as ``damagepred.solve`` returns it, and its comparison with the archive."""
    folder = StudyFolder(path)
    folder.require()
    design = folder.design()
    if not 0 <= sample < design.sizes["sample"]:
        raise InputError(f"sample {sample}: {folder.path} has samples 0 to {design.sizes['sample'] - 1}.")
    study = _campaign(folder.study_text())
    values = {key: float(design[key].values[sample]) for key in study.design.wall}
    scene, fields = sampled_wall(study.settings, study.design, sample, values)
    if recorded := design.attrs.get("solver_options"):
        scene = replace(scene, solver=with_recorded_options(scene.solver, recorded))
    ds = solve(scene, fields=fields, on_failure="return", on_step=on_step, limits=NO_LIMITS)
    ds.attrs.update(title=f"{study.settings.title}: sample {sample}", sample=sample, seed=study.settings.study.seed)
    ds.attrs["study"] = study.settings.to_toml()
    return ds, _compare(folder, sample, ds)


def _compare(folder: StudyFolder, sample: int, ds: xr.Dataset) -> str:
    if (file := folder.part_of(sample)) is None:
        return f"sample {sample} has no result in this study: nothing to compare with"
    try:
        columns = read_part(file, study=folder.study_hash)
    except InputError as error:
        return f"there is nothing to compare with: {error}"
    row = int(np.flatnonzero(columns["sample"].values == sample)[0])
    paths = {name: columns[name].values[row] for name in columns if name in ds and columns[name].dims[:2] == _PATH}
    kept = {name: columns[name].values[row] for name in columns if name in ds and columns[name].dims[:1] == _PATH[:1]}
    ends = {name: value for name, value in kept.items() if ds[name].dims[:1] == _PATH[1:] and name not in paths}
    steps = int(np.isfinite(paths["base_reaction"]).sum()) if paths else len(ds["increment"])
    # a study may keep only the end of the path, if the path reached it
    reached = not ends or bool(np.isfinite(ends["base_reaction"]))
    pairs = [(name, archived[:steps], ds[name].values[:steps]) for name, archived in paths.items()]
    pairs += [(name, archived, ds[name].values[-1]) for name, archived in ends.items() if reached]
    differing = [name for name, archived, now in pairs if not np.array_equal(archived, now, equal_nan=True)]
    if differing:
        column = columns.get("environment")  # parts of older versions lack it
        solved_in = None if column is None else from_table(column.attributes)[int(column.values[row])]
        why = why_bits_differ(solved_in, environment())
        return f"differs from the archive in {', '.join(differing)}. {why}"
    return f"{BIT_FOR_BIT} equal to sample {sample} of the archive"
