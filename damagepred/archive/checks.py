"""Valid values and attributes of archives, whatever the file."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from damagepred.archive.schema import CATEGORIES, FLAG_FILL, VARIABLES
from damagepred.enumerations import SOLVED
from damagepred.errors import DamagedError, InputError
from damagepred.inputs.input_files import parse_toml

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

Columns = Mapping[str, tuple[tuple[Any, ...], NDArray[Any], Mapping[Any, Any]]]
"""Dimensions, values and attributes by name."""


def check_values(columns: Columns, source: str, ranges: bool = False) -> None:
    """Check dimensions, types, flags and ranges of registered variables, and that solved samples have values."""
    for name, (dims, values, attributes) in columns.items():
        if name in VARIABLES and (wrong := _wrong(name, dims, values, attributes)):
            raise DamagedError(f"{source}: is damaged: {name} {wrong}.")
        if ranges and name in NOT_NEGATIVE and float(np.nanmin(values, initial=0.0)) < 0.0:
            raise DamagedError(f"{source}: {name} is negative.")
    if wrong := _unknown_widths(columns):
        raise DamagedError(f"{source}: is damaged: {wrong}.")


def _wrong(name: str, dims: tuple[Any, ...], values: NDArray[Any], attributes: Mapping[Any, Any]) -> str:
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
    solved = np.isin(columns["status"][1], SOLVED)
    width, force = (np.isfinite(columns[name][1]) for name in ("crack_width_max", "base_reaction"))
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
