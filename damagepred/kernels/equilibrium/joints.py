"""Steps of all joints of a wall: the joint law at the contacts of listed interfaces."""

from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from damagepred.kernels.concrete_section.forces import section_forces
from damagepred.kernels.equilibrium.wall import BOND_LOADS, CHECK_ELASTIC, FORCES, SECTION_FORCES, JointLaw
from damagepred.kernels.interface import checks, commit, internal_force
from damagepred.kernels.jit import kernel, law, phase
from damagepred.kernels.joint.return_mapping import ReturnMapping


class _Ground(NamedTuple):
    normal: NDArray[np.float64]
    shear: NDArray[np.float64]


class _Sides(NamedTuple):
    dof: NDArray[np.int64]
    rows: NDArray[np.float64]


class _Interfaces(NamedTuple):
    edge: Any
    contact_offset: NDArray[np.float64]
    contact_area: NDArray[np.float64]
    elastic: _Sides | None


@law
def _law_of(joints, general, elastic):
    """Interfaces, properties and parameters of the return mapping."""
    sides = None if elastic is None else _Sides(joints.side_dof, joints.side_rows)
    v = joints.return_mapping
    options = ReturnMapping(int(v[0]), v[1], v[2], int(v[3]), v[4], v[5], general)
    return _Interfaces(joints.edge, joints.contact_offset, joints.contact_area, sides), joints.properties, options


@kernel
def add_joint_forces(law, joints, history, bounds, listed, coulomb, displacement, force, stiffness):
    """Add the forces of listed joints and of strained blocks, and fill the tangents of the joints."""
    law.add_forces(joints, history, bounds, listed, coulomb, displacement, force, stiffness)


@kernel
def fill_bond_loads(law, joints, history, listed, displacement, load):
    """Fill the loads of the bonds of listed interfaces; the largest."""
    return law.bond_loads(joints, history, listed, displacement, load)


@kernel
def find_inelastic(law, joints, history, listed, displacement, slides, load):
    """Find listed interfaces that leave the elastic range, and fill the loads of their bonds; the largest."""
    return law.check_elastic(joints, history, listed, displacement, slides, load)


@phase(SECTION_FORCES)
def no_section_forces(sections, memory, joints, displacement, force, stiffness):
    """Add no force: the footing does not crack, or there is none."""


@phase(SECTION_FORCES)
def add_section_forces(sections, memory, joints, displacement, force, stiffness):
    """Add the forces of concrete sections to ``force``, and fill the tangents of their interfaces ``stiffness``."""
    sides = _Sides(joints.side_dof, joints.side_rows)
    interfaces = _Interfaces(joints.edge, joints.contact_offset, joints.contact_area, sides)
    section_forces(sections, memory, interfaces, joints.properties, displacement, force, stiffness)


class JointSteps:
    """Steps of the joints of walls of one kind.

    Parameters
    ----------
    general : bool or None
        None if all joints are plain; see ``ReturnMapping``. What is None is left out at compile time.
    elastic : bool or None
        None if no block has a strain of its own.
    """

    def __init__(self, general, elastic):
        @phase(FORCES)
        def add_forces(joints, history, bounds, listed, coulomb, displacement, force, stiffness):
            """Add the forces of joints and strained blocks to ``force``, and fill tangents of joints ``stiffness``."""
            interfaces, properties, options = _law_of(joints, general, elastic)
            ground = _Ground(history.ground_normal, history.ground_shear)
            tresca = bounds.bound, bounds.dilatant_opening, bounds.kappa
            internal_force.joint_forces(
                listed,
                interfaces,
                properties,
                options,
                ground,
                history,
                tresca,
                coulomb,
                displacement,
                force,
                stiffness,
            )
            if elastic is not None:
                first, strains = joints.first_strain, joints.strain_stiffness
                for i in range(strains.size):
                    force[first + i] -= strains[i] * displacement[first + i]

        @phase(BOND_LOADS)
        def bond_loads(joints, history, listed, displacement, load):
            """Fill the loads of the bonds of listed interfaces; the largest."""
            interfaces, properties, options = _law_of(joints, general, elastic)
            ground, no_strength = _Ground(history.ground_normal, history.ground_shear), joints.no_strength
            return checks.bond_loads(
                listed,
                interfaces,
                properties,
                options,
                ground,
                history,
                displacement,
                no_strength,
                joints.block_stress,
                load,
            )

        @phase(CHECK_ELASTIC)
        def check_elastic(joints, history, listed, displacement, slides, load):
            """Find listed interfaces that leave the elastic range, and fill the loads of their bonds; the largest."""
            interfaces, properties, options = _law_of(joints, general, elastic)
            ground, no_strength = _Ground(history.ground_normal, history.ground_shear), joints.no_strength
            return checks.check_elastic(
                listed,
                interfaces,
                properties,
                options,
                ground,
                history,
                displacement,
                no_strength,
                joints.block_stress,
                slides,
                load,
            )[1]

        @kernel
        def update_tresca_bounds(joints, history, bounds, listed, displacement, relaxation):
            """Move the bounds of the Tresca problem by a share of the way to Coulomb's limits."""
            interfaces, properties, options = _law_of(joints, general, elastic)
            ground = _Ground(history.ground_normal, history.ground_shear)
            tresca = bounds.bound, bounds.dilatant_opening, bounds.kappa
            internal_force.update_tresca_bounds(
                listed, interfaces, properties, options, ground, history, displacement, tresca, relaxation
            )

        @kernel
        def contact_stresses(joints, history, displacement, opening, normal_stress, shear_stress):
            """Fill opening (m), normal and shear stress (Pa) of all contacts."""
            interfaces, properties, options = _law_of(joints, general, elastic)
            ground = _Ground(history.ground_normal, history.ground_shear)
            internal_force.contact_stresses(
                interfaces, properties, options, ground, history, displacement, opening, normal_stress, shear_stress
            )

        @kernel
        def commit_history(joints, history, listed, displacement, never_opened, force_normal, force_shear):
            """Commit the history; dissipation by friction, crushing and mode I, stored and softening energy (J)."""
            interfaces, properties, options = _law_of(joints, general, elastic)
            ground, on_ground = _Ground(history.ground_normal, history.ground_shear), _Ground(force_normal, force_shear)
            return commit.commit_joint_history(
                listed, interfaces, properties, options, ground, history, displacement, never_opened, on_ground
            )

        @kernel
        def law_violation(joints, history, normal_stress, shear_stress):
            """Largest stress by which contacts violate the joint law (Pa)."""
            return checks.joint_law_violation_of(
                general, joints.properties, history.cracked, history.kappa, normal_stress, shear_stress
            )

        self.add_forces, self.bond_loads, self.check_elastic = add_forces, bond_loads, check_elastic
        self.update_tresca_bounds, self.contact_stresses = update_tresca_bounds, contact_stresses
        self.commit_history, self.law_violation = commit_history, law_violation

    def law(self, sections: bool) -> JointLaw:
        """Return the functions that other steps call, of a wall whose footing may crack or not."""
        made: JointLaw = JointLaw(
            add_forces=self.add_forces,
            bond_loads=self.bond_loads,
            check_elastic=self.check_elastic,
            add_section_forces=add_section_forces if sections else no_section_forces,
        )
        return made


@cache
def joint_steps(general: bool | None, elastic: bool | None) -> JointSteps:
    """Return the steps of walls with joints that are not plain, or None, and with elastic blocks, or None."""
    return JointSteps(general, elastic)
