"""Measured values from a column of a table of comma-separated values."""

from __future__ import annotations

import csv
from pathlib import Path

from damagepred.errors import InputError, nearest
from damagepred.input_files import LARGEST_TABLE, read_text
from damagepred.scene.quantity import to_si


def read_column(where: str, file: Path, column: str, written_in: str | None, unit: str) -> tuple[float, ...]:
    """Read one column of a CSV file, in SI.

    Parameters
    ----------
    where : str
        Place in the study, for messages.
    file : Path
        With a header line; lines that begin with ``#`` and empty cells are passed over.
    column : str
        Name in the header.
    written_in : str or None
        Unit of the column; None: SI.
    unit : str
        SI unit that is due.

    Raises
    ------
    InputError
        If the file, the column or a number in it cannot be read.
    """
    try:
        text = read_text(file, LARGEST_TABLE)
    except InputError as error:
        raise InputError(f"{where} file = {error}") from None
    lines = [(n, line) for n, line in enumerate(text.splitlines(), 1) if line.strip() and not line.startswith("#")]
    try:
        rows = list(csv.reader((line for _, line in lines), skipinitialspace=True))
    except csv.Error as error:
        raise InputError(f"{where} file = {file}: is no table of comma-separated values ({error}).") from None
    header = [name.strip() for name in rows[0]] if rows else []
    if column not in header:
        raise InputError(
            f"{where} column = '{column}': {file.name} has the columns {', '.join(header) or 'none'}."
            + nearest(column, header)
        )
    try:
        factor = 1.0 if written_in is None else to_si(f"1 {written_in}", unit)
    except ValueError as error:
        raise InputError(f"{where} unit = '{written_in}': {error}.") from None
    place = header.index(column)
    found: list[float] = []
    for (number, _), row in zip(lines[1:], rows[1:]):
        cell = row[place].strip() if place < len(row) else ""
        if cell:
            try:
                found.append(factor * to_si(float(cell), "1"))
            except ValueError:
                raise InputError(
                    f"{where} file = '{file.name}': line {number}, column {column}: {cell!r} is no finite number; "
                    "the unit of the column goes to unit."
                ) from None
    return tuple(found)
