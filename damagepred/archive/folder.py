"""Folder of a study: description, design, results and failures. Its files are written once.

    study.toml      frozen copy of the study, scene inside
    manifest.json   program, date, number of samples
    design.nc       every input of every sample, written before any run
    parts/          one file per finished task of one or more samples
    failures/       one file per failed sample, with reason, inputs and the command that replays it
    results.nc      all parts together, for fast reading; can be rebuilt from the parts
    damaged/        files that were set aside because they are damaged or of another study
    .lock, .writer  process that writes to the folder; the lock ends with the process

Every file is written under a temporary name and renamed when it is on the disk, so a killed run leaves complete files.
Each ends with a digest of its content and the hash of the study (``damagepred.archive.digest``). A part, a failure, a
manifest or a ``results.nc`` that is damaged or of another study is left out with an ``ArchiveWarning``.
"""

from __future__ import annotations

import contextlib
import os
import re
import socket
import warnings
from collections.abc import Iterable, Mapping
from datetime import datetime
from functools import cached_property
from pathlib import Path
from typing import Any

import filelock
import numpy as np
import xarray as xr

from damagepred.archive.digest import read_signed_json, signed, signed_json, study_hash, verified
from damagepred.archive.files import check_output, read_dataset, write_dataset, write_text, write_whole
from damagepred.archive.parts import read_part
from damagepred.archive.provenance import Environment, as_table, from_table, provenance
from damagepred.archive.schema import (
    FLAG_FILL,
    SCHEMA_VERSION,
    VARIABLES,
    Column,
    Columns,
    check_attributes,
    columns_of,
    dataset,
    with_shared_movement,
)
from damagepred.enumerations import UNSOLVED, FailureKind, SampleStatus
from damagepred.errors import ArchiveWarning, DamagedError, InputError, NewerError, StudyError
from damagepred.inputs.arguments import checked
from damagepred.inputs.input_files import as_text, read_bytes, read_text

_BEGUN = (".lock", ".writer", ".stop", "parts", "failures", "manifest.json", "design.nc")
"""Files that an interrupted creation leaves in a folder."""

DESIGN_ATTRIBUTES = ("title", "seed", "study", "scene", "highest_category", "span")  # attributes that every design has

_PART = re.compile(r"samples?-(\d+)(?:-(\d+))?\.nc")
_FAILURE = re.compile(r"sample-(\d+)\.json")


