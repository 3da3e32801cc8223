"""A clamped shear wall of clay masonry: initial stiffness, and damage Psi at two drifts.

    python studies/validation/shear_wall/run.py --samples 24 --workers 2

takes some minutes, goes on where it was stopped, and writes the table of the README.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))

from judging import case_main, judged, run_study, settings_of  # noqa: E402

HEIGHT = 2.69
STIFFNESS = 110.4
"""In the test (kN/mm, reported)."""
PSI = {0.41e-3: 1.7, 0.68e-3: 2.6}
"""Drift -> Psi in the test (reported)."""


CYCLES = [
    {"load_factor": 0.41 / 0.68, "increments": 12},
    {"load_factor": -0.41 / 0.68, "increments": 12},
    {"load_factor": 1.0, "increments": 20},
    {"load_factor": -1.0, "increments": 20},
]
"""One two-way cycle at each drift."""
CYCLED_WALLS = 4
"""Walls in cycles, at most."""


def run(folder: Path, samples: int, workers: int) -> tuple[list[dict[str, Any]], str]:
    """Run the wall in one push and in cycles; return the rows of the table."""
    ds = run_study(settings_of(HERE / "wall.toml"), folder / "wall.dp", samples, workers)
    moved, load = ds["load_displacement"].values, ds["load_force"].values
    rows = [judged("initial stiffness", "kN/mm", 1e-6 * load[:, 1] / moved[:, 1], np.array([STIFFNESS]))]
    settings = settings_of(HERE / "wall.toml", scene__movement={"stage": CYCLES})
    cycled = run_study(settings, folder / "cycles.dp", min(samples, CYCLED_WALLS), workers)
    worst = np.fmax.accumulate(cycled["psi"].values, axis=1)
    ends = np.cumsum([stage["increments"] for stage in CYCLES])[1::2]
    for (drift, psi), end in zip(PSI.items(), ends, strict=True):
        pushed = np.array([np.interp(drift * HEIGHT, x, y) for x, y in zip(moved, ds["psi"].values)])
        rows.append(judged(f"Psi at a drift of {1e3 * drift:g} per mille", "1", pushed, np.array([psi])))
        rows.append(
            judged(f"Psi after a two-way cycle at {1e3 * drift:g} per mille", "1", worst[:, end], np.array([psi]))
        )
    return rows, f"The largest load is {1e-3 * np.nanmax(load, axis=1).mean():.0f} kN on average."


if __name__ == "__main__":
    case_main(HERE, 24, run)
