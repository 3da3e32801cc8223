"""Tables in files of a scene: profiles of the ground, histories of movement, records of base motion."""

from __future__ import annotations

import itertools
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from damagepred.arrays import FloatArray
from damagepred.enumerations import SYNONYMS
from damagepred.errors import InputError
from damagepred.inputs.input_files import LARGEST_TABLE, as_text, opened, read_bytes
from damagepred.scene.ags import soil_layers
from damagepred.scene.footing_profile import through_points
from damagepred.scene.number_table import Column, NumberTable, read_number_table
from damagepred.scene.quantity import LARGEST, to_si
from damagepred.scene.settlement import LEAST_IN_MIDDLE, SETTLEMENTS, ZERO, signed_size
from damagepred.scene.survey_tables import LEVELS, heights, moved

END_TOLERANCE = 1e-3  # tolerance between the ends of a profile and of the wall, over its length: positions are rounded
SIZE_TOLERANCE = 0.01  # relative tolerance between a given movement and the profile's: figures are rounded
SIDES = {"doming": 1.0, "heave": 1.0, "dishing": -1.0, "settle": -1.0}
SIDES |= {word: SIDES[kind] for word, kind in SYNONYMS.items()}
"""Sign of the deflection of each kind of movement."""
FRACTIONS = ("1", "-", "%")  # units of a column of fractions
SI_UNIT = {"acceleration": "m/s**2", "velocity": "m/s", "displacement": "m"}


def with_input_tables(tables: Any, folder: Path) -> tuple[Any, tuple[str, ...]]:
    """Tables of a scene with the numbers of their files in a folder, and its profiles with positions in metres."""
    if not isinstance(tables, Mapping):  # the scene refuses it
        return tables, ()
    in_metres = []
    if isinstance(tables.get("wall"), list):
        from damagepred.scene.plan_ground import with_levels

        tables = with_levels(tables, folder)
    merged = {key: dict(content) if isinstance(content, Mapping) else content for key, content in tables.items()}
    if isinstance(layers := merged.get("soil_layer"), list):
        read = [soil_layers(x, folder) if isinstance(x, Mapping) and "file" in x else [x] for x in layers]
        merged["soil_layer"] = list(itertools.chain(*read))
    movement, mound, dynamics = (merged.get(key, {}) for key in ("movement", "mound", "dynamics"))
    if isinstance(movement, dict) and isinstance(mound, dict):
        for key in ("movement", "mound"):
            name = merged[key].get("table") if key in merged else None
            if isinstance(name, str) and _take_profile(merged, key, folder / name):
                in_metres.append(f"{key}.table = '{name}'")
        if isinstance(name := movement.get("history"), str) and "stage" not in movement:
            del movement["history"]
            settles = movement.get("shape") in SETTLEMENTS or {"settlement", "settlement_is"} & movement.keys()
            size = "settlement" if settles else "central_deflection"
            size = "surface_movement" if movement.get("shape") == "mound" else size
            movement["stage"] = _stages(folder / name, size)
            sized = merged.setdefault("mound", mound) if size == "surface_movement" else movement
            sized.setdefault(size, max(stage[size] for stage in movement["stage"]))
    if isinstance(dynamics, dict) and isinstance(motions := dynamics.get("base"), list):
        dynamics["base"] = [_with_record(m, folder) if isinstance(m, Mapping) else m for m in motions]
    return merged, tuple(in_metres)


def with_roof_in_all(tables: Any) -> Any:
    """Tables of a scene whose load of the roof, given per length ("3 kN/m"), is in all (N)."""
    loads = tables.get("loads") if isinstance(tables, Mapping) else None
    roof = loads.get("roof") if isinstance(loads, Mapping) else None
    if not isinstance(roof, str) or "/" not in roof:
        return tables
    try:
        in_all = to_si(roof, "N/m") * _length(tables)
    except ValueError:  # the scene refuses it
        return tables
    return {**tables, "loads": {**loads, "roof": in_all}}  # type: ignore[dict-item]


