"""Solve and check scenes one by one, each in a process with a time limit; finished rows are stored."""

from __future__ import annotations

import contextlib
import csv
import time
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import damagepred
from audited.checks import Violation, check
from audited.collapse import must_collapse, pulls_on_a_support
from audited.scenes import scene_of
from audited.wall import ArchivedWall
from damagepred.errors import DamagepredError
from damagepred.scene import Scene
from studies.benchmarks import cases

WARM_UP, SMALL = 60, 9
"""Number of scenes of which the small ones are solved beforehand, so that no run includes compiling."""
METHODS = ("quasi_static", "explicit")
COLUMNS = (
    "seed",
    "scene",
    "solver",
    "outcome",
    "progress",
    "collapse_progress",
    "must_collapse",
    "category",
    "crack_width",
    "band_width",
    "unbalanced",
    "energy_error",
    "silent",
    "stated",
    "seconds",
    "seconds_of_checks",
    "blocks",
    "increments",
    "refused",
    "features",
    "words",
)


@dataclass(frozen=True)
class Budget:
    """Budget of the explicit solver, which makes thousands of scenes affordable.

    Attributes
    ----------
    ramp_cycles, maximum_cycles : int
        Of ``[solver]``.
    """

    ramp_cycles: int = 1000
    maximum_cycles: int = 20_000


class Job(NamedTuple):
    """One scene by one solver.

    Attributes
    ----------
    seed, scene : int
        Seed and number of the scene.
    solver : str
        One of ``METHODS``.
    """

    seed: int
    scene: int
    solver: str


def jobs(seed: int, count: int, methods: Sequence[str] = METHODS) -> list[Job]:
    """Return the jobs, scene by scene."""
    return [Job(seed, number, method) for number in range(count) for method in methods]


def prepared(scene: Scene, method: str, budget: Budget | None = None) -> Scene:
    """Return a scene with a solver."""
    own = Budget() if budget is None else budget
    if method == "quasi_static":
        return scene
    changed = replace(scene.solver, method="explicit", ramp_cycles=own.ramp_cycles, maximum_cycles=own.maximum_cycles)
    return replace(scene, solver=changed)


def one(job: Job) -> dict[str, Any]:
    """Solve a scene, check the result, and return its row."""
    drawn = scene_of(job.seed, job.scene)
    row = empty_row(job) | {"refused": drawn.refused, "features": "; ".join(drawn.features)}
    begun = time.process_time()
    try:
        with warnings.catch_warnings(record=True) as warned:
            warnings.simplefilter("always", RuntimeWarning)
            ds = damagepred.solve(prepared(drawn.scene, job.solver), on_failure="return")
    except DamagepredError as error:
        return row | {"outcome": "gave up", "words": _on_one_line(error), "seconds": time.process_time() - begun}
    except Exception as error:
        words = f"{type(error).__name__}: {_on_one_line(error)}"
        return row | {"outcome": "traceback", "words": words, "seconds": time.process_time() - begun}
    row["seconds"] = time.process_time() - begun
    try:
        row |= examined(ds, [str(w.message) for w in warned if issubclass(w.category, RuntimeWarning)])
        if row["outcome"] == "collapsed" and drawn.scene.movement.shape == "jacks":
            latest = row["collapse_progress"] + ds.attrs["collapse_progress_uncertainty"]
            row["must_collapse"] = row["must_collapse"] or lifts_off(drawn.scene, latest)
    except Exception as error:
        row |= {"outcome": "traceback", "words": f"in the checks: {type(error).__name__}: {_on_one_line(error)}"}
    row["seconds_of_checks"] = time.process_time() - begun - row["seconds"]
    return row


