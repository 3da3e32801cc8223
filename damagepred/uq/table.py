"""Samples of the user: a table with one column per variable and one row per wall."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from damagepred.arrays import FloatArray
from damagepred.errors import InputError, nearest
from damagepred.scene.number_table import read_number_table

WEIGHT = "weight"
"""Column that is no number of the scene."""


def read_table(path: str | Path, unit_of: Callable[[str], str], places: Sequence[str]) -> dict[str, FloatArray]:
    """Read samples (SI) by place from a table."""
    try:
        table = read_number_table(path)
    except InputError as error:
        raise InputError(f"study.table: {error}") from None
    columns: dict[str, FloatArray] = {}
    for k, place in enumerate(table.names):
        if place not in (*places, WEIGHT):
            hint = nearest(place, [*places, WEIGHT])
            raise InputError(f"{path}: column {table.headers[k]!r}: the scene has no such number.{hint}")
        if place in columns:
            raise InputError(f"{path}: a column is named twice: {', '.join(table.names)}.")
        columns[place] = table.numbers(k, "1" if place == WEIGHT else unit_of(place), cell_units=True)
    if WEIGHT in columns and (columns[WEIGHT] < 0).any():
        first = table.cells.index[columns[WEIGHT] < 0][0]
        raise InputError(f"{path}, line {first}, weight = {columns[WEIGHT].min():g}: must not be negative.")
    return columns