def _take_profile(tables: dict[str, Any], key: str, path: Path) -> bool:
    """Put the points, kind and size of a profile into the tables of a scene; whether its positions are in metres."""
    table, movement = tables[key], tables.setdefault("movement", {})
    keys, measured, in_metres = _profile(path, _length(tables), table.get("table_ends", "refuse"), key == "movement")
    points = keys.pop("table")
    position, values = np.array(points).T
    off_chord = float(through_points(points, np.array([0.5]))[0] - 0.5 * (values[0] + values[-1]))
    settles = bool({"settlement", "settlement_is"} & table.keys())
    if measured and key == "movement" and not {"central_deflection", "stage", "history", "seasons"} & table.keys():
        departure = abs(signed_size(values, position, "relative"))
        settles |= abs(off_chord) <= LEAST_IN_MIDDLE * departure or departure <= ZERO * np.abs(values).max()
    central = key == "movement" and not settles
    size = "surface_movement" if key == "mound" else "settlement" if settles else "central_deflection"
    largest = off_chord if central else signed_size(values, position, table.get("settlement_is"))
    what = "middle lies" if central else f"{table.get('settlement_is', 'largest')} movement is"
    where = f"{path}: the {what} {1e3 * largest:+.4g} mm"
    where += " off the line through the ends (up positive)" if central else " (up positive)"
    table |= {**keys, **{name: table[name] for name in ("survey_error",) if name in table}}
    follows = {"stage", "history", "seasons"} & set(movement) or "soil_layer" in tables  # the size does
    if not measured:
        missing = [name for name, table in (("kind", movement), (size, table)) if name not in table]
        if missing and not follows:
            raise InputError(
                f"{path}: its second column has no unit, so it gives the form alone. Name the column with its unit, "
                f"such as 'level (mm)', for its sign and size; or give {' and '.join(missing)}."
            )
        if key == "mound" and np.abs(values).max() > 1.0:
            raise InputError(
                f"{path}: its second column has fractions of surface_movement, -1 to 1, or a unit in its name, such as "
                f"'movement (mm)'; it reaches {np.abs(values).max():g}."
            )
    elif largest:
        words = ("doming", "dishing") if central else ("heave", "settle")
        kind = movement.setdefault("kind", words[0] if largest > 0 else words[1])
        if SIDES.get(kind, largest) * largest < 0:
            raise InputError(f"{where}: movement.kind = '{kind}' contradicts it. Leave kind out, or mend the signs.")
        if not follows:
            _check_size(f"{key}.{size}", table.setdefault(size, abs(largest)), abs(largest), where)
        if key == "mound":
            points = [[x, value / largest] for x, value in points]
    table["table"] = points
    return in_metres


def _check_size(key: str, given: Any, measured: float, where: str) -> None:
    """Refuse a movement that differs from its profile."""
    try:
        size = to_si(given, "m")
    except ValueError:  # the scene refuses it
        return
    if abs(size - measured) > SIZE_TOLERANCE * measured:
        raise InputError(
            f"{where}: {key} = {given} contradicts it. Leave it out; or, for this form at another size, leave out "
            "the unit in the name of the column."
        )


def _length(tables: Mapping[str, Any]) -> float:
    """Length of the wall (m); NaN if invalid."""
    from damagepred.scene.wall import Wall

    wall = tables.get("wall", {})
    try:
        return to_si(wall["length"], "m") if "length" in wall else Wall().length
    except (TypeError, ValueError):
        return np.nan


def _profile_columns(table: NumberTable, along: bool) -> dict[str, int]:
    """Columns of a profile: by their names if these name the levels, otherwise by their order."""
    expected = {**LEVELS, "displacement": Column("m", ("horizontal", "horizontal_displacement", "move", "shift"))}
    keys, order = table.keys(expected), ("x", "level", "displacement") if along else ("x", "level")
    in_order = len(keys) == 2 and keys[0] in (None, "x") and keys[1] in (None, "level")
    if {"level", "settlement"} & set(keys) and not in_order:
        return table.columns({key: c for key, c in expected.items() if along or key != "displacement"})
    width = len(table.names)
    if width not in (2, len(order)):
        due = "position, level and, if measured, displacement" if along else "position and level"
        raise InputError(f"{table.path}: has {width} columns; due are {due}.")
    if foreign := [table.headers[k] for k, key in enumerate(keys) if key in ("date", "error")]:
        raise InputError(f"{table.path}, line {table.line}: has no column level; it has {foreign[0]}.")
    return dict(zip(order, range(width)))


