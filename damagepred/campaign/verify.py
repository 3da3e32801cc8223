"""Verification of the files of a study against their digests, and repair.

Derived files are made again, damaged files are set aside in the folder ``damaged``, and ``Study.run`` solves missing
samples.
"""

from __future__ import annotations

import warnings
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import xarray as xr

from damagepred.archive.digest import read_signed_json, signature, study_hash
from damagepred.archive.files import read_dataset
from damagepred.archive.folder import StudyFolder
from damagepred.archive.provenance import mixture
from damagepred.archive.schema import check_values, columns_of
from damagepred.campaign.campaign import Campaign
from damagepred.campaign.replay import BIT_FOR_BIT, replay
from damagepred.campaign.settings import read_frozen
from damagepred.enumerations import SOLVED, SampleStatus
from damagepred.errors import ArchiveWarning, DamagedError, InputError, NewerError, StudyError
from damagepred.formatting import duration


@dataclass
class Verification:
    """Findings of a verification."""

    files: int = 0  # checked files
    damaged: list[str] = field(default_factory=list)  # one sentence per file
    differing: list[str] = field(default_factory=list)  # samples that differ when solved again
    notes: list[str] = field(default_factory=list)  # other remarks

    @contextmanager
    def check(self) -> Iterator[None]:
        """Record errors and warnings of the archive as damage."""
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always", ArchiveWarning)
            try:
                yield
            except NewerError:
                raise
            except InputError as error:
                self.damaged.append(str(error))
        self.damaged += [str(w.message) for w in caught if issubclass(w.category, ArchiveWarning)]


def verify(path: str | Path, samples: int = 0, on_plan: Callable[[str], None] | None = None) -> Verification:
    """Check digests, variables, flags and ranges of a study folder or a file; solve some samples again."""
    target, result = Path(path), Verification()
    if not target.exists():
        raise InputError(f"{path}: no such file or folder.")
    if not target.is_dir():
        if samples:
            raise InputError(f"{path}: samples can be solved again in study folders only.")
        with result.check():
            _check_file(target)
        result.files = 1
        return result
    folder = _study_folder(target)
    ds = _check_folder(folder, result)
    if ds is not None:
        solved = np.flatnonzero(np.isin(ds["status"].values, SOLVED))
        chosen = solved[np.unique(np.linspace(0, len(solved) - 1, min(samples, len(solved))).astype(int))]
        if len(chosen) and on_plan is not None:
            each = float(np.nanmean(ds["run_time"].values)) if "run_time" in ds else np.nan
            which = f"{len(chosen)} sample{'s' * (len(chosen) > 1)} again"
            on_plan(f"solving {which}" + (f", {duration(each * len(chosen))}" if each > 0 else ""))
        for sample in chosen.tolist():
            comparison = replay(target, sample)[1]
            if not comparison.startswith(BIT_FOR_BIT):
                result.differing.append(f"sample {sample} solved again {comparison}")
    return result


def _study_folder(path: str | Path) -> StudyFolder:
    folder = StudyFolder(path)
    if not (folder.exists or folder.design_file.is_file()):
        raise InputError(f"{path}: is no study folder (it has neither study.toml nor design.nc).")
    return folder


def _check_file(file: Path) -> xr.Dataset:
    ds = read_dataset(file)
    signature(file, whole=True)
    check_values(columns_of(ds), str(file), ranges=True)
    return ds


def _check_folder(folder: StudyFolder, result: Verification) -> xr.Dataset | None:
    """Check all files of a folder; return its samples from the parts, if readable."""
    ds: xr.Dataset | None = None
    with result.check():
        read_frozen(folder.study_text())
        _check_file(folder.design_file)
        ds, left_out = folder.read(derived=False)
        result.damaged += left_out.values()
        check_values(columns_of(ds), str(folder.parts), ranges=True)
    unsigned = 0
    for file in (folder.study_file, folder.design_file, folder.results_file, *folder.part_files()):
        with result.check():
            if file.exists():
                unsigned += signature(file, whole=True) is None
    for sample in sorted(folder.failed_samples()):
        with result.check():
            folder.checked_failure(sample)
    if ds is None:
        return None
    if folder.results_file.exists():
        with result.check():
            _compare(read_dataset(folder.results_file, folder.study_hash), ds, folder.results_file)
    result.damaged = list(dict.fromkeys(result.damaged))
    single = (folder.study_file, folder.manifest_file, folder.design_file, folder.results_file)
    result.files = len(folder.part_files()) + len(folder.failed_samples()) + sum(file.is_file() for file in single)
    result.notes += [f"{word}." for word in mixture(ds)]
    if missing := int((ds["status"].values == SampleStatus.MISSING).sum()):
        result.notes.append(f"{missing} of {ds.sizes['sample']} samples have no result; `damagepred study` runs them.")
    if unsigned:
        result.notes.append(f"{unsigned} files have no digest, as in older versions: only values were checked.")
    return ds


