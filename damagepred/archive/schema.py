"""Archive variables: ``variables.csv`` is their only list, used by writers and readers; their valid values."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from damagepred.diagnostics import Counters, Energies, Residuals, described
from damagepred.enumerations import SOLVED, ContactKind, ContactState, SampleStatus, ZoneState, flag_meanings
from damagepred.errors import DamagedError, InputError
from damagepred.inputs.input_files import parse_toml

SCHEMA_VERSION = 9  # increases when names, meanings or files change; ``damagepred.archive.versions`` reads all versions


@dataclass(frozen=True)
class Variable:
    """Variable of an archive."""

    dims: tuple[str, ...]  # in a wall's file; in a study, "sample" comes first
    units: str | None  # UDUNITS; None for flags
    long_name: str  # meaning and sign
    flags: tuple[str, ...] = ()  # meanings of the values 0, 1, ...
    standard_name: str | None = None  # of CF
    mesh: Mapping[str, Any] = field(default_factory=dict)  # attributes of UGRID
    on_disk: str | None = None  # shorter type in files: stresses need no sixteen digits

    def attributes(self) -> dict[str, Any]:
        """CF attributes."""
        attrs: dict[str, Any] = {"long_name": self.long_name}
        if self.units is not None:
            attrs["units"] = self.units
        if self.standard_name:
            attrs["standard_name"] = self.standard_name
        if self.flags:
            values = np.arange(len(self.flags), dtype=np.int8)
            # valid_range instead of _FillValue, for which xarray would convert flags to floats
            attrs |= {"flag_values": values, "flag_meanings": " ".join(self.flags), "valid_range": values[[0, -1]]}
        return attrs | dict(self.mesh)


_STEP = ("increment",)
MESH = "zone_mesh"
"""Variable with the topology of zones and gridpoints (UGRID)."""

GROWING_GROUND = {"ground_states": "ground profile evaluated at the current surface movement"}
"""Attribute of ``surface_movement``; older archives lack it."""
MOVEMENTS = (
    *("surface_movement", "settlement", "differential_settlement"),
    *("angular_distortion", "ground_tilt", "horizontal_strain"),
)
"""Measures of the ground's movement, coordinates of a path."""
CATEGORIES = ("negligible", "very_slight", "slight", "moderate", "severe", "very_severe")
CATEGORY_VARIABLES = ("damage_category", "damage_category_band")
"""Category by the chosen measure, and by the width of the widest crack band."""
WORST_CATEGORY = "damage_category_worst"  # largest category to date in a history

_FLAGS = {
    **dict.fromkeys((*CATEGORY_VARIABLES, WORST_CATEGORY), CATEGORIES),
    "deviation_level": ("not_noticeable", "undesirable", "clearly_visible"),
    "opening_sticking": ("free", "sticks_slightly", "sticks"),
    "contact_kind": flag_meanings(ContactKind),
    "contact_state": flag_meanings(ContactState),
    "zone_state": flag_meanings(ZoneState),
    "status": flag_meanings(SampleStatus),
    "implausible": ("no", "yes"),
}
"""Meanings of the values 0, 1, ... of flags."""
_LOCATIONS = {
    "face": ("zone_block", "zone_state", "zone_stress_xx", "zone_stress_yy", "zone_stress_xy", "zone_stress_zz"),
    "node": ("gridpoint_block", "gridpoint_displacement_x", "gridpoint_displacement_y"),
}
_UGRID: dict[str, dict[str, Any]] = {
    MESH: {
        "cf_role": "mesh_topology",
        "topology_dimension": np.int32(2),
        "face_dimension": "zone",
        "node_coordinates": "gridpoint_x gridpoint_y",
        "face_node_connectivity": "zone_gridpoint",
    },
    "zone_gridpoint": {"cf_role": "face_node_connectivity", "start_index": np.int32(0)},
    **{name: {"mesh": MESH, "location": place} for place, names in _LOCATIONS.items() for name in names},
}
"""Attributes of the mesh of zones (UGRID)."""


