"""Older archives in today's form: the one place that knows how archives have changed.

Version 1: one netCDF-4 file a sample in ``parts/``.
Version 2: parts are in netCDF's classic format, and one may hold a run of samples. Variables are those of version 1.
Version 3: what other damage tables ask for is kept besides: ``crack_group_width``, slopes, distortion of openings.
Older archives simply lack it; ``damagepred.judge_again`` says what it then does without.
Version 4: each file of a study ends with a digest of its content and the hash of the study.
"""

from __future__ import annotations

from collections.abc import Callable

import xarray as xr

from damagepred.archive.schema import SCHEMA_VERSION
from damagepred.errors import InputError, NewerError

Migration = Callable[[xr.Dataset], xr.Dataset]


def _unchanged(ds: xr.Dataset) -> xr.Dataset:
    return ds


MIGRATIONS: dict[int, Migration] = {1: _unchanged, 2: _unchanged, 3: _unchanged}
"""What makes a dataset of one version one of the next."""


def brought_up_to_date(version: int, source: str, ds: xr.Dataset | None = None) -> xr.Dataset:
    """Return a dataset of any known version as one of today's.

    Parameters
    ----------
    version : int
        Its version.
    source : str
        Where it comes from, for the message.
    ds : xarray.Dataset, optional
        The dataset; without one the version alone is checked.

    Raises
    ------
    NewerError
        If it is newer than this package.
    InputError
        If it is no version.
    """
    if version < 1:
        raise InputError(f"{source}: has schema version {version}; it is not one of damagepred.")
    if version > SCHEMA_VERSION:
        raise NewerError(
            f"{source}: has schema version {version}, this damagepred reads up to {SCHEMA_VERSION}; update it."
        )
    ds = xr.Dataset() if ds is None else ds
    for number in range(version, SCHEMA_VERSION):
        ds = MIGRATIONS[number](ds)
    return ds.assign_attrs(schema_version=SCHEMA_VERSION)
