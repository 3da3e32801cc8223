"""The full-scale test of Bryant (1993), case by case: solve, table, pictures, sensitivity.

    python studies/bryant_1993/run.py [dishing doming window_dishing window_doming] [--quick] [--output FOLDER]

Writes table.csv, sensitivity.csv, the tables of the page, and the pictures; of some cases the pictures alone.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import xarray as xr
from cases import HERE, NAMES, Case, further, on_jacks, read_case
from figures import draw_case, save, window_stress, window_width
from measures import at, stress_table
from sensitivity import unbreakable, write_sensitivity
from solving import solve, solve_case
from table import Row, markdown, rows, write_csv

from damagepred.plotting.pictures import stress_sheet
from damagepred.scene import Solver
from studies.pages import put_in

MARKS = "<!-- table -->", "<!-- end of table -->"
FINE = 0.075
"""Largest edge of the cells of deformable bricks (m): 16 zones a brick."""
EARLY, LATE = 1e-3, 6e-3
"""Deflections of the paper's Figure 8 (m)."""


def with_zones(case: Case, steps: int) -> xr.Dataset:
    """Solve a wall of deformable bricks on a footing of zones, its underside prescribed."""
    solver = Solver(blocks="deformable", zone_size=FINE, zone_size_footing=FINE, footing="deformable")
    movement = replace(case.scene.movement, increments=steps)
    return solve(replace(case.scene, solver=solver, movement=movement), f"{case.name}, bricks and footing of zones")


def run_case(name: str, zones: bool, folder: Path) -> list[Row]:
    """Solve one case and draw it; return the rows of its table."""
    case = read_case(name)
    solved = solve_case(case)
    place = folder / name
    place.mkdir(parents=True, exist_ok=True)
    extra = {}
    if case.has_window:
        whole_wall = solve(further(on_jacks(unbreakable(case.scene))), f"{name}, joints that do not break")
        extra["window_width.png"] = partial(window_width, solved, whole_wall)
    draw_case(solved, place, extra)
    if zones:
        draw_zones(case, place)
    return rows(solved)


def draw_zones(case: Case, place: Path) -> None:
    """Draw stresses in bricks of zones: solid wall in dishing (Figure 8), window in doming (Figure 10)."""
    if case.name == "dishing":
        ds = with_zones(case, 8)
        both = at(ds, EARLY), at(ds, LATE)
        save(stress_sheet(ds, [("stress_xx", increment) for increment in both]), place / "stress_xx.png")
        if place.parent == HERE:
            text = "\n".join(stress_table(ds, both))
            put_in(HERE / "README.md", text, "<!-- stresses -->", "<!-- end of stresses -->")
    if case.name == "window_doming":
        ds = with_zones(case, 14)
        broken = (ds["contact_state"].values == 1) & (ds["contact_kind"].values < 2)
        first = int(np.argmax(broken.any(axis=1)))
        save(window_stress(ds, (max(first - 1, 1), ds.sizes["increment"] - 1)), place / "window_stress.png")


def summary(found: list[Row]) -> list[str]:
    """Return the one table, case by case."""
    lines = []
    for name in dict.fromkeys(row.case for row in found):
        lines += [f"**{name.replace('_', ' ')}**", "", *markdown([r for r in found if r.case == name]), ""]
    return lines[:-1]


def main() -> None:
    """Run the cases of the command line; all cases also write tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cases", nargs="*", choices=[[], *NAMES], default=[], help="which; all if none is named")
    parser.add_argument("--quick", action="store_true", help="without the walls of zones, which take longest")
    parser.add_argument("--output", type=Path, default=HERE, help="folder of the pictures")
    options = parser.parse_args()
    chosen = tuple(options.cases) or NAMES
    found = [row for name in chosen for row in run_case(name, not options.quick, options.output)]
    print("\n".join(summary(found)))
    if chosen == NAMES and options.output == HERE:
        write_csv(found, HERE / "table.csv")
        put_in(HERE / "README.md", "\n".join(summary(found)), *MARKS)
        write_sensitivity()


if __name__ == "__main__":
    main()
