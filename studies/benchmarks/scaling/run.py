"""Growth of time and memory of a path with blocks, contacts, zones and increments.

    python studies/benchmarks/scaling/run.py [--only blocks ...] [--limit 40] [--quick] [--output FOLDER]

Cases larger than one that exceeded the limit are not run, and both are listed.
"""

from __future__ import annotations

import resource
import statistics
import time
from collections.abc import Callable
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
from scipy.linalg import LinAlgError, cholesky_banded
from scipy.sparse.csgraph import reverse_cuthill_mckee

from damagepred.assembly import Model, wall_model
from damagepred.errors import DamagepredError
from damagepred.runtime.one_thread import one_blas_thread
from damagepred.scene import Scene
from damagepred.solvers import solve_path
from damagepred.solvers.explicit.stepper import explicit_path
from damagepred.solvers.system.discrete_system import DiscreteSystem
from studies import cases as campaign
from studies.benchmarks.scaling.cases import GROWING, Case, Curve, all_cases, scene_of

FINE = ("complete", "collapsed")
ENOUGH, REPEATS = 3.0, 5
"""What takes less than this in all (s) is repeated up to so often, and the median counts."""
SMALL = 30
"""Blocks of the wall on which compiled code is loaded."""
BAND_LIMIT = 4e9
"""Largest size of the band in bytes."""
Row = dict[str, Any]


def measure(*key: Any) -> Row:
    """Solve a case and return its measurements: processor time (s), peak memory (MB), steps and sizes."""
    case = Case(*key)
    curve, scene = GROWING[case.grows][case.curve], scene_of(case)
    warm_up(case)
    before = memory("VmRSS")
    model = wall_model(scene)
    row: Row = {"memory_before": before, "blocks": model.n_blocks, "contacts": model.n_contacts}
    row |= {"zones": 0 if model.mesh is None else len(model.mesh.zones), "dofs": model.size}
    row["increments"] = scene.movement.increments
    began = time.process_time()
    row |= follow(model, scene, curve, scene.movement.increments) | {"memory": memory("VmHWM")}
    row["seconds"] = time.process_time() - began
    if row["seconds"] < ENOUGH:
        row["seconds"] = median_time(lambda: follow(model, scene, curve, scene.movement.increments))
    if curve.method == "quasi_static" and case.grows == "blocks" and not curve.zoned:
        row |= factorise(model)
    return row


def warm_up(case: Case) -> None:
    """Compile what a case needs, or load what is compiled."""
    small = scene_of(case, SMALL)
    follow(wall_model(small), small, GROWING[case.grows][case.curve], 2)


def median_time(work: Callable[[], Any]) -> float:
    """Return the median processor time of a call (s)."""
    times: list[float] = []
    while len(times) < REPEATS and sum(times) < ENOUGH:
        began = time.process_time()
        work()
        times.append(time.process_time() - began)
    return statistics.median(times)


def follow(model: Model, scene: Scene, curve: Curve, increments: int) -> Row:
    """Follow a path, or only its equilibrium under dead load, without storing it; return its work."""
    row: Row = {"iterations": 0, "factorisations": 0, "end": "complete"}
    path = solve_path(model, scene.solver, increments)
    if curve.only_weight:
        path = islice(explicit_path(model, scene.solver, 1, elastic_start=False), 1)
    try:
        for step in path:
            row["iterations"] += step.counters.newton_iterations + step.counters.cycles
            row["factorisations"] += step.counters.factorisations
            row["end"] = "collapsed" if step.collapsed else row["end"]
    except DamagepredError as error:
        row |= {"end": "failed", "message": f"{type(error).__name__}: {error}"}
    return row


def memory(name: str) -> float:
    """Return memory of this process (MB): of the present, which resets the peak, or the peak since."""
    try:
        if name == "VmRSS":
            Path("/proc/self/clear_refs").write_text("5")
        lines = Path("/proc/self/status").read_text(encoding="ascii").splitlines()
        return float(next(line.split()[1] for line in lines if line.startswith(name))) / 1024
    except OSError:  # not Linux
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


@one_blas_thread()
def factorise(model: Model) -> Row:
    """Return the time (s) of a banded factorisation of the elastic stiffness, in the narrower of two orders.

    The orders are that of the courses and reverse Cuthill-McKee.
    """
    system = DiscreteSystem.of(model)
    free = system.free_dofs
    stiffness = system.elastic_stiffness[free][:, free].tocsr()
    by_course = np.lexsort((model.blocks.x, model.blocks.course))
    orders = ((3 * by_course[:, None] + np.arange(3)).ravel(), reverse_cuthill_mckee(stiffness, symmetric_mode=True))
    ordered = [stiffness[order][:, order].tocoo() for order in orders]
    entries = min(ordered, key=lambda entries: np.abs(entries.row - entries.col).max())
    width = int(np.abs(entries.row - entries.col).max())
    if 8 * (width + 1) * len(free) > BAND_LIMIT:
        return {"bandwidth": width}
    lower = entries.row >= entries.col
    rows, columns = entries.row[lower], entries.col[lower]
    band = np.zeros((width + 1, len(free)), order="F")
    band[rows - columns, columns] = entries.data[lower]
    try:
        seconds = median_time(lambda: cholesky_banded(band, lower=True, check_finite=False))
    except LinAlgError:
        return {"bandwidth": width}
    return {"bandwidth": width, "cholesky": seconds}


def lost(_: tuple[Any, ...], message: str) -> Row:
    """Return the row of a case that hung or died."""
    return {"end": "time-out" if "longer" in message else "failed", "message": message}


def beyond(key: tuple[Any, ...], rows: list[Row]) -> Row | None:
    """Return the row of a case that is larger than one that was not solved; None for others."""
    if any((row["grows"], row["curve"]) == key[:2] and row["end"] not in FINE for row in rows):
        return {"end": "not run", "message": "a smaller case took too long"}
    return None


def run_all(cases: list[Case], data: Path, limit: float) -> None:
    """Run cases, small ones first; what they need is compiled before processes are forked."""

    def ready() -> None:
        for case in {case[:2]: case for case in cases}.values():
            warm_up(case)

    campaign.run(cases, Case._fields, measure, lost, data, limit, fresh_process=True, leave_out=beyond, before=ready)


if __name__ == "__main__":
    options = campaign.options(__doc__, __file__, GROWING, 40.0)
    asked = [case for case in all_cases() if not options.only or case.grows in options.only]
    small = [case for case in asked if case[:2] == ("blocks", "quasi-static, dpc")][:2]
    run_all(small if options.quick else asked, options.output / "data.csv", options.limit)
