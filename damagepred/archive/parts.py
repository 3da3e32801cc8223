"""Parts of a study: results of one or more walls in a small file.

A part is netCDF in its classic format, which takes a millisecond to write (netCDF-4 fifty), and which every netCDF
program reads.
"""

from __future__ import annotations

import io
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from damagepred.archive.digest import NO_STUDY, check_study, signed, verified
from damagepred.archive.files import READER_ERRORS, read_dataset, write_whole
from damagepred.archive.schema import SCHEMA_VERSION, VARIABLES, Column, Columns, check_values, columns_of
from damagepred.archive.versions import brought_up_to_date
from damagepred.errors import DamagedError, InputError
from damagepred.inputs.input_files import LARGEST_TABLE, read_bytes

CLASSIC = b"CDF"  # first bytes of a file in the classic format


def study_dims(name: str) -> tuple[str, ...]:
    """Dimensions of a registered variable in a study."""
    dims = VARIABLES[name].dims
    return dims if "sample" in dims or dims == (name,) else ("sample", *dims)


def joined(rows: list[Columns]) -> Columns:
    """Rows of several samples with the same variables, as one part."""
    part = dict(rows[0])
    for name, column in part.items():
        if "sample" in column.dims:
            part[name] = column._replace(values=np.concatenate([row[name].values for row in rows]))
    return part


def alike(first: Columns, second: Columns) -> bool:
    """Whether two rows have the same variables, of the same shape within a sample."""
    return first.keys() == second.keys() and all(
        column.values.shape[1:] == second[name].values.shape[1:] for name, column in first.items()
    )


def write_part(path: Path, columns: Columns, study: str = NO_STUDY) -> None:
    """Write a part with its digest."""
    content = signed(_classic(columns), study)
    write_whole(path, lambda p: p.write_bytes(content))


def _classic(columns: Columns) -> bytes:
    from scipy.io import netcdf_file

    stream = io.BytesIO()
    file = netcdf_file(stream, "w", version=2)
    sizes: dict[str, int] = {}
    for name, column in columns.items():
        if column.values.size == 0:  # the classic format has no dimension of length 0
            continue
        for dim, size in zip(column.dims, column.values.shape):
            if dim not in sizes:
                sizes[dim] = size
                file.createDimension(dim, size)
        values = _storable(column.values)
        variable = file.createVariable(name, values.dtype, column.dims)
        variable[...] = values
        for key, value in column.attributes.items():
            setattr(variable, key, value.encode() if isinstance(value, str) else value)
    file.Conventions = "CF-1.11"
    file.schema_version = np.int32(SCHEMA_VERSION)
    file.flush()
    content = stream.getvalue()
    file.close()
    return content


def _storable(values: NDArray[Any]) -> NDArray[Any]:
    """Values in a type of the classic format; integers beyond its range become floats."""
    if values.dtype != np.int64:
        return values
    large = np.abs(values).max(initial=0) > np.iinfo(np.int32).max
    return values.astype(np.float64 if large else np.int32)


def read_part(path: Path, names: Iterable[str] | None = None, study: str | None = None) -> Columns:
    """Columns of a part of this or an older version; damaged, newer and foreign files raise InputError."""
    wanted = None if names is None else {"sample", *names}
    content, file_study = verified(read_bytes(path, LARGEST_TABLE), path)
    if content[:3] != CLASSIC:  # the first version wrote netCDF-4
        return columns_of(read_dataset(path, study), wanted)
    try:
        version, columns = _from_classic(content, str(path), wanted)
    except InputError:
        raise
    except READER_ERRORS as error:
        raise DamagedError(f"{path}: is damaged ({type(error).__name__}: {error}).") from None
    if study is not None:
        check_study(file_study, study, version, path)
    check_values(columns, str(path))
    return columns


def _from_classic(content: bytes, source: str, wanted: set[str] | None) -> tuple[int, Columns]:
    from scipy.io import netcdf_file

    columns: Columns = {}
    with netcdf_file(io.BytesIO(content), "r", mmap=False) as file:
        version = int(file.schema_version)
        brought_up_to_date(version, source)
        selected, wanted = wanted, wanted if version == SCHEMA_VERSION else None  # names may differ in older versions
        for name, variable in file.variables.items():
            if wanted is not None and name not in wanted:
                continue
            values = np.array(variable[...])
            values = values.astype(values.dtype.newbyteorder("="))
            attributes = {k: _plain(v) for k, v in variable._attributes.items() if k != "_FillValue"}
            columns[name] = Column(tuple(variable.dimensions), values, attributes)
    if version < SCHEMA_VERSION:
        ds = xr.Dataset({name: tuple(column) for name, column in columns.items()})
        columns = columns_of(brought_up_to_date(version, source, ds), selected)
    return version, columns


def _plain(value: Any) -> Any:
    if isinstance(value, bytes):
        return value.decode("utf-8")
    if isinstance(value, np.ndarray):
        return value.astype(value.dtype.newbyteorder("="))
    return value
