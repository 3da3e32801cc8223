"""Section of this benchmark on RESULTS.md: outcomes of all cases, counted and listed."""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from studies.benchmarks.pages import markdown
from studies.benchmarks.stress.case import VERDICTS, WAYS

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


def read(file: Path) -> pd.DataFrame:
    """Return the stored rows."""
    rows = pd.read_csv(file, keep_default_na=False)
    for name in ("off", "seconds"):
        rows[name] = pd.to_numeric(rows[name], errors="coerce")
    return rows


def cell(verdicts: pd.Series) -> str:
    """Return counts of some cases, in the order of ``VERDICTS``."""
    count = verdicts.value_counts()
    return ", ".join(f"{count[v]} {WORDS[v]}" for v in VERDICTS if v in count)


def in_a_word(rows: pd.DataFrame) -> str:
    """Return the results in one line."""
    answered = rows["verdict"].isin(["right", "fell, rightly"]).sum()
    tried = (rows["verdict"] != "not tried").sum()
    longest = rows.loc[rows["seconds"].idxmax()]
    return (
        f"{tried} runs of {len(rows.drop_duplicates(['family', 'case']))} cases: {cell(rows['verdict'])}. "
        f"{answered / tried:.1%} were checked against a second answer and agree. They took "
        f"{rows['seconds'].sum() / 60:.0f} minutes of one core, the longest {longest['seconds']:.0f} s "
        f"({longest['family']}, {longest['case']}, {longest['way']})."
    )


def headline(folder: Path) -> str:
    """Return the number of wrong and failed runs, in a sentence."""
    count = read(folder / "cases.csv")["verdict"].value_counts()
    return f"of {count.sum()} runs {count.get('WRONG', 0)} are wrong, {count.get('FAILED', 0)} failed"


def listed(rows: pd.DataFrame, verdict: str, most: int = 60) -> str:
    """Return the cases of one verdict, with their messages."""
    here = rows[rows["verdict"] == verdict]
    if here.empty:
        return "- none"
    lines = [
        f"- {r.family}, {r.case}, {r.way}{f' (by {r.by})' if r.by else ''}: {r.message or 'no message'}"
        for r in here.head(most).itertuples()
    ]
    if len(here) > most:
        lines.append(f"- and {len(here) - most} more, in cases.csv")
    return "\n".join(lines)


def text(folder: Path) -> str:
    """Return counts by verdict and solver, the wrong and failed runs with their messages, and the time steps."""
    rows = read(folder / "cases.csv")
    counts = pd.crosstab(rows["verdict"], rows["way"]).reindex(index=VERDICTS, columns=WAYS, fill_value=0)
    counts["all"] = counts.sum(axis=1)
    counts.index = [WORDS[v] for v in VERDICTS]
    parts = [in_a_word(rows), markdown(counts[counts["all"] > 0].rename_axis("verdict").reset_index())]
    parts += ["Wrong:", listed(rows, "WRONG"), "Failed:", listed(rows, "FAILED")]
    if (folder / "time_steps.csv").exists():
        steps = pd.read_csv(folder / "time_steps.csv")
        steps["cell"] = [r.verdict if r.verdict != "right" else f"{r.off:.0e}" for r in steps.itertuples()]
        wide = steps.pivot(index="share", columns="solver", values="cell")[steps["solver"].drop_duplicates()]
        wide = wide.reset_index().rename(columns={"share": "time step over the limit"})
        parts += ["Error over the largest displacement, by time step:", markdown(wide)]
        parts += ["A wall that cracks, far away and at other time steps:"]
        parts += [markdown(pd.read_csv(folder / "cracking.csv").astype(object).fillna(""))]
    return "\n\n".join(parts)
