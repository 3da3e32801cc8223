"""One skip on one wall: runs with and without, alternating, and the differences of their results."""

from __future__ import annotations

import time
from dataclasses import asdict
from typing import Any, NamedTuple

import numpy as np

from damagepred.assembly import Model
from damagepred.damage import Rules, judge
from damagepred.enumerations import ContactState
from damagepred.errors import SolverError
from damagepred.pipeline import dynamic_run, joint_map, model_of
from damagepred.scene import Scene
from damagepred.solvers import Increment, solve_path
from studies.benchmarks.skips.scenes import Known
from studies.benchmarks.skips.skips import Skip

REPEATS, ENOUGH = 5, 2.0
"""Pairs of runs are repeated, to 5 at most, until they took 2 s; the fastest of each way counts: other load on the
machine only makes runs slower."""

Row = dict[str, Any]


class Ran(NamedTuple):
    """A wall that was solved: its model, increments, time (s of the processor), and how it ended."""

    scene: Scene
    model: Model
    steps: list[Increment]
    seconds: float
    end: str


def run(known: Known, skip: Skip, on: bool) -> Ran:
    """Assemble and solve a wall with a skip or without."""
    scene = (skip.on if on else skip.off)(known.scene)
    steps: list[Increment] = []
    if on:
        return _solve(scene, known, steps)
    with skip.put():
        return _solve(scene, known, steps)


def _solve(scene: Scene, known: Known, steps: list[Increment]) -> Ran:
    model_of(_rigid(scene), known.fields)  # geometry is computed once for all samples
    began = time.process_time()
    model = model_of(scene, known.fields)
    end = "complete"
    try:
        if scene.dynamics is not None:
            steps.extend(dynamic_run(model, scene.solver, scene.dynamics))
        else:
            steps.extend(solve_path(model, scene.solver, scene.movement.increments))
        if steps[-1].collapsed:
            end = "collapsed"
    except SolverError as error:
        end = str(error).split(";")[0]
    return Ran(scene, model, steps, time.process_time() - began, end)


def _rigid(scene: Scene) -> Scene:
    from dataclasses import replace

    blocks: Any = "deformable" if scene.solver.blocks == "auto" else scene.solver.blocks
    return replace(scene, solver=replace(scene.solver, blocks=blocks))


def compare(known: Known, skip: Skip, first: bool) -> Row:
    """Return the time of a wall with a skip and without, and the largest differences over all increments.

    Parameters
    ----------
    known : Known
        The wall.
    skip : Skip
        Of which.
    first : bool
        Whether the run with the skip comes first.
    """
    order = (True, False) if first else (False, True)
    ran = {way: run(known, skip, way) for way in order}
    seconds = {way: [ran[way].seconds] for way in order}
    while len(seconds[True]) < REPEATS and sum(map(sum, seconds.values())) < ENOUGH:
        for way in order:
            seconds[way].append(run(known, skip, way).seconds)
    on, off = (ran[way]._replace(seconds=min(seconds[way])) for way in (True, False))
    row: Row = {}
    for name, one in (("on", on), ("off", off)):
        row |= {
            f"seconds_{name}": one.seconds,
            f"end_{name}": one.end,
            f"steps_{name}": sum(s.counters.newton_iterations + s.counters.cycles for s in one.steps),
            f"factorisations_{name}": sum(s.counters.factorisations for s in one.steps),
            f"searches_{name}": max((s.searches for s in one.steps), default=0),
            f"reached_{name}": one.steps[-1].number if one.steps else -1,
        }
    return row | differences(on, off)


def differences(on: Ran, off: Ran) -> Row:
    """Return the largest differences over all increments that both reached, and cracked contacts at the end."""
    movement = on.scene.movement.central_deflection
    maps = joint_map(on.model), joint_map(off.model)
    same = on.model.interfaces.contact_area.shape == off.model.interfaces.contact_area.shape
    bricks = min(on.model.n_blocks, off.model.n_blocks)
    moved, gap, cracked = np.zeros(2), 0.0, 0
    rules = Rules.from_settings(**asdict(on.scene.damage))
    for a, b in zip(on.steps, off.steps, strict=False):
        apart = np.abs(a.displacement[:bricks, :2] - b.displacement[:bricks, :2])
        moved = np.maximum(moved, apart.max(axis=0))
        opened = [
            judge(joints, s.opening, s.slip, s.state == ContactState.CRACKED, rules).dpc_opening_max
            for joints, s in zip(maps, (a, b), strict=True)
        ]
        gap = max(gap, abs(opened[0] - opened[1]))
        if same:
            cracked = max(cracked, int(((a.state == ContactState.CRACKED) != (b.state == ContactState.CRACKED)).sum()))
    return {
        "sideways": moved[0] / movement,
        "upwards": moved[1] / movement,
        "dpc_opening": gap,
        "cracked_on": _cracked(on),
        "cracked_off": _cracked(off),
        "otherwise": cracked if same else np.nan,
    }


def _cracked(ran: Ran) -> int:
    return int((ran.steps[-1].state == ContactState.CRACKED).sum()) if ran.steps else -1
