"""The cycle of the explicit solver: law of the joints, law of motion, again and again. Nothing is allocated here."""

from damagepred.kernels.contact import contact_forces, gather
from damagepred.kernels.jit import kernel
from damagepred.kernels.motion import move, sum_forces


@kernel
def run_cycles(joints, special, softening, motion, damping, load_share, progress, progress_step, cycles):
    """Run ``cycles`` cycles while the movement advances by ``progress_step`` in each.

    Parameters
    ----------
    joints : NamedTuple of arrays
        The interfaces in tiles; see ``damagepred.solvers.packed.PackedJoints``.
    special : bool or None
        None if no joint dilates or breaks in shear.
    softening : bool or None
        None if no bond softens.
    motion : NamedTuple of arrays
        Dead and live load, inverse mass, velocity, displacement, force, and the prescribed degrees of freedom with
        where they start and their displacement from there at full movement.
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
    tiles, ground = joints.tiles, joints.ground
    first_ground = tiles.size - ground.size
    for cycle in range(cycles):
        progress_now = progress + (cycle + 1) * progress_step
        for p in range(motion.prescribed.size):
            displacement[motion.prescribed[p]] = motion.start[p] + progress_now * motion.prescribed_displacement[p]
        for t in range(tiles.size):
            gather(tiles[t], displacement)
        for t in range(first_ground):
            contact_forces(tiles[t], None, special, softening, progress_now)
        for t in range(ground.size):
            contact_forces(tiles[first_ground + t], ground[t], special, softening, progress_now)
        sum_forces(
            joints.contributions, joints.first, joints.position, motion.load, load_share, motion.live_load,
            progress_now, force,
        )  # fmt: skip
        move(force, motion.inverse_mass, damping, motion.velocity, displacement)
