"""Summary of the baseline, for studies/benchmarks/run.py."""

from __future__ import annotations

import json
from pathlib import Path

import pandas as pd

from studies.pages import markdown

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


def headline(folder: Path) -> str:
    """Return the time of a path, in a sentence."""
    kept = json.loads((folder / "baseline.json").read_text(encoding="utf-8"))["processors"]
    cases = [one["cases"]["path"] for one in kept.values()]
    paths = [f"{case['time']:.3g} {case['unit']}" for case in cases]
    return "a path of the full-scale wall takes " + ", ".join(paths) + ", by machine"
