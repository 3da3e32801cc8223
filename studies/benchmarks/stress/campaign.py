"""Run cases, each in a process that may die or hang without harm; finished cases are stored and not repeated."""

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

from studies.benchmarks.stress.case import WAYS
from studies.benchmarks.stress.families import all_cases
from studies.benchmarks.stress.judging import judge

Job = tuple[str, str, str]
J = TypeVar("J")
COLUMNS = ("family", "case", "way", "verdict", "by", "off", "seconds", "message")


def jobs(families: Iterable[str] = (), ways: Iterable[str] = ()) -> list[Job]:
    """Return the jobs: family, case and way of each."""
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
    """Compile all kernels, before workers are forked and times are taken."""
    with np.errstate(all="ignore"):
        for way in WAYS:
            one(("proportion", "in proportion", way))
            one(("strengths", "f_t = C = 10000 Pa, mu = 0.5", way))
            one(("strengths", "both bonds wear", way))


def done_in(file: Path) -> list[dict[str, Any]]:
    """Return the stored rows."""
    if not file.exists():
        return []
    with file.open(newline="", encoding="utf-8") as stream:
        return [dict(row) for row in csv.DictReader(stream)]


def run(wanted: list[Job], file: Path, limit: float, processes: int = 1) -> None:
    """Run the jobs that are not in a file, and add their rows.

    Parameters
    ----------
    wanted : list of tuple
        Jobs.
    file : Path
        File of the rows, one for each job.
    limit : float
        Wall-clock limit of a job (s), after which it counts as failed.
    processes : int
        Number of processes.
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
        Job and end of its process -> the row of a job that hung or died.
    written : callable
        Row -> the values that are written.
    file : Path
        Where rows are added.
    columns : sequence of str
        Names of the columns.
    limit : float
        Wall-clock limit of a job (s).
    processes : int
        Number of processes.
    """
    begun, new = time.perf_counter(), not file.exists()
    with (
        file.open("a", newline="", encoding="utf-8") as stream,
        ProcessPool(max_workers=processes) as pool,
        ExitStack() as at_once,
    ):
        at_once.callback(pool.stop)  # when interrupted: otherwise the pool waits for all submitted jobs
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
