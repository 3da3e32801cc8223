"""Section of this benchmark on RESULTS.md: outcomes of all cases, counted and listed."""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from studies.benchmarks.pages import markdown
from studies.benchmarks.stress.case import WAYS

TITLE = "Robustness of the solvers"
WORDS = {
    "right": "right",
    "fell, rightly": "collapsed, rightly",
    "solved": "solved",
    "fell": "collapsed",
    "refused": "refused",
    "gave up": "no convergence",
    "not tried": "not tried",
    "WRONG": "**wrong**",
    "FAILED": "**failed**",
}
"""Verdicts; the page explains them."""


def read(file: Path) -> pd.DataFrame:
    """Return the stored rows."""
    rows = pd.read_csv(file, keep_default_na=False)
    return rows.assign(**{name: pd.to_numeric(rows[name], errors="coerce") for name in ("off", "seconds")})


def in_a_word(rows: pd.DataFrame) -> str:
    """Return the results in one line."""
    count = rows["verdict"].value_counts()
    answered = rows["verdict"].isin(["right", "fell, rightly"]).sum()
    tried = (rows["verdict"] != "not tried").sum()
    longest = rows.loc[rows["seconds"].idxmax()]
    return (
        f"{tried} runs of {len(rows.drop_duplicates(['family', 'case']))} cases: "
        f"{', '.join(f'{count[v]} {word}' for v, word in WORDS.items() if v in count)}. "
        f"{answered / tried:.1%} were checked against a second answer and agree. They took "
        f"{rows['seconds'].sum() / 60:.0f} minutes of one core, the longest {longest['seconds']:.0f} s "
        f"({longest['family']}, {longest['case']}, {longest['way']})."
    )


def headline(folder: Path) -> str:
    """Return the number of wrong and failed runs, in a sentence."""
    count = read(folder / "cases.csv")["verdict"].value_counts()
    return f"of {count.sum()} runs {count.get('WRONG', 0)} are wrong, {count.get('FAILED', 0)} failed"


def listed(rows: pd.DataFrame, verdict: str) -> str:
    """Return the cases of one verdict, with their messages."""
    lines = [
        f"- {r.family}, {r.case}, {r.way}{f' (by {r.by})' if r.by else ''}: {r.message or 'no message'}"
        for r in rows[rows["verdict"] == verdict].itertuples()
    ]
    return "\n".join(lines or ["- none"])


def text(folder: Path) -> str:
    """Return counts by verdict and solver, the wrong and failed runs with their messages, and the time steps."""
    rows = read(folder / "cases.csv")
    counts = pd.crosstab(rows["verdict"], rows["way"]).reindex(index=list(WORDS), columns=WAYS, fill_value=0)
    counts = counts.assign(all=counts.sum(axis=1)).rename(index=WORDS).query("all > 0")
    steps = rows[rows["family"] == "time steps"]
    cells = steps["off"].map("{:.0e}".format).where(steps["verdict"] == "right", steps["verdict"].map(WORDS))
    wide = steps.assign(cell=cells).pivot_table(index="case", columns="way", values="cell", aggfunc="first", sort=False)
    parts = [in_a_word(rows), markdown(counts.rename_axis("verdict").reset_index())]
    parts += ["Wrong:", listed(rows, "WRONG"), "Failed:", listed(rows, "FAILED")]
    return "\n\n".join(
        [*parts, "Error over the largest displacement, by time step:", markdown(wide.fillna("").reset_index())]
    )
