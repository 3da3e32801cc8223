"""Solve a case and judge its result."""

from __future__ import annotations

import time
import warnings
from typing import Any

import numpy as np

from damagepred.errors import DamagepredError, InputError, SolverError
from studies.benchmarks.stress.case import STATIC, Case, Found, NotTriedError, found, solver_of
from studies.benchmarks.stress.checks import energy_made, not_finite, statics
from studies.benchmarks.stress.limit import cannot_stand

SLACK = 3.0
"""Factor on a solver's tolerance within which independently summed forces must balance."""
ASTRAY = 0.1
"""Displacement of a collapsed wall on fixed ground, as a share of a block's size."""
SEEN, FARTHER = 1e-4, 2.5
"""Displacement (m) of a collapsed wall at the end of a run in time, and its ratio to that at half of the time."""


def judge(case: Case, way: str) -> dict[str, Any]:
    """Solve a case in one way; return the row of its result."""
    row: dict[str, Any] = {"verdict": "FAILED", "by": "", "off": np.nan, "seconds": 0.0, "message": ""}
    begun = time.process_time()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", RuntimeWarning)
            result = found(case, way)
        row |= verdict(case, way, result)
    except NotTriedError as error:
        row |= {"verdict": "not tried", "message": said(error)}
    except DamagepredError as error:
        gave_up = isinstance(error, SolverError) and not isinstance(error, InputError)
        row |= {"verdict": "gave up" if gave_up else "refused", "message": said(error)}
    except Exception as error:
        row["message"] = f"{type(error).__name__}: {said(error)}"
    row["seconds"] = time.process_time() - begun
    return row


def said(error: Exception) -> str:
    """Return the message of an error, on one line."""
    return " ".join(str(error).split())


def sets_off(result: Found) -> bool:
    """Return whether a run in time collapses: its displacement is at least four times as large in twice the time.

    A collapsed wall may have come to rest again by the end: then it is displaced by a tenth of a block.
    """
    model, size = result.model, float(np.sqrt(result.model.blocks.area.max(where=result.model.moves, initial=0.0)))
    ground = max(model.ground.full.largest(), np.abs(model.supports.prescribed_displacement).max(initial=0.0))
    half, end = (
        np.abs(step.displacement[model.moves, :2]).max(initial=0.0)
        for step in (result.path[len(result.path) // 2], result.path[-1])
    )
    return bool(end > ASTRAY * size + 2.0 * ground or (end > SEEN + 2.0 * ground and end > FARTHER * half))


def verdict(case: Case, way: str, result: Found) -> dict[str, Any]:
    """Judge a result."""
    other = case.expect_in_time
    expect = case.expect if way in STATIC or other is None else other
    if expect == "refused":
        return {"verdict": "WRONG", "by": "geometry", "message": "taken for a wall"}
    wrong = not_finite(result)
    if wrong:
        return {"message": f"not finite: {wrong}"}
    wrong = energy_made(result)
    if wrong:
        return {"message": f"energy from nothing: {wrong}"}
    fell = any(step.collapsed for step in result.path) or (way not in STATIC and sets_off(result))
    if fell and expect == "stands":
        return {"verdict": "WRONG", "by": "statics", "message": "said to fall, but it can stand"}
    if not fell and expect == "falls":
        return {"verdict": "WRONG", "by": "statics", "message": "said to stand, but it cannot"}
    check = None if case.check is None else case.check(result)
    if check is not None:
        good = check.off <= check.allowed
        kind = ("fell, rightly" if fell and expect else "right") if good else "WRONG"
        return {"verdict": kind, "by": check.by, "off": check.off}
    if way not in STATIC:
        if expect:
            return {"verdict": "fell, rightly" if fell else "right", "by": "stands or falls"}
        return {"verdict": "fell" if fell else "solved", "by": ""}
    tolerance = solver_of(case, way).tolerance_used
    force, law = statics(result, tolerance)
    if max(force, law) > SLACK:
        what = "forces" if force > SLACK else "law"
        return {"verdict": "WRONG", "by": what, "off": max(force, law), "message": f"{what}, in tolerances"}
    if fell:
        if expect == "falls":
            return {"verdict": "fell, rightly", "by": "stands or falls"}
        last = next(step for step in result.path if step.collapsed)
        proven = cannot_stand(result.model, last)
        return {"verdict": "fell, rightly" if proven else "fell", "by": "limit analysis" if proven else ""}
    return {"verdict": "right", "by": "statics", "off": force}