def read_variables(table: Path, flags: Mapping[str, tuple[str, ...]]) -> dict[str, Variable]:
    """Variables of a table (CSV) of names, dimensions, units and meanings, with the meanings of flags."""
    with table.open(encoding="utf-8", newline="") as rows:
        return {
            name: Variable(tuple(dims.split()), units or None, meaning, flags.get(name, ()))
            for name, dims, units, meaning in list(filter(None, csv.reader(rows)))[1:]
        }


VARIABLES = read_variables(Path(__file__).with_name("variables.csv"), _FLAGS)
VARIABLES["sample"] = replace(VARIABLES["sample"], standard_name="realization")
for _name, _mesh in _UGRID.items():
    _on_disk = "float32" if _name.startswith("zone_stress") else None
    VARIABLES[_name] = replace(VARIABLES[_name], mesh=_mesh, on_disk=_on_disk)
for _record in (Residuals, Counters, Energies):
    VARIABLES |= {name: Variable(_STEP, kind.units, kind.meaning) for name, kind in described(_record).items()}

BY_WALL = (
    *CATEGORY_VARIABLES,
    *("crack_width_max", "crack_width_worst", WORST_CATEGORY, "crack_band_width_max", "crack_count"),
    *("crack_length_total", "psi"),
    *("base_crack_width_max", "dpc_opening_max", "dpc_separation_length", "dpc_slip_max", "footing_opening_max"),
    *("footing_separation_length", "tilt_max", "slope_max", "base_slope_max", "central_deflection"),
    *("deflection_ratio", "base_reaction", "control_joint_opening_max", "control_joint_closing_max", "deviation_level"),
    "crack_group_width",
)
"""Results that a house has for each wall, as ``wall_<name>``; ``<name>`` is the largest of all walls."""
OF_HOUSE = {name: kind for name, kind in VARIABLES.items() if "wall" in name or name.startswith("corner")}
"""Variables of houses alone."""
for _name in BY_WALL:
    _path = VARIABLES[_name]
    OF_HOUSE[f"wall_{_name}"] = replace(_path, dims=(*_path.dims, "wall"), long_name=f"{_path.long_name}, of each wall")
VARIABLES |= OF_HOUSE

END_VARIABLES = (
    *CATEGORY_VARIABLES,
    *("crack_width_max", "crack_band_width_max", "dpc_opening_max", "footing_opening_max", "tilt_max", "slope_max"),
    *("central_deflection", "deflection_ratio", "surface_movement", "settlement", "crack_group_width"),
)
"""Results at the end of a sample's own movement, in a study that stores both path and end."""

for _name in (*END_VARIABLES, *(f"wall_{name}" for name in END_VARIABLES if name in BY_WALL)):
    _path = VARIABLES[_name]
    VARIABLES[f"end_{_name}"] = replace(
        _path, dims=("sample", *_path.dims[1:]), long_name=f"{_path.long_name}, at the end of the sample's movement"
    )


def name_categories(ds: xr.Dataset, names: tuple[str, ...], comment: str) -> None:
    """Set the category names of the damage table that made the categories of a dataset."""
    for prefix in ("", "end_", "wall_"):
        for name in (f"{prefix}{variable}" for variable in (*CATEGORY_VARIABLES, WORST_CATEGORY)):
            if name in ds:
                ds[name].attrs = category_attributes(names, comment, name)


def category_attributes(names: tuple[str, ...], comment: str, variable: str = "damage_category") -> dict[str, Any]:
    """Attributes of damage categories with the names of their damage table."""
    flags = tuple(name.replace(" ", "_") for name in names)
    registered = VARIABLES[variable]
    return Variable(registered.dims, None, registered.long_name, flags).attributes() | {"comment": comment}


def wall_attributes(names: Sequence[str]) -> dict[str, Any]:
    """Attributes of the walls of a house with these names."""
    return replace(VARIABLES["wall"], units=None, flags=tuple(names)).attributes()


