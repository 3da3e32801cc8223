"""Section of this benchmark on RESULTS.md."""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from studies.benchmarks.skips.run import PARTS, SKIPS
from studies.pages import markdown

TITLE = "Time saved and differences made by skipped computations"
CHANGES = ["upwards", "sideways", "otherwise"]
"""Differences of which the largest of all rounds counts."""


def medians(rows: pd.DataFrame) -> pd.DataFrame:
    """Return a row for each skip and wall: rounds, median ratio of times, largest differences."""
    cases = rows.assign(ratio=rows["seconds_off"] / rows["seconds_on"]).groupby(["skip", "wall"], sort=False)
    found = cases[CHANGES].max().assign(ratio=cases["ratio"].median(), rounds=cases.size()).reset_index()
    order = [*SKIPS, *PARTS]
    return found.sort_values("skip", key=lambda s: s.map(order.index), kind="stable")


def headline(folder: Path) -> str:
    """Return the skips that save most, in a sentence."""
    best = medians(pd.read_csv(folder / "data.csv")).query("skip in @SKIPS.keys()").nlargest(3, "ratio")
    return "most is saved by " + "; ".join(f"{r.skip}: {r.ratio:.2g} times ({r.wall})" for r in best.itertuples())


def text(folder: Path) -> str:
    """Return for each skip and wall the ratio of times and the differences; and the unmeasured skips."""
    found = medians(pd.read_csv(folder / "data.csv"))
    known = {name: skip["what"] for name, skip in SKIPS.items()} | {name: part[0] for name, part in PARTS.items()}

    def joined(values: pd.Series, form: str) -> str:
        return "; ".join("" if v != v else format(v, form) if v else "0" for v in values).strip("; ")

    lines = [
        {
            "skip": name,
            "skipped": known[str(name)],
            "times as fast": "; ".join(f"{r.wall} {r.ratio:.2f}" for r in own.itertuples()),
            "displacements differ by, over the movement": joined(own[["upwards", "sideways"]].max(axis=1), ".0e"),
            "contacts cracked otherwise": joined(own["otherwise"], ".0f"),
        }
        for name, own in found.groupby("skip", sort=False)
    ]
    parts = [
        f"Runs with and without alternate, {found['rounds'].min()} to {found['rounds'].max()} times each; walls are in "
        "the same order in each column.",
        markdown(pd.DataFrame(lines)),
    ]
    missing = [f"- {what} ({name})" for name, what in known.items() if name not in set(found["skip"])]
    return "\n\n".join(parts + (["Not measured yet:", "\n".join(missing)] if missing else []))