def _profile(path: Path, length: float, ends: Any, along: bool) -> tuple[dict[str, Any], bool, bool]:
    """Keys of a profile (points, displacements, error), and whether its values have a unit and x is in metres."""
    table = read_number_table(path, header=False)
    columns = _profile_columns(table, along)
    high = columns.get("level", columns.get("settlement", 0))
    position, level = ("1" if table.units[k] in FRACTIONS else "m" for k in (columns["x"], high))
    measured = bool(table.unit(high, level)) and level == "m"
    x, values = table.numbers(columns["x"], position), [heights(table, columns, level)]
    if "displacement" in columns:
        if bool(table.unit(columns["displacement"], level)) != measured:
            raise InputError(f"{path}: level and displacement both have a unit in their names, or neither has.")
        values.append(table.numbers(columns["displacement"], level))
    rows, changes = moved(table, columns, x[:, None], np.column_stack(values))
    x, (value, *shift) = x[rows], changes.T
    length = length if length > 0 else x[-1]
    x = x * length if position == "1" else x
    if (falls := np.flatnonzero(np.diff(x) <= 0)).size:
        line = table.cells.index[rows[falls[0] + 1]]
        raise InputError(f"{path}, line {line}: positions must rise from line to line, from the wall's left end.")
    if len(x) < 2:
        raise InputError(f"{path}: must have at least two points.")
    tolerance = END_TOLERANCE * length
    gap, overhang = max(x[0], length - x[-1]) > tolerance, min(x[0], length - x[-1]) < -tolerance
    off = x[0] >= length or x[-1] <= 0.0
    if off or (gap and ends not in ("level", "extend")) or (overhang and ends == "refuse"):
        raise InputError(
            f"{path}: goes from {x[0]:g} to {x[-1]:g} m, the wall from 0 to {length:g} m (positions are "
            "metres from its left end, or in the unit of the column's name; 'x (1)': fractions of its length). "
            "table_ends = 'cut' cuts what lies beyond the wall, 'level' or 'extend' also continue what ends before it."
        )
    keys: dict[str, Any] = {}
    if shift:
        along_x, shifted = _at_ends(x, shift[0], length, tolerance, ends)
        keys["horizontal"] = np.column_stack((along_x / length, shifted)).tolist()
    if "error" in columns and along:
        errors = np.unique(table.numbers(columns["error"], "m")[rows])
        if len(errors) > 1:
            raise InputError(
                f"{path}: a profile has one error for all levels (movement.survey_error); it has "
                f"{' and '.join(f'{1e3 * error:g}' for error in errors)} mm."
            )
        keys["survey_error"] = float(errors[0])
    x, value = _at_ends(x, value, length, tolerance, ends)
    if measured and abs(value[0]) > 0.1 * length:  # reduced levels: only differences act on the wall
        value = value - value[0]
    keys["table"] = np.column_stack((x / length, value)).tolist()
    return keys, measured, position == "m"


def _at_ends(x: FloatArray, value: FloatArray, length: float, near: float, ends: str) -> tuple[FloatArray, FloatArray]:
    """Profile from the left end of the wall to the right: cut, continued, or with rounded end positions."""
    edge = np.array([0.0, length])
    end_values = through_points(np.column_stack((x, value)).tolist(), np.clip(edge, x[0], x[-1]))
    if ends == "extend":
        slope = np.array([(value[1] - value[0]) / (x[1] - x[0]), (value[-1] - value[-2]) / (x[-1] - x[-2])])
        end_values += slope * (edge - np.clip(edge, x[0], x[-1]))
    inside = (x > near) & (x < length - near)
    return np.concatenate(([0.0], x[inside], [length])), np.concatenate((end_values[:1], value[inside], end_values[1:]))


def _stages(path: Path, size: str) -> list[dict[str, Any]]:
    """Stages of a history from a table."""
    table, takes = read_number_table(path), {"time": "year", "movement": "m", "increments": "1", "strain": "1"}
    expected = {key: Column(unit, required=key in ("time", "movement")) for key, unit in takes.items()}
    columns = {key: table.numbers(k, takes[key]).tolist() for key, k in table.columns(expected).items()}
    counts = columns.get("increments", [])
    if any(count != int(count) for count in counts):
        raise InputError(f"{path}: increments must be whole numbers.")
    stages = []
    for row in (dict(zip(columns, values)) for values in zip(*columns.values())):
        movement = row.pop("movement")
        stages.append({"kind": "doming" if movement > 0 else "dishing", size: abs(movement), **row})
        if counts:
            stages[-1]["increments"] = int(row["increments"])
    return stages


def _with_record(motion: Mapping[str, Any], folder: Path) -> dict[str, Any]:
    """Read the record of a base motion that names a file."""
    name = motion.get("file")
    if not isinstance(name, str) or motion.get("time") or motion.get("values"):
        return dict(motion)
    scale = motion.get("scale", 1.0)
    time, values = read_record(folder / name, motion.get("quantity", "acceleration"), scale)
    return {**{k: v for k, v in motion.items() if k != "file"}, "time": time.tolist(), "values": values.tolist()}


