"""Surveys in files: cracks, levels and other observations, one row each, and the movement between two visits."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from damagepred.arrays import FloatArray, IntArray
from damagepred.errors import InputError
from damagepred.scene.described import build, takes_number, unit_of
from damagepred.scene.number_table import Column, NumberTable, read_number_table
from damagepred.scene.quantity import to_si

SAME_POINT = 1e-3  # distance (m) up to which two visits read the same point
TEXTS = {
    "date": Column("", ("day", "visit")),
    "point": Column("", ("name", "id", "number")),
    "remark": Column("", ("remarks", "note", "comment")),
}
"""Columns of any survey; points and remarks are not read."""
POSITION = Column("m", ("position", "distance", "chainage", "station"), required=True)
LEVELS = {
    "x": POSITION,
    "level": Column("m", ("reduced_level", "rl", "movement", "rise", "heave")),
    "settlement": Column("m", ("subsidence",)),
    "error": Column("m", ("standard_error",)),
    **TEXTS,
}
"""Columns of a survey of levels. A settlement is positive downwards."""
OTHERS = {"x": POSITION.others, "width": ("crack_width",), "error": ("standard_error",)}
"""Other names of the keys of observations."""
SUFFIXES = (".csv", ".tsv", ".txt", ".xlsx")


def heights(table: NumberTable, columns: Mapping[str, int], unit: str = "m") -> FloatArray:
    """Levels (SI), up positive."""
    if ("level" in columns) == ("settlement" in columns):
        raise InputError(
            f"{table.path}, line {table.line}: needs a column level, or a column settlement (down positive)."
        )
    return table.numbers(columns["level"], unit) if "level" in columns else -table.numbers(columns["settlement"], unit)


def visits_of(table: NumberTable, columns: Mapping[str, int]) -> Any:
    """Date of each row; empty texts without dates."""
    return np.array(table.dates(columns["date"]) if "date" in columns else [""] * len(table.cells))


def between_visits(
    table: NumberTable, dates: Any, visits: tuple[str, str], place: FloatArray, values: FloatArray
) -> tuple[IntArray, FloatArray, IntArray | None]:
    """Rows of the second visit, values (rows, n) since the first, and its rows (None: one visit, values as read)."""
    before, last = (np.flatnonzero(dates == visit) for visit in visits)
    if visits[0] == visits[1]:
        return last, values, None
    apart = np.linalg.norm(place[last][:, None] - place[before], axis=2)
    if (lost := np.flatnonzero(apart.min(axis=1) > SAME_POINT)).size:
        line, where = table.cells.index[last[lost[0]]], ", ".join(f"{v:g}" for v in place[last[lost[0]]])
        raise InputError(f"{table.path}, line {line}: the visit of {visits[0]} has no point at {where} m.")
    first = before[apart.argmin(axis=1)]
    return last, values[last] - values[first], first


def moved(
    table: NumberTable, columns: Mapping[str, int], place: FloatArray, values: FloatArray
) -> tuple[IntArray, FloatArray]:
    """Rows of the last visit, and values (rows, n) since the first, or as read in a single visit."""
    dates = visits_of(table, columns)
    if len(visits := np.unique(dates)) > 2:
        raise InputError(
            f"{table.path}, column {table.names[columns['date']]}: has {len(visits)} visits ({', '.join(visits)}); a "
            "movement lies between two: keep the rows of these."
        )
    return between_visits(table, dates, (visits[0], visits[-1]), place, values)[:2]


def read_survey(kind: type, name: str, entry: Mapping[str, Any], folder: Path, dated: bool = False) -> list[Any]:
    """Observations of a class in a file: rows, or differences of levels from the first (with dates if wanted)."""
    others = {key: value for key, value in entry.items() if key != "file"}
    if not isinstance(entry["file"], str):
        raise InputError(f"[[{name}]] file = {entry['file']!r}: must be the name of a file.")
    table = read_number_table(folder / entry["file"])
    if name == "monitor":
        readings = {"width": Column("m", OTHERS["width"]), "change": Column("m", ("movement", "reading"))}
        columns = table.columns({**readings, **TEXTS, "date": TEXTS["date"]._replace(required=True)})
        read = {key: table.numbers(columns[key], "m").tolist() for key in readings if key in columns}
        return [{**others, "date": table.dates(columns["date"]), **read}]
    units = {f.name: unit_of(kind, [f.name]) if takes_number(kind, [f.name]) else "" for f in dataclasses.fields(kind)}
    fields = {key: Column(unit, OTHERS.get(key, ())) for key, unit in units.items()}
    if name == "level" and {"level", "settlement"} & set(table.keys(LEVELS)):
        return _levels(kind, table, others, dated)
    columns = table.columns({**TEXTS, **fields})
    if "date" in columns and "date" not in fields and len(visits := sorted(set(table.dates(columns["date"])))) > 1:
        raise InputError(f"{table.path}: has {len(visits)} visits ({', '.join(visits)}); keep the rows of one.")
    rows: list[dict[str, Any]] = [dict(others) for _ in range(len(table.cells))]
    for key in fields.keys() & columns.keys():
        text = table.cells[columns[key]]
        values: Any = text[text != ""]
        if fields[key].unit:
            values = table.numbers(columns[key], fields[key].unit, cell_units=True, gaps=True).tolist()
        for row, value in zip(np.flatnonzero(text != ""), values):
            rows[row] |= {"none": True} if (key, value) == ("width", 0.0) else {key: value}
    return [build(kind, row, f"{table.path}, line {line}") for line, row in zip(table.cells.index, rows)]


def _levels(kind: type, table: NumberTable, others: Mapping[str, Any], dated: bool) -> list[Any]:
    """Differences of levels from the first point, of one visit or since the first of several."""
    columns = table.columns({**LEVELS, "y": Column("m", ("height",))})
    count = len(table.cells)
    given: dict[str, FloatArray] = {}
    for key in ("y", "error"):  # of a column or, for all rows, of the entry
        if key in columns:
            given[key] = table.numbers(columns[key], "m")
        elif key in others or key == "y":
            try:
                given[key] = np.full(count, to_si(others.get(key, 0.0), "m"))
            except ValueError as error:
                raise InputError(f"[[level]] {key} = {others[key]!r}: {error}.") from None
    place = np.column_stack((table.numbers(columns["x"], "m"), given["y"]))
    height, dates = heights(table, columns), visits_of(table, columns)
    days = np.unique(dates).tolist()
    more = {key: value for key, value in others.items() if key not in ("y", "error")}
    found: list[Any] = []
    for day in days[1:] or days:
        rows, rise, first = between_visits(table, dates, (days[0], day), place, height)
        if len(rows) < 2:
            raise InputError(f"{table.path}: needs two points or more; a level counts relative to the first.")
        variance = given["error"] ** 2 if "error" in given else None
        if variance is not None:
            variance = variance[rows] + (0.0 if first is None else variance[first])
        when = {"date": day} if day and (dated or len(days) > 2) else {}
        when |= {"since": days[0]} if when and first is not None else {}
        for k, row in enumerate(rows[1:], 1):
            ends = (*place[rows[0]].tolist(), *place[row].tolist(), float(rise[k] - rise[0]))
            level = {**dict(zip(("x", "y", "to_x", "to_y", "difference"), ends)), **when, **more}
            if variance is not None:
                level["error"] = float(np.sqrt(variance[0] + variance[k]))
            found.append(build(kind, level, f"{table.path}, line {table.cells.index[row]}"))
    return found


def survey_kind(path: Path) -> str:
    """Kind of the observations in a file, by its columns."""
    keys = read_number_table(path).keys({**LEVELS, "width": Column("m", OTHERS["width"])})
    return "level" if {"level", "settlement"} & set(keys) else "crack"