class StudyFolder:
    """Folder of one study, usually named ``*.dp``."""

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        self.parts = self.path / "parts"
        self.failures = self.path / "failures"
        self.study_file = self.path / "study.toml"
        self.manifest_file = self.path / "manifest.json"
        self.design_file = self.path / "design.nc"
        self.results_file = self.path / "results.nc"
        self._stop_file = self.path / ".stop"
        self._writer_file = self.path / ".writer"

    # -- making and opening ---------------------------------------------------------------------------------------

    @property
    def exists(self) -> bool:
        """Whether the folder holds a study."""
        return self.study_file.is_file()

    def create(self, study_toml: str, manifest: Mapping[str, Any], design: xr.Dataset) -> None:
        """Make the folder. The frozen study is written last: it marks a complete folder."""
        self.check_new()
        self._make(self.parts)
        self._make(self.failures)
        study = study_hash(study_toml)
        self.write_manifest(manifest, study)
        write_dataset(design, self.design_file, study)
        self.write_study(study_toml)

    def check_new(self) -> None:
        """Refuse a path with anything except the leftovers of an interrupted creation."""
        check_output(self.path)
        if not self._can_begin():
            lost = " If its study.toml was lost, `damagepred repair` restores it." if self.design_file.is_file() else ""
            raise StudyError(
                f"{self.path}: exists and is no study folder; nothing was changed. Choose another with -o.{lost}"
            )

    def write_study(self, text: str) -> None:
        """Write the frozen copy of the study."""
        content = signed(text.encode("utf-8"))
        write_whole(self.study_file, lambda p: p.write_bytes(content))
        self.__dict__.pop("study_hash", None)

    def _can_begin(self) -> bool:
        """Whether the folder holds only leftovers of an interrupted creation."""
        if not self.path.exists():
            return True
        if not self.path.is_dir():
            return False
        if _names(self.parts) or _names(self.failures):
            return False
        return all(name in _BEGUN or re.fullmatch(r"\..*\.tmp", name) for name in _names(self.path))

    def _make(self, folder: Path) -> None:
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            why = f"the folder cannot be made: {error.strerror}; choose another place with -o."
            raise StudyError(f"{folder}: {why}") from error

    def require(self) -> None:
        """Check that this is a study folder of a known schema, with an unedited frozen study."""
        if not os.path.exists(self.path):
            raise InputError(f"{self.path}: no such study folder; `damagepred study` makes one.")
        if not self.exists or not (self.manifest_file.is_file() or self.design_file.is_file()):
            raise InputError(f"{self.path}: is not a study folder (it has no study.toml, manifest.json and design.nc).")
        self.manifest()

    def lock(self) -> filelock.FileLock:
        """Lock the folder for writing, until the lock is released or the process ends."""
        self._make(self.path)
        lock = filelock.FileLock(self.path / ".lock", timeout=0)
        try:
            lock.acquire()
        except filelock.Timeout:
            writer = ""
            with contextlib.suppress(InputError):
                writer = f" ({read_text(self._writer_file)})"
            raise StudyError(
                f"{self.path}: another damagepred is writing to this study{writer}; wait for it, or read with status."
            ) from None
        except OSError as error:
            raise StudyError(f"{self.path}: cannot be written: {error.strerror}; choose another with -o.") from error
        with contextlib.suppress(OSError):
            since = datetime.now().astimezone().isoformat(sep=" ", timespec="seconds")
            self._writer_file.unlink(missing_ok=True)
            self._writer_file.write_text(f"process {os.getpid()} on {socket.gethostname()} since {since}", "utf-8")
        return lock

    # -- what is in it --------------------------------------------------------------------------------------------

    def study_text(self) -> str:
        """Frozen copy of the study; an edited copy raises InputError."""
        return self._frozen()[0]

    def _frozen(self) -> tuple[str, bool]:
        """Frozen copy of the study, and whether it has a digest."""
        try:
            content, digest = verified(read_bytes(self.study_file), self.study_file)
        except DamagedError as error:
            raise DamagedError(f"{error} {self._restores}") from None
        return as_text(content, self.study_file), digest is not None

    @property
    def _restores(self) -> str:
        return f"`damagepred repair {self.path}` restores it."

    @cached_property
    def study_hash(self) -> str:
        """Hash of the frozen study, part of every digest in the folder."""
        return study_hash(self.study_text())

    def manifest(self) -> dict[str, Any]:
        """Manifest; a lost or damaged one is rebuilt from the design, with schema version 0."""
        try:
            manifest = read_signed_json(self.manifest_file, self.study_hash)
        except NewerError:
            raise
        except InputError as error:
            return self._manifest_again(str(error))
        version, samples = manifest.get("schema_version"), manifest.get("samples")
        if not isinstance(version, int) or version < 1:
            raise InputError(f"{self.manifest_file}: has no schema_version; it is not one of damagepred.")
        if not isinstance(samples, int) or samples < 1:
            return self._manifest_again(f"{self.manifest_file}: is damaged: its number of samples is {samples!r}.")
        return manifest

    def _manifest_again(self, why: str) -> dict[str, Any]:
        if not self._frozen()[1] and why.endswith("another study."):
            raise DamagedError(f"{self.study_file}: was edited: the manifest is of another. {self._restores}")
        _warn(f"{why} Its content is taken from the design.")
        return self.manifest_of_design()

    def manifest_of_design(self) -> dict[str, Any]:
        """Content of the manifest from the attributes of the design, with schema version 0."""
        design = self.design()
        known = {key: design.attrs[key] for key in ("title", "seed", "sampler", *provenance()) if key in design.attrs}
        attributes = {key: value.item() if isinstance(value, np.generic) else value for key, value in known.items()}
        return {**attributes, "created": "unknown", "samples": design.sizes["sample"], "schema_version": 0}

    def write_manifest(self, manifest: Mapping[str, Any], study: str | None = None) -> None:
        """Replace the manifest; the schema version is added."""
        record = dict(sorted({**manifest, "schema_version": SCHEMA_VERSION}.items()))
        write_text(self.manifest_file, signed_json(record, study or self.study_hash))

    @property
    def stopping(self) -> bool:
        """Whether a stop was requested: no further sample begins."""
        return self._stop_file.exists()

    def ask_to_stop(self) -> None:
        """Request a stop, also of workers on other computers: no further sample begins."""
        with contextlib.suppress(OSError):  # a full disk stops the workers as well
            self._stop_file.touch()

    def tidy(self) -> None:
        """Remove the leftovers of a killed run: half-written files and the request to stop."""
        self._stop_file.unlink(missing_ok=True)
        for folder in (self.path, self.parts, self.failures):
            for file in folder.glob(".*.tmp"):
                file.unlink(missing_ok=True)

    def part_file(self, first: int, last: int | None = None) -> Path:
        """File name of the part with one sample, or with a run of samples."""
        if last is None or last == first:
            return self.parts / f"sample-{first:08d}.nc"
        return self.parts / f"samples-{first:08d}-{last:08d}.nc"

    def part_files(self) -> dict[Path, range]:
        """File of every part, with its samples."""
        files = {}
        for name in _names(self.parts):
            if match := _PART.fullmatch(name):
                first = int(match[1])
                files[self.parts / name] = range(first, int(match[2] or first) + 1)
        return files

    def part_of(self, sample: int) -> Path | None:
        """File of the part with a sample; None if there is none."""
        if (alone := self.part_file(sample)).is_file():
            return alone
        return next((file for file, samples in self.part_files().items() if sample in samples), None)

    def failure_file(self, sample: int) -> Path:
        """File name of the record of one failed sample."""
        return self.failures / f"sample-{sample:08d}.json"

    def finished(self) -> set[int]:
        """Samples with a part, solved or failed in solving."""
        return {sample for samples in self.part_files().values() for sample in samples}

    def failed_samples(self) -> set[int]:
        """Failed samples, from the names of their records."""
        return {int(match[1]) for name in _names(self.failures) if (match := _FAILURE.fullmatch(name))}

    def failure(self, sample: int) -> dict[str, Any]:
        """Record of one failed sample; the reason is unknown if the record is damaged."""
        try:
            return self.checked_failure(sample)
        except InputError as error:
            return {"sample": sample, "reason": FailureKind.UNKNOWN, "message": str(error)}

    def checked_failure(self, sample: int) -> dict[str, Any]:
        """Record of one failed sample; a damaged or foreign record raises InputError."""
        file = self.failure_file(sample)
        record = read_signed_json(file, self.study_hash)
        words = (record.get("reason"), record.get("message"))
        if record.get("sample") != sample or not all(isinstance(word, str) for word in words):
            raise DamagedError(f"{file}: is damaged: it is no record of sample {sample}.")
        return record

    def record_failure(self, sample: int, reason: str, message: str, inputs: Mapping[str, float]) -> None:
        """Write the record of a failed sample: reason (a ``FailureKind``), full message, sampled inputs."""
        record = {"sample": sample, "reason": reason, "message": message, "inputs": dict(inputs)}
        record |= {"replay": f"damagepred replay {self.path.name} {sample}", "schema_version": SCHEMA_VERSION}
        record |= provenance()
        write_text(self.failure_file(sample), signed_json(record, self.study_hash))

    def forget_failures(self, samples: set[int]) -> None:
        """Remove failed samples, so that they run again; the record of the failure last."""
        if samples:
            self.results_file.unlink(missing_ok=True)
        for sample in samples:
            self.part_file(sample).unlink(missing_ok=True)
            self.failure_file(sample).unlink(missing_ok=True)

    def design(self) -> xr.Dataset:
        """Every input of every sample; a lost or damaged design raises InputError."""
        try:
            design = read_dataset(self.design_file, self.study_hash)
            check_attributes(design.attrs, str(self.design_file), DESIGN_ATTRIBUTES)
            samples = design["sample"].values if "sample" in design.coords else np.array([])
            if samples.size == 0 or not np.array_equal(samples, np.arange(samples.size)):
                raise DamagedError(f"{self.design_file}: is damaged: its samples are not numbered from 0.")
        except DamagedError as error:
            raise DamagedError(f"{error} {self._restores}") from None
        return design

    def set_aside(self, file: Path) -> Path:
        """Move a file into the folder of damaged files; return its new path."""
        folder = self.path / "damaged"
        self._make(folder)
        number = 0
        while os.path.lexists(target := folder / (f"{file.name}.{number}" if number else file.name)):
            number += 1
        file.rename(target)
        return target

    # -- reading it whole -----------------------------------------------------------------------------------------

    def results(self, names: Iterable[str] | None = None) -> xr.Dataset:
        """All samples as one dataset; samples without result have status missing, NaN and -1."""
        self.require()
        ds, left_out = self.read(names)
        for file, why in left_out.items():
            _warn(f"{why} {'Parts are read instead.' if file == self.results_file else 'It is left out.'}")
        return ds

    def read(self, names: Iterable[str] | None = None, derived: bool = True) -> tuple[xr.Dataset, dict[Path, str]]:
        """Dataset of ``results``, and the files that were left out, each with the reason."""
        samples = self.manifest()["samples"]
        wanted = None if names is None else {"status", *names}
        design = self.design()
        if samples > (count := design.sizes["sample"]):
            differ = f"has {count} samples, and the manifest says {samples}"
            raise DamagedError(f"{self.design_file}: {differ}. {self._restores}")
        pieces, done = _Pieces(count), set[int]()
        left_out: dict[Path, str] = {}
        if derived and os.path.lexists(self.results_file):
            try:
                whole = read_dataset(self.results_file, self.study_hash)
                done = pieces.put(columns_of(whole, wanted and {"sample", *wanted}), self.results_file)
            except InputError as error:
                left_out[self.results_file] = str(error)
        for file, numbers in sorted(self.part_files().items()):
            if not done.issuperset(numbers):
                try:
                    pieces.put(read_part(file, wanted, self.study_hash), file, numbers)
                except InputError as error:
                    left_out[file] = str(error)
        for sample in sorted(self.failed_samples()):
            try:
                status = pieces.status
                missing = sample < len(status) and status[sample] in (SampleStatus.MISSING, FLAG_FILL)
                if missing and self.checked_failure(sample):
                    status[sample] = SampleStatus.FAILED
            except InputError as error:
                left_out[self.failure_file(sample)] = str(error)
        ds = pieces.dataset()
        for name, variable in design.data_vars.items():
            if variable.dims == ("sample",):
                ds[str(name)] = variable
        ds.attrs.update(design.attrs)
        ds.attrs["samples_failed"] = int((ds["status"].values == SampleStatus.FAILED).sum())
        return ds, left_out

    def consolidate(self) -> None:
        """Write all samples to one file, for fast reading."""
        write_dataset(self.read()[0], self.results_file, self.study_hash)


