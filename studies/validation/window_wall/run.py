"""A clay wall with a window, pushed as a cantilever: its largest load, and the displacement at which it cracks as seen.

    python studies/validation/window_wall/run.py --samples 8 --workers 2

takes two minutes, goes on where it was stopped, and writes the table of the README.
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

BACK = {"stage": [{"load_factor": -1.0, "increments": 12}]}
"""Push to the left."""


def run(folder: Path, samples: int, workers: int) -> tuple[list[dict[str, Any]], str]:
    """Run the wall; return the row of the table, and what else the page says."""
    ds = run_study(settings_of(HERE / "wall.toml"), folder / "wall.dp", samples, workers)
    back = run_study(settings_of(HERE / "wall.toml", scene__movement=BACK), folder / "back.dp", samples, workers)
    seen = pd.read_csv(HERE / "observed.csv")
    force, crack = (seen.loc[seen.quantity == name, "value"].values for name in ("force", "crack"))
    loads = [1e-3 * np.nanmax(np.abs(one["load_force"].values), axis=1) for one in (ds, back)]
    rows = [judged("largest load", "kN", 0.5 * (loads[0] + loads[1]), force)]
    moved, widest = 1e3 * ds["load_displacement"].values, 1e3 * ds["crack_width_max"].values
    reached = []
    for width in crack:
        first = [np.flatnonzero(one >= width) for one in widest]
        reached.append([x[at[0]] for x, at in zip(moved, first) if at.size])
    said = [
        f"{width:g} mm at {np.median(at):.2f} mm ({len(at)} of {len(moved)} walls)"
        for width, at in zip(crack, reached)
        if at
    ]
    ways = " and ".join(
        f"{load.mean():.1f} kN to the {way}" for load, way in zip(loads, ("right", "left"), strict=True)
    )
    return (
        rows,
        f"The wall carries {ways}. The widest crack reaches, to the right, in the median: {', '.join(said)}.",
    )


if __name__ == "__main__":
    case_main(HERE, 8, run)
