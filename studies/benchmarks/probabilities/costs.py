"""Time of a wall in each form: all forms of the same walls alternate, under the same machine load."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from damagepred.study.analyses.limit_state import margin
from damagepred.study.campaign.sample import sampled_wall
from studies.benchmarks import cases
from studies.benchmarks.probabilities.walls import (
    SHIFTS,
    VARIANTS,
    Plan,
    planned,
    question_of,
    settings_to_question,
    solved,
    values_of,
)

SHORT, SHIFTED, TWICE = "short path", "short path, shifted", "path to twice the movement"


def forms_of(wall: str) -> list[str]:
    """Return the forms of a wall's path that are timed."""
    return ["path", *VARIANTS[wall], SHORT, *[SHIFTED] * (wall in SHIFTS), TWICE]


def measure(file: Path, timed: Sequence[tuple[str, str]], quick: bool) -> None:
    """Time walls by the processor; keep the mean of each form."""
    if file.is_file():
        return
    count, rows = 4 if quick else 60, []
    for wall in dict.fromkeys(wall for wall, _ in timed):
        calls = {form: _call(wall, form, count) for own, form in timed if own == wall}
        taken = {form: np.zeros(count) for form in calls}
        for i in (0, *range(count)):  # the first once more, because it loads what is compiled
            for form, call in calls.items():
                began = time.process_time()
                call(i)
                taken[form][i] = time.process_time() - began
        rows += [
            {"form": form, "mean": t.mean(), "median": float(np.median(t)), "wall": wall} for form, t in taken.items()
        ]
    cases.write(rows, file, 6)
    print(pd.DataFrame(rows).to_string(index=False), flush=True)


def _call(wall: str, form: str, count: int) -> Callable[[int], object]:
    """Return a function that solves a wall by its number, in a form."""
    if form == TWICE:
        settings, question = settings_to_question(wall), question_of(wall)
        design = settings.design()
        drawn = design.wall_values(count)
        return lambda i: margin(*sampled_wall(settings, design, i, values_of(drawn, i)), question)
    plan = Plan("", "random", count, 1, form if form in VARIANTS[wall] else "", form.startswith(SHORT), form == SHIFTED)
    settings = planned(wall, plan)
    design = settings.design()
    drawn = design.wall_values(count)
    return lambda i: solved(wall, plan, settings, design, i, values_of(drawn, i))
