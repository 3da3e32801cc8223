"""What this room says in short."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
from page import exponents, left_out, medians
from pages import markdown

TITLE = "What larger walls and studies cost"


def text(folder: Path) -> str:
    """Return the exponents of time and memory, and what was not solved."""
    rows = pd.read_csv(folder / "data.csv")
    missing = left_out(rows)
    return "\n\n".join(
        (
            "Time, steps and memory grow as what grows to the power of:",
            markdown(exponents(medians(rows)).drop(columns=["time of a step"])),
            "Not solved:",
            "\n".join(missing) if missing else "- none of those tried",
        )
    )


def minutes(folder: Path) -> float:
    """Return what the processes of all cases took."""
    return float(pd.read_csv(folder / "data.csv")["clock"].sum()) / 60
