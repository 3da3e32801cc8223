"""The page: outcomes of all cases, counted and listed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from damagepred.plotting.sheet import legend_below, new_figure, text_size
from stressed.case import VERDICTS, WAYS

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
COLOURS = {
    "right": "#2b6a4d",
    "fell, rightly": "#7fb69a",
    "solved": "#4477aa",
    "fell": "#a8c4de",
    "refused": "#cccccc",
    "gave up": "#e0a030",
    "not tried": "#f0f0f0",
    "WRONG": "#b03030",
    "FAILED": "#000000",
}
SECOND = ("by", "right", "fell, rightly")


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


def summary(rows: pd.DataFrame) -> str:
    """Return the table of all families and solvers."""
    lines = ["| family | " + " | ".join(WAYS) + " |", "|---" * (len(WAYS) + 1) + "|"]
    for name, part in [*rows.groupby("family", sort=False), ("**all**", rows)]:
        cells = [cell(part.loc[part["way"] == way, "verdict"]) for way in WAYS]
        lines.append(f"| {name} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


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


def second_answers(rows: pd.DataFrame) -> str:
    """Return the table of second answers."""
    good = rows[rows["verdict"].isin(["right", "fell, rightly"])]
    lines = ["| second answer | runs | farthest from it |", "|---|---|---|"]
    for by, part in good.groupby("by"):
        off = part["off"].max()
        unit = " tolerances" if by == "statics" else ""
        lines.append(f"| {by} | {len(part)} | {'' if np.isnan(off) else f'{off:.1g}{unit}'} |")
    return "\n".join(lines)


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


def draw(rows: pd.DataFrame, ax: Axes | None = None) -> Axes:
    """Draw the outcomes of the cases of each solver."""
    ax = new_figure(8.0, 3.6).add_subplot() if ax is None else ax
    tried = rows[rows["verdict"] != "not tried"]
    left = np.zeros(len(WAYS))
    for verdict in (v for v in VERDICTS if v in set(tried["verdict"])):
        share = np.array([(tried.loc[tried["way"] == way, "verdict"] == verdict).mean() for way in WAYS])
        ax.barh(
            WAYS, 100 * np.nan_to_num(share), left=100 * left, color=COLOURS[verdict], label=WORDS[verdict].strip("*")
        )
        left += np.nan_to_num(share)
    ax.set_yticks(range(len(WAYS)), [way.replace("in time", "dynamic") for way in WAYS])
    ax.invert_yaxis()
    ax.set_xlabel("share of the runs (%)")
    ax.set_xlim(0, 100)
    legend_below(ax, ax.get_legend_handles_labels()[0], 4)
    ax.set_title("Outcomes by solver", fontsize=text_size(ax), loc="left")
    return ax
