"""Checks of every archived wall: equilibrium, joint law, energy and damage, each from the equations alone."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

from audited.damage import damage
from audited.tolerances import Tolerances
from audited.wall import CONTROL, CRACKED, DPC, EXPONENT, INTACT, SECTION, SLIPPING, ArchivedWall
from damagepred.arrays import FloatArray


class Violation(NamedTuple):
    """A rule that an archived wall violates.

    Attributes
    ----------
    check : str
        Name of the rule.
    increment : int
        Number of the increment.
    amount : float
        Ratio to the allowed value.
    words : str
        Figures.
    stated : bool
        Whether the archive itself states it: then it is reported, but not silent.
    """

    check: str
    increment: int
    amount: float
    words: str
    stated: bool = False


Found = Iterator[Violation]


def check(wall: ArchivedWall, tolerances: Tolerances | None = None) -> list[Violation]:
    """Return all violations of an archived wall, each check's worst one.

    Parameters
    ----------
    wall : ArchivedWall
        The wall.
    tolerances : Tolerances, optional
        Tolerances of the checks.
    """
    allowed = Tolerances() if tolerances is None else tolerances
    worst: dict[str, Violation] = {}
    broken = list(finite(wall))
    for rule in () if broken else CHECKS:
        broken += rule(wall, allowed)
    for one in broken:
        if one.check not in worst or one.amount > worst[one.check].amount:
            worst[one.check] = one
    return list(worst.values())


def _beyond(name: str, step: int, excess: FloatArray, allowed: FloatArray, what: str = "Pa") -> Found:
    """Yield a violation where an excess is larger than allowed."""
    excess, allowed = np.broadcast_arrays(excess, allowed)
    wrong = np.flatnonzero(excess > allowed)
    if wrong.size:
        at = wrong[np.argmax(excess[wrong])]
        ratio = float(excess[at] / allowed[at]) if allowed[at] > 0 else np.inf
        yield Violation(
            name, step, ratio, f"{excess[at]:.3g} {what} at {at}, allowed {allowed[at]:.3g}; {wrong.size} places"
        )


# -- numbers and status ------------------------------------------------------------------------------------------------


ABSENT = {"contact_broken_at", "opening_width_change", "opening_distortion", "opening_diagonal_change"}
"""Variables that may be NaN, such as the breaking of an intact bond."""
NOT_EXPLICIT = {
    "joint_law_violation",
    "external_work",
    "elastic_energy",
    "friction_work",
    "fracture_work",
    "crushing_work",
    "plastic_work",
    "released_energy",
    "snap_through_energy",
    "energy_error",
}
"""Variables that the explicit solver does not store."""


def finite(wall: ArchivedWall) -> Found:
    """Find values that are not finite, and statuses that do not fit the path."""
    for name, variable in wall.ds.variables.items():
        if variable.dtype.kind != "f" or name in ABSENT or (wall.explicit and name in NOT_EXPLICIT):
            continue
        if np.isfinite(variable.values).all() or (name in SLOPES and not measurable(wall, str(name))):
            continue
        yield Violation("finite", -1, np.inf, f"{name} is not finite")
    status, progress = wall.ds.attrs["status"], wall["progress"]
    if status not in ("complete", "collapsed", "failed"):
        yield Violation("status", -1, np.inf, f"status = {status}")
    if (np.diff(progress) <= 0).any() and not wall.collapsed:
        yield Violation("status", -1, np.inf, "progress does not grow")
    limit = "limit" in wall.ds.attrs
    if status == "complete" and not limit and (abs(progress[-1] - 1) > 1e-9 or wall.steps != wall.increments + 1):
        yield Violation(
            "status", -1, np.inf, f"complete at progress {progress[-1]:.6g} after {wall.steps - 1} increments"
        )
    if wall.collapsed and wall.steps > 1 and not 0 <= wall.ds.attrs["collapse_progress"] <= progress[-1] + 1e-12:
        yield Violation("status", -1, np.inf, f"collapse_progress = {wall.ds.attrs['collapse_progress']}")


SLOPES = ("tilt_max", "slope_max", "base_slope_max")
"""Variables that are not known where a wall has no two bricks to measure between."""


def measurable(wall: ArchivedWall, name: str) -> bool:
    """Whether the wall has two bricks between which a slope can be measured without doubt.

    For a tilt these stand one right over the other, for a slope in one course. A pair is at most a metre apart, and at
    least half of that, or of the wall or course where that is shorter: a door may leave none.
    """
    course = wall["block_course"]
    dpc = wall.place[wall["contact_kind"] == DPC, 1].max(initial=-np.inf)
    own = np.flatnonzero((course >= 0) & (wall.centroid[:, 1] > dpc if name != "base_slope_max" else course == 0))
    x, y = wall.centroid[own].T
    apart = np.abs(y[:, None] - y)
    if name == "tilt_max":
        far = (apart > 0) & (apart >= 0.5 * min(1.0, float(np.ptp(y))) * (1 + 1e-9)) & (apart <= 1.0)
        return bool((far & (np.abs(x[:, None] - x) < 1e-6)).any())
    for level in np.unique(course[own]):
        place = x[course[own] == level]
        apart = np.abs(place[:, None] - place)
        far = (apart > 1e-6) & (apart >= 0.5 * min(1.0, float(np.ptp(place))) * (1 + 1e-9)) & (apart <= 1.0)
        if far.any():
            return True
    return False


# -- statics -----------------------------------------------------------------------------------------------------------


def equilibrium(wall: ArchivedWall, allowed: Tolerances) -> Found:
    """Sum forces and moments on every block from the contact stresses, weights, roof, jacks and supports."""
    unit = wall.yardstick
    scale = np.column_stack((np.ones(wall.n), np.ones(wall.n), wall.gyration))
    for step in range(wall.standing):
        joints, size = wall.joint_forces(step)
        load = wall.load(step)
        ratio = np.abs(joints[: wall.n] + load) / scale / unit
        rounding = allowed.rounding * (size[: wall.n] + np.abs(load)) / scale / unit
        # a stress is the stiffness times a small difference of displacements
        rounding += 1e-15 * wall.largest_motion(step) * wall.stiffest / unit
        stated = float(wall["unbalanced_force_ratio"][step])
        # unbalanced forces of gridpoints add up in a block, which has some tens of them
        slack = allowed.explicit_slack if wall.explicit else allowed.unbalanced_slack
        limit = slack * max(stated, wall.tolerance) * np.where(wall.deformable, 30.0, 1.0)
        yield from _beyond(
            "equilibrium", step, ratio.max(axis=1), limit + rounding.max(axis=1) + 1e-12, "block weights"
        )
        if stated > wall.tolerance:
            words = f"unbalanced_force_ratio = {stated:.3g}, tolerance {wall.tolerance:.0e}"
            yield Violation("tolerance", step, stated / wall.tolerance, words, stated <= allowed.fallback)
        reaction = float(wall["base_reaction"][step])
        ground = float(-joints[wall.n, 1] + np.nan_to_num(wall["block_support_force_y"][step]).sum())
        within = np.array(allowed.rounding * size[wall.n, 1] + 1e-9 * unit + limit.max() * unit)
        yield from _bending(wall, step, limit.max())
        yield from _beyond("reaction", step, np.array([abs(reaction - ground)]), within[None], "N")


def _bending(wall: ArchivedWall, step: int, limit: float) -> Found:
    """Compare stress resultants of elastic blocks with the work of their contact stresses on strain and curvature."""
    if not wall.elastic.any():
        return
    sigma, tau = wall["contact_normal_stress"][step], wall["contact_shear_stress"][step]
    pull = wall.contact_area[:, None] * (sigma[:, None] * wall.normal + tau[:, None] * wall.tangent)
    total, size = np.zeros((wall.n + 1, 2)), np.zeros((wall.n + 1, 2))
    for side, sign, rows in zip(wall.sides, (1.0, -1.0), wall.strain_rows, strict=True):
        parts = np.einsum("cdk,ck->cd", rows, pull)
        np.add.at(total, side, sign * parts)
        np.add.at(size, side, np.abs(parts))
    inner = wall.strain_stiffness * wall.strains(step)[: wall.n]
    # in units of a force: a strain moves the ends of a block by half its length, a curvature by its eighth squared
    arm = np.column_stack((wall.size[:, 0] / 2, wall.size[:, 0] ** 2 / 8))
    off = np.abs(total[: wall.n] - inner) / arm / wall.yardstick
    rounding = (
        1e-11 * (size[: wall.n] + np.abs(inner)) / arm + 1e-14 * wall.largest_motion(step) * wall.stiffest
    ) / wall.yardstick
    here = wall.elastic
    yield from _beyond(
        "stress resultants", step, off[here].max(axis=1), (limit + rounding.max(axis=1) + 1e-12)[here], "block weights"
    )


def compatibility(wall: ArchivedWall, allowed: Tolerances) -> Found:
    """Compare openings with the motion of the rigid blocks on both sides and of the ground."""
    known = None
    for step in range(wall.standing):
        opening, _ = wall.motion(step)
        archived = wall["contact_opening"][step]
        known = ~np.isnan(opening)
        size = np.abs(archived).max(initial=0.0) + wall.largest_motion(step)
        yield from _beyond("compatibility", step, np.abs(opening - archived)[known], np.array(1e-9 * size + 1e-14), "m")


# -- joint law ---------------------------------------------------------------------------------------------------------


def bond(wall: ArchivedWall, step: int) -> FloatArray:
    """Return an upper bound of the integrity of each contact: 1 intact, 0 broken at once.

    For a softening bond it follows from the largest archived opening since it cracked. Openings between increments,
    softening by slip, and dilation can only reduce it, or are left out.
    """
    law, cracked = wall.law, wall["contact_state"][: step + 1] == CRACKED
    first = law.tensile_strength / law.normal_stiffness
    opened = np.where(cracked, wall["contact_opening"][: step + 1], 0.0).max(axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        left = np.clip((law.critical_opening - np.maximum(opened, first)) / (law.critical_opening - first), 0.0, 1.0)
    curved = np.exp(-EXPONENT * (1.0 - left)) - (1.0 - left) * np.exp(-EXPONENT)
    left = np.where(law.exponential & (left > 0), curved, left)
    left = np.where(law.critical_opening > 0, np.where(law.dilation > 0, 1.0, left), 0.0)
    return np.where(cracked[-1], left, 1.0)


def joint_law(wall: ArchivedWall, allowed: Tolerances) -> Found:
    """Compare the stresses of every contact with the strength of its state (FACTS 1)."""
    law, kind = wall.law, wall["contact_kind"]
    joint = kind != SECTION
    weight = wall.yardstick / wall.contact_area
    peak = np.where(np.isfinite(law.cohesion), np.maximum(law.cohesion, law.tensile_strength), 0.0)
    for step in range(wall.standing):
        sigma, tau = wall["contact_normal_stress"][step], np.abs(wall["contact_shear_stress"][step])
        state = wall["contact_state"][step]
        stated = 0.0 if wall.explicit else float(wall["joint_law_violation"][step])
        left = bond(wall, step)
        slack = stated * (1 + 1e-6) + allowed.strength_share * peak + 3.0 * wall.tolerance * weight
        strength = law.residual_tensile_strength + left * (law.tensile_strength - law.residual_tensile_strength)
        bare = np.where((state != CRACKED) & (strength == 0.0), allowed.bond_without_strength * weight, 0.0)
        yield from _beyond("tension", step, (sigma - strength)[joint], (slack + bare)[joint])
        yield from _beyond("tension in the dpc", step, sigma[kind == DPC], (slack + bare)[kind == DPC])
        # linear in the integrity: the larger of the ends
        limit = np.maximum(
            law.residual_cohesion - sigma * law.residual_friction,
            law.residual_cohesion
            + left * (law.cohesion - law.residual_cohesion)
            - sigma * (law.residual_friction + left * (law.friction - law.residual_friction)),
        )
        limit = np.maximum(limit, 0.0)
        f_c = law.compressive_strength
        pressed = np.clip(-sigma, 0.0, f_c)
        with np.errstate(invalid="ignore"):
            ellipse = np.where(np.isfinite(f_c), np.sqrt((f_c - pressed) * (f_c + pressed) / law.cap_shear), np.inf)
        # on the ellipse a rounding of the pressure near f_c is a root of it in shear
        near_cap = np.where(np.isfinite(f_c), 1e-6 * f_c, 0.0)
        yield from _beyond("shear", step, (tau - np.minimum(limit, ellipse))[joint], (slack + near_cap)[joint])
        yield from _beyond("cap", step, (-sigma - f_c)[joint], (slack + 1e-9 * np.nan_to_num(f_c, posinf=0.0))[joint])
        largest = float(peak.max(initial=0.0))
        if stated > allowed.stated_violation * largest + float((1e-3 * weight).max()):
            words = f"joint_law_violation = {stated:.3g} Pa, largest strength {largest:.3g} Pa"
            yield Violation("stated law violation", step, stated / max(largest, 1e-300), words, True)


def elasticity(wall: ArchivedWall, allowed: Tolerances) -> Found:
    """Compare stresses of elastic contacts with the elastic relation, and those of open joints with zero."""
    law, kind = wall.law, wall["contact_kind"]
    joint = (kind != SECTION) & np.isfinite(law.normal_stiffness)
    brittle = law.critical_opening == 0
    capped = np.isfinite(law.compressive_strength)
    for step in range(wall.standing):
        opening, sigma, tau = (wall[f"contact_{n}"][step] for n in ("opening", "normal_stress", "shear_stress"))
        state = wall["contact_state"][step]
        stated = 0.0 if wall.explicit else float(wall["joint_law_violation"][step])
        # the explicit solver's slip is that of the cycle before
        loose = 3.0 * (allowed.explicit_slack if wall.explicit else 1.0) * wall.tolerance
        slack = stated + loose * wall.yardstick / wall.contact_area
        slack = slack + law.normal_stiffness * 1e-15 * (1.0 + wall.largest_motion(step))
        reach = opening + law.gap
        is_open = joint & (reach > 0) & np.where(kind == CONTROL, True, (state == CRACKED) & brittle)
        # a contact with residual strength may be open and carry stress; dilated joints are compressed
        is_open &= (law.residual_tensile_strength == 0) & (law.dilation == 0)
        carried = np.abs(sigma) + np.abs(tau)
        carried = np.where(kind == CONTROL, np.abs(sigma), carried)
        yield from _beyond("open contacts", step, carried[is_open], slack[is_open])
        elastic = law.normal_stiffness * reach
        whole = joint & (law.dilation == 0) & ~capped & ~is_open
        whole &= (state != CRACKED) | (reach < 0)
        whole &= (kind != CONTROL) | (reach < 0)
        yield from _beyond(
            "elastic relation", step, np.abs(sigma - elastic)[whole], (allowed.elastic * np.abs(elastic) + slack)[whole]
        )
        # a cap crushes: less pressure than the elastic one, dilation presses: more
        crushed = joint & capped & (reach < 0)
        yield from _beyond(
            "crushed contacts", step, (elastic - sigma)[crushed], (allowed.elastic * np.abs(elastic) + slack)[crushed]
        )
        _, shear = wall.motion(step)
        known = joint & ~np.isnan(shear) & ~is_open & (kind != CONTROL)
        known &= (state != CRACKED) | (reach < 0)
        elastic = law.shear_stiffness * (shear - wall["contact_slip"][step])
        slack = slack + allowed.elastic * np.abs(elastic) + law.shear_stiffness * 1e-12 * wall.largest_motion(step)
        yield from _beyond("elastic shear", step, np.abs(tau - elastic)[known], slack[known])


def cracking(wall: ArchivedWall, allowed: Tolerances) -> Found:
    """Check the states: a broken bond stays broken, and ``contact_broken_at`` lies in its increment."""
    state, progress = wall["contact_state"], wall["progress"]
    cracked = state == CRACKED
    healed = cracked[:-1] & ~cracked[1:]
    for step in np.flatnonzero(healed.any(axis=1)):
        count = int(healed[step].sum())
        yield Violation("cracks stay", int(step) + 1, float(count), f"{count} contacts are whole again")
    slid = (wall["contact_slip"] != 0) & (state == INTACT) & (wall["contact_kind"] != CONTROL)
    for step in np.flatnonzero(slid.any(axis=1)):
        yield Violation("states", int(step), float(slid[step].sum()), f"{slid[step].sum()} intact contacts have slid")
    if not np.isin(state, (INTACT, CRACKED, SLIPPING)).all():
        yield Violation("states", -1, np.inf, "unknown state")
    if "contact_broken_at" not in wall.ds:
        return
    at = wall["contact_broken_at"]
    ever, bonded = (
        cracked.any(axis=0),
        (wall.law.tensile_strength > 0) | (wall.law.cohesion > wall.law.residual_cohesion),
    )
    first = np.where(ever, cracked.argmax(axis=0), 0)
    before = np.where(first > 0, progress[np.maximum(first - 1, 0)], 0.0)
    known = ~np.isnan(at)
    near = 1e-9
    late = known & ever & ((at > progress[first] + near) | (at < before - near))
    beyond = known & ((at > progress[-1] + near) | (at < 0))
    # bonds that break during collapse belong to no equilibrium
    unsaid = cracked[: wall.standing].any(axis=0) & ~known & bonded & (wall["contact_kind"] != CONTROL)
    for wrong, words in (
        (late, "broken_at outside the increment in which the state says it"),
        (beyond, "broken_at beyond the path"),
        (known & ~ever, "broken_at of a bond that holds"),
        (unsaid, "broken without broken_at"),
    ):
        if wrong.any():
            yield Violation("broken at", -1, float(wrong.sum()), f"{wrong.sum()} contacts: {words}")


# -- energy ------------------------------------------------------------------------------------------------------------

TAKEN = ("friction_work", "fracture_work", "crushing_work", "plastic_work", "released_energy")
"""Dissipated energies, which cannot be negative."""


def energy(wall: ArchivedWall, allowed: Tolerances) -> Found:
    """Sum the energies of the archive, and compare them with those of the contact stresses."""
    if wall.explicit:
        return
    work, error, stored = (wall[name] for name in ("external_work", "energy_error", "elastic_energy"))
    taken = {name: wall[name] for name in TAKEN}
    size = np.maximum.accumulate(np.abs(work) + stored + sum(np.abs(v) for v in taken.values()))
    for step in range(wall.standing):
        tiny = allowed.energy_rounding * size[step] + 1e-15
        off = abs(work[step] - stored[step] - sum(v[step] for v in taken.values()))
        yield from _beyond("energy balance", step, np.array([off]), np.array([error[step] + tiny]), "J")
        for name, values in taken.items():
            before = values[step - 1] if step else 0.0
            # a gain of energy in an increment must lie within its energy error
            loose = error[step] - (error[step - 1] if step else 0.0) + tiny
            yield from _beyond(
                "dissipation", step, np.array([before - values[step]]), np.array([loose]), f"J of {name}"
            )
        own = strain_energy(wall, step)
        if own is not None:
            yield from _beyond(
                "elastic energy", step, np.array([abs(own - stored[step])]), np.array([1e-5 * size[step] + tiny]), "J"
            )
        most = fracture_limit(wall, step)
        if most is not None:
            yield from _beyond(
                "fracture energy",
                step,
                np.array([taken["fracture_work"][step]]),
                np.array([most * (1 + 0.01) + error[step] + tiny]),
                "J",
            )
        put_in = max(work[: step + 1].max(), 0.0)
        spent = sum(values[step] for values in taken.values())
        yield from _beyond("work put in", step, np.array([spent]), np.array([put_in + error[step] + tiny]), "J")
        if error[step] > allowed.large_energy_error * size[step] + 1e-12:
            words = f"energy_error = {error[step]:.3g} J of {size[step]:.3g} J"
            yield Violation("energy error", step, error[step] / size[step], words, True)
    yield from external_work(wall, allowed, size)


def strain_energy(wall: ArchivedWall, step: int) -> float | None:
    """Return the elastic energy of all contacts (J), None where zones or cracking sections store energy, too."""
    if wall.deformable.any() or ("concrete" in wall.scene["footing"] and (wall["contact_kind"] == SECTION).any()):
        return None
    law, sigma, tau = wall.law, wall["contact_normal_stress"][step], wall["contact_shear_stress"][step]
    k_n, k_s = wall.stiffness
    density = 0.5 * (sigma**2 / k_n + tau**2 / k_s)
    # a cracked bond that softens unloads to the origin
    soft = (wall["contact_state"][step] == CRACKED) & (law.critical_opening > 0) & (sigma > 0)
    if (soft & (law.dilation > 0)).any():
        return None
    density = np.where(soft, 0.5 * sigma * wall["contact_opening"][step] + 0.5 * tau**2 / k_s, density)
    strain = 0.5 * wall.strain_stiffness * wall.strains(step)[: wall.n] ** 2
    return float((wall.contact_area * density).sum() + strain[wall.elastic].sum())


def fracture_limit(wall: ArchivedWall, step: int) -> float | None:
    """Return the fracture energy of all bonds that have begun to break (J); None of a footing that cracks."""
    if "concrete" in wall.scene["footing"] and (wall["contact_kind"] == SECTION).any():
        return None
    begun = (wall["contact_state"][: step + 1] == CRACKED).any(axis=0)
    return float((wall.contact_area * wall.law.fracture_energy)[begun].sum())


def external_work(wall: ArchivedWall, allowed: Tolerances, size: FloatArray) -> Found:
    """Compare the work of an increment with that of loads, ground and jacks by the trapezoidal rule.

    Its error is at most the change of the ground's force over the increment times its displacement.
    """
    if wall.deformable.any() or wall.shape == "jacks":
        return
    work, error = wall["external_work"], wall["energy_error"]
    weight = wall.weight + wall.roof
    on_ground = (wall.sides[0] == wall.n) | (wall.sides[1] == wall.n)
    sign = np.where(wall.sides[0] == wall.n, -1.0, 1.0)

    def pull(step: int) -> FloatArray:
        sigma, tau = wall["contact_normal_stress"][step], wall["contact_shear_stress"][step]
        return (sign * wall.contact_area)[:, None] * (sigma[:, None] * wall.normal + tau[:, None] * wall.tangent)

    state, events, snapped = wall["contact_state"], wall["events"], wall["snap_through_energy"]
    for step in range(1, wall.standing):
        broken = events[step] or ((state[step] == CRACKED) != (state[step - 1] == CRACKED)).any()
        if broken or snapped[step] > snapped[step - 1]:
            continue  # the ground's force has a peak between the ends, before a bond breaks or the wall snaps through
        down = wall["block_displacement_y"][step] - wall["block_displacement_y"][step - 1]
        way = np.where(on_ground[:, None], wall.ground(step) - wall.ground(step - 1), 0.0)
        before, now = pull(step - 1), pull(step)
        own = -float(weight @ down) + 0.5 * float(((before + now) * way).sum())
        most = float((np.abs(now - before) * np.abs(way)).sum())
        off = abs(own - (work[step] - work[step - 1]))
        largest = float((np.maximum(np.abs(now), np.abs(before)) * np.abs(way)).sum())
        limit = allowed.work_slack * most + 0.05 * largest + error[step] - error[step - 1] + 1e-6 * size[step]
        yield from _beyond("external work", step, np.array([off]), np.array([limit]), "J")


CHECKS: tuple[Callable[[ArchivedWall, Tolerances], Found], ...] = (
    equilibrium,
    compatibility,
    joint_law,
    elasticity,
    cracking,
    energy,
    damage,
)
"""All checks of a wall whose numbers are finite."""
