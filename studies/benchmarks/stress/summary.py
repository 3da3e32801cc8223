"""Summary of this benchmark for RESULTS.md."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
from pages import markdown
from stressed import page
from stressed.case import VERDICTS, WAYS

TITLE = "Robustness of the solvers"


def text(folder: Path) -> str:
    """Return counts by verdict and solver, and the wrong and failed runs with their messages."""
    rows = page.read(folder / "cases.csv")
    counts = pd.crosstab(rows["verdict"], rows["way"]).reindex(index=VERDICTS, columns=WAYS, fill_value=0)
    counts["all"] = counts.sum(axis=1)
    counts.index = [page.WORDS[v] for v in VERDICTS]
    table = counts[counts["all"] > 0].rename_axis("verdict").reset_index()
    return "\n\n".join(
        (
            page.in_a_word(rows),
            markdown(table),
            "Wrong:",
            page.listed(rows, "WRONG"),
            "Failed:",
            page.listed(rows, "FAILED"),
        )
    )


def minutes(folder: Path) -> float:
    """Return the minutes that the runs took."""
    return float(page.read(folder / "cases.csv")["seconds"].sum()) / 60
