"""Ramsgate: predicted damage of a terrace over a tunnel, and what was seen.

    python studies/validation/ramsgate/run.py --samples 16 --workers 2

takes some minutes, goes on where it was stopped, and writes the table of the README.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))

from judging import case_main, judged, run_study, settings_of  # noqa: E402


def run(folder: Path, samples: int, workers: int) -> tuple[list[dict[str, Any]], str]:
    """Run the terrace; return the row of the table, and what else the page says."""
    ds = run_study(settings_of(HERE / "front.toml"), folder / "front.dp", samples, workers)
    seen = pd.read_csv(HERE / "observed.csv").iloc[0]
    widest = 1e3 * ds["crack_width_max"].values[:, -1]
    middle = 0.5 * (seen.width_from_mm + seen.width_to_mm)
    low = float((ds["damage_category"].values[:, -1] <= seen.category).mean())
    more = (
        f"The median of the widest crack is {np.median(widest):.2f} mm; {seen.width_from_mm} to {seen.width_to_mm} mm "
        f"were seen. P(category at most {seen.category}) is {low:.2f}; category {seen.category} was seen."
    )
    return [judged("front wall: widest crack", "mm", widest, np.array([middle]))], more


if __name__ == "__main__":
    case_main(HERE, 16, run)
