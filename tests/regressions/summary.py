"""Summary of the baseline, for studies/benchmarks/results.py."""

from __future__ import annotations

import json
from pathlib import Path

import pandas as pd

from studies.benchmarks.pages import markdown

TITLE = "Kernels, and commands of a user"


def text(folder: Path) -> str:
    """Return the times of the baseline."""
    kept = json.loads((folder / "baseline.json").read_text(encoding="utf-8"))
    parts = ["Processor time, the shortest of several; the gate compares its ratio to a yardstick of the same run."]
    for one in kept["processors"].values():
        rows = [
            {"what": name, "time": case["time"], "unit": case["unit"], "over its yardstick": case["ratio"]}
            for name, case in one["cases"].items()
        ]
        parts.append(f"{one['machine']}:\n\n{markdown(pd.DataFrame(rows))}")
    return "\n\n".join(parts)


def minutes(folder: Path) -> float:
    """Return NaN: the baseline does not contain the minutes."""
    return float("nan")
