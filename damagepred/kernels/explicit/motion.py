"""Newton's law for all degrees of freedom, with Cundall's local damping (paper, Eq. 7)."""

import numpy as np

from damagepred.kernels.explicit.tiles import LANES
from damagepred.kernels.jit import law

NEXT = np.uint64(LANES)


@law
def sum_forces(joints, motion, load_share, load_factor):
    """Sum the residual force of each block: loads and contact forces."""
    contributions, first, position = joints.contributions, joints.first, joints.position
    load, live_load, force = motion.load, motion.live_load, motion.force
    for j in range(first.size - 1):
        x = load_share * load[3 * j] + load_factor * live_load[3 * j]
        y = load_share * load[3 * j + 1] + load_factor * live_load[3 * j + 1]
        turning = load_share * load[3 * j + 2] + load_factor * live_load[3 * j + 2]
        for p in range(first[j], first[j + 1]):
            slot = position[p]
            x += contributions[slot]
            y += contributions[slot + NEXT]
            turning += contributions[slot + NEXT + NEXT]
        force[3 * j] = x
        force[3 * j + 1] = y
        force[3 * j + 2] = turning


@law
def sum_strain_forces(joints, elastic, displacement, force):
    """Sum the residual force of strain and curvature of elastic blocks; loads do no work on them."""
    contributions, first, position = joints.contributions, joints.first, joints.position
    if elastic is not None:
        dof = 3 * (first.size - 1)
        for d in range(elastic.block.size):
            block = elastic.block[d]
            stretching = -elastic.stiffness[2 * d] * displacement[dof]
            bending = -elastic.stiffness[2 * d + 1] * displacement[dof + 1]
            for p in range(first[block], first[elastic.end[d]]):
                slot = position[p] + NEXT + NEXT + NEXT
                stretching += contributions[slot]
                bending += contributions[slot + NEXT]
            force[dof], force[dof + 1] = stretching, bending
            dof += 2


@law
def damped(velocity, gain, damping):
    """Velocity after a step at constant force, with local damping (Cundall 1987) that turns with the motion."""
    # exact within the step, where the drag changes sign with the velocity: continuous, so rounding decides nothing
    after = velocity + (1.0 + damping if velocity * gain < 0.0 else 1.0 - damping) * gain
    return after * ((1.0 - damping) / (1.0 + damping) if velocity * after < 0.0 else 1.0)


@law
def move(motion, damping, first, last):
    """Advance degrees of freedom ``first`` to ``last`` - 1 by one time step of length 1."""
    force, inverse_mass, drift = motion.force, motion.inverse_mass, motion.drift
    velocity, displacement = motion.velocity, motion.displacement
    for j in range(first, last):
        velocity[j] = drift[j] + damped(velocity[j] - drift[j], force[j] * inverse_mass[j], damping)
        displacement[j] += velocity[j]
