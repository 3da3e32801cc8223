"""Functions of all benchmarks: machine, stored rows, tables of a page."""

from __future__ import annotations

import os
import platform
from importlib.metadata import version
from pathlib import Path
from typing import Any

import pandas as pd

from damagepred.archive.files import write_whole

BEGIN, END = "<!-- written by run.py -->", "<!-- end -->"


def kept_rows(file: Path) -> list[dict[str, Any]]:
    """Return the rows measured so far, without empty cells."""
    if not file.exists():
        return []
    return [{k: v for k, v in row.items() if v == v} for row in pd.read_csv(file).to_dict("records")]


def keep_rows(rows: list[dict[str, Any]], file: Path) -> None:
    """Write the rows measured so far, atomically: an interruption loses no earlier row."""
    table = pd.DataFrame(rows)
    write_whole(file, lambda path: table.to_csv(path, index=False, float_format="%.5g"))


def replace_rows(rows: pd.DataFrame, file: Path, key: list[str]) -> None:
    """Write rows into a file in place of those with the same key, sorted by it."""
    if file.exists():
        old, new = pd.read_csv(file), pd.MultiIndex.from_frame(rows[key])
        rows = pd.concat([old[~pd.MultiIndex.from_frame(old[key]).isin(new)], rows])
    rows = rows.sort_values(key, kind="stable")
    write_whole(file, lambda path: rows.to_csv(path, index=False, float_format="%.6g"))


def processor_model() -> str:
    """Return the model of the processor, with its cache and whether it has AVX-512."""
    maker, cache = "", ""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    for line in lines:
        key, _, value = (part.strip() for part in line.partition(":"))
        if key == "model name":
            maker = value
        elif key == "cache size":
            cache = value
        elif key == "flags" and "avx512f" in value.split():
            cache += ", AVX-512"
            break
    return f"{maker or platform.processor() or platform.machine()} ({cache})"


def machine() -> str:
    """Return a description of the machine, in general terms."""
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**30
    libraries = ", ".join(f"{name} {version(name)}" for name in ("numpy", "numba", "scipy"))
    return (
        f"{os.cpu_count()} cores of a {processor_model()}, "
        f"{memory:.0f} GiB, {platform.system()}, Python {platform.python_version()}, {libraries}"
    )


def markdown(rows: pd.DataFrame) -> str:
    """Return a table for a page, numbers with three digits."""

    def cell(value: Any) -> str:
        if isinstance(value, float):
            return "" if value != value else f"{value:.3g}"
        return str(value)

    lines = ["| " + " | ".join(map(str, rows.columns)) + " |", "|" + "---|" * len(rows.columns)]
    lines += ["| " + " | ".join(map(cell, row)) + " |" for row in rows.itertuples(index=False)]
    return "\n".join(lines)


def put_in(page: Path, text: str, begin: str = BEGIN) -> None:
    """Write into a page, between its marks.

    Raises
    ------
    ValueError
        If it has no such marks.
    """
    before, _, rest = page.read_text(encoding="utf-8").partition(begin)
    _, found, after = rest.partition(END)
    if not found:
        raise ValueError(f"{page}: no {begin} ... {END} in it")
    whole = f"{before}{begin}\n\n{text}\n\n{END}{after}"
    write_whole(page, lambda p: p.write_text(whole, encoding="utf-8"))
