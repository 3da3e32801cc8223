"""The walls of this benchmark: coarser and finer forms of them, and sets of solved walls in files.

A set has a number of walls of one sampler, or several replicates with different seeds. It is stored in one file; errors
are computed from the files without solving.
"""

from __future__ import annotations

import time
import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from damagepred.archive.files import write_whole
from damagepred.arrays import FloatArray
from damagepred.study.analyses.limit_state import Question, margin, study_for_limit_state
from damagepred.study.campaign.sample import sampled_wall, solve_sample
from damagepred.study.campaign.warm_up import warm_up
from damagepred.study.settings import StudySettings
from damagepred.uq.importance import Proposal

HERE = Path(__file__).resolve().parent

CATEGORY = 1
"""The only quantity is whether, or at which movement, this category is reached."""

RARE_AT = {"joints": 0.113e-3, "window": 0.4e-3}
"""Movement (m) by which few walls reach it."""

RARE_INCREMENTS = 4
"""Increments of the path to that movement, at which the path ends."""

VARIANTS: dict[str, dict[str, dict[str, dict[str, Any]]]] = {
    "joints": {
        "larger blocks": {"wall": {"block_length": 0.8, "block_height": 0.4}},
        "two contacts": {"solver": {"contacts_per_interface": 2}},
        "half the increments": {"movement": {"increments": 5}},
        "increments x 4": {"movement": {"increments": 40}},
        "five contacts": {"solver": {"contacts_per_interface": 5}},
    },
    "window": {
        "larger blocks": {"wall": {"block_length": 0.8}},
        "two contacts": {"solver": {"contacts_per_interface": 2}},
        "half the increments": {"movement": {"increments": 8}},
        "increments x 4": {"movement": {"increments": 64}},
        "five contacts": {"solver": {"contacts_per_interface": 5}},
    },
}
"""Coarser and finer forms, by their difference from the wall."""

SHIFTS = {"window": {"joint.tensile_strength": -2.0, "joint.cohesion": -1.5}}
"""Shift of importance sampling, in standard deviations of the underlying normal: variables of the whole wall."""


class Plan(NamedTuple):
    """A set of walls.

    Attributes
    ----------
    name : str
        Name of the set.
    sampler : {"random", "lhs", "sobol"}
        Sampler of the variables of the whole wall.
    walls, replicates : int
        Walls of a replicate, and how many replicates.
    variant : str
        Variant of the wall; "" for the wall itself.
    rare : bool
        Whether paths end at the small movement.
    shifted : bool
        Importance sampling.
    """

    name: str
    sampler: str
    walls: int
    replicates: int
    variant: str = ""
    rare: bool = False
    shifted: bool = False


class Bank(NamedTuple):
    """Results of a set, as far as it is solved: arrays (replicates, walls), except for the last.

    Attributes
    ----------
    lower, upper : array
        Interval of the movement (m) at which the category is reached.
    weight : array
        Weight of importance sampling.
    failed : int
        Number of failed walls.
    """

    lower: FloatArray
    upper: FloatArray
    weight: FloatArray
    failed: int


def settings_of(wall: str, variant: str = "") -> StudySettings:
    """Return the study of a wall in one of its forms; random fields are those of the wall itself."""
    tables = tomllib.loads((HERE / f"{wall}.toml").read_text(encoding="utf-8"))
    settings = StudySettings.from_dict(tables, wall)
    settings = replace(settings, study=replace(settings.study, sampler="random", store_fields=False))
    if not variant:
        return settings
    changed = replace(settings, study=replace(settings.study, coarse=VARIANTS[wall][variant]))
    how = replace(settings.study, fields_from=settings.scene)
    return replace(settings, scene=changed.coarse_scene(), study=how)


def rare_settings(settings: StudySettings, at: float) -> StudySettings:
    """Return a study whose paths end at a small movement, in a few increments."""
    moved = replace(settings.scene.movement, central_deflection=at, increments=RARE_INCREMENTS)
    return replace(settings, scene=replace(settings.scene, movement=moved))


