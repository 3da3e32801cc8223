"""Steps of all joints of a wall: the joint law of ``damagepred.kernels.interface`` at the contacts of interfaces."""

from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from damagepred.kernels.concrete_section.forces import commit_sections, section_forces
from damagepred.kernels.equilibrium.wall import BOND_LOADS, CHECK_ELASTIC, FORCES, SECTION_FORCES, JointLaw
from damagepred.kernels.interface import checks, commit, internal_force
from damagepred.kernels.jit import kernel, law, phase, rule


class _Sides(NamedTuple):
    dof: NDArray[np.int64]
    rows: NDArray[np.float64]


class JointArrays(NamedTuple):
    """Fields of ``Joints`` as the laws take them: ``elastic`` is None without elastic blocks, to omit their code."""

    edge: Any
    contact_offset: NDArray[np.float64]
    contact_area: NDArray[np.float64]
    elastic: _Sides | None
    properties: Any
    general: bool | None  # None: all joints are plain (``is_plain``)
    no_strength: float
    block_stress: float


@law
def _arrays_of(joints, general, elastic):
    """``JointArrays`` of a wall; ``general`` and ``elastic`` as in ``joint_steps``."""
    sides = None if elastic is None else _Sides(joints.side_dof, joints.side_rows)
    return JointArrays(
        joints.edge,
        joints.contact_offset,
        joints.contact_area,
        sides,
        joints.properties,
        general,
        joints.no_strength,
        joints.block_stress,
    )


@rule
def internal_forces(components, state, ground, live, listed, coulomb, condensed_too, displacement, force, stiffness):
    """Add the forces of listed joints, of all sections and blocks to ``force``; fill the tangents of the interfaces.

    ``ground`` and ``live`` may be ahead of the state. ``coulomb``: Coulomb law or Tresca problem; ``condensed_too``:
    also blocks in condensed fronts. In ``displacement``, the motion of facets and the inside of yielding blocks follow.
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
    arrays = _arrays_of(joints, None, True)
    section_forces(sections, memory, arrays, joints.properties, displacement, force, stiffness, values)


@kernel
def fill_section_values(footing, state, joints, displacement, force, stiffness, values):
    """Fill deformation and forces of all sections (s, 6), see ``section_forces``; force and stiffness are room."""
    footing.add_forces(footing.sections, state.sections, joints, displacement, force, stiffness, values)


@kernel
def commit_section_history(footing, state, joints, displacement):
    """Commit the history variables of all sections at an equilibrium."""
    commit_sections(footing.sections, state.sections, _arrays_of(joints, None, True), displacement)


class JointSteps:
    """Functions of the joints of walls of one kind, made by ``joint_steps``."""

    def __init__(self, general, elastic):
        self.plain = general is None

        @phase(FORCES)
        def add_forces(joints, history, ground, bounds, listed, coulomb, displacement, force, stiffness):
            """Add the forces of joints and strained blocks to ``force``, and fill tangents of joints ``stiffness``."""
            arrays, tresca = _arrays_of(joints, general, elastic), (bounds.bound, bounds.dilatant_opening, bounds.kappa)
            internal_force.joint_forces(
                listed, arrays, ground, history, tresca, coulomb, displacement, force, stiffness
            )
            if elastic is not None:
                first, strains = joints.first_strain, joints.strain_stiffness
                for i in range(strains.size):
                    force[first + i] -= strains[i] * displacement[first + i]

        @phase(BOND_LOADS)
        def bond_loads(joints, history, ground, listed, displacement, load):
            """Fill the loads of the bonds of listed interfaces; the largest."""
            return checks.bond_loads(listed, _arrays_of(joints, general, elastic), ground, history, displacement, load)

        @phase(CHECK_ELASTIC)
        def check_elastic(joints, history, ground, listed, displacement, slides, load):
            """Mark listed interfaces that leave the elastic range, and fill the loads of their bonds; the largest."""
            arrays = _arrays_of(joints, general, elastic)
            return checks.check_elastic(listed, arrays, ground, history, displacement, slides, load)[1]

        @kernel
        def update_tresca_bounds(joints, state, bounds, listed, displacement, relaxation):
            """Move the bounds of the Tresca problem by a share of the way to Coulomb's limits."""
            arrays, tresca = _arrays_of(joints, general, elastic), (bounds.bound, bounds.dilatant_opening, bounds.kappa)
            internal_force.update_tresca_bounds(
                listed, arrays, state.ground, state.history, displacement, tresca, relaxation
            )

        @kernel
        def contact_stresses(joints, state, displacement, opening, normal_stress, shear_stress):
            """Fill opening (m), normal and shear stress (Pa) of all contacts."""
            arrays, ground, history = _arrays_of(joints, general, elastic), state.ground, state.history
            internal_force.contact_stresses(arrays, ground, history, displacement, opening, normal_stress, shear_stress)

        @kernel
        def commit_history(joints, state, listed, displacement, never_opened, force_normal, force_shear):
            """Commit the history; see ``commit_joint_history``."""
            arrays, on_ground = _arrays_of(joints, general, elastic), (force_normal, force_shear)
            ground, history = state.ground, state.history
            return commit.commit_joint_history(listed, arrays, ground, history, displacement, never_opened, on_ground)

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
        made: JointLaw = JointLaw(
            add_forces=self.add_forces, bond_loads=self.bond_loads, check_elastic=self.check_elastic
        )
        return made


@cache
def joint_steps(general: bool | None, elastic: bool | None) -> JointSteps:
    """Functions of one kind of wall, compiled once: None for ``general`` or ``elastic`` omits code.

    ``general`` is None in a wall of plain joints (``is_plain``), ``elastic`` without elastic blocks; otherwise True.
    """
    return JointSteps(general, elastic)
