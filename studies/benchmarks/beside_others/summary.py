"""Summary of this benchmark for RESULTS.md."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
from pages import markdown
from tables import RUNS_OF, compared, fastest

TITLE = "The same dry wall in other public solvers"


def text(folder: Path) -> str:
    """Return the time of other solvers to the same residual, over that of the quasi-static solver, by size."""
    runs = pd.read_csv(folder / "runs.csv")
    parts = [
        "How many times as long as the quasi-static solver, to the same largest unbalanced force (mean block "
        "weights); fastest of the settings tried; `>`: not reached within the time limit."
    ]
    for case, words in RUNS_OF:
        own = fastest(runs, case).query("solver == 'quasi_static'").sort_values("blocks")
        took = ", ".join(f"{1e3 * s:.3g} ms ({n} blocks)" for n, s in zip(own["blocks"], own["s at 0.0001"]))
        parts += [f"*{words[0].upper()}{words[1:]}*; quasi-static to 0.0001 in {took}.", markdown(compared(runs, case))]
    return "\n\n".join(parts)


def minutes(folder: Path) -> float:
    """Return the minutes of the runs; short ones are repeated for about half a second."""
    runs = pd.read_csv(folder / "runs.csv")
    return float(np.maximum(runs["seconds"].fillna(0.0), 1.0).sum()) / 60
