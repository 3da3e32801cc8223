"""The one way to run the cases of a benchmark: each in a process with a time limit, each a row of a file when it ends.

A case is a tuple, its key; the columns of the key name it in the file. Rows that are there are not measured again, so
the same call resumes an interrupted one. Every row has the version of the package and the date of its measurement.
"""

from __future__ import annotations

import argparse
import multiprocessing
import sys
import tempfile
import time
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import TimeoutError as TooLateError
from contextlib import ExitStack
from datetime import UTC, datetime
from numbers import Number
from pathlib import Path
from typing import Any

import pandas as pd
from pebble import ProcessExpired, ProcessPool

from damagepred.archive.files import write_whole
from studies.pages import version

Key = tuple[Any, ...]
Row = dict[str, Any]
TOLD = ("seconds", "seconds_on", "status", "end", "message")
"""Columns of which the first that a case has is printed."""


def options(
    doc: str | None, script: str, names: Iterable[str], limit: float, arguments: Sequence[str] | None = None
) -> argparse.Namespace:
    """Read the command line of a benchmark: ``only``, ``limit``, ``quick`` and ``output``.

    The small form writes into a temporary folder where no other is given: it never changes the data.
    """
    parser = argparse.ArgumentParser(description=doc, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="+", choices=sorted(names), metavar="NAME", help=f"of {', '.join(names)}")
    parser.add_argument("--limit", type=float, default=limit, help=f"time of a case ({limit:g} s)")
    parser.add_argument("--quick", action="store_true", help="a few small cases, to see that it runs")
    parser.add_argument("--output", type=Path, help="folder of the data")
    found = parser.parse_args(arguments)
    if found.output is None:
        found.output = Path(tempfile.mkdtemp()) if found.quick else Path(script).resolve().parent
    found.output.mkdir(parents=True, exist_ok=True)
    return found


def read(file: Path) -> pd.DataFrame:
    """Return the rows of a file as far as they are measured; empty cells are NaN."""
    return pd.read_csv(file, low_memory=False) if file.exists() else pd.DataFrame()


def write(rows: Sequence[Row], file: Path, digits: int = 5) -> None:
    """Write rows at once or not at all: an interruption loses no earlier row."""
    table = pd.DataFrame(rows)
    write_whole(file, lambda path: table.to_csv(path, index=False, float_format=f"%.{digits}g", lineterminator="\n"))


def keys_in(file: Path, columns: Sequence[str]) -> set[tuple[str, ...]]:
    """Return the keys of the rows of a file, as text."""
    return {tuple(_cell(row[name]) for name in columns) for row in read(file).to_dict("records")}


def _cell(value: Any) -> str:
    """Return a value of a key as a file has it, whether as a number or as text."""
    return f"{value:g}" if isinstance(value, Number) else str(value)


def run(
    keys: Sequence[Key],
    columns: Sequence[str],
    work: Callable[..., Row],
    lost: Callable[[Key, str], Row],
    file: Path,
    limit: float,
    *,
    processes: int = 1,
    fresh_process: bool = False,
    leave_out: Callable[[Key, list[Row]], Row | None] | None = None,
    digits: int = 5,
    every: int = 1,
    before: Callable[[], object] | None = None,
) -> None:
    """Measure cases that are not in a file: ``work`` gives the row of a key, ``lost`` that of a case that died or hung.

    Each case has ``limit`` seconds by the clock. ``processes``: cases at a time, 1 where times are the result;
    ``fresh_process``: a new process per case, where memory is the result; ``leave_out``: row of a case that is not run,
    by key and earlier rows; ``every``: cases per line of progress; ``before``: compiles before processes are forked.
    """
    rows, known = read(file).to_dict("records"), keys_in(file, columns)
    todo = [key for key in keys if tuple(map(_cell, key)) not in known]
    if todo and before is not None:
        before()
    waiting: deque[tuple[Key, Any]] = deque()
    mark, began, done = {"version": version(), "date": f"{datetime.now(UTC):%Y-%m-%d}"}, time.perf_counter(), 0

    def take(key: Key, found: Row) -> None:
        nonlocal done
        done += 1
        rows.append({**dict(zip(columns, key, strict=True)), **found, **mark})
        write(rows, file, digits)
        if done % every == 0 or done == len(todo):
            spent = time.perf_counter() - began
            left = f"{spent / done * (len(todo) - done):.0f} s left" if done < len(todo) else "complete"
            result = next((found[name] for name in TOLD if name in found), "")
            told = f"{', '.join(map(str, key))}: {f'{result:.3g} s' if isinstance(result, float) else result}"
            print(f"{done} of {len(todo)}, {spent:.0f} s, {left}; {told}", file=sys.stderr, flush=True)

    def finish() -> None:
        key, future = waiting.popleft()
        try:
            found = future.result()
        except TooLateError:
            found = lost(key, f"took longer than {limit:g} s")
        except ProcessExpired as error:
            found = lost(key, f"the process died: {error}")
        take(key, found)

    context = multiprocessing.get_context("fork")
    with (
        ProcessPool(max_workers=processes, max_tasks=int(fresh_process), context=context) as pool,
        ExitStack() as at_end,
    ):
        at_end.callback(pool.stop)  # when interrupted: otherwise the pool waits for all submitted cases
        for key in todo:
            left = None if leave_out is None else leave_out(key, rows)
            if left is not None:
                take(key, left)
                continue
            waiting.append((key, pool.schedule(work, args=list(key), timeout=limit)))
            if leave_out is not None and len(waiting) >= processes:
                finish()
        while waiting:
            finish()
