"""The walls of this benchmark: coarser and finer forms of them, and sets of solved walls in files.

A set has a number of walls of one sampler, or several replicates with different seeds. It is stored in one file; errors
are computed from the files without solving.
"""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from damagepred.analyses.limit_state import Question, margin, study_for_limit_state
from damagepred.analyses.rare_event_samples import normals_to_wall
from damagepred.archive.files import write_whole
from damagepred.arrays import FloatArray
from damagepred.campaign.sample import joint_places, sampled_wall, solve_sample
from damagepred.campaign.settings import StudySettings
from damagepred.scene import Scene
from damagepred.scene.keys import merged
from damagepred.uq.importance import Proposal
from damagepred.uq.subset import subset_simulation
from studies.benchmarks.walls import read as read_tables

HERE = Path(__file__).resolve().parent
CATEGORY = 1
"""The only quantity is whether, or at which movement, this category is reached."""
RARE_INCREMENTS = 4
"""Increments of the path to that movement, at which the path ends."""
SETS = read_tables(HERE / "plans.toml")
WALLS = ("window", "joints")


class Plan(NamedTuple):
    """Set of walls: sampler, walls of a replicate, replicates, variant of the wall, whether paths end early."""

    name: str
    sampler: str
    walls: int
    replicates: int
    variant: str = ""
    rare: bool = False
    shifted: bool = False


class Bank(NamedTuple):
    """Interval of the movement (m) at which the category is reached, and weight: arrays (replicates, walls)."""

    lower: FloatArray
    upper: FloatArray
    weight: FloatArray


def plans(wall: str, quick: bool = False) -> list[Plan]:
    """Return the sets of a wall: for the errors of a curve, and of a small probability."""
    return [Plan(**plan) for plan in SETS["quick" if quick else wall]["plans"]]


def settings_of(wall: str, variant: str = "") -> StudySettings:
    """Return the study of a wall in one of its forms; random fields are those of the wall itself."""
    settings = StudySettings.from_toml(HERE / f"{wall}.toml")
    settings = replace(settings, study=replace(settings.study, sampler="random", store_fields=False))
    if not variant:
        return settings
    scene = Scene.from_dict(merged(settings.scene.free_tables(), SETS[wall]["variants"][variant]))
    how = replace(settings.study, fields_from=settings.scene)
    return replace(settings, scene=scene, study=how)


def rare_settings(wall: str, variant: str = "") -> StudySettings:
    """Return a study whose paths end at the small movement, in a few increments."""
    settings = settings_of(wall, variant)
    moved = replace(settings.scene.movement, central_deflection=SETS[wall]["rare_at"], increments=RARE_INCREMENTS)
    return replace(settings, scene=replace(settings.scene, movement=moved))


def planned(wall: str, plan: Plan) -> StudySettings:
    """Return the study from which a plan samples its walls."""
    settings = rare_settings(wall, plan.variant) if plan.rare else settings_of(wall, plan.variant)
    how = replace(settings.study, sampler=plan.sampler)
    if plan.shifted:
        proposals = {place: Proposal(shift=shift) for place, shift in SETS[wall]["shifts"].items()}
        how = replace(how, importance=proposals, nominal_share=0.1)
    return replace(settings, study=how)


def solved(wall: str, plan: Plan, settings: StudySettings) -> FloatArray:
    """Return for each wall the movements between which it reaches the category, NaN if it failed; and its weight."""
    design, at = settings.design(), SETS[wall]["rare_at"]
    drawn, weight = design.wall_values(plan.walls), design.weights(plan.walls)

    def interval(number: int) -> tuple[float, float]:
        values = {place: float(each[number]) for place, each in drawn.items()}
        if plan.rare:  # only whether it does so by the small movement
            found = margin(*sampled_wall(settings, design, number, values), Question(CATEGORY, at, 1.0))
            return (np.nan, np.nan) if found.most == np.inf else (0.0, at) if found.most <= 0 else (at, np.inf)
        result = solve_sample(settings, design, number, values)
        if result.reason or result.columns is None:
            return np.nan, np.nan
        moved = result.columns["central_deflection"].values[0]
        reached = np.flatnonzero(result.columns["damage_category"].values[0] >= CATEGORY)
        return (moved[reached[0] - 1], moved[reached[0]]) if len(reached) else (moved[-1], np.inf)

    found = np.array([interval(number) for number in range(plan.walls)])
    return np.array([*found.T, np.ones(plan.walls) if weight is None else weight])


def solve(folder: Path, quick: bool, wall: str, name: str) -> dict[str, Any]:
    """Solve a set and write its file; return the number of walls and the time (s)."""
    plan = next(p for p in plans(wall, quick) if p.name == name)
    began, settings = time.process_time(), planned(wall, plan)
    # a replicate's seed does not depend on their number
    seeds = [settings.study.seed + 1000 * replicate for replicate in range(plan.replicates)]
    sets = [solved(wall, plan, replace(settings, study=replace(settings.study, seed=seed))) for seed in seeds]
    kept = np.stack(sets, axis=1)

    def write(path: Path) -> None:
        with path.open("wb") as stream:
            np.savez_compressed(stream, kept=kept)

    file = folder / wall / f"{name}.npz"
    file.parent.mkdir(parents=True, exist_ok=True)
    write_whole(file, write)
    return {"walls": kept[0].size, "seconds": time.process_time() - began}


def read(folder: Path, wall: str, name: str) -> Bank:
    """Return a set."""
    with np.load(folder / wall / f"{name}.npz") as held:
        lower, upper, weight = held["kept"]
    failed = np.isnan(lower)
    return Bank(np.where(failed, 0.0, lower), np.where(failed, np.inf, upper), weight)


def subset(wall: str, level: int, run: int) -> dict[str, Any]:
    """Estimate the small probability once, by subset simulation."""
    question = Question(CATEGORY, SETS[wall]["rare_at"])
    settings = study_for_limit_state(rare_settings(wall), question)  # paths go on, so that a margin is known
    design = settings.design()

    def limit_state(z: np.ndarray, numbers: np.ndarray) -> np.ndarray:
        return np.array([margin(*normals_to_wall(settings, design, row), question).most for row in z])

    size = len(design.wall) + (len(design.joint) * len(joint_places(settings.scene).x) if design.joint else 0)
    began = time.process_time()
    found = subset_simulation(limit_state, size, samples=level, seed=1000 * level + run)
    seconds = time.process_time() - began
    return {"probability": found.probability, "walls": found.evaluations, "seconds": seconds}
