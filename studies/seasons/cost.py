"""What a history of seasons costs, over one movement to its largest state.

    python studies/seasons/cost.py

takes a minute, and writes a table of the README.
"""

from __future__ import annotations

import argparse
import statistics
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import xarray as xr

from damagepred import Scene, solve
from damagepred.scene import Seasons

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "validation"))

from judging import write_page  # noqa: E402

WALL = HERE.parents[1] / "data" / "bryant_window_dishing.toml"
BEGIN, END = "<!-- written by cost.py -->", "<!-- end of cost -->"


def timed(scene: Scene) -> tuple[float, xr.Dataset]:
    """Return processor time of a wall (s), and its path."""
    began = time.process_time()
    path = solve(scene)
    return time.process_time() - began, path


def main() -> None:
    """Solve the wall of the test with a window under both movements in turn, and write the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--years", type=int, default=30)
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--no-page", action="store_true", help="print the table alone")
    asked = parser.parse_args()
    wall = Scene.from_toml(WALL)
    seasons = Seasons(years=asked.years, swing=8e-3)
    history = replace(wall, movement=replace(wall.movement, central_deflection=0.0, seasons=seasons))
    largest = history.movement.largest
    walls = {
        f"{asked.years} years": history,
        f"once to {1e3 * largest:.1f} mm": replace(wall, movement=replace(wall.movement, central_deflection=largest)),
        f"once to {1e3 * wall.movement.central_deflection:.1f} mm": wall,
    }
    solve(replace(wall, movement=replace(wall.movement, increments=1)))  # makes kernels ready
    found = [[timed(scene) for scene in walls.values()] for _ in range(asked.repeats)]
    rows = [
        (
            statistics.median(seconds for seconds, _ in runs),
            *(float(runs[0][1][name].sum()) for name in ("newton_iterations", "factorisations")),
        )
        for runs in zip(*found)
    ]
    lines = [
        "| movement | increments | Newton iterations | factorisations | processor time, s | "
        "years over it, iterations | years over it, time |",
        "|---|---|---|---|---|---|---|",
    ]
    for (name, scene), (seconds, newton, factorisations) in zip(walls.items(), rows):
        over = np.array(rows[0][:2]) / (seconds, newton)
        lines.append(
            f"| {name} | {scene.movement.increment_count} | {newton:.0f} | {factorisations:.0f} | {seconds:.2f} | "
            f"{over[1]:.1f} | {over[0]:.1f} |"
        )
    print("\n".join(lines))
    if not asked.no_page:
        write_page(HERE / "README.md", "\n".join(lines), (BEGIN, END))


if __name__ == "__main__":
    main()
