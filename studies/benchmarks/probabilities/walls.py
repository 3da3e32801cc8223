"""The walls of this benchmark: coarser and finer forms of them, and sets of solved walls in files.

A set has a number of walls of one sampler, or several replicates with different seeds. It is stored in one file, which
the same call extends; errors are computed from the files without solving.
"""

from __future__ import annotations

import time
import tomllib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from damagepred.archive.files import write_whole
from damagepred.arrays import FloatArray
from damagepred.study.analyses.limit_state import Question, margin
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


def capacity(settings: StudySettings, design: Any, number: int, values: dict[str, float]) -> tuple[float, float]:
    """Solve a wall: the movements between which it reaches the category; NaN if it failed."""
    solved = solve_sample(settings, design, number, values)
    if solved.reason or solved.columns is None:
        return np.nan, np.nan
    moved = solved.columns["central_deflection"].values[0]
    reached = np.flatnonzero(solved.columns["damage_category"].values[0] >= CATEGORY)
    return (moved[reached[0] - 1], moved[reached[0]]) if len(reached) else (moved[-1], np.inf)


def hit(settings: StudySettings, design: Any, number: int, values: dict[str, float], at: float) -> tuple[float, float]:
    """Solve a wall to a movement: whether it has reached the category, as a capacity."""
    found = margin(*sampled_wall(settings, design, number, values), Question(CATEGORY, at, 1.0))
    if found.most == np.inf:
        return np.nan, np.nan
    return (0.0, at) if found.most <= 0 else (at, np.inf)


def solve(wall: str, plan: Plan, file: Path, over: Callable[[], bool], say: Callable[[str], None]) -> bool:
    """Continue a set; return whether it is complete.

    Parameters
    ----------
    wall, plan
        The wall and the plan of its set.
    file : Path
        File of the set.
    over : callable
        Whether to stop for now.
    say : callable
        Called with a line on the progress.
    """
    total = plan.walls * plan.replicates
    kept = np.zeros((3, total))
    done = 0
    if file.is_file():
        with np.load(file) as held:
            done = min(int(held["done"]), total)
            kept[:, :done] = held["kept"][:, :done]
    if done == total:
        return True
    settings = planned(wall, plan)
    warm_up(settings.scene)
    saved = time.monotonic()
    while done < total and not over():
        # a replicate's seed does not depend on their number
        own = replace(settings, study=replace(settings.study, seed=settings.study.seed + 1000 * (done // plan.walls)))
        design = own.design()
        drawn, weight = design.wall_values(plan.walls), design.weights(plan.walls)
        for number in range(done % plan.walls, plan.walls):
            values = {place: float(v[number]) for place, v in drawn.items()}
            try:
                found = (
                    hit(own, design, number, values, RARE_AT[wall])
                    if plan.rare
                    else capacity(own, design, number, values)
                )
            except ArithmeticError:
                found = np.nan, np.nan
            kept[:, done] = *found, 1.0 if weight is None else weight[number]
            done += 1
            if time.monotonic() - saved > 15 or over():
                keep(file, kept, done)
                say(f"{wall}, {plan.name}: {done} of {total} walls")
                saved = time.monotonic()
                if over():
                    break
    keep(file, kept, done)
    return done == total


def keep(file: Path, kept: FloatArray, done: int) -> None:
    """Write a set as far as it is solved."""

    def write(path: Path) -> None:
        with path.open("wb") as stream:
            np.savez_compressed(stream, kept=kept[:, :done], done=done)

    file.parent.mkdir(parents=True, exist_ok=True)
    write_whole(file, write)


def read(file: Path, plan: Plan) -> Bank | None:
    """Return a set, whole replicates of it (of a single one what there is); None if there is nothing yet."""
    if not file.is_file():
        return None
    with np.load(file) as held:
        kept = held["kept"]
    if plan.replicates == 1:
        kept = kept[:, None, :]
    else:
        whole = kept.shape[1] // plan.walls
        kept = kept[:, : whole * plan.walls].reshape(3, whole, plan.walls)
    lower, upper, weight = kept
    failed = np.isnan(lower)
    # a failed wall counts as not damaged; their number is printed
    return Bank(np.where(failed, 0.0, lower), np.where(failed, np.inf, upper), weight, int(failed.sum()))
