"""Files that are written completely or not at all."""

from __future__ import annotations

import contextlib
import errno
import os
import tempfile
import threading
import warnings
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from damagepred.archive.digest import NO_STUDY, SINCE, check_study, sign, signature
from damagepred.archive.schema import VARIABLES, check_attributes, check_values, columns_of
from damagepred.archive.versions import brought_up_to_date
from damagepred.errors import ArchiveWarning, DamagedError, InputError, StudyError

_ONE_AT_A_TIME = threading.RLock()  # the HDF5 library crashes when two threads use it, and a study may run in threads
PICTURES = (".png", ".pdf", ".svg")  # suffixes of pictures

FILE_SUFFIXES = (*PICTURES, ".nc", ".csv", ".xml", ".json", ".html", ".toml")
"""Suffixes of files; folders of results have other names."""

READER_ERRORS = (OSError, RuntimeError, ValueError, TypeError, LookupError, AttributeError, ArithmeticError)
"""Exceptions of netCDF readers for damaged files."""


def write_whole(path: Path, write: Callable[[Path], object]) -> None:
    """Write a file under a temporary name, flush it to the disk, then rename it."""
    temporary: Path | None = None
    try:
        handle, name = tempfile.mkstemp(prefix=f".{path.name[:50]}.", suffix=".tmp", dir=path.parent)
        os.close(handle)
        temporary = Path(name)
        write(temporary)
        with temporary.open("rb+") as stream:
            os.fsync(stream.fileno())
        temporary.chmod(0o644)
        temporary.replace(path)
        with contextlib.suppress(OSError):  # some systems cannot open a folder; the rename must do
            folder = os.open(path.parent, os.O_RDONLY)
            try:
                os.fsync(folder)
            finally:
                os.close(folder)
    except OSError as error:
        raise StudyError(f"{path}: could not be written: {_reason(error)}") from error
    except RuntimeError as error:  # the netCDF library's word for a full disk
        raise StudyError(f"{path}: could not be written: {error}. Is the disk full?") from error
    finally:
        if temporary is not None:
            with contextlib.suppress(OSError):
                temporary.unlink(missing_ok=True)


def write_text(path: Path, text: str) -> None:
    """Write a text in UTF-8 as a whole file."""
    write_whole(path, lambda temporary: temporary.write_text(text, encoding="utf-8"))


def check_output(path: str | Path, *suffixes: str, inputs: Iterable[Path] = (), new_folder: bool = False) -> None:
    """Refuse a file that cannot be written or has a wrong suffix; without suffixes a folder. Writes nothing."""
    target = Path(path)
    existing = (parent for parent in (target, *target.absolute().parents) if os.path.lexists(parent))
    try:
        if suffixes:
            if target.is_dir():
                raise InputError(
                    f"{target}: is a folder; give the name of a file, such as {target / 'result'}{suffixes[0]}."
                )
            if target.suffix.lower() not in suffixes:
                name = f"{target.stem or 'result'}{suffixes[0]}"
                raise InputError(
                    f"{target}: the name must end in {' or '.join(suffixes)}; write {target.parent / name}."
                )
            if any(target.exists() and file.exists() and target.samefile(file) for file in inputs):
                raise InputError(f"{target}: is the input of this command; give another name.")
            folder = next(parent for parent in existing if parent != target) if new_folder else target.parent
        elif target.exists() and not target.is_dir():
            raise StudyError(f"{target}: is a file, and a folder is needed; give another place with -o.")
        elif target.suffix.lower() in FILE_SUFFIXES and not target.exists():
            raise InputError(f"{target}: a folder is needed; give a name without the suffix of a file.")
        else:
            folder = next(existing)
        status = os.statvfs(folder)
        if not folder.is_dir():
            raise OSError(errno.ENOTDIR, "")
        if status.f_flag & os.ST_RDONLY:
            raise OSError(errno.EROFS, "")
        if not os.access(folder, os.W_OK | os.X_OK):
            raise OSError(errno.EACCES, "")
        if status.f_blocks and not status.f_bavail:
            raise OSError(errno.ENOSPC, "")
    except OSError as error:
        raise StudyError(f"{path}: cannot be written: {_reason(error)}") from error


