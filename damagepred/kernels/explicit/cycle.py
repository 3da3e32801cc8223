"""The cycle of the explicit solver: law of the joints, law of motion, again and again. Nothing is allocated here."""

from damagepred.kernels.concrete_section.forces import commit_sections, section_forces
from damagepred.kernels.explicit.jacks import press
from damagepred.kernels.explicit.motion import move, sum_forces, sum_strain_forces
from damagepred.kernels.interface.contact import contact_forces, gather
from damagepred.kernels.jit import kernel
from damagepred.kernels.zone.forces import place_facets, scatter_facet_forces, zone_forces


@kernel
def run_cycles(
    joints,
    special,
    softening,
    zoned,
    sections,
    pump,
    motion,
    damping,
    load_share,
    load_factor,
    load_factor_step,
    cycles,
):
    """Run ``cycles`` cycles while the movement advances by ``load_factor_step`` in each.

    Parameters
    ----------
    joints : NamedTuple of arrays
        The interfaces in tiles; see ``damagepred.solvers.explicit.tiles.PackedJoints``.
    special : bool or None
        None if no joint dilates, breaks or wears by slip or has a cap.
    softening : Softening or None
        None if no bond softens.
    zoned : tuple or None
        Facets and zones of the deformable blocks, see
        ``damagepred.solvers.system.deformable_blocks``; None if all blocks are rigid.
    sections : NamedTuple or None
        Of a footing that cracks, see ``damagepred.solvers.explicit.tiles.PackedSections``; None if there are none.
    pump : NamedTuple or None
        Of the jacks under the footing, see ``damagepred.solvers.explicit.jack_servo``; None if there are none.
    motion : NamedTuple of arrays
        See ``damagepred.solvers.explicit.scheme.Motion``.
    damping : float
        Local damping.
    load_share : float
        Factor on the dead load.
    load_factor, load_factor_step : float
        Share of the full movement at the start, and its change a cycle.
    cycles : int
        How many.
    """
    force, displacement = motion.force, motion.displacement
    tiles, ground = joints.tiles, joints.ground
    first_ground = tiles.size - ground.size
    for cycle in range(cycles):
        load_factor_now = load_factor + (cycle + 1) * load_factor_step
        for p in range(motion.prescribed.size):
            displacement[motion.prescribed[p]] = motion.start[p] + load_factor_now * motion.prescribed_displacement[p]
        if zoned is not None:
            place_facets(zoned[0], displacement)
        for t in range(tiles.size):
            gather(tiles[t], joints.elastic, displacement)
        for t in range(first_ground):
            contact_forces(tiles[t], None, special, softening, joints.elastic, load_factor_now)
        for t in range(ground.size):
            contact_forces(tiles[first_ground + t], ground[t], special, softening, joints.elastic, load_factor_now)
        sum_forces(
            joints.contributions,
            joints.first,
            joints.position,
            motion.load,
            load_share,
            motion.live_load,
            load_factor_now,
            force,
        )
        sum_strain_forces(joints.elastic, joints.contributions, joints.first, joints.position, displacement, force)
        if sections is not None:
            section_forces(
                sections.law,
                sections.memory,
                sections.interfaces,
                sections.properties,
                displacement,
                force,
                sections.stiffness,
            )
            if sections.commit_interval > 0 and (cycle + 1) % sections.commit_interval == 0:
                commit_sections(sections.law, sections.memory, sections.interfaces, displacement)
        if zoned is None:
            if pump is not None:
                press(pump, displacement, load_factor_now, load_factor_step, force)
            move(motion, damping, 0, force.size)
        else:
            facets, gridpoints = zoned[0].first_dof, 3 * (joints.first.size - 1)
            for j in range(gridpoints, force.size):
                force[j] = load_share * motion.load[j] + load_factor_now * motion.live_load[j]
            zone_forces(zoned[1], displacement, force)
            scatter_facet_forces(zoned[0], force)
            if pump is not None:
                press(pump, displacement, load_factor_now, load_factor_step, force)
            # facets follow their gridpoints
            move(motion, damping, 0, facets)
            move(motion, damping, gridpoints, force.size)
    if zoned is not None:
        place_facets(zoned[0], displacement)
