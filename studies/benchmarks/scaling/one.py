"""One case in a separate process: its measurements, each printed as a line of JSON."""

from __future__ import annotations

import json
import os
import resource
import signal
import statistics
import time
from collections.abc import Callable, Iterator
from itertools import islice
from pathlib import Path
from threading import Thread
from typing import Any

from damagepred.assembly import Model, wall_model
from damagepred.enumerations import ContactState, ZoneState
from damagepred.errors import DamagepredError
from damagepred.scene import Scene
from damagepred.solvers import Increment, solve_path
from studies.benchmarks.scaling.cases import Case, Curve, curve_of, scene_of
from studies.benchmarks.scaling.cholesky import factorise

ENOUGH, REPEATS = 3.0, 5
"""A path is timed 5 times or for 3 s in all, whichever is shorter; the median counts."""
SMALL = 30
"""Blocks of the wall on which compiled code is loaded."""

Say = Callable[..., None]


def measure(case: Case, say: Say) -> None:
    """Solve a case; report each measurement at once."""
    if case.grows == "samples":
        from studies.benchmarks.scaling import samples

        samples.measure(case, say)
        return
    curve, scene = curve_of(case), scene_of(case)
    began = time.process_time()
    small = scene_of(case, SMALL)
    follow(path_of(wall_model(small), small, curve, 2), {})
    say(warm_up=time.process_time() - began, memory_before=memory_now())
    began = time.process_time()
    model = wall_model(scene)
    mesh = model.mesh
    say(
        assemble=time.process_time() - began,
        blocks=model.n_blocks,
        contacts=model.n_contacts,
        zones=0 if mesh is None else len(mesh.zones),
        dofs=model.size,
        increments=scene.movement.increments,
        length=scene.wall.length,
        height=scene.wall.height,
    )
    times: list[float] = []
    while len(times) < REPEATS and sum(times) < ENOUGH:
        row: dict[str, Any] = {}
        began = time.process_time()
        follow(path_of(model, scene, curve, scene.movement.increments), row, say if not times else None)
        times.append(time.process_time() - began)
        if len(times) == 1:
            say(memory=memory_peak(), **row)
    say(seconds=statistics.median(times), runs=len(times))
    if curve.method == "quasi_static" and case.grows == "blocks" and not curve.zoned:
        say(**factorise(model))


def path_of(model: Model, scene: Scene, curve: Curve, increments: int) -> Iterator[Increment]:
    """Return the increments of a wall; or only its equilibrium under dead load."""
    if not curve.only_weight:
        return solve_path(model, scene.solver, increments)
    from damagepred.solvers.explicit.stepper import explicit_path

    return islice(explicit_path(model, scene.solver, 1, elastic_start=False), 1)


def follow(path: Iterator[Increment], row: dict[str, Any], say: Say | None = None) -> None:
    """Follow a path without storing it; count the work in ``row``."""
    row.update(iterations=0, events=0, factorisations=0, reached=-1, end="complete")
    try:
        for step in path:
            row["iterations"] += step.counters.newton_iterations + step.counters.cycles
            for name in ("events", "factorisations"):
                row[name] += getattr(step.counters, name)
            row["reached"] = step.number
            row["cracked"] = int((step.state == ContactState.CRACKED).sum())
            if step.zones is not None:
                row["yielded"] = int((step.zones.state > ZoneState.ELASTIC).sum())
            if step.collapsed:
                row["end"] = "collapsed"
            if say is not None:
                say(**row)
    except DamagepredError as error:
        row["end"], row["message"] = "failed", f"{type(error).__name__}: {error}"


def memory_now() -> float:
    """Reset the peak memory, where the system can; return the memory of the process (MB)."""
    try:
        Path("/proc/self/clear_refs").write_text("5")
        return _status("VmRSS")
    except OSError:
        return memory_peak()


def memory_peak() -> float:
    """Return the peak memory of this process since ``memory_now`` (MB)."""
    try:
        return _status("VmHWM")
    except OSError:
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def _status(name: str) -> float:
    text = Path("/proc/self/status").read_text(encoding="ascii")
    return float(next(line.split()[1] for line in text.splitlines() if line.startswith(name))) / 1024


def say_line(**known: Any) -> None:
    """Print a measurement."""
    print(json.dumps(known, default=float), flush=True)


def alone(case: Case, limit: float) -> None:
    """Measure in this process, which ends after a limit of processor time (s)."""
    # not by RLIMIT_CPU or a system timer: with these some systems have a clock resolution of 10 ms
    Thread(target=_end_after, args=(limit,), daemon=True).start()
    measure(case, say_line)


def _end_after(limit: float) -> None:
    while time.process_time() < limit:
        time.sleep(min(0.2, 0.2 * limit))
    os.kill(os.getpid(), signal.SIGKILL)
