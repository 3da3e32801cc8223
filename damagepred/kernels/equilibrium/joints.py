"""Steps of all joints of a wall: the joint law of ``damagepred.kernels.interface`` at the contacts of interfaces."""

from functools import cache

from damagepred.kernels.concrete_section.forces import commit_sections, section_forces
from damagepred.kernels.equilibrium.wall import BOND_LOADS, CHECK_ELASTIC, FORCES, SECTION_FORCES, JointLaw
from damagepred.kernels.interface import checks, commit, internal_force
from damagepred.kernels.jit import kernel, phase, rule


@rule
def internal_forces(components, state, ground, live, listed, coulomb, condensed_too, displacement, force, stiffness):
    """Add the forces of listed joints, of all sections and blocks to ``force``; fill the tangents of the interfaces.

    ``ground`` and ``live`` may be ahead of the state. ``coulomb``: Coulomb law or Tresca problem; ``condensed_too``:
    also blocks in condensed fronts. ``displacement`` gets the motion of facets and the inside of yielding blocks.
    """
    footing, blocks, joints, law = components.footing, components.blocks, components.joints, components.law
    if blocks.present:
        blocks.place_facets(blocks.blocks, displacement, force)
    if footing.present:
        footing.add_forces(footing.sections, state.sections, joints, displacement, force, stiffness, footing.values)
    bounds, history = components.bounds, state.history
    law.add_forces(joints, history, ground, bounds, listed, coulomb, displacement, force, stiffness)
    if blocks.present:
        blocks.add_forces(blocks.blocks, condensed_too, displacement, force)
    if blocks.present and blocks.yielding.present:
        trial, correct_active = blocks.blocks.trial, blocks.yielding.correct_active
        correct_active(blocks.blocks, state.plastic, state.load, live, trial, displacement, force)


@kernel
def add_internal_forces(components, state, listed, coulomb, displacement, force, stiffness):
    """Add the forces of listed joints, and of all sections and blocks; see ``internal_forces``."""
    internal_forces(components, state, state.ground, state.live, listed, coulomb, True, displacement, force, stiffness)


@kernel
def fill_bond_loads(components, state, listed, displacement, load):
    """Fill the loads of the bonds of listed interfaces; the largest."""
    return components.law.bond_loads(components.joints, state.history, state.ground, listed, displacement, load)


@phase(SECTION_FORCES)
def add_section_forces(sections, memory, joints, displacement, force, stiffness, values):
    """Add the forces of concrete sections, and fill the tangents of their interfaces; see ``section_forces``."""
    section_forces(sections, memory, joints, displacement, force, stiffness, values)


@kernel
def fill_section_values(footing, state, joints, displacement, force, stiffness, values):
    """Fill deformation and forces of all sections (s, 6), see ``section_forces``; force and stiffness are room."""
    footing.add_forces(footing.sections, state.sections, joints, displacement, force, stiffness, values)


@kernel
def commit_section_history(footing, state, joints, displacement):
    """Commit the history variables of all sections at an equilibrium."""
    commit_sections(footing.sections, state.sections, joints, displacement)


class JointSteps:
    """Functions of the joints of walls of one kind, made by ``joint_steps``."""

    def __init__(self, general):
        self.plain = general is None

        @phase(FORCES)
        def add_forces(joints, history, ground, bounds, listed, coulomb, displacement, force, stiffness):
            """Add the forces of joints and strained blocks to ``force``, and fill tangents of joints ``stiffness``."""
            internal_force.joint_forces(
                listed, joints, general, ground, history, bounds, coulomb, displacement, force, stiffness
            )
            first, strains = joints.first_strain, joints.strain_stiffness
            for i in range(strains.size):
                force[first + i] -= strains[i] * displacement[first + i]

        @phase(BOND_LOADS)
        def bond_loads(joints, history, ground, listed, displacement, load):
            """Fill the loads of the bonds of listed interfaces; the largest."""
            return checks.bond_loads(listed, joints, general, ground, history, displacement, load)

        @phase(CHECK_ELASTIC)
        def check_elastic(joints, history, ground, listed, displacement, slides, load):
            """Mark listed interfaces that leave the elastic range, and fill the loads of their bonds; the largest."""
            return checks.check_elastic(listed, joints, general, ground, history, displacement, slides, load)

        @kernel
        def update_tresca_bounds(joints, state, bounds, listed, displacement, relaxation):
            """Move the bounds of the Tresca problem by a share of the way to Coulomb's limits."""
            ground, history = state.ground, state.history
            internal_force.update_tresca_bounds(
                listed, joints, general, ground, history, displacement, bounds, relaxation
            )

        @kernel
        def contact_stresses(joints, state, displacement, opening, sigma, tau):
            """Fill opening (m), normal and shear stress (Pa) of all contacts."""
            ground, history = state.ground, state.history
            internal_force.contact_stresses(joints, general, ground, history, displacement, opening, sigma, tau)

        @kernel
        def commit_history(joints, state, listed, displacement, never_opened, force_normal, force_shear):
            """Commit the history; see ``commit_joint_history``."""
            ground, history, on_ground = state.ground, state.history, (force_normal, force_shear)
            return commit.commit_joint_history(
                listed, joints, general, ground, history, displacement, never_opened, on_ground
            )

        @kernel
        def law_violation(joints, state, normal_stress, shear_stress):
            """Largest stress by which contacts violate the joint law (Pa)."""
            return checks.joint_law_violation_of(
                general, joints.properties, state.history.cracked, state.history.kappa, normal_stress, shear_stress
            )

        self.add_forces, self.bond_loads, self.check_elastic = add_forces, bond_loads, check_elastic
        self.update_tresca_bounds, self.contact_stresses = update_tresca_bounds, contact_stresses
        self.commit_history, self.law_violation = commit_history, law_violation

    def law(self) -> JointLaw:
        """Functions that other kernels call through ``wall.components.law``."""
        return JointLaw(add_forces=self.add_forces, bond_loads=self.bond_loads, check_elastic=self.check_elastic)


@cache
def joint_steps(general: bool | None) -> JointSteps:
    """Functions of walls of plain joints (None, which omits code; see ``is_plain``), or of others (True)."""
    return JointSteps(general)