def read_record(path: Path, quantity: str, scale: Any = 1.0) -> tuple[FloatArray, FloatArray]:
    """Time (s) and values (SI) of a record of base motion, before ``scale``."""
    unit = SI_UNIT.get(quantity, "1")
    try:
        if is_peer_record(path):
            time, values, factor, written = read_peer_record(path, unit)
        else:
            table = read_number_table(path, columns=2, header=False)
            keys = table.keys({"time": Column("s", ("t",)), quantity: Column(unit, (quantity[0], quantity[:3]))})
            k = 0 if quantity == keys[0] or keys[1] == "time" else 1  # by names in any order, otherwise the second
            time, values, factor = table.numbers(1 - k, "s"), table.numbers(k, unit), table.factor(k, unit)
            written = table.headers[k]
    except InputError as error:
        raise InputError(f"{error} The record is read as quantity = '{quantity}'.") from None
    if factor != 1.0 and isinstance(scale, int | float) and abs(scale / factor - 1.0) < SIZE_TOLERANCE:
        raise InputError(f"{path}: its values have their unit, '{written}'; scale = {scale:g} converts it again.")
    if len(time) < 2 or time[0] < 0 or (np.diff(time) <= 0).any():
        raise InputError(
            f"{path}: a record needs two lines or more, with times (s) of 0 or later that rise from line to line."
        )
    return time, values


HEAD = 10  # lines in which the head ends
_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_ROW = re.compile(rf"\s*{_NUMBER}(?:\s+{_NUMBER}|(?=[-+]){_NUMBER})*\s*")  # full columns touch at their signs
_UNITS = re.compile(r"IN UNITS OF\s+([A-Z0-9/*^]+)", re.IGNORECASE)
_STEPS = (
    re.compile(rf"NPTS\s*=\s*(?P<count>\d+)\s*,?\s*DT\s*=\s*(?P<step>{_NUMBER})(?:\s*SEC)?", re.IGNORECASE),
    re.compile(rf"(?P<count>\d+)\s+(?P<step>{_NUMBER})\s+NPTS\s*,\s*DT", re.IGNORECASE),  # older files
)


def is_peer_record(path: Path) -> bool:
    """Whether a file is a PEER record, by its name or its head."""
    with opened(path, LARGEST_TABLE) as stream:
        return path.suffix.lower() in (".at2", ".vt2", ".dt2") or b"NPTS" in stream.read(2000)


def read_peer_record(path: Path, unit: str) -> tuple[FloatArray, FloatArray, float, str]:
    """Times from 0 (s), values (SI), and their unit in the file as factor and text."""
    lines = as_text(read_bytes(path, LARGEST_TABLE), path).splitlines()
    found = ((n, match) for n, line in enumerate(lines[:HEAD]) for form in _STEPS if (match := form.search(line)))
    head, step = next(found, (0, None))
    if step is None:
        raise InputError(
            f"{path}: has no line 'NPTS= 4000, DT= .0050 SEC' among its first {HEAD}; it is no PEER record."
        )
    count, interval = int(step["count"]), float(step["step"])
    if not (count >= 2 and 0 < interval <= LARGEST):
        raise InputError(f"{path}, line {head + 1}: NPTS must be 2 or more and DT greater than 0.")
    units = [match[1] for line in lines[:head] if (match := _UNITS.search(line))]
    if not units:
        raise InputError(f"{path}: has no line 'ACCELERATION TIME SERIES IN UNITS OF G' before line {head + 1}.")
    try:
        factor = to_si(f"1 {units[0].lower().replace('sec', 's')}", unit)
    except ValueError as error:
        raise InputError(f"{path}: UNITS OF {units[0]}: {error}.") from None
    values: list[float] = []
    for number, line in enumerate(lines[head + 1 :], head + 2):
        if not line.strip():
            continue
        if _ROW.fullmatch(line) is None:
            kept = re.match(rf"(?:\s*{_NUMBER}(?=\s|[-+]|$))*\s*", line)
            column = kept.end() + 1 if kept else 1
            raise InputError(f"{path}, line {number}, character {column}: is no number: {line.strip()[:40]!r}.")
        values.extend(map(float, re.findall(_NUMBER, line)))
    if len(values) != count:
        raise InputError(f"{path}, line {head + 1}: NPTS is {count}, but the file has {len(values)} values.")
    if not np.abs(values).max() <= LARGEST:
        raise InputError(f"{path}: has a value beyond {LARGEST:g}.")
    return interval * np.arange(count, dtype=np.float64), factor * np.array(values), factor, units[0]