def _warn(message: str) -> None:
    warnings.warn(message, ArchiveWarning, stacklevel=3)


def _names(folder: Path) -> list[str]:
    """Names in a folder; none if the folder is missing."""
    try:
        return os.listdir(folder)
    except FileNotFoundError:
        return []
    except NotADirectoryError:
        raise DamagedError(f"{folder}: is no folder; move it away and run the same command again.") from None


class _Pieces:
    """Samples of all parts, put together in arrays."""

    def __init__(self, samples: int) -> None:
        self.samples = samples
        self.status = np.full(samples, SampleStatus.MISSING, dtype=np.int8)
        self.columns = {"status": Column(("sample",), self.status, {})}
        self.environments: list[Environment] = []

    def put(self, columns: Columns, file: Path, numbers: range | None = None) -> set[int]:
        """Add the samples of a part (without numbers: the solved samples of ``results.nc``); return the added ones."""
        if not {"sample", "status"} <= columns.keys():
            raise DamagedError(f"{file}: is damaged: it has no sample or no status.")
        rows = columns["sample"].values
        if numbers is not None and not np.array_equal(rows, numbers):
            raise DamagedError(f"{file}: does not hold the samples that its name says.")
        if rows.max(initial=0) >= self.samples:
            raise DamagedError(f"{file}: holds sample {rows.max()}, and the design has {self.samples}.")
        for name, column in columns.items():
            before = self.columns.get(name, column)
            if "sample" in column.dims and before.values.shape[1:] != column.values.shape[1:]:
                raise DamagedError(f"{file}: {name} is of another shape than in other parts.")
        # a failed sample may have run again since
        keep = np.full(len(rows), True) if numbers is not None else ~np.isin(columns["status"].values, UNSOLVED)
        if "environment" in columns:
            columns = columns | {"environment": self._renumbered(columns["environment"], file)}
        for name, column in columns.items():
            if name not in VARIABLES or name in ("sample", "increment"):
                continue
            if column.dims == (name,):
                self.columns[name] = column if "flag_meanings" in column.attributes else column._replace(attributes={})
            elif "sample" in column.dims:
                if name not in self.columns:
                    is_float, shape = column.values.dtype.kind == "f", (self.samples, *column.values.shape[1:])
                    unknown = np.full(
                        shape, np.nan if is_float else -1, np.float64 if is_float else column.values.dtype
                    )
                    self.columns[name] = column._replace(values=unknown)
                self.columns[name].values[rows[keep]] = column.values[keep]
        return set(rows[keep].tolist())

    def _renumbered(self, column: Column, file: Path) -> Column:
        """Environments of a part's samples as rows of the table of all parts."""
        rows = []
        table = from_table(column.attributes, str(file))
        if column.values.size and not -1 <= column.values.min() <= column.values.max() < len(table):
            raise DamagedError(f"{file}: is damaged: environment has rows that its table lacks.")
        for environment in table:
            if environment not in self.environments:
                self.environments.append(environment)
            rows.append(self.environments.index(environment))
        values = np.array([*rows, -1], dtype=np.int64)[column.values.astype(np.int64)]  # -1: unknown
        return column._replace(values=values, attributes={})

    def dataset(self) -> xr.Dataset:
        self.status[self.status == FLAG_FILL] = SampleStatus.MISSING
        values = {"sample": np.arange(self.samples), **{name: column.values for name, column in self.columns.items()}}
        ds = dataset(values, {}, {name: column.dims for name, column in self.columns.items()})
        for name, column in self.columns.items():
            ds[name].attrs.update(column.attributes)
        if "environment" in self.columns:
            ds["environment"].attrs.update(as_table(self.environments))
        return with_shared_movement(ds)


@checked
def open_study(path: str | Path) -> xr.Dataset:
    """Read a study, finished or still running.

    Parameters
    ----------
    path : str or Path
        Study folder, or a file of a whole study, as ``damagepred judge -o`` writes it.

    Returns
    -------
    xarray.Dataset
        Dimensions ``sample`` and ``increment``: every sampled input with one value per wall, and the results. The flag
        ``status`` is complete, collapsed, failed or missing; unknown values are NaN or -1. Where all samples have the
        same movement, it is the coordinate ``movement`` (increment).

    Examples
    --------
    >>> import damagepred
    >>> ds = damagepred.open_study("house.dp")
    >>> ds.sizes["sample"], int(ds.attrs["seed"])
    (24, 1)
    """
    if os.path.isfile(path):
        ds = read_dataset(path)
        if "sample" not in ds.sizes:
            raise InputError(f"{path}: is no study (it has no dimension sample).")
        return ds
    return StudyFolder(path).results()