def planned(wall: str, plan: Plan) -> StudySettings:
    """Return the study from which a plan samples its walls."""
    settings = settings_of(wall, plan.variant)
    if plan.rare:
        settings = rare_settings(settings, RARE_AT[wall])
    how = replace(settings.study, sampler=plan.sampler)
    if plan.shifted:
        proposals = {place: Proposal(shift=shift) for place, shift in SHIFTS[wall].items()}
        how = replace(how, importance=proposals, nominal_share=0.1)
    return replace(settings, study=how)


def question_of(wall: str) -> Question:
    """Return the question whose answer is the small probability."""
    return Question(CATEGORY, RARE_AT[wall])


def settings_to_question(wall: str) -> StudySettings:
    """Return a study whose paths go beyond the small movement, so that a margin is known."""
    return study_for_limit_state(rare_settings(settings_of(wall), RARE_AT[wall]), question_of(wall))


def make_ready(wall: str) -> None:
    """Compile, or load what is compiled, before processes are forked."""
    for variant in ("", *VARIANTS[wall]):
        warm_up(settings_of(wall, variant).scene)


def values_of(drawn: dict[str, FloatArray], number: int) -> dict[str, float]:
    """Return the values of a wall."""
    return {place: float(values[number]) for place, values in drawn.items()}


def solved(
    wall: str, plan: Plan, settings: StudySettings, design: Any, number: int, values: dict[str, float]
) -> tuple[float, float]:
    """Solve a wall: the movements between which it reaches the category; NaN if it failed."""
    if plan.rare:  # only whether it does so by the small movement
        at = RARE_AT[wall]
        found = margin(*sampled_wall(settings, design, number, values), Question(CATEGORY, at, 1.0))
        if found.most == np.inf:
            return np.nan, np.nan
        return (0.0, at) if found.most <= 0 else (at, np.inf)
    result = solve_sample(settings, design, number, values)
    if result.reason or result.columns is None:
        return np.nan, np.nan
    moved = result.columns["central_deflection"].values[0]
    reached = np.flatnonzero(result.columns["damage_category"].values[0] >= CATEGORY)
    return (moved[reached[0] - 1], moved[reached[0]]) if len(reached) else (moved[-1], np.inf)


def solve(wall: str, plan: Plan, file: Path) -> dict[str, Any]:
    """Solve a set and write its file; return the number of walls and the time (s)."""
    began, settings = time.process_time(), planned(wall, plan)
    kept = np.zeros((3, plan.replicates, plan.walls))
    for replicate in range(plan.replicates):
        # a replicate's seed does not depend on their number
        own = replace(settings, study=replace(settings.study, seed=settings.study.seed + 1000 * replicate))
        design = own.design()
        drawn, weight = design.wall_values(plan.walls), design.weights(plan.walls)
        for number in range(plan.walls):
            try:
                found = solved(wall, plan, own, design, number, values_of(drawn, number))
            except ArithmeticError:
                found = np.nan, np.nan
            kept[:, replicate, number] = *found, 1.0 if weight is None else weight[number]

    def write(path: Path) -> None:
        with path.open("wb") as stream:
            np.savez_compressed(stream, kept=kept)

    file.parent.mkdir(parents=True, exist_ok=True)
    write_whole(file, write)
    return {"walls": kept[0].size, "seconds": time.process_time() - began}


def file_of(folder: Path, wall: str, plan: Plan) -> Path:
    """Return the file of a set."""
    return folder / wall / f"{plan.name.replace(' ', '_')}.npz"


def read(file: Path) -> Bank | None:
    """Return a set; None if there is nothing yet."""
    if not file.is_file():
        return None
    with np.load(file) as held:
        lower, upper, weight = held["kept"]
    failed = np.isnan(lower)
    # a failed wall counts as not damaged; their number is printed
    return Bank(np.where(failed, 0.0, lower), np.where(failed, np.inf, upper), weight, int(failed.sum()))
