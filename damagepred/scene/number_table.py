"""Strict reader of number tables: CSV files and xlsx workbooks."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from damagepred.arrays import FloatArray
from damagepred.errors import InputError, nearest
from damagepred.inputs.input_files import LARGEST_DESCRIPTION, LARGEST_TABLE, as_text, read_bytes
from damagepred.inputs.text import written_date
from damagepred.scene.quantity import COMMON, LARGEST, to_si

if TYPE_CHECKING:
    import pandas as pd

SEPARATORS = {"\t": "tabs", ";": "semicolons", ",": "commas", " ": "spaces", "": "columns"}
"""Separators of cells and their names, in the order of the search; none in a workbook."""

_DECIMALS = {".": r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?", ",": r"[-+]?(?:\d+,?\d*|,\d+)(?:[eE][-+]?\d+)?"}
_THOUSANDS = re.compile(r"[-+]?\d{1,3}(?:[.,'’\s]\d{3})+(?:[.,]\d*)?")
_HEADER = re.compile(r"(?P<name>.*?)\s*[\[(]\s*(?P<unit>[^\[\]()]*?)\s*[\])](?P<more>[^\[\]()]*)")


class Column(NamedTuple):
    """Column by its name."""

    unit: str  # SI; empty for text
    others: tuple[str, ...] = ()  # other names
    required: bool = False


@dataclass(frozen=True)
class NumberTable:
    """Cells of a table, as text, with the names and units of its header."""

    path: Path  # for messages
    headers: list[str]  # per column; the unit in brackets behind the name; empty if absent
    names: list[str]
    units: list[str]
    cells: pd.DataFrame  # text of the rows; the index is the line in the file, the columns count from 0
    decimal: str  # separator of decimals
    line: int = 1  # of the header

    def find(self, name: str) -> int | None:
        """Column of a name, with or without its unit, or None."""
        columns = [k for k, header in enumerate(self.headers) if header == name]
        columns = columns or [k for k, column_name in enumerate(self.names) if column_name == name]
        if len(columns) > 1:
            raise InputError(f"{self.path}: a column is named twice: {name}; give its whole header.")
        return columns[0] if columns else None

    def keys(self, expected: Mapping[str, Column]) -> list[str | None]:
        """Key of each column, in any letter case and with a unit at its end; None for an unknown name."""
        words = {word: key for key, column in expected.items() for word in (key, *column.others)}
        found = []
        for k, name in enumerate(self.names):
            word = re.sub(r"[\s_,/.-]+", "_", name.strip().lower())
            head, _, tail = word.rpartition("_")
            key = words.get(word)
            if key is None and head in words and self.unit(k, expected[words[head]].unit).lower() == tail:
                key = words[head]
            found.append(key)
        return found

    def columns(self, expected: Mapping[str, Column]) -> dict[str, int]:
        """Column of each key; refuses unknown, repeated and missing ones."""
        found: dict[str, int] = {}
        takes = ", ".join(f"{key} [{c.unit}]" if c.unit not in ("", "1") else key for key, c in expected.items())
        for k, key in enumerate(self.keys(expected)):
            where = f"{self.path}, line {self.line}, column {k + 1}"
            if key is None:
                hint = nearest(self.names[k], expected)
                raise InputError(f"{where}: '{self.headers[k]}' is unknown; the columns may be {takes}.{hint}")
            if key in found:
                twice = f"'{self.headers[k]}' and '{self.headers[found[key]]}' both mean {key}"
                raise InputError(f"{where}: {twice}; remove one of them.")
            found[key] = k
        if missing := [key for key, column in expected.items() if column.required and key not in found]:
            has = ", ".join(self.headers)
            raise InputError(f"{self.path}, line {self.line}: has no column {missing[0]} ({takes}); it has {has}.")
        return found

    def dates(self, column: int) -> list[str]:
        """Dates of a column, as 2026-11-28."""
        dates = []
        for line, cell in self.cells[column].str.removesuffix(" 00:00:00").items():
            try:
                dates.append(str(written_date(cell)))
            except ValueError as error:
                raise InputError(f"{self.path}, line {line}, {self.names[column]} = {cell!r}: {error}.") from None
        return dates

    def unit(self, column: int, unit: str) -> str:
        """Unit of a column: in brackets, or at the end of its name (level_mm) if it fits the SI ``unit``."""
        tail = re.split(r"[\s_,/]+", self.headers[column])[-1] if unit != "1" else ""
        if tail == "g" and unit == "m/s**2":
            return tail
        return self.units[column] or (tail if tail in COMMON.get(unit, {}) else "")

    def numbers(
        self, column: int, unit: str, written_in: str | None = None, cell_units: bool = False, gaps: bool = False
    ) -> FloatArray:
        """Numbers (SI) of a column; ``gaps``: without empty cells; ``cell_units``: a cell may have its own unit."""
        factor, text = self.factor(column, unit, written_in), self.cells[column]
        if gaps:
            text = text[text != ""]
        plain = text.str.fullmatch(_DECIMALS[self.decimal]).to_numpy(bool)
        values = np.empty(len(text))
        values[plain] = factor * text[plain].str.replace(",", ".").astype(float)
        for k in np.flatnonzero(~plain | ~(np.abs(values, where=plain, out=np.zeros(len(text))) <= LARGEST)).tolist():
            line, cell = text.index[k], text.iloc[k]
            reason = self._reason(cell)
            if cell_units and not reason:
                try:
                    values[k] = to_si(cell, unit)
                    continue
                except ValueError as error:
                    reason = str(error)
            name, advice = self.names[column] or f"column {column + 1}", "; a unit goes to the column's name"
            raise InputError(f"{self.path}, line {line}, {name} = {cell!r}: {reason or f'is no plain number{advice}'}.")
        return values

    def _reason(self, cell: str) -> str:
        """Reason why a cell is no number; empty if it may have a unit."""
        if not cell:
            return "is empty; give a number"
        if _THOUSANDS.fullmatch(cell):
            return "has a thousands separator; write the digits without one"
        if re.fullmatch(_DECIMALS[","], cell) and "," in cell:
            return "has a decimal comma; separate the cells by semicolons or tabs, or write a decimal point"
        return "" if re.match(r"[-+.]?\d", cell) else "is no finite number"

    def factor(self, column: int, unit: str, written_in: str | None = None) -> float:
        """Factor from the unit of a column, or the unit given for it, to SI."""
        header, factors = self.unit(column, unit), [1.0]
        for written in filter(None, (header, written_in)):
            try:
                factors.append(1.0 if written in ("1", "-") and unit == "1" else to_si(f"1 {written}", unit))
            except ValueError as error:
                if written == header and written_in is not None and "wrong kind" not in str(error):
                    continue  # a remark in brackets
                where = f"column '{self.headers[column]}'" if written == header else f"unit = '{written}'"
                raise InputError(f"{self.path}: {where}: {error}.") from None
        if len(factors) == 3 and not np.isclose(factors[1], factors[2]):
            raise InputError(
                f"{self.path}: column '{self.headers[column]}' has a unit in its header, and unit = '{written_in}' is "
                "another; leave out one."
            )
        return factors[-1]


def read_number_table(path: str | Path, columns: int | None = None, header: bool = True) -> NumberTable:
    """Table of a CSV file or an xlsx workbook, with ``columns`` columns; without ``header`` they may lack names."""
    import pandas as pd

    path = Path(path)
    separator, rows = _rows(path)
    if not rows:
        raise InputError(f"{path}: is empty; a table of numbers is needed.")
    width = len(rows[0][1])
    for line, cells in rows:
        if len(cells) != width:
            due = f"the {'header' if header else 'first line'} {width}.{_hint(separator, cells, width)}"
            raise InputError(f"{path}, line {line}: has {len(cells)} cells, {due}")
    while width > 1 and not any(cells[width - 1] for _, cells in rows):  # spreadsheets leave empty columns
        width -= 1
    if columns is not None and width != columns:
        raise InputError(f"{path}: has {width} columns; {columns} are expected.{_hint(separator, rows[0][1], columns)}")
    first, headers = rows[0][0], rows[0][1][:width]
    named = header or not any(re.match(r"[-+.,]?\d|[-+]?(nan|inf)|$", cell, re.IGNORECASE) for cell in headers)
    if named:
        rows = rows[1:]
        if all(re.fullmatch(_DECIMALS["."], cell) for cell in headers):
            raise InputError(f"{path}: the first line must name the columns; it has {', '.join(headers)}.")
    else:
        headers = [""] * width
    if twice := sorted({cell for cell in headers if cell and headers.count(cell) > 1}):
        raise InputError(f"{path}: a column is named twice: {', '.join(twice)}.")
    matches = [_HEADER.fullmatch(cell) for cell in headers]
    names = [match["name"] + match["more"].rstrip() if match else cell for match, cell in zip(matches, headers)]
    frame = pd.DataFrame([cells[:width] for _, cells in rows], index=[line for line, _ in rows], dtype=str)
    if frame.empty:
        raise InputError(f"{path}: has no rows of numbers.")
    decimal = _decimal(path, separator, frame)
    units = [match["unit"] if match else "" for match in matches]
    return NumberTable(path, headers, names, units, frame, decimal, first)


def _decimal(path: Path, separator: str, cells: pd.DataFrame) -> str:
    """Decimal mark of a table."""
    if separator in (",", "", " "):
        return "."
    lines: dict[str, list[int]] = {mark: [] for mark in _DECIMALS}
    for column in cells:
        for mark, pattern in _DECIMALS.items():
            text = cells[column][cells[column].str.contains(mark, regex=False)]
            lines[mark] += text.index[text.str.fullmatch(pattern)].tolist()
    if lines["."] and lines[","]:
        raise InputError(
            f"{path}: has decimal points (line {lines['.'][0]}) and commas (line {lines[','][0]}); write one of them, "
            "and no thousands separators."
        )
    return "," if lines[","] else "."


def _hint(separator: str, cells: list[str], due: int) -> str:
    hint = f" The cells are separated by {SEPARATORS[separator]}: {separator.join(cells)!r}."
    if separator != "," or len(cells) < due:
        return hint
    return f"{hint} A decimal comma or a thousands separator splits a number: separate the cells by semicolons or tabs."


def _rows(path: Path) -> tuple[str, list[tuple[int, list[str]]]]:
    """Separator, and line and cells of the rows with content."""
    content = read_bytes(path, LARGEST_TABLE)
    if content.startswith(b"\xd0\xcf\x11\xe0"):
        raise InputError(f"{path}: is an old workbook (xls); save it as xlsx or as CSV.")
    if content.startswith(b"PK\x03\x04"):
        separator, rows = "", list(enumerate(_workbook(path, content), 1))
    else:
        text = as_text(content, path).splitlines()
        lines = [(n, line.strip(" ")) for n, line in enumerate(text, 1) if line.strip() and line.lstrip()[0] != "#"]
        separator = _separator([line for _, line in lines])
        rows = [(number, split_row(path, number, line, separator)) for number, line in lines]
    return separator, [(n, cells) for n, cells in rows if any(cells) and not cells[0].startswith("#")]


def split_row(path: Path, number: int, line: str, separator: str) -> list[str]:
    """Cells of a line."""
    if separator == " ":
        return re.split(r"\s+(?![\[(])(?![^\[(]*[\])])", line)
    if '"' not in line:
        return [cell.strip() for cell in line.split(separator)]
    try:
        reader = csv.reader([line], delimiter=separator, skipinitialspace=True, strict=True)
        return [cell.strip() for cell in next(reader)]
    except csv.Error as error:
        raise InputError(f"{path}, line {number}: is no row of a table ({error}).") from None


def _separator(lines: list[str]) -> str:
    """Separator of the first line or, if it has none, of the second."""
    for line in lines[:2]:
        bare = re.sub(r'"[^"]*"|\([^)]*\)|\[[^\]]*\]', "", line)
        if separators := [mark for mark in ("\t", ";", ",") if mark in bare]:
            return separators[0]
    number = rf"\s*{_DECIMALS['.']}"
    spaced = re.compile(rf"{number}(\s{number})+")
    return " " if lines[1:] and " " in lines[0] and all(map(spaced.fullmatch, lines[1:])) else ","


def _workbook(path: Path, content: bytes) -> list[list[str]]:
    """Cells of the only sheet of a workbook that has any."""
    import pandas as pd

    if len(content) > LARGEST_DESCRIPTION:
        raise InputError(f"{path}: is too large for a workbook of numbers; save it as CSV.")
    try:
        how: dict[str, Any] = {"sheet_name": None, "header": None, "dtype": object, "na_filter": False}
        sheets = pd.read_excel(io.BytesIO(content), engine="openpyxl", **how)
    except ImportError:
        raise InputError(
            f"{path}: workbooks are read with openpyxl: pip install 'damagepred[excel]', or save the sheet as CSV."
        ) from None
    except Exception as error:  # a zip file of another kind
        raise InputError(f"{path}: is no xlsx workbook ({type(error).__name__}: {error}).") from None
    filled = {str(name): frame for name, frame in sheets.items() if frame.size}
    if len(filled) != 1:
        raise InputError(
            f"{path}: must have one sheet with cells; it has {len(filled)} ({', '.join(filled)}). Delete the "
            "others, or save the sheet as CSV."
        )
    [frame] = filled.values()
    return [[_cell_text(cell) for cell in row] for row in frame.itertuples(index=False)]


def _cell_text(cell: object) -> str:
    return repr(float(cell)) if isinstance(cell, int | float) and not isinstance(cell, bool) else str(cell).strip()
