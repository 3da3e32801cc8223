"""Section of this benchmark on RESULTS.md."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from studies.benchmarks.pages import markdown
from studies.benchmarks.skips.skips import NOT_TURNED_OFF, SKIPS
from studies.benchmarks.skips.study_skips import PARTS

TITLE = "Time saved and differences made by skipped computations"
CHANGES = ["upwards", "sideways", "otherwise"]
"""Differences of which the largest of all rounds counts."""


def medians(rows: pd.DataFrame) -> pd.DataFrame:
    """Return a row for each skip and wall: rounds, median ratio of time or size, largest differences."""
    rows = rows.reindex(columns=["skip", "wall", "seconds_on", "seconds_off", "bytes_on", "bytes_off", *CHANGES])
    sizes, times = rows["bytes_off"] / rows["bytes_on"], rows["seconds_off"] / rows["seconds_on"]
    cases = rows.assign(ratio=np.where(times.isna(), sizes, times)).groupby(["skip", "wall"], sort=False)
    found = cases[CHANGES].max().assign(ratio=cases["ratio"].median(), rounds=cases.size()).reset_index()
    order = {name: k for k, name in enumerate((*SKIPS, *PARTS))}
    return found.sort_values("skip", key=lambda s: s.map(order), kind="stable")


def text(folder: Path) -> str:
    """Return for each skip and wall the ratio of times and the differences; and the unmeasured skips."""
    found = medians(pd.read_csv(folder / "data.csv"))
    lines: list[dict[str, Any]] = []
    unmeasured = []
    for skip, one in {**SKIPS, **PARTS}.items():
        own = found[found["skip"] == skip]
        if own.empty:
            unmeasured.append(f"{one.what} ({skip})")
            continue
        changes = own[["upwards", "sideways"]].max(axis=1)
        lines.append(
            {
                "skip": skip,
                "skipped": one.what,
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
