"""The cycle of the dynamic solver: law of motion, law of the joints, again and again. Nothing is allocated here."""

from damagepred.kernels.dynamics.contact import HOME, act
from damagepred.kernels.dynamics.motion import BOUNDARY, farthest, kick_and_drift, push, work_at_boundary
from damagepred.kernels.dynamics.zones import (
    farthest_point,
    move_points,
    place_sides,
    relieve_sides,
    work_of_held_points,
    zones_act,
)
from damagepred.kernels.jit import kernel


@kernel
def run_steps(
    scenery,
    near,
    motion,
    grid,
    special,
    softening,
    imposed,
    pushed,
    drive,
    first,
    last,
    damping,
    time_step,
    seen,
    far,
    counts,
):
    """Run steps ``first`` to ``last`` of a stretch; stop early where what is near has to be looked for anew.

    Parameters
    ----------
    scenery : NamedTuple of arrays
        ``points``, ``edges``, ``first_edge``, ``laws``, ``reach``; see ``damagepred.solvers.dynamics.body_arrays``.
    near : NamedTuple of arrays
        Blocks near each point.
    motion : NamedTuple of arrays
        See ``damagepred.kernels.dynamics.motion``.
    grid : NamedTuple of arrays or None
        Zones and gridpoints, see ``damagepred.kernels.dynamics.zones``; None if all blocks are rigid.
    special, softening : bool or None
        None if no joint needs more than the plain law; if no bond softens.
    imposed : NamedTuple of arrays
        ``point`` (i,), ``normal`` and ``shear`` (i,): movement of the ground under points per load factor (m).
    pushed : bool
        Whether there are live loads.
    drive : array (steps + 1, 3)
        Base x, y (m) and share of the movement.
    first, last : int
        Range of steps.
    damping : tuple of float
        Local damping (1), mass-proportional (1/s), stiffness-proportional (s), of pressed contacts (s).
    time_step : float
        dt (s).
    seen : array (n + 1, 3)
        Displacements when what is near was last looked for.
    far : float
        Movement since then (m) at which it has to be looked for anew; 0 to never look and meet nothing.
    counts : NamedTuple of arrays
        ``tallies`` and ``works``, added to.

    Returns
    -------
    int
        The step reached.
    """
    local, mass_damping, stiffness_damping, contact_damping = damping
    points = scenery.points
    sides, base = motion.velocity.shape[0], motion.velocity.shape[0] - 1
    k = first
    while k < last:
        kick_and_drift(motion, drive, k, time_step, local, mass_damping, counts.works)
        if grid is not None:
            move_points(grid, drive, k, time_step, local, mass_damping, counts.works)
            place_sides(grid, motion.pose, sides)
        change = drive[k + 1, 2] - drive[k, 2]
        if pushed:
            push(motion, drive[k, 2], drive[k + 1, 2], time_step, counts.works)
            if grid is not None:
                push(grid, drive[k, 2], drive[k + 1, 2], time_step, counts.works)
        if change != 0.0:
            for m in range(imposed.point.size):
                p = points[imposed.point[m]]
                if p.status == HOME:
                    d_n, d_s = -change * imposed.normal[m], change * imposed.shear[m]
                    p.offset += d_n
                    p.anchor += d_s
                    pull_n, pull_s = p.sigma + p.drag_n, p.tau + p.drag_s
                    counts.works[BOUNDARY] += 0.5 * p.area * (pull_n * d_n - pull_s * d_s)
        act(
            points,
            scenery.edges,
            scenery.first_edge,
            near,
            scenery.laws,
            motion.pose,
            motion.force,
            special,
            softening,
            stiffness_damping / time_step,
            contact_damping / time_step,
            far > 0.0,
            counts.tallies,
        )
        if change != 0.0:
            for m in range(imposed.point.size):
                p = points[imposed.point[m]]
                if p.status == HOME:
                    d_n, d_s = -change * imposed.normal[m], change * imposed.shear[m]
                    pull_n, pull_s = p.sigma + p.drag_n, p.tau + p.drag_s
                    counts.works[BOUNDARY] += 0.5 * p.area * (pull_n * d_n - pull_s * d_s)
        work_at_boundary(motion, time_step, counts.works)
        if grid is not None:
            zones_act(grid, stiffness_damping / time_step)
            relieve_sides(grid, motion.force, sides)
            work_of_held_points(grid, time_step, counts.works)
        k += 1
        if far > 0.0:
            if not farthest(motion, seen, scenery.reach) <= far:
                break
            if grid is not None:
                moved = motion.displacement
                if not farthest_point(grid, moved[base, 0] - seen[base, 0], moved[base, 1] - seen[base, 1]) <= far:
                    break
    return k


@kernel
def first_forces(scenery, near, motion, grid, special, softening, search, counts):
    """Fill the forces at the start; arguments as of ``run_steps``."""
    motion.force[:] = 0.0
    act(
        scenery.points,
        scenery.edges,
        scenery.first_edge,
        near,
        scenery.laws,
        motion.pose,
        motion.force,
        special,
        softening,
        0.0,
        0.0,
        search,
        counts.tallies,
    )
    if grid is not None:
        grid.force[:] = 0.0
        zones_act(grid, 0.0)
        relieve_sides(grid, motion.force, motion.velocity.shape[0])
