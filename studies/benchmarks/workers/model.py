"""Model of the time of a study by number of workers: start, serial work of the parent process, parallel work.

All figures are measurements of the parts (parts.csv); none is fitted to the runs that check the model.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import pandas as pd

from damagepred.study.campaign.dispatch import DispatchOptions


class Costs(NamedTuple):
    """Parts of the time of a study of one kind of wall (s, wall clock of an otherwise idle machine).

    Attributes
    ----------
    wall : float
        Of a worker for each wall: sampling, assembly, solution, judging and writing.
    start : float
        Once: program and first worker, until it takes its first wall.
    drawing : float
        Of the parent process for each wall at the start: sampling and the design file.
    parent : float
        Of the parent process for each wall: dispatch and recording.
    merging : float
        Of the parent process for each wall at the end: merging of parts into one file.
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
    """Predicted time of a study (s), and the efficiency of its workers.

    Attributes
    ----------
    total, once, solving, waiting, merging : float
        In all; before the first wall; while walls are solved; of that, for the last batches; at the end.
    efficiency : float
        Time of all walls over time of all workers.
    bound : bool
        Whether the parent process is the bottleneck.
    """

    total: float
    once: float
    solving: float
    waiting: float
    merging: float
    efficiency: float
    bound: bool


def batch_seconds(costs: Costs, samples: int) -> float:
    """Return the work in a batch (see ``damagepred.study.campaign.dispatch``)."""
    options = DispatchOptions()
    work = max(costs.wall * samples / options.most_parts, options.shortest_batch)
    return max(costs.wall, min(work, options.longest_batch))


def predicted(costs: Costs, samples: int, workers: int) -> Time:
    """Return the predicted times of a study.

    On average the last worker has half a batch more than the others.
    """
    work = samples * costs.wall / workers
    handing_out = samples * costs.parent
    waiting = 0.5 * min(batch_seconds(costs, samples), work) * (workers > 1)
    solving = max(work, handing_out) + waiting
    once, merging = costs.start + samples * costs.drawing, samples * costs.merging
    total = once + solving + merging
    return Time(total, once, solving, waiting, merging, samples * costs.wall / (workers * total), handing_out > work)


def most_workers(costs: Costs) -> float:
    """Return the number of workers from which the parent process is the bottleneck."""
    return costs.wall / costs.parent


def costs_of(table: pd.DataFrame, wall: str) -> Costs:
    """Return the measured parts of a wall's study."""
    return Costs(**table[table["wall of"] == wall].iloc[0][list(Costs._fields)])


def expected(measured: pd.DataFrame) -> pd.DataFrame:
    """Return the hours of large studies on few and on many workers."""
    rows = []
    for wall in measured["wall of"]:
        for samples in (100_000, 1_000_000):
            row: dict[str, Any] = {"study": wall, "walls": f"{samples:.0e}".replace("+0", "")}
            for workers in (2, 16, 128, 1024):
                row[f"{workers} workers"] = predicted(costs_of(measured, wall), samples, workers).total / 3600
            rows.append(row)
    return pd.DataFrame(rows).sort_values(["study", "walls"])
