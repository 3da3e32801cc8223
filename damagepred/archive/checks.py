"""What values and attributes an archive may hold: the one place that judges them, whatever file they come from."""

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
    "crack_width_max",
    "crack_band_width_max",
    "end_crack_width_max",
    "end_crack_band_width_max",
    "run_time",
    "weight",
    "central_deflection",
    "deflection_ratio",
)
"""Variables that are zero or more where they are known."""

TEXTS = (
    "title",
    "scene",
    "scene_given",
    "study",
    "damage_table",
    "damage_measure",
    "status",
    "status_message",
    "solver_method",
)
NUMBERS = {
    "seed": (0, np.inf),
    "replicates": (1, np.inf),
    "highest_category": (0, len(CATEGORIES) - 1),
    "span": (1e-9, 1e9),
    "crossed": (0, 1),
    "count_footing_gap": (0, 1),
    "samples_failed": (0, np.inf),
    "sample": (0, np.inf),
    "hairline": (0, np.inf),
    "thickness": (0, np.inf),
    "apex_limited_joints": (0, np.inf),
    "snap_back_limited_joints": (0, np.inf),
}
"""Global attributes that readers take as text, and as a number between two bounds."""


Columns = Mapping[str, tuple[tuple[Any, ...], NDArray[Any], Mapping[Any, Any]]]
"""Dimensions, values and attributes by name."""


def check_values(columns: Columns, source: str, ranges: bool = False) -> None:
    """Check dimensions, types, flags and ranges of registered variables, and that solved samples have values.

    Parameters
    ----------
    columns : mapping
        Of a wall, a part or a whole study; variables that are not registered are passed over.
    source : str
        Where they come from, for the message.
    ranges : bool
        Whether to ask also that what cannot be negative is not.

    Raises
    ------
    DamagedError
        If one is not as it can have been written.
    """
    for name, (dims, values, attributes) in columns.items():
        if name in VARIABLES and (wrong := _wrong(name, dims, values, attributes)):
            raise DamagedError(f"{source}: is damaged: {name} {wrong}.")
        if ranges and name in NOT_NEGATIVE and float(np.nanmin(values, initial=0.0)) < 0.0:
            raise DamagedError(f"{source}: {name} is negative.")
    if wrong := _unknown_widths(columns):
        raise DamagedError(f"{source}: is damaged: {wrong}.")


def _wrong(name: str, dims: tuple[Any, ...], values: NDArray[Any], attributes: Mapping[Any, Any]) -> str:
    known = VARIABLES[name]
    leading = ("sample", "increment")
    if [d for d in dims if d not in leading] != [d for d in known.dims if d not in leading] or dims[1:].count("sample"):
        return f"has the dimensions ({', '.join(map(str, dims))})"
    if values.dtype.kind not in ("i" if known.flags else "iuf"):
        return f"is of type {values.dtype}"
    if any(not isinstance(attributes.get(key, ""), str) for key in ("units", "long_name", "flag_meanings")):
        return "has damaged attributes"
    if values.size == 0:
        return ""
    if known.flags:
        low, high = int(values.min()), int(values.max())
        return (
            f"has the value {high if high >= len(known.flags) else low}"
            if (low < FLAG_FILL or high >= len(known.flags))
            else ""
        )
    if name in ("sample", "increment"):
        return "" if values.ndim == 1 and values[0] >= 0 and (np.diff(values) > 0).all() else "does not count up"
    return ""


def _unknown_widths(columns: Columns) -> str:
    """Say whether a solved sample lacks values of increments that it was followed to."""
    if not {"status", "crack_width_max", "base_reaction"} <= columns.keys():
        return ""
    solved = np.isin(columns["status"][1], SOLVED)
    width, force = (np.isfinite(columns[name][1]) for name in ("crack_width_max", "base_reaction"))
    if width.shape != force.shape or width.shape[:1] != solved.shape:
        return "crack_width_max, base_reaction and status differ in shape"
    if width.ndim == 1:  # the end of the movement alone, which a path may not have come to
        return "" if np.array_equal(width[solved], force[solved]) else "a solved sample has no crack width"
    followed = np.logical_and.accumulate(force, axis=1)
    good = (width == followed) & (force == followed) & followed[:, :1]
    return "" if good[solved].all() else "a solved sample has increments without crack width"


def check_attributes(attributes: Mapping[Any, Any], source: str, needed: tuple[str, ...] = ()) -> None:
    """Check the global attributes that readers rely on.

    Parameters
    ----------
    attributes : mapping
        Of the file.
    source : str
        The file, for the message.
    needed : tuple of str
        Those that must be there.

    Raises
    ------
    DamagedError
        If one is missing, of another type, out of bounds, or no TOML where it holds a scene.
    """
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
