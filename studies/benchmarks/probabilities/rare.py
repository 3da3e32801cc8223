"""Repeated subset simulation: the estimate of each run, and its number of walls."""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from damagepred.study.analyses.limit_state import margin
from damagepred.study.analyses.rare_event_samples import normals_to_wall
from damagepred.study.campaign.sample import joint_places
from damagepred.uq.subset import subset_simulation
from studies.benchmarks.probabilities.walls import question_of, settings_to_question

RUNS = {"window": {50: 12, 100: 6}, "joints": {50: 8}}
"""Number of runs, by the number of walls of a level."""


def runs_of(wall: str, quick: bool) -> list[tuple[str, int, int]]:
    """Return the runs of a wall: wall, walls of a level, number."""
    runs = {50: 1} if quick else RUNS[wall]
    return [(wall, level, run) for level, count in runs.items() for run in range(count)]


def subset(wall: str, level: int, run: int) -> dict[str, Any]:
    """Estimate the probability once."""
    settings, question = settings_to_question(wall), question_of(wall)
    design = settings.design()
    joints = len(joint_places(settings.scene).x) if design.joint else 0

    def limit_state(z: np.ndarray, numbers: np.ndarray) -> np.ndarray:
        return np.array([margin(*normals_to_wall(settings, design, row), question).most for row in z])

    began = time.process_time()
    size = len(design.wall) + len(design.joint) * joints
    found = subset_simulation(limit_state, size, samples=level, seed=1000 * level + run)
    names = ("probability", "variation", "lower", "upper", "failed", "reached")
    row = {name: getattr(found, name) for name in names} | {"walls": found.evaluations, "levels": len(found.levels)}
    return row | {"seconds": time.process_time() - began}
