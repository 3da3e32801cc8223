"""The cycle of the dynamic solver: law of motion, law of the joints, again and again. Nothing is allocated here."""

from damagepred.kernels.dynamics.contact import BONDED, contact_forces
from damagepred.kernels.dynamics.motion import (
    BOUNDARY,
    add_boundary_work,
    advance_bodies,
    largest_movement,
    ramp_live_load,
)
from damagepred.kernels.dynamics.strains import advance_strains, resist_strains
from damagepred.kernels.dynamics.zones import (
    add_gridpoint_boundary_work,
    advance_gridpoints,
    largest_gridpoint_movement,
    scatter_facet_forces,
    update_facet_poses,
    zone_forces,
)
from damagepred.kernels.jit import kernel, law


@law
def _add_ground_work(points, imposed, change, body_terms):
    """Add half the work of the ground's movement in a step, by the forces of the bonded points on it."""
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
    body_arrays,
    neighbours,
    motion,
    grid,
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
    """Run steps ``first`` to ``last`` of the explicit time integration; stop early where the neighbour list expires.

    Parameters
    ----------
    body_arrays : NamedTuple of arrays
        See ``damagepred.solvers.dynamics.body_arrays``.
    neighbours : NamedTuple of arrays
        Blocks near each point.
    motion : NamedTuple of arrays
        See ``damagepred.kernels.dynamics.motion``.
    grid : NamedTuple of arrays or None
        Zones and gridpoints, see ``damagepred.kernels.dynamics.zones``; None if all blocks are rigid.
    special, softening : bool or None, Softening or None
        None if no joint needs more than the plain law; if no bond softens.
    imposed : NamedTuple of arrays
        ``point`` (i,), ``normal`` and ``shear`` (i,): movement of the ground under points per load factor (m).
    has_live_load : bool
        Whether there are live loads.
    loading : array (steps + 1, 3)
        Displacement x, y of the base (m) and load factor.
    first, last : int
        Range of steps.
    damping : tuple of float
        Local damping (1), mass-proportional (1/s), stiffness-proportional (s), of pressed contacts (s).
    time_step : float
        dt (s).
    searched_at : array (n + 1, 3)
        Displacements at the last neighbour search.
    search_distance : float
        Movement since then (m) that asks for the next search; 0 for no search and no new contacts.
    counts : NamedTuple of arrays
        ``joint_terms`` and ``body_terms``, added to.

    Returns
    -------
    int
        The step reached.
    """
    local, mass_damping, stiffness_damping, contact_damping = damping
    points = body_arrays.points
    first_facet, base = motion.velocity.shape[0], motion.velocity.shape[0] - 1
    k = first
    while k < last:
        advance_bodies(motion, loading, k, time_step, local, mass_damping, counts.body_terms)
        advance_strains(motion.strains, time_step, local, mass_damping, counts.body_terms)
        if grid is not None:
            advance_gridpoints(grid, loading, k, time_step, local, mass_damping, counts.body_terms)
            update_facet_poses(grid, motion.pose, first_facet)
        change = loading[k + 1, 2] - loading[k, 2]
        if has_live_load:
            ramp_live_load(motion, loading[k, 2], loading[k + 1, 2], time_step, counts.body_terms)
            if grid is not None:
                ramp_live_load(grid, loading[k, 2], loading[k + 1, 2], time_step, counts.body_terms)
        if change != 0.0:
            _add_ground_work(points, imposed, change, counts.body_terms)
            _move_ground(points, imposed, change)
        contact_forces(
            body_arrays,
            neighbours,
            motion.pose,
            motion.force,
            motion.strains,
            special,
            softening,
            stiffness_damping / time_step,
            contact_damping / time_step,
            search_distance > 0.0,
            counts.joint_terms,
        )
        resist_strains(motion.strains, stiffness_damping, time_step)
        if change != 0.0:
            _add_ground_work(points, imposed, change, counts.body_terms)
        add_boundary_work(motion, time_step, counts.body_terms)
        if grid is not None:
            zone_forces(grid, stiffness_damping / time_step)
            scatter_facet_forces(grid, motion.force, first_facet)
            add_gridpoint_boundary_work(grid, time_step, counts.body_terms)
        k += 1
        if search_distance > 0.0:
            if not largest_movement(motion, searched_at, body_arrays.radius) <= search_distance:
                break
            if grid is not None:
                moved = motion.displacement
                if (
                    not largest_gridpoint_movement(
                        grid, moved[base, 0] - searched_at[base, 0], moved[base, 1] - searched_at[base, 1]
                    )
                    <= search_distance
                ):
                    break
    return k


@kernel
def first_forces(body_arrays, neighbours, motion, grid, special, softening, search, counts):
    """Compute the forces at the start.

    Parameters
    ----------
    body_arrays, neighbours, motion, grid, special, softening, counts
        As of ``run_steps``.
    search : bool
        Whether points may touch blocks that they were not bonded to.
    """
    motion.force[:] = 0.0
    contact_forces(
        body_arrays,
        neighbours,
        motion.pose,
        motion.force,
        motion.strains,
        special,
        softening,
        0.0,
        0.0,
        search,
        counts.joint_terms,
    )
    resist_strains(motion.strains, 0.0, 0.0)
    if grid is not None:
        grid.force[:] = 0.0
        zone_forces(grid, 0.0)
        scatter_facet_forces(grid, motion.force, motion.velocity.shape[0])
