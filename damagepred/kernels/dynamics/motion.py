"""Newton's law with physical mass and time for bodies with large displacements and rotations.

Central differences, v(n + 1/2) = v(n - 1/2) + dt F(n) / m. Poses follow from the sum of rotations, without drift.
"""

import numpy as np

from damagepred.kernels.explicit.motion import damped
from damagepred.kernels.jit import law, rule

DAMPING, BOUNDARY, LIVE, BODY_TERMS = 0, 1, 2, 3
"""Energy terms of bodies (J): work of damping, of supports and ground, and of live loads."""


@law
def advance_free(motion, count, base, time_step, local_damping, mass_damping, body_terms):
    """Advance the free degrees of freedom by one step: central differences with local damping (Cundall 1987)."""
    half = 0.5 * mass_damping * time_step
    velocity, displacement, force, load = motion.velocity, motion.displacement, motion.force, motion.load
    drags = (local_damping > 0.0) | (mass_damping > 0.0)
    for j in range(count):
        for d in range(len(base)):
            inverse = motion.inverse_mass[j, d]
            if inverse == 0.0:
                continue
            total = force[j, d] + load[j, d]
            v = velocity[j, d]
            if drags:
                slowed = (v * (1.0 - half) + 2.0 * half * base[d]) / (1.0 + half)
                new = damped(slowed, time_step * total * inverse / (1.0 + half), local_damping)
                mean = 0.5 * (v + new)
                dashpot = mass_damping * (mean - base[d]) / inverse
                drag = total - dashpot - (new - v) / (time_step * inverse)
                body_terms[DAMPING] += time_step * (drag * mean + dashpot * (mean - base[d]))
                body_terms[BOUNDARY] -= time_step * dashpot * base[d]
            else:
                new = v + time_step * total * inverse
            velocity[j, d] = new
            displacement[j, d] += time_step * new


@law
def advance_prescribed(motion, loading, k, time_step, body_terms):
    """Move the prescribed degrees of freedom by one step, and add the first half of their work."""
    velocity, displacement = motion.velocity, motion.displacement
    directions = velocity.shape[1]
    for h in range(motion.held.size):
        j, d = motion.held[h] // directions, motion.held[h] % directions
        now = motion.held_start[h] + loading[k + 1, 2] * motion.held_displacement[h]
        now += loading[k + 1, d] if d < 2 else 0.0
        v = (now - displacement[j, d]) / time_step
        displacement[j, d] = now
        velocity[j, d] = v
        body_terms[BOUNDARY] -= 0.5 * time_step * v * (motion.force[j, d] + motion.load[j, d])


@rule
def advance_bodies(motion, loading, k, time_step, local_damping, mass_damping, body_terms):
    """Advance velocities and poses of all blocks by one step."""
    base = ((loading[k + 1, 0] - loading[k, 0]) / time_step, (loading[k + 1, 1] - loading[k, 1]) / time_step, 0.0)
    velocity, displacement, force = motion.velocity, motion.displacement, motion.force
    blocks = velocity.shape[0] - 1
    advance_free(motion, blocks, base, time_step, local_damping, mass_damping, body_terms)
    displacement[blocks, 0] = loading[k + 1, 0]
    displacement[blocks, 1] = loading[k + 1, 1]
    velocity[blocks, 0] = base[0]
    velocity[blocks, 1] = base[1]
    body_terms[BOUNDARY] -= 0.5 * time_step * (force[blocks, 0] * base[0] + force[blocks, 1] * base[1])
    advance_prescribed(motion, loading, k, time_step, body_terms)
    for j in range(blocks + 1):
        _update_pose(motion, j)
    force[:] = 0.0


@rule
def _update_pose(motion, j):
    """Update the pose of body j, a rigid block or the ground, from its displacement."""
    moved = motion.displacement
    motion.pose[j, 0] = motion.reference[j, 0] + moved[j, 0]
    motion.pose[j, 1] = motion.reference[j, 1] + moved[j, 1]
    motion.pose[j, 2] = np.cos(moved[j, 2])
    motion.pose[j, 3] = np.sin(moved[j, 2])


@rule
def ramp_live_load(motion, before, now, time_step, body_terms):
    """Ramp the live loads from one load factor to the next, and count their work in the step."""
    live, load, velocity = motion.live_load, motion.load, motion.velocity
    work = 0.0
    for j in range(live.shape[0]):
        for d in range(live.shape[1]):
            work += live[j, d] * velocity[j, d]
            load[j, d] += (now - before) * live[j, d]
    body_terms[LIVE] += 0.5 * (before + now) * time_step * work


@rule
def add_boundary_work(motion, time_step, body_terms):
    """Add the second half of the work at prescribed degrees of freedom (trapezoidal rule)."""
    velocity, force = motion.velocity, motion.force
    ground = velocity.shape[0] - 1
    power = force[ground, 0] * velocity[ground, 0] + force[ground, 1] * velocity[ground, 1]
    for h in range(motion.held.size):
        j, d = motion.held[h] // 3, motion.held[h] % 3
        power += velocity[j, d] * (force[j, d] + motion.load[j, d])
    body_terms[BOUNDARY] -= 0.5 * time_step * power


@rule
def largest_movement(motion, searched_at, radius):
    """Upper bound of a block point's displacement relative to the base since the last neighbour search (m)."""
    now, largest, ground = motion.displacement, 0.0, radius.size
    base_x, base_y = now[ground, 0] - searched_at[ground, 0], now[ground, 1] - searched_at[ground, 1]
    for j in range(ground):
        x, y = now[j, 0] - searched_at[j, 0] - base_x, now[j, 1] - searched_at[j, 1] - base_y
        turn = now[j, 2] - searched_at[j, 2]
        moved = abs(x) + abs(y) + radius[j] * abs(turn)
        largest = moved if not moved <= largest else largest
    return largest
