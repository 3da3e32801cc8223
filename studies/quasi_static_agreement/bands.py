"""Widest joint and crack band of one wall by several solvers, and with the cohesion kept or lost after slip."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
from explicit import FAST, SLOW, note, path_of
from walls import DATA, Case, brittle_case

from damagepred.one_wall.judged_path import gauges
from damagepred.scene import Scene, Solver

WALLS = ("bryant_window_dishing", "bryant_window_doming")
SOLVERS = {
    "quasi-static": Solver(method="quasi_static"),
    "explicit, default": Solver(method="explicit"),
    "explicit, fast": FAST,
    "explicit, slow": SLOW,
}
"""Rates of the explicit solver are those of the other parts; the default ramp has 10 000 cycles."""
BRITTLE = range(8)
"""Numbers of the random walls that crack, of the comparison of cohesions."""


def wall_of_the_test(name: str) -> Case:
    return Case(name, Scene.from_toml(DATA / f"{name}.toml"), {})


def band_table() -> str:
    """Return widest joint, widest crack band and both categories of the window walls by solver and pace."""
    rows = []
    for name in WALLS:
        for solver, settings in SOLVERS.items():
            rows.append((name, solver, *widths(wall_of_the_test(name), settings)))
            note(" ".join(map(str, rows[-1])))
    return table(("wall", "solver", *HEADS), rows)


def cohesion_table() -> str:
    """Return the same with the cohesion kept after slip, as the paper prints it, and lost with it."""
    rows = []
    for case in (*map(wall_of_the_test, WALLS), *(brittle_case(number) for number in BRITTLE)):
        for word, brittle in (("kept", False), ("lost", True)):
            joint = replace(case.scene.joint, brittle_shear=brittle)
            scene = replace(case.scene, joint=joint)
            rows.append((case.name, word, *widths(Case(case.name, scene, case.fields), SOLVERS["quasi-static"])))
            note(" ".join(map(str, rows[-1])))
    return table(("wall", "cohesion after slip", *HEADS), rows)


HEADS = (
    "widest joint, mm",
    "crack band, mm",
    "widest joint over band",
    "cracked joints of the wall",
    "category by joint",
    "category by band",
    "path",
)


def widths(case: Case, solver: Solver) -> tuple[str, ...]:
    """Return the tabulated values of the last increment of a path."""
    result = path_of(case, solver)
    joint, band = (1e3 * float(result[name][-1]) for name in ("crack_width", "crack_band"))
    mortar = gauges(case.model()).joints.is_wall
    cracked = int((np.asarray(result["state"]) == 1)[mortar].any(axis=1).sum())
    share = f"{joint / band:.2f}" if band > 0 else "-"
    categories = (f"{int(result[name][-1])}" for name in ("category", "category_band"))
    return (f"{joint:.2f}", f"{band:.2f}", share, str(cracked), *categories, str(result["end"]))


def table(heads: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    lines = [list(heads), *map(list, rows)]
    lines.insert(1, ["---"] * len(lines[0]))
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)