def with_shared_movement(ds: xr.Dataset) -> xr.Dataset:
    """Study with the coordinate ``increment``, and ``movement`` where all samples have the same."""
    if not {"sample", "increment"} <= ds.sizes.keys():
        return ds
    number = np.arange(ds.sizes["increment"])
    ds = ds.assign_coords(increment=("increment", number, VARIABLES["increment"].attributes()))
    for name in ("surface_movement", "settlement", "central_deflection"):
        if name in ds.variables and ds[name].dims == ("sample", "increment"):
            least, most = ds[name].min("sample").values, ds[name].max("sample").values
            if np.array_equal(least, most):  # False with NaN
                attributes = VARIABLES["movement"].attributes() | {"comment": f"is {name}"}
                return ds.assign_coords(movement=("increment", least, attributes))
    return ds


def flag_name(ds: xr.Dataset, value: int, variable: str = "damage_category") -> str:
    """Meaning of a value of a flag variable in plain words, ``"not known"`` if it has none."""
    registered = VARIABLES[variable].flags if variable in VARIABLES else ()
    given = ds[variable].attrs.get("flag_meanings") if variable in ds.variables else None
    names = str(given).split() if given else registered
    return names[value].replace("_", " ") if 0 <= value < len(names) else "not known"


def category_label(ds: xr.Dataset, category: int, variable: str = "damage_category") -> str:
    """Number and name of a damage category, such as ``"2 slight"``."""
    return f"{category} {flag_name(ds, category, variable)}" if category >= 0 else "not known"


FLAG_FILL = np.int8(-1)  # value of an unknown flag


def require(ds: xr.Dataset, names: Iterable[str], result: str) -> None:
    """Check that a dataset has some variables or dimensions; ``result``: the result that has them."""
    if missing := [name for name in names if name not in ds.variables and name not in ds.dims]:
        raise InputError(f"the dataset has no variable '{missing[0]}'; give {result}.")


def is_dynamic(ds: xr.Dataset) -> bool:
    """Whether an archive is from a run in physical time; a history has a time too, but also stages."""
    return "time" in ds.variables and "stage" not in ds.variables


def dataset(
    values: Mapping[str, Any],
    attributes: Mapping[str, Any],
    dims: Mapping[str, tuple[str, ...]] | None = None,
    extra: Mapping[str, Variable] | None = None,
) -> xr.Dataset:
    """CF dataset of values under their registered names."""
    registered = {**VARIABLES, **(extra or {})}
    variables = {
        name: xr.Variable(
            (dims or {}).get(name, registered[name].dims), np.asarray(value), registered[name].attributes()
        )
        for name, value in values.items()
    }
    coordinates = {name for name, v in variables.items() if v.dims == (name,)} | (
        {*MOVEMENTS, "central_deflection", "deflection_ratio", "strain", "movement", "time"} & set(variables)
    )
    ds = xr.Dataset(
        {k: v for k, v in variables.items() if k not in coordinates},
        coords={k: v for k, v in variables.items() if k in coordinates},
    )
    conventions = "CF-1.11 UGRID-1.0" if MESH in ds else "CF-1.11"
    ds.attrs = {"Conventions": conventions, "schema_version": SCHEMA_VERSION} | {
        key: (int(value) if isinstance(value, bool | np.bool_) else value)
        for key, value in attributes.items()
        if value is not None
    }
    return ds


# -- valid values and attributes, whatever the file ------------------------------------------------------------------


NOT_NEGATIVE = (
    *("crack_width_max", "crack_band_width_max", "end_crack_width_max", "end_crack_band_width_max"),
    *("run_time", "weight", "central_deflection", "deflection_ratio"),
)
"""Variables that are zero or more."""

TEXTS = (
    *("title", "scene", "scene_given", "study", "damage_table", "damage_measure"),
    *("status", "status_message", "solver_method"),
)
_COUNTS = ("seed", "samples_failed", "sample", "hairline", "thickness")
NUMBERS = {
    **dict.fromkeys((*_COUNTS, "apex_limited_joints", "snap_back_limited_joints"), (0, np.inf)),
    **dict.fromkeys(("crossed", "count_footing_gap"), (0, 1)),
    "replicates": (1, np.inf),
    "highest_category": (0, len(CATEGORIES) - 1),
    "span": (1e-9, 1e9),
}
"""Global attributes that are text, and numbers between two bounds."""


