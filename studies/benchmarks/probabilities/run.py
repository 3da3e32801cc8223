"""Error of a fragility median and of a small probability over computing time, measured by repetition.

    python studies/benchmarks/probabilities/run.py [--wall joints window] [--seconds 240] [--quick]

Sets of walls are solved and kept in the output folder; a call stops after ``--seconds``, and the same call resumes. All
sets of both walls take about 25 minutes on one core. At the end of each call it writes data.csv, the errors so far.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from pathlib import Path

from studies.benchmarks.probabilities import costs, errors, rare, walls
from studies.benchmarks.probabilities.walls import Plan

HERE = Path(__file__).resolve().parent

STAGES = ("costs", "curves", "small probabilities", "curves, more", "subset simulation", "small probabilities, more")
"""Groups of sets that are solved for all walls in this order: an incomplete study then includes every wall."""


def curve_plans(wall: str, quick: bool = False) -> list[Plan]:
    """Return the sets for the errors of a curve, the most informative first."""
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


def file_of(folder: Path, wall: str, plan: Plan) -> Path:
    """Return the file of a set."""
    return folder / wall / f"{plan.name.replace(' ', '_')}.npz"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--wall", nargs="+", choices=("joints", "window"), default=["window", "joints"])
    parser.add_argument("--seconds", type=float, default=1e9, help="stop after this wall-clock time (s)")
    parser.add_argument("--quick", action="store_true", help="a few walls of each set, to check that it runs")
    parser.add_argument("--output", type=Path, default=HERE / "results", help="folder of the sets")
    parser.add_argument("--into", type=Path, default=HERE, help="folder of data.csv")
    options = parser.parse_args()
    stop = time.monotonic() + max(options.seconds - 45, 0.7 * options.seconds)  # the rest is for reading the sets
    complete = True
    for stage in range(len(STAGES)):
        for wall in options.wall:
            complete = complete and solve_stage(options, stage, wall, lambda: time.monotonic() > stop)
    if not complete:
        print("not complete; the same call resumes")
    sets = [(wall, curve_plans(wall, options.quick), rare_plans(wall, options.quick)) for wall in options.wall]
    errors.write(options.into, options.output, sets)


def solve_stage(options: argparse.Namespace, stage: int, wall: str, over: Callable[[], bool]) -> bool:
    """Solve the next set of one wall as far as time allows; return whether it is complete."""

    def say(line: str) -> None:
        print(line, flush=True)

    if STAGES[stage] == "costs":
        costs.measure(options.output, wall, options.quick, say)
        return True
    if STAGES[stage] == "subset simulation":
        return rare.subsets(options.output, wall, options.quick, over, say)
    plans = curve_plans(wall, options.quick) if STAGES[stage].startswith("curves") else rare_plans(wall, options.quick)
    chosen = plans[2:] if STAGES[stage].endswith("more") else plans[:2]
    return all(walls.solve(wall, plan, file_of(options.output, wall, plan), over, say) for plan in chosen)


if __name__ == "__main__":
    main()
