"""Repeated subset simulation: the estimate of each run, and its number of walls."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd

from damagepred.archive.files import write_whole
from damagepred.study.analyses.limit_state import Question, margin, study_for_limit_state
from damagepred.study.analyses.rare_event_samples import normals_to_wall
from damagepred.study.campaign.sample import joint_places
from damagepred.study.campaign.warm_up import warm_up
from damagepred.uq.subset import subset_simulation
from studies.benchmarks.probabilities.walls import CATEGORY, RARE_AT, rare_settings, settings_of

RUNS = {"window": {50: 12, 100: 6}, "joints": {50: 8}}
"""Number of runs, by the number of walls of a level."""


def subsets(folder: Path, wall: str, quick: bool, over: Callable[[], bool], say: Callable[[str], None]) -> bool:
    """Continue the runs of one wall; return whether all are done."""
    file = folder / wall / "subset.csv"
    rows = pd.read_csv(file).to_dict("records") if file.is_file() else []
    known = {(int(row["level"]), int(row["run"])) for row in rows}
    runs = {50: 1} if quick else RUNS[wall]
    question = Question(CATEGORY, RARE_AT[wall])
    settings = study_for_limit_state(rare_settings(settings_of(wall), RARE_AT[wall]), question)
    design = settings.design()
    joints = len(joint_places(settings.scene).x) if design.joint else 0
    size = len(design.wall) + len(design.joint) * joints
    warm_up(settings.scene)

    def limit_state(z: np.ndarray, numbers: np.ndarray) -> np.ndarray:
        return np.array([margin(*normals_to_wall(settings, design, row), question).most for row in z])

    for run in range(max(runs.values())):
        for level, count in runs.items():
            if run >= count or (level, run) in known:
                continue
            if over():
                return False
            began = time.process_time()
            found = subset_simulation(limit_state, size, samples=level, seed=1000 * level + run)
            rows.append(
                {
                    "level": level,
                    "run": run,
                    "probability": found.probability,
                    "variation": found.variation,
                    "lower": found.lower,
                    "upper": found.upper,
                    "walls": found.evaluations,
                    "levels": len(found.levels),
                    "failed": found.failed,
                    "reached": found.reached,
                    "seconds": time.process_time() - began,
                }
            )
            table = pd.DataFrame(rows)
            write_whole(file, lambda path, table=table: table.to_csv(path, index=False))
            say(f"{wall}, subset simulation, {level} a level, run {run}: {found.probability:.3g}")
    return True
