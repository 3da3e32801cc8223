"""Cycle of the dynamic solver: law of motion, joint law. Nothing is allocated here."""

from damagepred.kernels.dynamics.contact import BONDED, contact_forces
from damagepred.kernels.dynamics.motion import (
    BOUNDARY,
    add_boundary_work,
    advance_bodies,
    largest_movement,
    ramp_live_load,
)
from damagepred.kernels.dynamics.strains import advance_strains, resist_strains
from damagepred.kernels.jit import kernel, law


@law
def _add_ground_work(points, imposed, change, body_terms):
    """Add half the work of the ground movement in a step on the bonded points (trapezoidal rule)."""
    for m in range(imposed.point.size):
        p = points[imposed.point[m]]
        if p.status == BONDED:
            d_n, d_s = -change * imposed.normal[m], change * imposed.shear[m]
            body_terms[BOUNDARY] += 0.5 * p.area * ((p.sigma + p.damping_n) * d_n - (p.tau + p.damping_s) * d_s)


@law
def _move_ground(points, imposed, change):
    """Move the ground under the bonded points."""
    for m in range(imposed.point.size):
        p = points[imposed.point[m]]
        if p.status == BONDED:
            p.offset += -change * imposed.normal[m]
            p.anchor += change * imposed.shear[m]


@kernel
def run_steps(
    bodies,
    neighbours,
    motion,
    special,
    softening,
    imposed,
    has_live_load,
    loading,
    first,
    last,
    damping,
    time_step,
    searched_at,
    search_distance,
    counts,
):
    """Integrate from step ``first`` to ``last``, or until neighbours must be searched; return the next step.

    ``loading`` (steps + 1, 3): displacement x, y of the base (m) and load factor. ``damping``: local (1),
    mass-proportional (1/s), stiffness-proportional (s), of pressed contacts (s). ``search_distance`` (m): 0 without
    new contacts.
    """
    local, mass_damping, stiffness_damping, contact_damping = damping
    per_step, pressed_per_step = stiffness_damping / time_step, contact_damping / time_step
    points, search, joint_terms = bodies.points, search_distance > 0.0, counts.joint_terms
    k = first
    while k < last:
        advance_bodies(motion, loading, k, time_step, local, mass_damping, counts.body_terms)
        advance_strains(motion.strains, time_step, local, mass_damping, counts.body_terms)
        change = loading[k + 1, 2] - loading[k, 2]
        if has_live_load:
            ramp_live_load(motion, loading[k, 2], loading[k + 1, 2], time_step, counts.body_terms)
        if change != 0.0:
            _add_ground_work(points, imposed, change, counts.body_terms)
            _move_ground(points, imposed, change)
        contact_forces(bodies, neighbours, motion, special, softening, per_step, pressed_per_step, search, joint_terms)
        resist_strains(motion.strains, stiffness_damping, time_step)
        if change != 0.0:
            _add_ground_work(points, imposed, change, counts.body_terms)
        add_boundary_work(motion, time_step, counts.body_terms)
        k += 1
        if search and not largest_movement(motion, searched_at, bodies.radius) <= search_distance:
            break
    return k


@kernel
def first_forces(bodies, neighbours, motion, special, softening, search, counts):
    """Compute the forces at the start; with ``search`` points may touch blocks that they were not bonded to."""
    motion.force[:] = 0.0
    contact_forces(bodies, neighbours, motion, special, softening, 0.0, 0.0, search, counts.joint_terms)
    resist_strains(motion.strains, 0.0, 0.0)