def examined(ds: Any, warned: Sequence[str] = ()) -> dict[str, Any]:
    """Return the violations of a dataset, and the numerical warnings of its solution, by column."""
    wall = ArchivedWall(ds)
    found = check(wall) + [Violation("numerical warning", -1, 1.0, words) for words in dict.fromkeys(warned)]
    outcome = {"complete": "solved", "failed": "gave up"}.get(ds.attrs["status"], ds.attrs["status"])
    row: dict[str, Any] = {"outcome": "limit" if "limit" in ds.attrs and outcome == "solved" else outcome}
    words = [_on_one_line(ds.attrs["status_message"])] if outcome == "gave up" else []
    if wall.collapsed:
        row |= {"collapse_progress": ds.attrs["collapse_progress"], "must_collapse": must_collapse(wall)}
    last = max(wall.standing - 1, 0)
    for name, column in (
        ("progress", "progress"),
        ("damage_category", "category"),
        ("crack_width_max", "crack_width"),
        ("crack_band_width_max", "band_width"),
        ("unbalanced_force_ratio", "unbalanced"),
        ("energy_error", "energy_error"),
    ):
        if name in ds:
            row[column] = wall[name][last]
    silent, stated = ([v for v in found if v.stated == said] for said in (False, True))
    row["silent"], row["stated"] = ("; ".join(v.check for v in kind) for kind in (silent, stated))
    return row | {
        "blocks": wall.n,
        "increments": wall.increments,
        "words": " | ".join(words + [said(v) for v in found]),
    }


def lifts_off(scene: Scene, progress: float) -> str:
    """Return "lifted" if the footing needs a downward reaction at the reported collapse, else ''."""
    if scene.rig.support != "lift_off":
        return ""
    # until a support carries no load, bilateral and unilateral supports are the same
    way = float(np.nan_to_num(progress)) * scene.movement.central_deflection
    held = replace(
        scene,
        rig=replace(scene.rig, support="held", stop_at_zero=False),
        movement=replace(scene.movement, central_deflection=way),
    )
    return "lifted" if pulls_on_a_support(ArchivedWall(damagepred.solve(held, on_failure="return"))) else ""


def said(violation: Violation) -> str:
    """Return a violation on one line."""
    return f"{violation.check}, increment {violation.increment}: {violation.words}"


def empty_row(job: Job, words: str = "") -> dict[str, Any]:
    """Return the row of a job whose process hung or died."""
    nothing = dict.fromkeys(COLUMNS, "")
    return nothing | job._asdict() | {"outcome": "time" if "longer" in words else "died", "words": words}


def kept(file: Path) -> set[Job]:
    """Return the finished jobs."""
    if not file.exists():
        return set()
    with file.open(newline="", encoding="utf-8") as stream:
        return {Job(int(row["seed"]), int(row["scene"]), row["solver"]) for row in csv.DictReader(stream)}


def warm_up() -> None:
    """Compile all kernels before processes are forked and times are taken: two increments of some small walls."""
    for number in range(WARM_UP):
        scene = scene_of(0, number).scene
        bricks = scene.wall.length * scene.wall.height / (scene.wall.block_length * scene.wall.block_height)
        if bricks > SMALL:
            continue
        short = replace(scene, movement=replace(scene.movement, increments=2))
        for method in METHODS:
            with contextlib.suppress(DamagepredError), warnings.catch_warnings():
                warnings.simplefilter("ignore", RuntimeWarning)
                damagepred.solve(prepared(short, method, Budget(maximum_cycles=2000)))


def run(wanted: Sequence[Job], file: Path, limit: float, processes: int = 1) -> None:
    """Run the jobs that are not in a file, and add their rows.

    Parameters
    ----------
    wanted : sequence of Job
        The jobs.
    file : Path
        File of the rows.
    limit : float
        Wall-clock limit of a job (s).
    processes : int
        Number of processes.
    """
    known = kept(file)
    todo = [job for job in wanted if job not in known]
    if not todo:
        return
    warm_up()

    def lost(job: tuple[Any, ...], words: str) -> dict[str, Any]:
        return empty_row(Job(*job), words) | {"seconds": limit}

    cases.run(todo, Job._fields, one_of, lost, file, limit, processes=processes, every=50)


def one_of(*job: Any) -> dict[str, Any]:
    """Solve a scene, and print what is wrong with it."""
    row = one(Job(*job))
    if row["silent"] or row["outcome"] in ("traceback", "died"):
        print(f"scene {row['scene']}, {row['solver']}: {row['outcome']}: {row['words']}", flush=True)
    return row


def _on_one_line(error: object) -> str:
    return " ".join(str(error).split())
