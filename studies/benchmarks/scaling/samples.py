"""Time and memory of a study with more walls: small walls that are solved, and synthetic ones that are read."""

from __future__ import annotations

import resource
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from cases import Case
from one import Say, memory_now, memory_peak

from damagepred import fit_fragility, judge_again
from damagepred.study import Study, open_study
from damagepred.study.settings import StudySettings

STUDIES = Path(__file__).resolve().parents[2]
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
    sys.path.insert(0, str(STUDIES / "benchmarks"))
    from million_walls import archive

    read(archive(FIRST * 10, own_movement=False), lambda **_: None)
    say(memory_before=memory_now(), zones=0)
    ds = archive(walls, own_movement=True)
    took = read(ds, say)
    say(seconds=took, samples=walls, end="complete", runs=1, memory=memory_peak(), archive=ds.nbytes / 2**20)


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
