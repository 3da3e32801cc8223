"""Summary of this benchmark for RESULTS.md."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
from page import medians, told
from pages import markdown
from skips import NOT_TURNED_OFF, SKIPS

from studies import PARTS

TITLE = "Time saved and differences made by skipped computations"
ROUNDS = 3
"""Default of run.py."""


def text(folder: Path) -> str:
    """Return for each skip and wall the ratio of times and the differences; and the unmeasured skips."""
    found = medians(pd.read_csv(folder / "data.csv"))
    lines, unmeasured = [], []
    for skip in (*SKIPS, *PARTS):
        own, (what, _) = found[found["skip"] == skip], told(skip)
        if own.empty:
            unmeasured.append(f"{what} ({skip})")
            continue
        changes = own[["upwards", "sideways"]].max(axis=1)
        lines.append(
            {
                "skip": skip,
                "skipped": what,
                "times as fast, or as small": "; ".join(f"{r['wall']} {r['ratio']:.2f}" for _, r in own.iterrows()),
                "saved of the time, or size": "; ".join(f"{1 - 1 / r['ratio']:.0%}" for _, r in own.iterrows()),
                "displacements differ by, over the movement": "; ".join(
                    "" if v != v else f"{v:.0e}" if v else "0" for v in changes
                ).strip("; "),
                "contacts cracked otherwise": "; ".join("" if v != v else f"{v:.0f}" for v in own["otherwise"]).strip(
                    "; "
                ),
            }
        )
    parts = [
        f"Runs with and without alternate, {found['rounds'].min()} to {found['rounds'].max()} times each; walls are in "
        "the same order in each column.",
        markdown(pd.DataFrame(lines)),
    ]
    if unmeasured:
        parts += ["Not measured yet:", "\n".join(f"- {line}" for line in unmeasured)]
    return "\n\n".join(
        (*parts, "Not turned off there:", "\n".join(f"- {what}: {why}" for what, why in NOT_TURNED_OFF.items()))
    )


def minutes(folder: Path) -> float:
    """Return the minutes of the default number of rounds."""
    rows = pd.read_csv(folder / "data.csv")
    both = rows.reindex(columns=["seconds_on", "seconds_off"]).sum(axis=1)
    return float(both.sum() / rows["round"].max()) * ROUNDS / 60
