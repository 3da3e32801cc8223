"""The page of the audit: counts, violations by check, and remaining cases, from the stored rows."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np
import pandas as pd

from audited.campaign import METHODS
from audited.tolerances import Tolerances
from studies.benchmarks.pages import markdown

OUTCOMES = ("solved", "limit", "collapsed, confirmed", "collapsed", "gave up", "time", "traceback", "died")
"""Outcomes of a run; the page explains them."""
GOOD = ("solved", "limit", "collapsed, confirmed")
LISTED = 40
"""Most cases of a kind that the page lists."""


def read(file: Path) -> pd.DataFrame:
    """Return the stored rows, with collapses marked that the other solver or statics confirm."""
    rows = pd.read_csv(file, keep_default_na=False, na_values={"collapse_progress": ["", "nan"]})
    for name in ("seconds", "seconds_of_checks", "blocks", "increments", "progress", "crack_width", "energy_error"):
        rows[name] = pd.to_numeric(rows[name], errors="coerce")
    within = Tolerances().confirmed_within
    at = {(r.seed, r.scene, r.solver): r.collapse_progress for r in rows.itertuples() if r.outcome == "collapsed"}
    confirmed = []
    for row in rows.itertuples():
        if row.outcome != "collapsed":
            confirmed.append(row.outcome)
            continue
        other = at.get((row.seed, row.scene, METHODS[1 - METHODS.index(row.solver)]), np.inf)
        near = abs(np.nan_to_num(other) - np.nan_to_num(row.collapse_progress)) <= within
        must = str(row.must_collapse) in ("True", "lifted")
        confirmed.append("collapsed, confirmed" if must or near else "collapsed")
    return rows.assign(outcome=confirmed)


def counts(rows: pd.DataFrame) -> pd.DataFrame:
    """Return the number of runs by outcome and solver."""
    table = pd.crosstab(rows["outcome"], rows["solver"]).reindex(index=OUTCOMES, columns=METHODS, fill_value=0)
    return table[table.sum(axis=1) > 0].rename_axis("outcome").reset_index()


def by_check(rows: pd.DataFrame) -> pd.DataFrame:
    """Return the number of runs by violated check and solver, silent and stated."""
    found = [
        {"check": name, "said": kind, "solver": row.solver}
        for row in rows.itertuples()
        for kind in ("silent", "stated")
        for name in split(getattr(row, kind))
    ]
    if not found:
        return pd.DataFrame({"check": ["none"], "said": [""], **{m: [0] for m in METHODS}})
    table = pd.DataFrame(found)
    wide = pd.crosstab([table["said"], table["check"]], table["solver"]).reindex(columns=METHODS, fill_value=0)
    return wide.reset_index()


def split(names: object) -> list[str]:
    """Return the names in a cell."""
    return [name for name in str(names).split("; ") if name and name != "nan"]


def feature_counts(rows: pd.DataFrame) -> pd.DataFrame:
    """Return the number of scenes of each feature, and of those with cracks, collapses and violations."""
    own = rows[rows["solver"] == rows["solver"].iloc[0]]
    names = sorted({name for cell in own["features"] for name in split(cell)})
    table = []
    for name in names:
        there = own[[name in split(cell) for cell in own["features"]]]
        table.append(
            {
                "feature": name,
                "scenes": len(there),
                "crack of 0.1 mm or more": int((there["crack_width"] >= 1e-4).sum()),
                "collapsed": int(there["outcome"].str.startswith("collapsed").sum()),
                "silent violation": int((there["silent"] != "").sum()),
            }
        )
    return pd.DataFrame(table)


def costs(rows: pd.DataFrame) -> pd.DataFrame:
    """Return processor seconds by solver, with the checks."""
    table = []
    for method in METHODS:
        own = rows[rows["solver"] == method]
        if len(own):
            seconds = own["seconds"] + own["seconds_of_checks"].fillna(0.0)
            table.append(
                {
                    "solver": method,
                    "runs": len(own),
                    "mean (s)": seconds.mean(),
                    "median (s)": seconds.median(),
                    "longest (s)": seconds.max(),
                    "in all (min)": seconds.sum() / 60,
                }
            )
    return pd.DataFrame(table)


def in_a_word(rows: pd.DataFrame) -> str:
    """Return the counts in a sentence."""
    scenes = len(rows[["seed", "scene"]].drop_duplicates())
    parts = []
    for method in METHODS:
        own = rows[rows["solver"] == method]
        if len(own):
            share = own["outcome"].isin(GOOD).mean()
            silent = int((own["silent"] != "").sum())
            parts.append(f"{method}: {share:.2%} solved or rightly collapsed, {silent} runs with a silent violation")
    return f"{scenes} scenes. " + "; ".join(parts) + "."


def listed(rows: pd.DataFrame) -> str:
    """Return runs as a list, with their messages."""
    lines = [f"- scene {r.scene} of seed {r.seed}, {r.solver}: {r.words}" for r in rows.head(LISTED).itertuples()]
    more = len(rows) - LISTED
    return "\n".join([*lines, *([f"- and {more} more"] if more > 0 else [])]) or "- none"


def text(rows: pd.DataFrame) -> str:
    """Return all tables of the page."""
    silent = rows[rows["silent"] != ""]
    parts = [
        in_a_word(rows),
        markdown(counts(rows)),
        "### Violations by check, in runs",
        markdown(by_check(rows)),
        "### Silent violations",
        listed(silent),
    ]
    for outcome in OUTCOMES:
        if outcome not in GOOD:
            parts += [f"### Outcome: {outcome}", listed(rows[rows["outcome"] == outcome])]
    parts += ["### Features of the scenes", markdown(feature_counts(rows)), "### Cost", markdown(costs(rows))]
    return "\n\n".join(_without_empty(parts))


def _without_empty(parts: Iterable[str]) -> list[str]:
    return [part for part in parts if part]
