"""What the baseline says in short, for studies/benchmarks/results.py."""

from __future__ import annotations

import json
from pathlib import Path

import pandas as pd

from studies.benchmarks.pages import markdown

TITLE = "Kernels, and what a user waits for"


def text(folder: Path) -> str:
    """Return time by time what the baseline holds."""
    kept = json.loads((folder / "baseline.json").read_text(encoding="utf-8"))
    parts = [
        "Time of the processor, the shortest of some; over a yardstick of the same run, which is what the gate "
        "compares."
    ]
    for one in kept["processors"].values():
        rows = [
            {"what": name, "time": case["time"], "unit": case["unit"], "over its yardstick": case["ratio"]}
            for name, case in one["cases"].items()
        ]
        parts.append(f"{one['machine']}:\n\n{markdown(pd.DataFrame(rows))}")
    return "\n\n".join(parts)


def minutes(folder: Path) -> float:
    """Return what it takes: the baseline does not hold that."""
    return float("nan")
