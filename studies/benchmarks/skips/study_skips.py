"""Skips of studies: solutions, geometry and storage that are left out."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from damagepred import pipeline as path
from damagepred import solve
from damagepred.assembly import wall, wall_model
from damagepred.pipeline import Step, follow
from damagepred.study import Study
from damagepred.study.settings import StudySettings
from studies.benchmarks.skips.scenes import DATA, deformable

Row = dict[str, Any]
STOP_AT = 3
"""Category of interest: moderate damage."""


class Part(NamedTuple):
    """A skip of a study: name, how it is turned off, its wall, and the function that measures it."""

    what: str
    how: str
    scene: str
    measure: Callable[[int, bool], Row]


def stop(number: int, quick: bool) -> Row:
    """Follow sampled walls to their end, and until the category of interest."""
    settings = small_walls() if quick else StudySettings.from_toml(DATA / "bryant_study.toml")
    study = Study(settings)
    row: Row = {"seconds_on": 0.0, "seconds_off": 0.0, "steps_on": 0, "steps_off": 0, "upwards": 0.0}
    for sample in range(2 * number, 2 * number + 2):  # other walls each round
        scene, fields = study.sample(sample, 64)
        model = wall_model(scene, fields)
        found: dict[str, list[Step]] = {"on": [], "off": []}
        for way in ("on", "off") if sample % 2 else ("off", "on"):
            began = time.process_time()
            for step in follow(model, scene.solver, scene.damage, scene.movement.increments):
                found[way].append(step)
                if way == "on" and step.verdict.damage_category >= STOP_AT:
                    break
            row[f"seconds_{way}"] += time.process_time() - began
            row[f"steps_{way}"] += sum(s.increment.counters.newton_iterations for s in found[way])
        both = zip(found["on"], found["off"], strict=False)
        apart = max(float(np.abs(a.increment.displacement - b.increment.displacement).max()) for a, b in both)
        row["upwards"] = max(row["upwards"], apart / scene.movement.central_deflection)
    return row | {"sideways": row["upwards"]}


def shared(number: int, quick: bool) -> Row:
    """Assemble and judge sampled walls, with geometry and gauges computed once or each time."""
    study = Study(small_walls() if quick else StudySettings.from_toml(DATA / "bryant_study.toml"))
    times = {"on": 0.0, "off": 0.0}
    for sample in range(4):
        scene, fields = study.sample(sample, 64)
        for way in ("on", "off") if number % 2 else ("off", "on"):
            path.gauges(wall_model(scene, fields))
            if way == "off":
                wall._geometry.cache_clear()
                path._KNOWN.clear()
            began = time.process_time()
            path.gauges(wall_model(scene, fields))
            times[way] += time.process_time() - began
    return {f"seconds_{way}": value for way, value in times.items()}


def zones_kept(number: int, quick: bool) -> Row:
    """Solve a wall of deformable bricks, with zones stored or not."""
    scene = replace(deformable().scene, movement=replace(deformable().scene.movement, increments=4 if quick else 20))
    if quick:
        scene = replace(scene, wall=replace(scene.wall, length=1.44, height=0.45))
    row: Row = {}
    for way in ("on", "off") if number % 2 else ("off", "on"):
        began = time.process_time()
        ds = solve(scene, store_zones=way == "off")
        row |= {f"seconds_{way}": time.process_time() - began, f"bytes_{way}": ds.nbytes}
    return row


def archive_of(changes: dict[str, Any]) -> Callable[[int, bool], Row]:
    """Return a function that runs a study with and without settings of ``[study]`` and returns its size on disk."""

    def measure(number: int, quick: bool) -> Row:
        row: Row = {}
        samples = 4 if quick else 64
        for way in ("on", "off") if number % 2 else ("off", "on"):
            settings = small_walls()
            sampling = replace(settings.study, stop_at_category="none", **(changes if way == "on" else {}))
            with tempfile.TemporaryDirectory() as place:
                folder = Path(place) / "walls.dp"
                summary = Study(replace(settings, study=sampling)).run(folder, samples=samples)
                assert not summary.failed
                row[f"bytes_{way}"] = sum(f.stat().st_size for f in folder.rglob("*") if f.is_file()) / samples
        return row

    return measure


def small_walls() -> StudySettings:
    """Return the study of a wall of four bricks by six courses."""
    settings = StudySettings.from_toml(DATA.parent / "studies" / "durability" / "small.toml")
    small = replace(settings.scene.wall, length=0.96, height=0.45)
    return replace(settings, scene=replace(settings.scene, wall=small))


PARTS: dict[str, Part] = {
    "stop": Part(
        "the movement after the category of interest (3)",
        '`[study] stop_at_category = "none"`',
        "sampled window walls",
        stop,
    ),
    "shared": Part("geometry and gauges of samples that share them", "caches emptied", "sampled window walls", shared),
    "zones kept": Part("zones in the results", "`solve(..., store_zones=True)`, the default", "deformable", zones_kept),
    "path kept": Part(
        "increments before the end of a sample's movement",
        '`[study] movement = "path"`, the default; without: `"sampled"`',
        "small sampled walls",
        archive_of({"movement": "sampled"}),
    ),
    "fields kept": Part(
        "values of joints in the design file, which follow from the seed",
        "`[study] store_fields = true`, the default",
        "small sampled walls",
        archive_of({"store_fields": False}),
    ),
}
"""Skips of studies, by short names."""
