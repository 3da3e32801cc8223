"""Results of the explicit solver, stored so that each wall is solved only once."""

from __future__ import annotations

import sys
import time
from concurrent.futures import TimeoutError as TooLate
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from pebble import ProcessPool
from walls import Case, fingerprint

from damagepred.errors import SolverError
from damagepred.one_wall.judged_path import follow
from damagepred.scene import Solver

# the reference skips no computation
FAST = Solver(method="explicit", symmetric_half=False, ramp_cycles=3000)
SLOW = replace(FAST, tolerance=1e-4, ramp_cycles=10_000, maximum_cycles=1_000_000)
SLOWER = replace(FAST, tolerance=1e-5, ramp_cycles=40_000, maximum_cycles=4_000_000)
DAMPED = replace(SLOWER, damping=0.98)
PACES = {"fast": FAST, "slow": SLOW, "slower": SLOWER, "damped": DAMPED}
"""Rates of the explicit solver: cycles of the ramp of an increment, tolerance and damping. The last is as slow as the
third, and more damped, so that the release of a broken bond is less dynamic."""

Result = dict[str, Any]


def pace_text(solver: Solver) -> str:
    """Return the settings of a rate in words."""
    return f"ramp {solver.ramp_cycles}, tolerance {solver.tolerance_used:g}, damping {solver.damping:g}"


def path_of(case: Case, solver: Solver) -> Result:
    """Follow a wall's path; return the fields of its last increment and the values of every increment."""
    model = case.model()
    rows, step = [], None
    end, began = "complete", time.perf_counter()
    try:
        for step in follow(model, solver, case.scene.damage, case.scene.movement.increments):
            inc, verdict = step.increment, step.verdict
            rows.append(
                (
                    inc.load_factor * model.central_deflection,
                    inc.base_reaction,
                    verdict.crack_width_max,
                    max(verdict.crack_width_max, verdict.base_crack_width_max),
                    verdict.dpc_opening_max,
                    verdict.damage_category,
                    (inc.state == 1).sum(),
                    inc.unbalanced_force_ratio,
                    inc.counters.newton_iterations + inc.counters.cycles,
                    verdict.crack_band_width_max,
                    verdict.damage_category_band,
                )
            )
            if inc.collapsed:
                end = "collapsed"
    except SolverError as error:
        end = f"{type(error).__name__}: {error}"
    result: Result = {"end": end, "seconds": time.perf_counter() - began}
    names = (
        "deflection",
        "base_reaction",
        "crack_width",
        "crack_width_anywhere",
        "dpc_opening",
        "category",
        "cracked",
        "unbalanced",
        "iterations",
        "crack_band",
        "category_band",
    )
    result.update(zip(names, np.array(rows, dtype=np.float64).reshape(-1, len(names)).T, strict=True))
    if step is not None:
        last = step.increment
        for name in ("opening", "slip", "normal_stress", "shear_stress", "state"):
            result[name] = getattr(last, name)
    return result


def cache_file(folder: Path, case: Case, solver: Solver) -> Path:
    """Return the file of a result: by the wall's name, a hash of its numbers, and the rate."""
    name = f"{case.name} {fingerprint(case.model())} {pace_text(solver)}"
    return folder / f"{name.replace(',', '').replace(' ', '_')}.npz"


def explicit_results(
    cases: list[Case], paces: list[str], folder: Path, *, fresh: bool, processes: int, limit: float
) -> dict[tuple[str, str], Result]:
    """Return the explicit solver's results of walls at some rates, from the folder or computed now."""
    folder.mkdir(parents=True, exist_ok=True)
    wanted = [(case, pace, cache_file(folder, case, PACES[pace])) for case in cases for pace in paces]
    missing = [job for job in wanted if fresh or not job[2].exists()]
    if missing:
        note(f"explicit solver: {len(missing)} of {len(wanted)} paths to follow, the others are kept in {folder.name}")
        with ProcessPool(max_workers=processes) as pool:
            running = [(job, pool.schedule(path_of, args=[job[0], PACES[job[1]]], timeout=limit)) for job in missing]
            for done, ((case, pace, file), future) in enumerate(running, start=1):
                try:
                    result = future.result()
                except TooLate:
                    result = {"end": f"took longer than {limit:g} s", "seconds": limit}
                with file.open("wb") as to:
                    np.savez_compressed(to, **result)
                note(f"{done} of {len(missing)}: {case.name}, {pace}: {result['end']}, {result['seconds']:.1f} s")
    return {(case.name, pace): load(file) for case, pace, file in wanted}


def load(file: Path) -> Result:
    with np.load(file) as kept:
        return {name: values.item() if values.ndim == 0 else values for name, values in kept.items()}


def note(text: str) -> None:
    """Print the progress."""
    print(text, file=sys.stderr, flush=True)


def complete(result: Result) -> bool:
    return bool(result["end"] == "complete")
