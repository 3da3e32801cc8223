"""Independent checks of a solved path, by forces that are summed from the contact stresses."""

from dataclasses import asdict, fields, is_dataclass, replace
from typing import NamedTuple

import numpy as np

from damagepred.arrays import FloatArray
from damagepred.assembly import Model
from damagepred.enumerations import ContactState
from damagepred.solvers import Increment

MADE = 1e-3
"""Allowed gain of energy, as a share of the energy exchanged: steps are of finite length."""
TAKEN = ("friction_work", "fracture_work", "crushing_work", "plastic_work", "released_energy", "damping_work")
"""Dissipated energies, which cannot be negative."""
OPTIONAL = {"deflection", "jack_load", "last_stable_load_factor", "broken_at"}
"""Fields of an increment that may be NaN."""
LAW_WITHIN = 1e-5
"""Share of a strength by which stresses may exceed it: bonds break beyond 1e-6 of theirs."""


class Found(NamedTuple):
    model: Model
    path: list[Increment]


def not_finite(found: Found) -> str:
    """Fields that are not finite in any increment, '' if none."""
    known = None
    for step in found.path:
        values = {f.name: getattr(step, f.name) for f in fields(step) if f.name not in OPTIONAL}
        for group in [name for name, v in values.items() if is_dataclass(v) or hasattr(v, "_asdict")]:
            record = values.pop(group)
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
    """Description of a gain of energy, '' if there is none."""
    for step in found.path:
        energy = step.energy
        if step.number == 0 and not found.model.ground.moves:
            given = np.abs(found.model.supports.load * step.displacement.ravel()).sum()
            held = stored(found.model, step)
            if held > (1.0 + MADE) * given and found.model.mesh is None and not step.collapsed:
                return f"joints hold {held:.3g} J where the loads gave at most {given:.3g} J"
        if np.isnan(energy.external_work):
            continue
        taken = {name: getattr(energy, name) for name in TAKEN if np.isfinite(getattr(energy, name))}
        size = max(abs(energy.external_work), energy.elastic_energy, energy.friction_work + energy.fracture_work)
        for name, value in taken.items():
            if value < -MADE * size - 1e-12:
                return f"{name} = {value:.3g} J in increment {step.number}, of {size:.3g} J"
    return ""


def stored(model: Model, step: Increment) -> float:
    """Elastic energy of the joints (J), from their stresses."""
    law = model.properties
    each = step.normal_stress**2 / law.normal_stiffness[:, None] + step.shear_stress**2 / law.shear_stiffness[:, None]
    return 0.5 * float((model.interfaces.contact_area * each).sum())


def unbalanced(model: Model, step: Increment) -> FloatArray:
    """Force on each block (n, 3) over the mean block weight: loads, and contact stresses times areas and arms."""
    face, n = model.interfaces, model.n_blocks
    normal = np.column_stack((face.normal_x, face.normal_y))
    tangent = np.column_stack((face.normal_y, -face.normal_x))
    where = np.stack((face.x, face.y), axis=-1)[:, None] + face.contact_offset[..., None] * tangent[:, None]
    # tension pulls block a along the normal; where b is sheared along the tangent, it drags a with it
    pull = step.normal_stress[..., None] * normal[:, None] + step.shear_stress[..., None] * tangent[:, None]
    pull = pull * face.contact_area[..., None]
    centre = np.column_stack((np.append(model.blocks.x, 0.0), np.append(model.blocks.y, 0.0)))
    force = np.zeros((n + 1, 3))
    force[:n] = model.supports.load.reshape(n, 3)
    for block, sign in ((face.block_a, 1.0), (face.block_b, -1.0)):
        arm = where - centre[block][:, None]
        turn = arm[..., 0] * pull[..., 1] - arm[..., 1] * pull[..., 0]
        np.add.at(force, block, sign * np.column_stack((pull.sum(axis=1), turn.sum(axis=1))))
    force[:n, 2] /= np.sqrt(model.blocks.polar / model.blocks.area)
    return force[:n] / model.mean_block_weight


def imbalance(model: Model, step: Increment) -> float:
    """Largest unbalanced force over the mean block weight, under live loads and held by supports, too."""
    acting = model.supports.load + step.load_factor * model.supports.live_load
    if step.support_force is not None:
        acting = acting + step.support_force.ravel()
    return float(np.abs(unbalanced(replace(model, supports=model.supports._replace(load=acting)), step)).max())


def plain_law(model: Model) -> bool:
    """Whether all joints have the paper's law, or that with residual values."""
    law = model.properties
    others = (law.brittle_shear, law.critical_opening, law.dilation, law.gap, np.isfinite(law.compressive_strength))
    return model.sections is None and not any(other.any() for other in others)


def beyond_law(model: Model, step: Increment) -> float:
    """Largest force of a contact beyond its law, over the mean block weight and over its own size."""
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
    """Worst imbalance and excess (block weights) of all equilibria; law only where it is the plain one."""
    standing = [step for step in found.path if not step.collapsed]
    worst = max((imbalance(found.model, step) for step in standing), default=0.0)
    law = max((beyond_law(found.model, step) for step in standing), default=0.0) if plain_law(found.model) else 0.0
    return worst / allowed, law / allowed
