"""Error of a fragility median and of a small probability over computing time, measured by repetition.

    python studies/benchmarks/probabilities/run.py [--only window joints] [--limit 900] [--quick] [--output FOLDER]

Sets of walls are solved, two at a time, and kept in ``results``; the same call resumes. The time of a wall is measured
apart: all forms of the same walls alternate, one at a time. At the end data.csv, the errors, is written.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from damagepred.study.analyses.limit_state import margin
from damagepred.study.campaign.sample import sampled_wall
from damagepred.study.campaign.warm_up import warm_up
from studies.benchmarks import cases
from studies.benchmarks.probabilities import errors, walls
from studies.benchmarks.probabilities.walls import SHIFTS, SUBSET_RUNS, VARIANTS, Plan

SHORT, SHIFTED, TWICE = "short path", "short path, shifted", "path to twice the movement"


def lost(_: tuple[Any, ...], message: str) -> dict[str, Any]:
    """Return the row of a set that took too long, or whose process died."""
    return {"message": message}


def make_ready(names: list[str]) -> None:
    """Compile, or load what is compiled, before processes are forked."""
    for wall in names:
        for variant in ("", *VARIANTS[wall]):
            warm_up(walls.settings_of(wall, variant).scene)


def call(wall: str, form: str, count: int) -> Callable[[int], object]:
    """Return a function that solves a wall by its number, in a form."""
    if form == TWICE:
        settings, question = walls.to_question(wall)
        design = settings.design()
        drawn = design.wall_values(count)
        return lambda i: margin(
            *sampled_wall(settings, design, i, {place: float(v[i]) for place, v in drawn.items()}), question
        )
    plan = Plan("", "random", count, 1, form if form in VARIANTS[wall] else "", form.startswith(SHORT), form == SHIFTED)
    return walls.solver_of(wall, plan, walls.planned(wall, plan))


def costs(count: int, wall: str) -> list[dict[str, Any]]:
    """Time some walls by the processor, all forms of a wall in turn; return the mean and median of each form (s)."""
    forms = ["path", *VARIANTS[wall], SHORT, *[SHIFTED] * (wall in SHIFTS), TWICE]
    calls = {form: call(wall, form, count) for form in forms}
    taken = {form: np.zeros(count) for form in calls}
    for i in (0, *range(count)):  # the first once more, because it loads what is compiled
        for form, solve in calls.items():
            began = time.process_time()
            solve(i)
            taken[form][i] = time.process_time() - began
    return [{"wall": wall, "form": f, "mean": t.mean(), "median": float(np.median(t))} for f, t in taken.items()]


def main() -> None:
    """Measure what the command line asks for."""
    options = cases.options(__doc__, __file__, walls.RARE_AT, 900.0)
    quick, names = options.quick, options.only or list(walls.RARE_AT)[: 1 if options.quick else None]
    folder: Path = options.output / "results"
    ready, spent = partial(make_ready, names), folder / "costs.csv"
    folder.mkdir(exist_ok=True)
    if not spent.exists():
        ready()
        cases.write([row for wall in names for row in costs(4 if quick else 60, wall)], spent, 6)
    keys = [(wall, plan.name) for wall in names for plan in walls.plans(wall, quick)]
    work, sets = partial(walls.solve, folder, quick), folder / "sets.csv"
    cases.run(keys, ("wall", "set"), work, lost, sets, options.limit, processes=2, before=ready)
    levels = {wall: {50: 1} if quick else SUBSET_RUNS[wall] for wall in names}
    runs = [(wall, level, run) for wall in names for level, count in levels[wall].items() for run in range(count)]
    key, file = ("wall", "level", "run"), folder / "subset.csv"
    cases.run(runs, key, walls.subset, lost, file, options.limit, processes=2, before=ready)
    errors.write(options.output, folder, {wall: [p.name for p in walls.plans(wall, quick)] for wall in names})


if __name__ == "__main__":
    main()
