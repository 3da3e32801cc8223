"""Samples that the user brings: a CSV file with one column a variable and one row a wall."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from damagepred.arrays import FloatArray
from damagepred.errors import InputError, nearest
from damagepred.input_files import LARGEST_TABLE, read_text
from damagepred.scene.quantity import to_si

WEIGHT = "weight"
"""Column that is no number of the scene."""

_HEADER = re.compile(r"\s*(?P<place>[^\s\[(]+)\s*(?:[\[(]\s*(?P<unit>[^\])]*)[\])])?\s*")


def read_table(path: str | Path, unit_of: Callable[[str], str], known: Sequence[str]) -> dict[str, FloatArray]:
    """Read samples from a CSV file.

    Parameters
    ----------
    path : str or Path
        The first line names the columns by place, with a unit in brackets if they are not in SI:
        ``joint.tensile_strength [MPa],dpc.friction``. A cell may carry its own unit instead. A column ``weight`` has
        the weight of each sample, for samples from another distribution (importance sampling).
    unit_of : callable
        Returns a place's SI unit.
    known : sequence of str
        Places that may stand in the header.

    Returns
    -------
    dict of str to array (samples,)
        In SI.

    Raises
    ------
    InputError
        If the file is missing, or a header or a cell is not acceptable; the message names it.
    """
    try:
        rows = csv.reader(io.StringIO(read_text(path, LARGEST_TABLE), newline=""))
        lines = [(number, row) for number, row in enumerate(rows, start=1) if any(map(str.strip, row))]
    except InputError as error:
        raise InputError(f"study.table: {error}") from None
    except csv.Error as error:
        raise InputError(f"study.table: {path}: is no table of comma-separated values ({error}).") from None
    lines = [(number, row) for number, row in lines if not row[0].lstrip().startswith("#")]
    if len(lines) < 2:
        raise InputError(f"{path}: must have a line with the columns' names and one line a sample.")
    columns = [_column(path, cell, [*known, WEIGHT]) for cell in lines[0][1]]
    places = [place for place, _ in columns]
    if len(set(places)) < len(places):
        raise InputError(f"{path}: a column is named twice: {', '.join(places)}.")
    values = np.empty((len(lines) - 1, len(columns)))
    for i, (number, row) in enumerate(lines[1:]):
        if len(row) != len(columns):
            raise InputError(f"{path}, line {number}: has {len(row)} cells, the header {len(columns)}.")
        for k, (cell, (place, unit)) in enumerate(zip(row, columns)):
            values[i, k] = _cell(path, number, cell, place, unit, "1" if place == WEIGHT else unit_of(place))
            if place == WEIGHT and values[i, k] < 0:
                raise InputError(f"{path}, line {number}, weight = {cell.strip()}: must not be negative.")
    return {place: values[:, k].copy() for k, place in enumerate(places)}


def _column(path: str | Path, cell: str, known: Sequence[str]) -> tuple[str, str]:
    parts = _HEADER.fullmatch(cell)
    place = parts["place"] if parts else cell.strip()
    if parts is None or place not in known:
        raise InputError(f"{path}: column {cell.strip()!r}: the scene has no such number.{nearest(place, known)}")
    return place, (parts["unit"] or "").strip()


def _cell(path: str | Path, line: int, cell: str, place: str, unit: str, si: str) -> float:
    text = cell.strip()
    plain = re.fullmatch(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?", text) is not None
    try:
        return to_si(f"{text} {unit}" if plain and unit and unit != "1" else text, si)
    except ValueError as error:
        raise InputError(f"{path}, line {line}, {place} = {text!r}: {error}.") from None