class Column(NamedTuple):
    """Variable of a file: dimensions, values in SI (unknown flags are -1), CF attributes."""

    dims: tuple[str, ...]
    values: NDArray[Any]
    attributes: Mapping[str, Any]


Columns = dict[str, Column]


def columns_of(ds: xr.Dataset, names: set[str] | None = None) -> Columns:
    """Variables of a dataset as columns; with names only these."""
    return {
        str(name): Column(tuple(map(str, v.dims)), v.values, v.attrs)
        for name, v in ds.variables.items()
        if names is None or name in names
    }


def check_values(columns: Columns, source: str, ranges: bool = False) -> None:
    """Check dimensions, types, flags and ranges of registered variables, and that solved samples have values."""
    for name, column in columns.items():
        if name in VARIABLES and (wrong := _wrong(name, *column)):
            raise DamagedError(f"{source}: is damaged: {name} {wrong}.")
        if ranges and name in NOT_NEGATIVE and float(np.nanmin(column.values, initial=0.0)) < 0.0:
            raise DamagedError(f"{source}: {name} is negative.")
    if wrong := _unknown_widths(columns):
        raise DamagedError(f"{source}: is damaged: {wrong}.")


def _wrong(name: str, dims: tuple[str, ...], values: NDArray[Any], attributes: Mapping[str, Any]) -> str:
    registered = VARIABLES[name]
    own, wanted = ([d for d in given if d not in ("sample", "increment")] for given in (dims, registered.dims))
    if own != wanted or "sample" in dims[1:]:
        return f"has the dimensions ({', '.join(map(str, dims))})"
    if values.dtype.kind not in ("i" if registered.flags else "iuf"):
        return f"is of type {values.dtype}"
    if any(not isinstance(attributes.get(key, ""), str) for key in ("units", "long_name", "flag_meanings")):
        return "has damaged attributes"
    if values.size == 0:
        return ""
    if registered.flags:
        wrong = values[(values < FLAG_FILL) | (values >= len(registered.flags))]
        return f"has the value {int(wrong.max())}" if wrong.size else ""
    if name in ("sample", "increment"):
        return "" if values.ndim == 1 and values[0] >= 0 and (np.diff(values) > 0).all() else "does not count up"
    return ""


def _unknown_widths(columns: Columns) -> str:
    """Sentence if a solved sample lacks values of increments of its path, or ""."""
    if not {"status", "crack_width_max", "base_reaction"} <= columns.keys():
        return ""
    solved = np.isin(columns["status"].values, SOLVED)
    width, force = (np.isfinite(columns[name].values) for name in ("crack_width_max", "base_reaction"))
    if width.shape != force.shape or width.shape[:1] != solved.shape:
        return "crack_width_max, base_reaction and status differ in shape"
    if width.ndim == 1:  # only the end of the movement, which a path may not have reached
        return "" if np.array_equal(width[solved], force[solved]) else "a solved sample has no crack width"
    followed = np.logical_and.accumulate(force, axis=1)
    good = (width == followed) & (force == followed) & followed[:, :1]
    return "" if good[solved].all() else "a solved sample has increments without crack width"


def check_attributes(attributes: Mapping[Any, Any], source: str, needed: tuple[str, ...] = ()) -> None:
    """Check the global attributes that readers need; a damaged one raises DamagedError."""
    if missing := [name for name in needed if name not in attributes]:
        raise DamagedError(f"{source}: is damaged: it has no attribute {missing[0]}.")
    for name in TEXTS:
        if not isinstance(attributes.get(name, ""), str):
            raise DamagedError(f"{source}: is damaged: its attribute {name} is no text.")
    for name, (low, high) in NUMBERS.items():
        value = attributes.get(name, low)
        if not isinstance(value, int | float | np.number) or not low <= value <= high:
            raise DamagedError(f"{source}: is damaged: its attribute {name} is {str(value)[:40]!r}.")
    if "scene" in attributes:
        try:
            parse_toml(attributes["scene"], f"{source}: its attribute scene")
        except InputError as error:
            raise DamagedError(f"{source}: is damaged: its attribute scene is no TOML.") from error
