"""Solve a case and judge its result: finite values, energy balance, equilibrium and joint law of the stresses.

No check uses the solvers' own diagnostics: forces are summed from the stresses of the contacts, and compared with the
law of the input.
"""

from __future__ import annotations

import time
import warnings
from dataclasses import asdict, fields, is_dataclass
from typing import Any

import numpy as np

from damagepred.arrays import FloatArray
from damagepred.assembly import Model
from damagepred.enumerations import ContactState
from damagepred.errors import DamagepredError, InputError, SolverError
from damagepred.solvers import Increment
from studies.benchmarks.stress.case import STATIC, Case, Found, NotTriedError, found, solver_of

MADE = 1e-3
"""Allowed gain of energy, as a share of the energy exchanged: steps are of finite length."""
MADE_IN_TIME = 0.02
"""The same of a run in time, whose blocks hit each other."""
TAKEN = ("friction_work", "fracture_work", "crushing_work", "plastic_work", "released_energy", "damping_work")
"""Dissipated energies, which cannot be negative."""
OPTIONAL = {"deflection", "jack_load", "last_stable_load_factor", "broken_at"}
"""Fields of an increment that may be NaN."""
LAW_WITHIN = 1e-5
"""Share of a strength by which stresses may exceed it: bonds break beyond 1e-6 of theirs."""
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
        return (
            {"verdict": "fell, rightly", "by": "stands or falls"}
            if expect == "falls"
            else {"verdict": "fell", "by": ""}
        )
    return {"verdict": "right", "by": "statics", "off": force}


def not_finite(found: Found) -> str:
    """Return the fields that are not finite in any increment, '' if none."""
    known = None
    for step in found.path:
        values = {f.name: getattr(step, f.name) for f in fields(step) if f.name not in OPTIONAL}
        for group in ("zones", "energy", "counters"):
            record = values.pop(group)
            if record is not None:
                described = asdict(record) if is_dataclass(record) else record._asdict()
                values |= {f"{group}.{name}": value for name, value in described.items()}
        numbers = {name: np.asarray(v) for name, v in values.items() if v is not None and not isinstance(v, str)}
        absent = {name for name, value in numbers.items() if value.ndim == 0 and np.isnan(value)}
        # the explicit solver has no energy balance, and only runs in time have a time: in all increments or in none
        known = absent if known is None else known
        wrong = [n for n, v in numbers.items() if n not in known and not np.isfinite(v).all()]
        if wrong:
            return f"{', '.join(wrong)} in increment {step.number}"
    return ""


def energy_made(found: Found) -> str:
    """Return a description of a gain of energy, '' if there is none."""
    allowed = MADE if found.run is None else MADE_IN_TIME
    begun, size = found.path[0].energy.kinetic_energy + found.path[0].energy.elastic_energy, 0.0
    for step in found.path:
        energy, when = step.energy, f"in increment {step.number}" if found.run is None else f"by {step.time:.3g} s"
        if found.run is None and step.number == 0 and not found.model.ground.moves:
            given = np.abs(found.model.supports.load * step.displacement.ravel()).sum()
            held = stored(found.model, step)
            if held > (1.0 + MADE) * given and found.model.mesh is None and not step.collapsed:
                return f"joints hold {held:.3g} J where the loads gave at most {given:.3g} J"
        if np.isnan(energy.external_work):
            continue
        taken = {name: getattr(energy, name) for name in TAKEN if np.isfinite(getattr(energy, name))}
        if found.run is None:
            size = max(abs(energy.external_work), energy.elastic_energy, energy.friction_work + energy.fracture_work)
        else:
            held = energy.kinetic_energy + energy.elastic_energy
            size = max(size, begun + abs(energy.external_work), held, sum(taken.values()))
            if energy.energy_error < -allowed * size - 1e-12:
                return f"{-energy.energy_error:.3g} J made {when}, of {size:.3g} J"
        for name, value in taken.items():
            if value < -allowed * size - 1e-12:
                return f"{name} = {value:.3g} J {when}, of {size:.3g} J"
    return ""


def stored(model: Model, step: Increment) -> float:
    """Return the elastic energy of the joints (J), from their stresses."""
    law = model.properties
    each = step.normal_stress**2 / law.normal_stiffness[:, None] + step.shear_stress**2 / law.shear_stiffness[:, None]
    return 0.5 * float((model.interfaces.contact_area * each).sum())


def imbalance(model: Model, step: Increment) -> float:
    """Return the largest unbalanced force over the mean block weight, from the contact stresses alone."""
    face, n = model.interfaces, model.n_blocks
    normal = np.column_stack((face.normal_x, face.normal_y))
    tangent = np.column_stack((face.normal_y, -face.normal_x))
    where = np.stack((face.x, face.y), axis=-1)[:, None] + face.contact_offset[..., None] * tangent[:, None]
    pull = step.normal_stress[..., None] * normal[:, None] + step.shear_stress[..., None] * tangent[:, None]
    pull = pull * face.contact_area[..., None]
    centre = np.column_stack((np.append(model.blocks.x, 0.0), np.append(model.blocks.y, 0.0)))
    force = np.zeros((n + 1, 3))
    force[:n] = (model.supports.load + step.load_factor * model.supports.live_load).reshape(n, 3)
    if step.support_force is not None:
        force[:n] += step.support_force
    for block, sign in ((face.block_a, 1.0), (face.block_b, -1.0)):
        arm = where - centre[block][:, None]
        turn = arm[..., 0] * pull[..., 1] - arm[..., 1] * pull[..., 0]
        np.add.at(force, block, sign * np.column_stack((pull.sum(axis=1), turn.sum(axis=1))))
    force[:n, 2] /= np.sqrt(model.blocks.polar / model.blocks.area)
    return float(np.abs(force[:n]).max() / model.mean_block_weight)


def plain_law(model: Model) -> bool:
    """Return whether all joints have the paper's law, or that with residual values."""
    law = model.properties
    others = (law.brittle_shear, law.critical_opening, law.dilation, law.gap, np.isfinite(law.compressive_strength))
    return model.sections is None and not any(other.any() for other in others)


def beyond_law(model: Model, step: Increment) -> float:
    """Return the largest force of a contact beyond its law, over the mean block weight and over its own size."""
    law, cracked = model.properties, step.state == ContactState.CRACKED

    def now(whole: FloatArray, left: FloatArray) -> FloatArray:
        return np.where(cracked, left[:, None], whole[:, None])

    strength = now(law.tensile_strength, law.residual_tensile_strength)
    cohesion, friction = now(law.cohesion, law.residual_cohesion), now(law.friction, law.residual_friction)
    sigma, tau = step.normal_stress, np.abs(step.shear_stress)
    limit = np.maximum(cohesion - friction * sigma, 0.0)
    weight = model.mean_block_weight / model.interfaces.contact_area
    excess = np.maximum(sigma - strength * (1 + LAW_WITHIN), tau - limit * (1 + LAW_WITHIN)) - LAW_WITHIN * cohesion
    return float((excess / (weight + LAW_WITHIN * (np.abs(sigma) + tau))).max(initial=0.0))


def statics(found: Found, allowed: float) -> tuple[float, float]:
    """Return the worst imbalance and excess (block weights) of all equilibria; law only where it is the plain one."""
    standing = [step for step in found.path if not step.collapsed]
    worst = max((imbalance(found.model, step) for step in standing), default=0.0)
    law = max((beyond_law(found.model, step) for step in standing), default=0.0) if plain_law(found.model) else 0.0
    return worst / allowed, law / allowed
