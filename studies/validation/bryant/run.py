"""Bryant (1993): where each observation of the full-scale test lies among walls with the test's unknowns.

    python studies/validation/bryant/run.py --samples 64 --workers 2

takes a few minutes, goes on where it was stopped, and writes the table of the README.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parent), str(HERE.parents[1] / "bryant_1993")]

from cases import bent_before, further, on_jacks, read_case, results_of_the_test  # noqa: E402
from judging import case_main, judged, run_study  # noqa: E402

from damagepred.arrays import FloatArray  # noqa: E402
from damagepred.campaign.settings import StudySettings  # noqa: E402
from damagepred.inputs.input_files import read_toml  # noqa: E402

INCREMENTS = 32


def settings(name: str) -> StudySettings:
    """Return the study of a wall of the test on jacks, to the test's deflection."""
    case = read_case(name)
    scene = further(on_jacks(case.scene, bent_before(1e3)))
    scene = replace(scene, movement=replace(scene.movement, increments=INCREMENTS))
    return StudySettings.from_dict({**read_toml(HERE / "unknowns.toml"), "scene": scene.to_dict()})


def falls_to_nothing(deflection: FloatArray, load: FloatArray) -> FloatArray:
    """Return the deflection (mm) at which each wall's load, the first of it beside the dead load, falls to nothing."""
    found = []
    for x, y in zip(deflection, load):
        below = np.flatnonzero((y[1:] <= 0.0) & (y[:-1] > 0.0))
        if not below.size:
            found.append(float(np.nanmax(x)))
            continue
        i = below[0]
        found.append(float(x[i] + (x[i + 1] - x[i]) * y[i] / (y[i] - y[i + 1])))
    return 1e3 * np.array(found)


def run(folder: Path, samples: int, workers: int) -> tuple[list[dict[str, Any]], str]:
    """Run the walls of the test; return the rows of the table, and what else the page says."""
    test = results_of_the_test()
    ds = {name: run_study(settings(name), folder / f"{name}.dp", samples, workers) for name in test if name in WALLS}
    length = 6.0
    dishing, doming, window = (ds[name] for name in WALLS)
    closed = 0.5 * (length - dishing["dpc_separation_length"].values[:, -1])
    rows = [
        judged(
            "dishing: deflection at which jacks carry nothing",
            "mm",
            falls_to_nothing(dishing["central_deflection"].values, dishing["jack_load"].values),
            np.array([1e3 * test["dishing"]["central_deflection"]]),
        ),
        judged(
            "dishing: dpc closed at each end",
            "mm",
            1e3 * closed,
            np.array([1e3 * test["dishing"]["dpc_closed_length_at_ends"]]),
        ),
        judged(
            "doming: opening of the dpc at the ends",
            "mm",
            1e3 * doming["dpc_opening_max"].values[:, -1],
            1e3 * np.array(test["doming"]["dpc_opening_at_ends"]),
        ),
        judged(
            "window, dishing: change of its width",
            "mm",
            1e3 * window["opening_width_change"].values[:, -1, 0],
            np.array([1e3 * test["window_dishing"]["opening_width_change"]]),
        ),
    ]
    uncracked = [float((d["crack_width_max"].values[:, -1] < 1e-4).mean()) for d in (dishing, doming)]
    more = (
        f"No crack above the dpc was seen in either solid wall; {100 * uncracked[0]:.0f} % of the walls in dishing and "
        f"{100 * uncracked[1]:.0f} % in doming have none wider than 0.1 mm."
    )
    return rows, more


WALLS = ("dishing", "doming", "window_dishing")

if __name__ == "__main__":
    case_main(HERE, 64, run)
