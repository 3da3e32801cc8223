"""Section of this benchmark on RESULTS.md."""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from studies.benchmarks.pages import markdown
from studies.benchmarks.workers.model import costs_of, expected, predicted

TITLE = "Time of large studies by number of workers"


def text(folder: Path) -> str:
    """Return hours of large studies, and the ratio of measured times to the model."""
    measured, checked = pd.read_csv(folder / "parts.csv"), pd.read_csv(folder / "runs.csv")
    over = [
        row.seconds / predicted(costs_of(measured, row.wall), row.walls, row.workers).total
        for row in checked.itertuples()
    ]
    walls = ", ".join(f"{row['wall of']} {1e3 * row['wall']:.3g} ms" for _, row in measured.iterrows())
    return "\n\n".join(
        (
            f"Hours, by a model of measured parts (a wall takes one worker: {walls}):",
            markdown(expected(measured)),
            f"{len(checked)} runs, to which the model is not fitted, took {min(over):.2g} to {max(over):.2g} "
            "times the "
            f"predicted time, at load averages of {checked['load'].min():.1f} to {checked['load'].max():.1f}.",
        )
    )
