"""Time and memory of a study with more walls: small walls that are solved, and synthetic ones that are read."""

from __future__ import annotations

import resource
import tempfile
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from damagepred import fit_fragility, judge_again
from damagepred.study import Study, open_study
from damagepred.study.settings import StudySettings
from studies.benchmarks.scaling.cases import Case
from studies.benchmarks.scaling.one import Say, memory_now, memory_peak

STUDIES = Path(__file__).resolve().parents[2]
INCREMENTS, MOVEMENT, RATE, SCATTER = 20, 0.02, 0.3, 0.6
GROUPS = [2, 3, 4, 5]
"""Cracks in a group whose width the archive stores."""
FIRST = 4
"""Walls for the first loading of compiled code and libraries."""


def measure(case: Case, say: Say) -> None:
    """Run a study of a number of walls, solved or synthetic; report its time and memory."""
    {"small walls solved": solved, "walls made up": made_up}[case.curve](int(case.size), say)


def small_walls() -> StudySettings:
    """Return the study of a wall of four bricks by six courses, which cracks."""
    settings = StudySettings.from_toml(STUDIES / "durability" / "small.toml")
    scene = settings.scene
    wall = replace(scene.wall, length=0.96, height=0.45)
    # the same weight above a joint and the same rotation of the ends, so that these walls crack like the larger ones
    scene = replace(scene, wall=wall, loads=replace(scene.loads, roof=4e3 / 3))
    return replace(settings, scene=scene)


def solved(walls: int, say: Say) -> None:
    """Run, open, judge again and fit a study of walls."""
    study = Study(small_walls())
    with tempfile.TemporaryDirectory() as place:
        before = Path(place) / "before.dp"
        study.run(before, samples=FIRST, workers=1)
        judge_again(open_study(before), table="bre251")
        say(memory_before=memory_now(), zones=0)
        folder = Path(place) / "walls.dp"
        own, children = time.process_time(), _children()
        summary = study.run(folder, samples=walls, workers=1)
        own, children = time.process_time() - own, _children() - children
        say(failed=summary.failed, walls_seconds=children, parent_seconds=own)
        size = sum(f.stat().st_size for f in folder.rglob("*") if f.is_file()) / 2**20
        say(archive=size, files=sum(1 for f in folder.rglob("*") if f.is_file()), memory=memory_peak())
        began = time.process_time()
        ds = open_study(folder).load()
        say(open_seconds=time.process_time() - began)
        read(ds, say)
        say(seconds=own + children, samples=walls, end="complete", runs=1)


def made_up(walls: int, say: Say) -> None:
    """Judge synthetic walls again and fit curves to them."""
    read(archive(FIRST * 10, own_movement=False), lambda **_: None)
    say(memory_before=memory_now(), zones=0)
    ds = archive(walls, own_movement=True)
    took = read(ds, say)
    say(seconds=took, samples=walls, end="complete", runs=1, memory=memory_peak(), archive=ds.nbytes / 2**20)


def archive(walls: int, own_movement: bool, seed: int = 1) -> xr.Dataset:
    """Return a synthetic study: cracks grow with the movement, at a rate that is lognormal from wall to wall.

    The movement is the same for all walls, or the final one of each is random.
    """
    random = np.random.default_rng(seed)
    end = random.uniform(0.75, 1.25, walls) if own_movement else np.ones(walls)
    movement = (MOVEMENT * end)[:, None] * np.linspace(0.0, 1.0, INCREMENTS + 1)
    width = movement * (RATE * np.exp(SCATTER * random.standard_normal(walls)))[:, None]
    category = np.zeros(width.shape, dtype=np.int8)
    for limit in (0.1e-3, 1e-3, 5e-3, 15e-3):
        category += width >= limit
    both = ("sample", "increment")
    names = "negligible very_slight slight moderate severe"
    group = np.repeat(0.2 * width[..., None], len(GROUPS), axis=2)
    return xr.Dataset(
        {
            "damage_category": (both, category, {"flag_meanings": names}),
            "crack_width_max": (both, width, {"units": "m"}),
            "crack_group_width": ((*both, "group_count"), group, {"units": "m"}),
            "group_count": ("group_count", GROUPS),
            "status": ("sample", np.zeros(walls, dtype=np.int8)),
            "central_deflection": (both, movement, {"units": "m"}),
        },
        attrs={"title": f"{walls} walls made up", "highest_category": 4},
    )


def read(ds: Any, say: Say) -> float:
    """Judge a study by another table, and fit curves with bands to it; return the time (s)."""
    began = time.process_time()
    judged = judge_again(ds, table="bre251")
    then = time.process_time()
    reached = int(np.nanmax(judged["damage_category"].values))
    if reached >= 1:
        fit_fragility(judged, categories=list(range(1, min(reached, 4) + 1)), bootstrap=200)
    say(judge_seconds=then - began, fit_seconds=time.process_time() - then)
    return time.process_time() - began


def _children() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime
