"""Migration of older archives to the present schema.

Version 1: one netCDF-4 file per sample in ``parts/``. Version 2: parts in netCDF's classic format, one or more samples.
Version 3: ``crack_group_width``, slopes, distortion of openings; ``damagepred.judge_again`` reports missing inputs.
Version 4: each file of a study ends with a digest of its content and the hash of the study.
Version 5: ``newton_iterations`` of the quasi-static solver and ``cycles`` of the others; both were ``cycles`` before.
Version 6: no dimension of length 0; flags have a ``valid_range`` and no ``_FillValue``; studies have the coordinates
``increment`` and ``movement``. Version 7: ``crack_width_worst``, which was ``worst_crack_width`` before.
Version 8: keys count from 1 instead of 0. A scene specifies the ground below its soil log, which did not move before.
Version 9: bricks are elastic by default; they were rigid before.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import xarray as xr

from damagepred.archive.provenance import GIVEN
from damagepred.archive.schema import SCHEMA_VERSION, VARIABLES, with_shared_movement
from damagepred.errors import InputError, NewerError

_NUMBER = re.compile(r"\.(\d+)(?=\.|$)")

Migration = Callable[[xr.Dataset], xr.Dataset]


def _split_cycles(ds: xr.Dataset) -> xr.Dataset:
    """``cycles`` of the quasi-static solver as ``newton_iterations``; -1 (unknown) in both."""
    if "cycles" not in ds:
        return ds
    if "solver_method" in ds.attrs:
        quasi_static = xr.DataArray(ds.attrs["solver_method"] == "quasi_static")
    elif "joint_law_violation" in ds:  # a study of the quasi-static solver
        quasi_static = ds["joint_law_violation"].notnull().any("increment")
    else:
        quasi_static = xr.DataArray("events" in ds)
    spent = ds["cycles"]
    unknown_or_0 = np.minimum(spent, 0)
    split = {}
    for name, parts in (("newton_iterations", (spent, unknown_or_0)), ("cycles", (unknown_or_0, spent))):
        values = xr.where(quasi_static, *parts).transpose(*spent.dims).values
        split[name] = (spent.dims, values, {**spent.attrs, **VARIABLES[name].attributes()})
    return ds.assign(split)


def _without_empty_dimensions(ds: xr.Dataset) -> xr.Dataset:
    """Dataset without dimensions of length 0, its flags with their range, a study with its movement."""
    ds = ds.drop_dims([dim for dim, size in ds.sizes.items() if size == 0])
    for variable in ds.variables.values():
        if "flag_values" in variable.attrs:
            variable.attrs["valid_range"] = np.asarray(variable.attrs["flag_values"])[[0, -1]]
    return with_shared_movement(ds)


def from_1(key: str) -> str:
    """Key that counts from 1, from a key that counts from 0."""
    return _NUMBER.sub(lambda match: f".{int(match[1]) + 1}", key)


def from_0(key: str) -> str:
    """Key that counts from 0, from a key that counts from 1."""
    return _NUMBER.sub(lambda match: f".{int(match[1]) - 1}", key)


def with_defaults_of(version: int, scene: Mapping[str, Any]) -> dict[str, Any]:
    """Tables of a scene of an older version: its soil was inert below its log, its bricks were rigid by default."""
    older = dict(scene)
    if version < COUNTS_FROM_1 and "soil_layer" in scene:
        older["suction"] = {"below_log": "inert", **scene.get("suction", {})}
    if version < ELASTIC_BRICKS:
        older["solver"] = {"accuracy": "standard", **scene.get("solver", {})}
    return older


def _with_older_defaults(version: int, ds: xr.Dataset) -> xr.Dataset:
    """Dataset whose scene states the defaults of its version that have changed."""
    scene = tomllib.loads(str(ds.attrs.get("scene", "")))
    if not scene or (older := with_defaults_of(version, scene)) == scene:
        return ds
    import tomli_w

    return ds.assign_attrs(scene=tomli_w.dumps(older))


def _counted_from_1(ds: xr.Dataset) -> xr.Dataset:
    """Dataset whose keys count from 1."""
    ds = ds.rename({name: from_1(str(name)) for name in ds.variables if "." in str(name)})
    if "variable" in ds.coords and ds["variable"].dtype.kind in "OUT":
        ds = ds.assign_coords(variable=[from_1(str(key)) for key in ds["variable"].values])
    attrs = {GIVEN: " ".join(map(from_1, str(ds.attrs[GIVEN]).split()))} if GIVEN in ds.attrs else {}
    return ds.assign_attrs(attrs)


COUNTS_FROM_1 = 8  # first version whose keys count from 1
ELASTIC_BRICKS = 9  # first version with elastic bricks by default

MIGRATIONS: dict[int, Migration] = {
    **dict.fromkeys((1, 2, 3), lambda ds: ds),
    4: _split_cycles,
    5: _without_empty_dimensions,
    6: lambda ds: ds.rename(worst_crack_width="crack_width_worst") if "worst_crack_width" in ds else ds,
    7: lambda ds: _with_older_defaults(7, _counted_from_1(ds)),
    8: lambda ds: _with_older_defaults(8, ds),
}
"""Migration from each version to the next."""


def brought_up_to_date(version: int, source: str, ds: xr.Dataset | None = None) -> xr.Dataset:
    """Dataset of any known version in the present schema."""
    if version < 1:
        raise InputError(f"{source}: has schema version {version}; it is not one of damagepred.")
    if version > SCHEMA_VERSION:
        known = f"this damagepred reads up to {SCHEMA_VERSION}"
        raise NewerError(f"{source}: has schema version {version}, {known}; update it.")
    ds = xr.Dataset() if ds is None else ds
    for number in range(version, SCHEMA_VERSION):
        ds = MIGRATIONS[number](ds)
    return ds.assign_attrs(schema_version=SCHEMA_VERSION)
