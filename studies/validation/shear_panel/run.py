"""The shear panel J4D: its strength, as a distribution over the scatter of its joints.

    python studies/validation/shear_panel/run.py --samples 32 --workers 2

takes two minutes, goes on where it was stopped, and writes the table of the README.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))

from judging import case_main, judged, run_study, settings_of  # noqa: E402

PEAK = 50.0
"""Approximate strength in the test (kN)."""


def run(folder: Path, samples: int, workers: int) -> tuple[list[dict[str, Any]], str]:
    """Run the panel; return the row of the table."""
    ds = run_study(settings_of(HERE / "j4d.toml"), folder / "j4d.dp", samples, workers)
    return [judged("strength", "kN", 1e-3 * np.nanmax(ds["load_force"].values, axis=1), np.array([PEAK]))], ""


if __name__ == "__main__":
    case_main(HERE, 32, run)
