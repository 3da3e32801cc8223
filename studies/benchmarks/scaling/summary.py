"""Summary of this benchmark for RESULTS.md."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
from page import exponents, left_out, medians
from pages import markdown

TITLE = "Growth of time and memory with the size of walls and studies"


def text(folder: Path) -> str:
    """Return the exponents of time and memory, and the cases that were not solved."""
    rows = pd.read_csv(folder / "data.csv")
    missing = left_out(rows)
    return "\n\n".join(
        (
            "Exponents p: time, steps and memory grow as size^p:",
            markdown(exponents(medians(rows)).drop(columns=["time of a step"])),
            "Not solved:",
            "\n".join(missing) if missing else "- none of those tried",
        )
    )


def minutes(folder: Path) -> float:
    """Return the minutes of all cases."""
    return float(pd.read_csv(folder / "data.csv")["clock"].sum()) / 60
