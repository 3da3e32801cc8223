"""Cycle of the explicit solver: joint law, loads of jacks, law of motion. Nothing is allocated here."""

from damagepred.kernels.concrete_section.forces import commit_sections, section_forces
from damagepred.kernels.explicit.motion import move, sum_forces, sum_strain_forces
from damagepred.kernels.interface.contact import contact_forces, gather
from damagepred.kernels.jit import kernel, law
from damagepred.kernels.zone.forces import place_facets, scatter_facet_forces, zone_forces

VOLUME, LOAD = 0, 1


@law
def press(pump, displacement, load_factor, load_factor_step, force):
    """Add the forces of the jacks on one pump, whose volume follows the deflection by integral control."""
    # the line is a spring, load = stiffness * (volume - lift): its forces have a potential and excite no oscillation
    lift, deflection = 0.0, 0.0
    for i in range(pump.dof.size):
        u = displacement[pump.dof[i]]
        lift += pump.push[i] * u
        deflection += pump.weight[i] * u
    missing = pump.origin + load_factor * pump.goal - deflection
    volume = pump.state[VOLUME] + load_factor_step * pump.volume_step + pump.gain * missing
    load = pump.load + load_factor * pump.load_step + pump.stiffness * (volume - lift)
    pump.state[VOLUME] = volume
    pump.state[LOAD] = load
    for i in range(pump.dof.size):
        force[pump.dof[i]] += load * pump.push[i]


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
    """Run ``cycles`` cycles while the load factor advances by ``load_factor_step`` in each.

    ``special``, ``softening``, ``zoned``, ``sections``, ``pump``: None in walls without; the compiler omits their code.
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
        sum_forces(joints, motion, load_share, load_factor_now)
        sum_strain_forces(joints, joints.elastic, displacement, force)
        if sections is not None:
            law, memory, interfaces, stiffness = sections.law, sections.memory, sections.interfaces, sections.stiffness
            section_forces(law, memory, interfaces, displacement, force, stiffness, sections.values)
            if sections.commit_interval > 0 and (cycle + 1) % sections.commit_interval == 0:
                commit_sections(law, memory, interfaces, displacement)
        gridpoints = 3 * (joints.first.size - 1)  # or strains of elastic blocks
        if zoned is not None:
            for j in range(gridpoints, force.size):
                force[j] = load_share * motion.load[j] + load_factor_now * motion.live_load[j]
            zone_forces(zoned[1], displacement, force)
            scatter_facet_forces(zoned[0], force)
        if pump is not None:
            press(pump, displacement, load_factor_now, load_factor_step, force)
        # facets follow their gridpoints
        move(motion, damping, 0, gridpoints if zoned is None else zoned[0].first_dof)
        move(motion, damping, gridpoints, force.size)
    if zoned is not None:
        place_facets(zoned[0], displacement)
