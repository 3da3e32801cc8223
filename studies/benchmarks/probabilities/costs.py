"""Time of a wall in each form: all forms of the same walls alternate, under the same machine load."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd

from damagepred.archive.files import write_whole
from damagepred.study.analyses.limit_state import Question, margin, study_for_limit_state
from damagepred.study.campaign.sample import sampled_wall
from damagepred.study.campaign.warm_up import warm_up
from studies.benchmarks.probabilities.walls import (
    CATEGORY,
    RARE_AT,
    SHIFTS,
    VARIANTS,
    Plan,
    capacity,
    hit,
    planned,
    rare_settings,
    settings_of,
)


def measure(folder: Path, wall: str, quick: bool, say: Callable[[str], None]) -> None:
    """Time walls by the processor; keep the mean of each form."""
    file = folder / wall / "costs.csv"
    if file.is_file():
        return
    count = 4 if quick else 60
    question = Question(CATEGORY, RARE_AT[wall])
    forms: dict[str, Callable[[int], object]] = {}
    for variant in ("", *VARIANTS[wall]):
        forms[variant or "path"] = _path(wall, Plan("", "random", count, 1, variant))
    forms["short path"] = _path(wall, Plan("", "random", count, 1, rare=True))
    if wall in SHIFTS:
        forms["short path, shifted"] = _path(wall, Plan("", "random", count, 1, rare=True, shifted=True))
    climbed = study_for_limit_state(rare_settings(settings_of(wall), RARE_AT[wall]), question)
    design = climbed.design()
    drawn = design.wall_values(count)

    def to_twice(i: int) -> object:
        values = {place: float(v[i]) for place, v in drawn.items()}
        return margin(*sampled_wall(climbed, design, i, values), question)

    forms["path to twice the movement"] = to_twice
    warm_up(climbed.scene)
    for call in forms.values():
        call(0)
    taken = {name: np.zeros(count) for name in forms}
    for i in range(count):
        for name, call in forms.items():
            began = time.process_time()
            call(i)
            taken[name][i] = time.process_time() - began
    rows = [{"form": name, "mean": t.mean(), "median": float(np.median(t))} for name, t in taken.items()]
    table = pd.DataFrame(rows)
    file.parent.mkdir(parents=True, exist_ok=True)
    write_whole(file, lambda path: table.to_csv(path, index=False, float_format="%.6g"))
    say(f"{wall}: \n{table.to_string(index=False)}")


def _path(wall: str, plan: Plan) -> Callable[[int], object]:
    settings = planned(wall, plan)
    design = settings.design()
    drawn = design.wall_values(plan.walls)

    def call(i: int) -> object:
        values = {place: float(v[i]) for place, v in drawn.items()}
        if plan.rare:
            return hit(settings, design, i, values, RARE_AT[wall])
        return capacity(settings, design, i, values)

    return call
