"""Error of a fragility median and of a small probability over computing time, measured by repetition.

    python studies/benchmarks/probabilities/run.py [--wall joints window] [--quick] [--output FOLDER] [--into FOLDER]

Sets of walls are solved and kept in the output folder; the same call resumes. At the end of each call data.csv, the
errors so far, is written from them.
"""

from __future__ import annotations

import argparse
from functools import partial
from pathlib import Path
from typing import Any

from studies.benchmarks import cases
from studies.benchmarks.probabilities import costs, errors, rare, walls
from studies.benchmarks.probabilities.walls import Plan, file_of

HERE = Path(__file__).resolve().parent
LIMIT = 1800.0
"""Time of a set (s)."""


def curve_plans(wall: str, quick: bool = False) -> list[Plan]:
    """Return the sets for the errors of a curve."""
    if quick:
        return [Plan("random", "random", 24, 1), Plan("sobol", "sobol", 8, 2), Plan("lhs 8", "lhs", 8, 2)]
    random, sobol, many = (1024, 32, 512) if wall == "joints" else (2048, 128, 512)
    plans = [Plan("random", "random", random, 1), Plan("sobol", "sobol", sobol, 16)]
    for name in walls.VARIANTS[wall]:
        cheaper = name in ("larger blocks", "two contacts")
        plans.append(Plan(name, "random", many if cheaper else many // 2, 1, name))
    sizes = (16, 64) if wall == "window" else ()
    return plans + [Plan(f"lhs {n}", "lhs", n, 16) for n in sizes]


def rare_plans(wall: str, quick: bool = False) -> list[Plan]:
    """Return the sets for the errors of a small probability, without subset simulation."""
    if quick:
        return [
            Plan("rare random", "random", 24, 1, rare=True),
            Plan("importance", "random", 8, 2, rare=True, shifted=True),
        ]
    if wall == "joints":  # no variable of the whole wall decides, so there is none to shift
        return [Plan("rare random", "random", 1024, 1, rare=True)]
    return [
        Plan("rare random", "random", 2048, 1, rare=True),
        Plan("importance", "random", 128, 16, rare=True, shifted=True),
        Plan("importance sobol", "sobol", 128, 16, rare=True, shifted=True),
        Plan("rare sobol", "sobol", 256, 16, rare=True),
    ]


def one(folder: Path, quick: bool, wall: str, name: str) -> dict[str, Any]:
    """Solve a set."""
    plan = next(p for p in curve_plans(wall, quick) + rare_plans(wall, quick) if p.name == name)
    return walls.solve(wall, plan, file_of(folder, wall, plan))


def lost(_: tuple[Any, ...], message: str) -> dict[str, Any]:
    """Return the row of a set that took too long, or whose process died."""
    return {"message": message}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--wall", nargs="+", choices=("joints", "window"), default=["window", "joints"])
    parser.add_argument("--quick", action="store_true", help="a few walls of each set, to check that it runs")
    parser.add_argument("--output", type=Path, default=HERE / "results", help="folder of the sets")
    parser.add_argument("--into", type=Path, default=HERE, help="folder of data.csv")
    options = parser.parse_args()
    folder, quick = options.output, options.quick
    folder.mkdir(parents=True, exist_ok=True)
    sets = {wall: (curve_plans(wall, quick), rare_plans(wall, quick)) for wall in options.wall}
    for wall in options.wall:
        walls.make_ready(wall)
    timed = [(wall, form) for wall in options.wall for form in costs.forms_of(wall)]
    costs.measure(folder / "costs.csv", timed, quick)
    keys = [(wall, plan.name) for wall, plans in sets.items() for plan in plans[0] + plans[1]]
    cases.run(keys, ("wall", "set"), partial(one, folder, quick), lost, folder / "sets.csv", LIMIT)
    runs = [key for wall in options.wall for key in rare.runs_of(wall, quick)]
    cases.run(runs, ("wall", "level", "run"), rare.subset, lost, folder / "subset.csv", LIMIT)
    errors.write(options.into, folder, sets)


if __name__ == "__main__":
    main()
