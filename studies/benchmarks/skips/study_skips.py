"""Skips of studies: solutions, geometry and storage that are left out."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from damagepred import solve
from damagepred.assembly import wall_model
from damagepred.pipeline import Step, follow, gauges
from damagepred.study import Study
from damagepred.study.settings import StudySettings
from studies.benchmarks.skips.measuring import WAYS, Row, alternate, timed
from studies.benchmarks.skips.scenes import DATA, deformable

STOP_AT = 3
"""Category of interest: moderate damage."""


class Part(NamedTuple):
    """A skip of a study: name, how it is turned off, its wall, and the function that measures it."""

    what: str
    how: str
    scene: str
    measure: Callable[[int, bool], Row]


def window_walls(quick: bool) -> Study:
    """Return the study of the test wall with a window, or that of a wall of four bricks by six courses."""
    return Study(small_walls() if quick else StudySettings.from_toml(DATA / "bryant_study.toml"))


def small_walls() -> StudySettings:
    """Return the study of a wall of four bricks by six courses."""
    settings = StudySettings.from_toml(DATA.parent / "studies" / "durability" / "small.toml")
    small = replace(settings.scene.wall, length=0.96, height=0.45)
    return replace(settings, scene=replace(settings.scene, wall=small))


def stop(number: int, quick: bool) -> Row:
    """Follow sampled walls to their end, and until the category of interest."""
    row: Row = {"seconds_on": 0.0, "seconds_off": 0.0, "steps_on": 0, "steps_off": 0, "upwards": 0.0}
    study = window_walls(quick)
    for sample in range(2 * number, 2 * number + 2):  # other walls each round
        scene, fields = study.sample(sample, 64)
        model = wall_model(scene, fields)

        def path(way: str, scene: Any = scene, model: Any = model) -> list[Step]:
            found = []
            for step in follow(model, scene.solver, scene.damage, scene.movement.increments):
                found.append(step)
                if way == "on" and step.verdict.damage_category >= STOP_AT:
                    break
            return found

        ran = {way: timed(partial(path, way)) for way in alternate(sample)}
        for way in WAYS:
            row[f"seconds_{way}"] += ran[way][0]
            row[f"steps_{way}"] += sum(s.increment.counters.newton_iterations for s in ran[way][1])
        both = zip(ran["on"][1], ran["off"][1], strict=False)
        apart = max(float(np.abs(a.increment.displacement - b.increment.displacement).max()) for a, b in both)
        row["upwards"] = max(row["upwards"], apart / scene.movement.central_deflection)
    return row | {"sideways": row["upwards"]}


def shared(number: int, quick: bool) -> Row:
    """Assemble and judge sampled walls, with geometry and gauges known, and of a length that was not there before."""
    study, row = window_walls(quick), {f"seconds_{way}": 0.0 for way in WAYS}
    for sample in range(4):
        scene, fields = study.sample(sample, 64)
        length = scene.wall.length * (1 + 1e-6 * (4 * number + sample + 1))
        other = scene.with_values({"wall.length": length})
        gauges(wall_model(scene, fields))
        for way in alternate(number):
            wall = scene if way == "on" else other
            row[f"seconds_{way}"] += timed(lambda wall=wall, own=fields: gauges(wall_model(wall, own)))[0]  # type: ignore[misc]
    return row


def zones_kept(number: int, quick: bool) -> Row:
    """Solve a wall of deformable bricks, with zones stored or not."""
    wall = deformable().scene
    scene = replace(wall, movement=replace(wall.movement, increments=4 if quick else 20))
    if quick:
        scene = replace(scene, wall=replace(scene.wall, length=1.44, height=0.45))
    row: Row = {}
    for way in alternate(number):
        seconds, ds = timed(partial(solve, scene, store_zones=way == "off"))
        row |= {f"seconds_{way}": seconds, f"bytes_{way}": ds.nbytes}
    return row


PARTS: dict[str, Part] = {
    "stop": Part(
        "the movement after the category of interest (3)",
        '`[study] stop_at_category = "none"`',
        "sampled window walls",
        stop,
    ),
    "shared": Part("geometry and gauges of samples that share them", "another length", "sampled window walls", shared),
    "zones kept": Part("zones in the results", "`solve(..., store_zones=True)`, the default", "deformable", zones_kept),
}
"""Skips of studies, by short names."""
