"""Measure the time that each skip of the program saves, and the differences it makes.

    python studies/benchmarks/skips/run.py [--only condense half ...] [--limit 120] [--quick] [--output FOLDER]

Each is turned off while the others stay at their defaults. Runs with and without alternate, in two rounds; times are
processor times. ``--quick`` measures a few skips on a few bricks.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from damagepred.arrays import FloatArray
from damagepred.assembly import Model, wall_model
from damagepred.campaign.settings import StudySettings
from damagepred.enumerations import ContactState
from damagepred.errors import SolverError
from damagepred.one_wall.judged_path import Step, dynamic_run, follow, gauges, model_of
from damagepred.scene import Scene
from damagepred.solvers import Increment, solve_path
from damagepred.solvers.explicit.stepper import explicit_path
from damagepred.study import Study
from studies import cases
from studies.benchmarks import walls

HERE = Path(__file__).resolve().parent
SKIPS, WALLS = (walls.read(HERE / name) for name in ("skips.toml", "walls.toml"))
QUICK = ("condense", "half", "elastic start", "stop", "shared")
"""Skips of the quick form: none needs extra compiling."""
ROUNDS = 2
REPEATS, ENOUGH = 5, 2.0
"""Pairs of runs are repeated, to 5 at most, until they took 2 s; the fastest of each way counts: other load on the
machine only makes runs slower."""

Row = dict[str, Any]
Fields = dict[str, FloatArray] | None
WAYS = ("on", "off")


class Ran(NamedTuple):
    """A wall that was solved: its model, increments, time (s of the processor), and how it ended."""

    model: Model
    steps: list[Increment]
    seconds: float
    end: str


def alternate(number: int) -> tuple[str, ...]:
    """Return the ways, with and without a skip, in the order of a round."""
    return WAYS if number % 2 else WAYS[::-1]


def timed(work: Callable[[], Any]) -> tuple[float, Any]:
    """Return the processor time of a call (s), and its result."""
    began = time.process_time()
    found = work()
    return time.process_time() - began, found


def known(wall: str, small: bool) -> tuple[Scene, Fields]:
    """Return a wall, or a few of its bricks, and the values of its joints where they differ."""
    scene, fields = walls.scene(WALLS.get(wall, WALLS["no dpc"])), None
    if wall == "random joints":  # sampled as in a study
        tables = walls.read(walls.DATA / "bryant_study.toml")
        for place in ("movement.central_deflection", "dpc.friction"):
            del tables["variables"][place]
        scene, fields = Study(StudySettings.from_dict({**tables, "scene": scene.to_dict()})).sample(0, 1)
    if not small:
        return scene, fields
    scene = walls.part_of_test(replace(scene, opening=()), 1.44, 0.45)
    return walls.changed(scene, {"movement": {"increments": 4}}), None


def run(wall: tuple[Scene, Fields], name: str, way: str) -> Ran:
    """Assemble and solve a wall with a skip or without."""
    scene, fields = walls.changed(wall[0], SKIPS[name].get(way, {})), wall[1]
    model_of(scene, fields)  # geometry is computed once for all samples
    began, steps, end = time.process_time(), [], "complete"
    model = model_of(scene, fields)
    try:
        for step in path(model, scene, way == "on" if name == "elastic start" else None):
            steps.append(step)
            end = "collapsed" if step.collapsed else "complete"
    except SolverError as error:
        end = str(error).split(";")[0]
    return Ran(model, steps, time.process_time() - began, end)


def path(model: Model, scene: Scene, elastic_start: bool | None) -> Iterator[Increment]:
    """Return the path of a wall, or its run in time; or the explicit one, from the elastic solution or from nothing."""
    if scene.dynamics is not None:
        return iter(dynamic_run(model, scene.solver, scene.dynamics))
    if elastic_start is not None:
        return explicit_path(model, scene.solver, scene.movement.increments, elastic_start=elastic_start)
    return solve_path(model, scene.solver, scene.movement.increments)


def compare(wall: tuple[Scene, Fields], name: str, number: int) -> Row:
    """Return the time of a wall with a skip and without, and the largest differences over all increments."""
    ran = {way: run(wall, name, way) for way in alternate(number)}
    seconds = {way: [one.seconds] for way, one in ran.items()}
    while len(seconds["on"]) < REPEATS and sum(map(sum, seconds.values())) < ENOUGH:
        for way in alternate(number):
            seconds[way].append(run(wall, name, way).seconds)
    row: Row = {}
    for way in WAYS:
        steps = ran[way].steps
        row |= {f"seconds_{way}": min(seconds[way]), f"end_{way}": ran[way].end}
        row[f"steps_{way}"] = sum(s.counters.newton_iterations + s.counters.cycles for s in steps)
    return row | differences(wall[0], ran["on"], ran["off"])


def differences(scene: Scene, on: Ran, off: Ran) -> Row:
    """Return the largest differences over all increments that both reached, and contacts that cracked otherwise."""
    same = on.model.interfaces.contact_area.shape == off.model.interfaces.contact_area.shape
    bricks = min(on.model.n_blocks, off.model.n_blocks)
    moved, otherwise = np.zeros(2), 0
    for pair in zip(on.steps, off.steps, strict=False):
        a, b = (step.displacement[:bricks, :2] for step in pair)
        moved = np.maximum(moved, np.abs(a - b).max(axis=0))
        if same:
            cracked = [step.state == ContactState.CRACKED for step in pair]
            otherwise = max(otherwise, int((cracked[0] != cracked[1]).sum()))
    sideways, upwards = moved / scene.movement.central_deflection
    return {"sideways": sideways, "upwards": upwards, "otherwise": otherwise if same else np.nan}


# -- studies -----------------------------------------------------------------------------------------------------------

STOP_AT = 3
"""Category of interest: moderate damage."""


def window_walls(quick: bool) -> Study:
    """Return the study of the test wall with a window, or that of a wall of four bricks by six courses."""
    return Study(small_walls() if quick else StudySettings.from_toml(walls.DATA / "bryant_study.toml"))


def small_walls() -> StudySettings:
    """Return the study of a wall of four bricks by six courses."""
    settings = StudySettings.from_toml(walls.DATA.parent / "studies" / "durability" / "small.toml")
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


PARTS: dict[str, tuple[str, str, str, Callable[[int, bool], Row]]] = {
    "stop": (
        "the movement after the category of interest (3)",
        '`[study] stop_at_category = "none"`',
        "sampled window walls",
        stop,
    ),
    "shared": ("geometry and gauges of samples that share them", "another length", "sampled window walls", shared),
}
"""Skips of studies, by short names: what is skipped, how it is turned off, the walls, and how it is measured."""


# -- command line ------------------------------------------------------------------------------------------------------


def measure(name: str, wall: str, number: int, small: bool) -> Row:
    """Measure a skip on a wall, or on a few of its bricks."""
    if name in PARTS:
        return PARTS[name][-1](number, small)
    return compare(known(wall, small), name, number)


@cache
def make_ready(name: str, wall: str) -> None:
    """Compile, or load what is compiled."""
    measure(name, wall, 0, True)


def one(small: bool, name: str, wall: str, number: int) -> Row:
    """Measure a skip in a round."""
    make_ready(name, wall)
    return measure(name, wall, number, small)


def lost(_: tuple[Any, ...], message: str) -> dict[str, Any]:
    """Return the row of a pair that hung or died."""
    return {"end_on": message, "end_off": message}


def main() -> None:
    """Measure the cases of the command line."""
    options = cases.options(__doc__, __file__, (*SKIPS, *PARTS), 120.0)
    quick, measured_on = options.quick, {name: skip["walls"] for name, skip in SKIPS.items()}
    measured_on |= {name: [part[2]] for name, part in PARTS.items()}
    only = options.only or (QUICK if quick else measured_on)
    keys = [
        (name, wall, number)
        for number in range(1, 2 if quick else ROUNDS + 1)
        for name in only
        for wall in measured_on[name][: 1 if quick else None]
    ]
    file = options.output / "data.csv"
    cases.run(keys, ("skip", "wall", "round"), partial(one, quick), lost, file, options.limit)


if __name__ == "__main__":
    main()
