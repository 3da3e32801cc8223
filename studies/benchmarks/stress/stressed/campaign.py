"""Run cases, each in a process that may die or hang without harm; what is done is kept, and not done again."""

from __future__ import annotations

import csv
import sys
import time
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import TimeoutError as TooLate
from contextlib import ExitStack
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from pebble import ProcessExpired, ProcessPool

from stressed.case import WAYS
from stressed.families import all_cases
from stressed.judging import judge

Job = tuple[str, str, str]
J = TypeVar("J")
COLUMNS = ("family", "case", "way", "verdict", "by", "off", "seconds", "message")


def jobs(families: Iterable[str] = (), ways: Iterable[str] = ()) -> list[Job]:
    """Return what there is to do: family, case and way of each."""
    wanted, asked = set(families), set(ways) or set(WAYS)
    return [
        (case.family, case.name, way)
        for case in all_cases().values()
        if not wanted or case.family in wanted
        for way in case.ways
        if way in asked
    ]


def one(job: Job) -> dict[str, Any]:
    """Do one job."""
    family, name, way = job
    return judge(all_cases()[family, name], way)


def warm_up() -> None:
    """Compile what there is to compile, before workers are born of this process and before time is taken."""
    with np.errstate(all="ignore"):
        for way in WAYS:
            one(("proportion", "in proportion", way))
            one(("strengths", "f_t = C = 10000 Pa, mu = 0.5", way))
            one(("strengths", "both bonds wear", way))


def done_in(file: Path) -> list[dict[str, Any]]:
    """Return rows that are kept."""
    if not file.exists():
        return []
    with file.open(newline="", encoding="utf-8") as stream:
        return [dict(row) for row in csv.DictReader(stream)]


def run(wanted: list[Job], file: Path, limit: float, processes: int = 1) -> None:
    """Run what is not yet in a file, and add it there.

    Parameters
    ----------
    wanted : list of tuple
        Jobs.
    file : Path
        Where rows are kept, one for each job.
    limit : float
        Seconds that one may take (by the clock) before it counts as failed.
    processes : int
        Side by side.
    """
    known = {(row["family"], row["case"], row["way"]) for row in done_in(file)}
    todo = [job for job in wanted if job not in known]
    if not todo:
        return
    warm_up()

    def lost(job: Job, message: str) -> dict[str, Any]:
        return dict(zip(COLUMNS, (*job, "FAILED", "", "nan", limit, message)))

    def written(row: dict[str, Any]) -> dict[str, Any]:
        if row["verdict"] in ("FAILED", "WRONG"):
            print(f"{' | '.join(row[name] for name in COLUMNS[:3])}: {row['verdict']} {row['message']}", flush=True)
        return row | {"off": f"{float(row['off']):.2g}", "seconds": f"{float(row['seconds']):.3g}"}

    in_processes(todo, one, lost, written, file, COLUMNS, limit, processes)


def in_processes(
    todo: Sequence[J],
    work: Callable[[J], dict[str, Any]],
    lost: Callable[[J, str], dict[str, Any]],
    written: Callable[[dict[str, Any]], dict[str, Any]],
    file: Path,
    columns: Sequence[str],
    limit: float,
    processes: int = 1,
) -> None:
    """Do jobs in processes that may hang or die, and add a row for each to a file as it is done.

    Parameters
    ----------
    todo : sequence
        Jobs.
    work : callable
        Job -> its row.
    lost : callable
        Job and what became of its process -> the row of one that hung or died.
    written : callable
        Row -> what is written of it.
    file : Path
        Where rows are added.
    columns : sequence of str
        Names of what a row holds.
    limit : float
        Seconds that a job may take by the clock.
    processes : int
        Side by side.
    """
    begun, new = time.perf_counter(), not file.exists()
    with (
        file.open("a", newline="", encoding="utf-8") as stream,
        ProcessPool(max_workers=processes) as pool,
        ExitStack() as at_once,
    ):
        at_once.callback(pool.stop)  # where it is interrupted: a pool that is left waits for all that was handed to it
        writer = csv.DictWriter(stream, fieldnames=columns, lineterminator="\n")
        if new:
            writer.writeheader()
        for number, (job, future) in enumerate([(j, pool.schedule(work, args=[j], timeout=limit)) for j in todo], 1):
            try:
                row = future.result()
            except TooLate:
                row = lost(job, f"took longer than {limit:g} s")
            except ProcessExpired as error:
                row = lost(job, f"the process died: {error}")
            writer.writerow(written(row))
            stream.flush()
            if number % 50 == 0 or number == len(todo):
                spent = time.perf_counter() - begun
                print(f"{number} of {len(todo)}, {spent:.0f} s", file=sys.stderr, flush=True)
