"""Model of the time of a study by number of workers: start, serial work of the parent process, parallel work.

All figures are measurements of the parts (parts.csv); none is fitted to the runs that it is checked with.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import pandas as pd

from damagepred.study.campaign.dispatch import LONGEST, PARTS, SHORTEST


class Costs(NamedTuple):
    """What a study of one kind of wall is made of (s, by the clock of a machine with nothing else to do).

    Attributes
    ----------
    wall : float
        Of a worker for each wall: drawn, assembled, solved, judged and written.
    start : float
        Once: program and first worker, until it takes its first wall.
    drawing : float
        Of one process for each wall before any is solved: its inputs, and the design file.
    parent : float
        Of one process for each wall while others solve: handing out and noting.
    merging : float
        Of one process for each wall at the end: parts put together into one file.
    bytes : float
        On disk for each wall, in all files.
    """

    wall: float
    start: float
    drawing: float
    parent: float
    merging: float
    bytes: float


class Time(NamedTuple):
    """How long a study takes (s), and what share of its workers' time they solve walls.

    Attributes
    ----------
    total, once, solving, waiting, merging : float
        In all; before the first wall; while walls are solved; of that, for the last batches; at the end.
    efficiency : float
        Time of all walls over time of all workers.
    bound : bool
        Whether the process that hands out and notes is what all wait for.
    """

    total: float
    once: float
    solving: float
    waiting: float
    merging: float
    efficiency: float
    bound: bool


def batch_seconds(costs: Costs, samples: int) -> float:
    """Return how much work is handed out at a time (see ``damagepred.study.campaign.dispatch``)."""
    return max(costs.wall, min(max(costs.wall * samples / PARTS, SHORTEST), LONGEST))


def predicted(costs: Costs, samples: int, workers: int) -> Time:
    """Return what a study takes.

    On average the last worker to come to its end has half a batch more than the others.
    """
    work = samples * costs.wall / workers
    handing_out = samples * costs.parent
    waiting = 0.5 * min(batch_seconds(costs, samples), work) * (workers > 1)
    solving = max(work, handing_out) + waiting
    once, merging = costs.start + samples * costs.drawing, samples * costs.merging
    total = once + solving + merging
    return Time(total, once, solving, waiting, merging, samples * costs.wall / (workers * total), handing_out > work)


def most_workers(costs: Costs) -> float:
    """Return from how many workers on the process that hands out is what all wait for."""
    return costs.wall / costs.parent


def costs_of(table: pd.DataFrame, wall: str) -> Costs:
    """Return what was measured of a wall's study."""
    return Costs(**table[table["wall of"] == wall].iloc[0][list(Costs._fields)])


def expected(measured: pd.DataFrame) -> list[dict[str, Any]]:
    """Return how long large studies take on few and on many workers, a row for each."""
    table = []
    for wall in measured["wall of"]:
        costs = costs_of(measured, wall)
        for samples in (100_000, 1_000_000):
            for workers in (2, 16, 128, 1024):
                found = predicted(costs, samples, workers)
                table.append(
                    {
                        "study": wall,
                        "walls": f"{samples:.0e}".replace("+0", ""),
                        "workers": workers,
                        "hours": found.total / 3600,
                        "of that before the first wall": f"{found.once / found.total:.0%}",
                        "merging": f"{found.merging / found.total:.0%}",
                        "efficiency": f"{found.efficiency:.0%}",
                        "GB": samples * costs.bytes / 1e9,
                        "waits for": "handing out" if found.bound else "walls",
                    }
                )
    return table
