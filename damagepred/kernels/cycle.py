"""The cycle of the explicit solver: law of the joints, law of motion, again and again. Nothing is allocated here."""

from damagepred.kernels.contact import contact_forces
from damagepred.kernels.jit import kernel
from damagepred.kernels.motion import move


@kernel
def run_cycles(
    interfaces, properties, ground, state, motion, damping, load_share, progress, progress_step, cycles
):
    """Run ``cycles`` cycles while the movement advances by ``progress_step`` in each.

    Parameters
    ----------
    interfaces, properties, ground, state, motion : NamedTuple of arrays
        Model and state; ``motion`` holds load, inverse mass, velocity, displacement, force, and the prescribed
        degrees of freedom with their displacement at full movement.
    damping : float
        Local damping.
    load_share : float
        Factor on the dead load.
    progress, progress_step : float
        Share of the full movement at the start, and its change a cycle.
    cycles : int
        How many.
    """
    force, displacement = motion.force, motion.displacement
    for cycle in range(cycles):
        progress_now = progress + (cycle + 1) * progress_step
        for p in range(motion.prescribed.size):
            displacement[motion.prescribed[p]] = progress_now * motion.prescribed_displacement[p]
        for j in range(force.size):
            force[j] = load_share * motion.load[j]
        contact_forces(interfaces, properties, ground, state, displacement, progress_now, force)
        move(force, motion.inverse_mass, damping, motion.velocity, displacement)
