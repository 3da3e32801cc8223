"""The jobs of the campaign: every case by every solver that is asked for."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from studies.benchmarks import cases
from studies.benchmarks.stress.case import WAYS
from studies.benchmarks.stress.families import all_cases
from studies.benchmarks.stress.judging import judge

Job = tuple[str, str, str]
KEY = ("family", "case", "way")


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


def one(family: str, name: str, way: str) -> dict[str, Any]:
    """Do one job."""
    row = judge(all_cases()[family, name], way)
    if row["verdict"] in ("FAILED", "WRONG"):
        print(f"{family} | {name} | {way}: {row['verdict']} {row['message']}", flush=True)
    return row


def lost(_: tuple[Any, ...], message: str) -> dict[str, Any]:
    """Return the row of a job that hung or died."""
    return {"verdict": "FAILED", "by": "", "off": np.nan, "seconds": np.nan, "message": message}


def warm_up() -> None:
    """Compile all kernels, before workers are forked and times are taken."""
    with np.errstate(all="ignore"):
        for way in WAYS:
            one("proportion", "in proportion", way)
            one("strengths", "f_t = C = 10000 Pa, mu = 0.5", way)
            one("strengths", "both bonds wear", way)


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
    known = cases.keys_in(file, KEY)
    if set(wanted) <= known:
        return
    warm_up()
    cases.run(wanted, KEY, one, lost, file, limit, processes=processes, digits=3, each=False)
