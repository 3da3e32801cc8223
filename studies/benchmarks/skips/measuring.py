"""One skip on one wall: runs with and without, alternating, and the differences of their results."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from damagepred.assembly import Model
from damagepred.enumerations import ContactState
from damagepred.errors import SolverError
from damagepred.pipeline import dynamic_run, model_of
from damagepred.solvers import Increment, solve_path
from damagepred.solvers.explicit.stepper import explicit_path
from studies.benchmarks.skips.scenes import Known
from studies.benchmarks.skips.skips import Skip

REPEATS, ENOUGH = 5, 2.0
"""Pairs of runs are repeated, to 5 at most, until they took 2 s; the fastest of each way counts: other load on the
machine only makes runs slower."""

Row = dict[str, Any]
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


def run(known: Known, skip: Skip, way: str) -> Ran:
    """Assemble and solve a wall with a skip or without."""
    scene = (skip.on if way == "on" else skip.off)(known.scene)
    blocks: Any = "deformable" if scene.solver.blocks == "auto" else scene.solver.blocks
    # geometry is computed once for all samples
    model_of(replace(scene, solver=replace(scene.solver, blocks=blocks)), known.fields)
    began, steps, end = time.process_time(), [], "complete"
    model = model_of(scene, known.fields)
    try:
        for step in path(model, scene, way == "on" or skip.elastic_start):
            steps.append(step)
            end = "collapsed" if step.collapsed else "complete"
    except SolverError as error:
        end = str(error).split(";")[0]
    return Ran(model, steps, time.process_time() - began, end)


def path(model: Model, scene: Any, elastic_start: bool) -> Iterator[Increment]:
    """Return the path of a wall, or its run in time."""
    if scene.dynamics is not None:
        return iter(dynamic_run(model, scene.solver, scene.dynamics))
    if not elastic_start:
        return explicit_path(model, scene.solver, scene.movement.increments, elastic_start=False)
    return solve_path(model, scene.solver, scene.movement.increments)


def compare(known: Known, skip: Skip, number: int) -> Row:
    """Return the time of a wall with a skip and without, and the largest differences over all increments."""
    ran = {way: run(known, skip, way) for way in alternate(number)}
    seconds = {way: [one.seconds] for way, one in ran.items()}
    while len(seconds["on"]) < REPEATS and sum(map(sum, seconds.values())) < ENOUGH:
        for way in alternate(number):
            seconds[way].append(run(known, skip, way).seconds)
    row: Row = {}
    for way in WAYS:
        steps = ran[way].steps
        row |= {f"seconds_{way}": min(seconds[way]), f"end_{way}": ran[way].end}
        row[f"steps_{way}"] = sum(s.counters.newton_iterations + s.counters.cycles for s in steps)
    return row | differences(known, ran["on"], ran["off"])


def differences(known: Known, on: Ran, off: Ran) -> Row:
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
    sideways, upwards = moved / known.scene.movement.central_deflection
    return {"sideways": sideways, "upwards": upwards, "otherwise": otherwise if same else np.nan}