def _reason(error: OSError) -> str:
    hints = {
        errno.ENOSPC: "the disk is full; free some space and run the same command again",
        errno.EDQUOT: "your disk quota is used up; free some space and run the same command again",
        errno.EFBIG: "it exceeds the file size limit; raise the limit and run the same command again",
        **dict.fromkeys((errno.EACCES, errno.EPERM), "no permission to write there; choose another place"),
        errno.EROFS: "the file system is read-only; choose another place",
        errno.ENOENT: "its folder does not exist; create it or choose another place",
        errno.ENOTDIR: "part of its path is a file, not a folder; choose another place",
    }
    return hints.get(error.errno or 0, error.strerror or str(error))


def write_dataset(ds: xr.Dataset, path: str | Path, study: str = NO_STUDY) -> None:
    """Write a dataset as compressed netCDF-4 with its digest; zone stresses with seven digits."""
    encoding: dict[str, dict[str, Any]] = {}
    for name, variable in ds.variables.items():
        settings: dict[str, Any] = {}
        if variable.size > 1000:
            settings |= {"zlib": True, "complevel": 2, "shuffle": True, "fletcher32": True}
        if variable.dtype.kind == "f":
            settings["_FillValue"] = np.nan if name not in ds.coords else None
        elif variable.dtype == np.int64 and np.abs(variable.values).max(initial=0) <= np.iinfo(np.int32).max:
            settings["dtype"] = "int32"
        if name in VARIABLES and VARIABLES[str(name)].on_disk:
            settings["dtype"] = VARIABLES[str(name)].on_disk
        encoding[str(name)] = settings

    def write(temporary: Path) -> None:
        with _ONE_AT_A_TIME:
            ds.to_netcdf(temporary, engine="netcdf4", format="NETCDF4", encoding=encoding)
        sign(temporary, study)

    write_whole(Path(path), write)


def read_dataset(path: str | Path, study: str | None = None) -> xr.Dataset:
    """Dataset of a netCDF file of this package, in memory."""
    file = Path(path)
    if os.path.isdir(file):  # False for names that no file can have
        raise InputError(
            f"{file}: is a folder, and the file (*.nc) of one wall is needed; `damagepred replay` writes it from a "
            "study."
        )
    file_study = signature(file)
    if file.suffix == ".toml":
        raise InputError(
            f"{file}: is a description, and a result is needed: a study folder (*.dp), which `damagepred study` makes, "
            "or a file (*.nc) of `damagepred solve`."
        )
    try:
        with _ONE_AT_A_TIME, xr.open_dataset(file, engine="netcdf4", mask_and_scale=False) as opened:
            ds = opened.load()
    except READER_ERRORS as error:
        raise DamagedError(f"{file}: is not a readable netCDF file: it is of another kind, or damaged.") from error
    version = ds.attrs.get("schema_version")
    if not isinstance(version, int | np.integer) or version < 1:
        raise InputError(f"{file}: is a netCDF file, but not one of damagepred (it has no schema_version).")
    if study is not None:
        check_study(file_study, study, int(version), file)
    elif file_study is None and version >= SINCE:
        message = f"{file}: was written or changed by another program: it has no digest"
        warnings.warn(message, ArchiveWarning, stacklevel=2)
    if file_study is None:
        check_attributes(ds.attrs, str(file))
    check_values(columns_of(ds), str(file))
    ds = brought_up_to_date(int(version), str(file), ds)
    ds = ds.assign({name: ds[name].astype(np.float64) for name in ds.data_vars if ds[name].dtype == np.float32})
    for variable in ds.variables.values():
        variable.attrs.pop("_FillValue", None)
    return ds