def _compare(whole: xr.Dataset, parts: xr.Dataset, file: Path) -> None:
    """Check that ``results.nc`` equals the parts, for samples in both."""
    solved = np.isin(whole["status"].values, SOLVED)
    for name, values in parts.data_vars.items():
        if values.dims[:1] != ("sample",) or name not in whole or name in ("run_time", "environment"):
            continue  # these differ for a wall that was solved again
        rows = whole["sample"].values[solved]
        both = np.isin(parts["status"].values[rows], SOLVED)
        stored, of_parts = whole[name].values[solved][both], values.values[rows][both]
        if not np.array_equal(stored, of_parts, equal_nan=stored.dtype.kind == "f"):
            raise DamagedError(f"{file}: differs from the parts in {name}.")


def repair(path: str | Path) -> list[str]:
    """Rebuild derived files of a study folder and set damaged files aside; return the repairs, one sentence each."""
    folder = _study_folder(path)
    lock = folder.lock()
    try:
        folder.tidy()
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ArchiveWarning)  # the sentences report it
            repairs = (_repair_study, _repair_design, _repair_manifest, _repair_samples)
            return [sentence for repaired in repairs for sentence in repaired(folder)]
    finally:
        lock.release()


def _set_aside(folder: StudyFolder, file: Path, why: str) -> str:
    return f"{why} It was set aside as {folder.set_aside(file)}."


def _repair_study(folder: StudyFolder) -> Iterator[str]:
    """Restore the frozen study from the design."""
    carried: Counter[str] = Counter()  # hashes of the study in the other files
    for file in (folder.manifest_file, folder.design_file, folder.results_file, *folder.part_files()):
        with suppress(InputError):
            carried.update(filter(None, [signature(file)]))
    wanted = carried.most_common(1)[0][0] if carried else None
    with suppress(InputError):
        text = folder.study_text()
        if wanted in (None, study_hash(text)):
            read_frozen(text)
            return
    try:
        text = str(read_dataset(folder.design_file).attrs.get("study", ""))
    except InputError:
        text = ""
    if study_hash(text) != wanted:
        raise StudyError(
            f"{folder.study_file}: cannot be read, and neither can the design, which has a copy; restore a backup."
        )
    if folder.study_file.exists():
        yield _set_aside(folder, folder.study_file, f"{folder.study_file}: was edited or is damaged.")
    folder.write_study(text)
    yield f"{folder.study_file}: restored from the design."


def _repair_design(folder: StudyFolder) -> Iterator[str]:
    """Draw the design again."""
    study = Campaign.from_text(folder.study_text())
    count = 0
    with suppress(InputError):
        requested = read_signed_json(folder.manifest_file, folder.study_hash).get("samples")
        count = requested if isinstance(requested, int) else 0
    try:
        if folder.design().sizes["sample"] >= count:
            return
        why = f"{folder.design_file}: has fewer than {count} samples."
    except InputError as error:
        why = str(error)
    if not count:
        count = max([study.settings.study.samples, *(samples.stop for samples in folder.part_files().values())])
    if folder.design_file.exists():
        yield _set_aside(folder, folder.design_file, why)
    study.write_design(folder, count)
    yield f"{folder.design_file}: drawn again, {count} samples."


def _repair_manifest(folder: StudyFolder) -> Iterator[str]:
    """Restore the manifest from the design."""
    try:
        manifest = folder.manifest()
    except NewerError:
        raise
    except InputError:  # unknown schema version
        manifest = folder.manifest_of_design()
    if manifest["schema_version"] == 0:
        if folder.manifest_file.exists():
            yield _set_aside(folder, folder.manifest_file, f"{folder.manifest_file}: is damaged or of another study.")
        folder.write_manifest(manifest)
        yield f"{folder.manifest_file}: made again from the design."


def _repair_samples(folder: StudyFolder) -> Iterator[str]:
    """Set aside damaged parts and failures, and rebuild ``results.nc`` where it differs from the parts."""
    ds, left_out = folder.read(derived=False)
    for sample in folder.failed_samples():
        try:
            folder.checked_failure(sample)
        except InputError as error:
            left_out[folder.failure_file(sample)] = str(error)
    for file, why in left_out.items():
        yield _set_aside(folder, file, why)
    try:
        _compare(read_dataset(folder.results_file, folder.study_hash), ds, folder.results_file)
        return
    except InputError as error:
        if folder.results_file.exists():
            yield _set_aside(folder, folder.results_file, str(error))
    folder.consolidate()
    yield f"{folder.results_file}: made again from the parts."
