"""Units of the joints of a wall: the joint law at the contacts of the interfaces in ``joints`` of a ``PROBLEM``."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from damagepred.kernels.equilibrium.problem import problem_at
from damagepred.kernels.interface import checks, commit, internal_force
from damagepred.kernels.interface.kinematics import EDGE
from damagepred.kernels.jit import Unit, law
from damagepred.kernels.joint.parameters import JOINT_PARAMETERS
from damagepred.kernels.joint.return_mapping import ReturnMapping
from damagepred.kernels.table import flag_rows, float_pairs, float_rows, floats, integer_rows, integers, records_of

edges, joint_parameters = records_of(EDGE), records_of(JOINT_PARAMETERS)
"""What gives the records of interfaces and joints at a place."""


class _Ground(NamedTuple):
    normal: NDArray[np.float64]
    shear: NDArray[np.float64]


class _History(NamedTuple):
    slip: NDArray[np.float64]
    dilatant_opening: NDArray[np.float64]
    cracked: NDArray[np.bool_]
    kappa: NDArray[np.float64]


class _Sides(NamedTuple):
    dof: NDArray[np.int64]
    rows: NDArray[np.float64]


class _Interfaces(NamedTuple):
    edge: Any
    contact_offset: NDArray[np.float64]
    contact_area: NDArray[np.float64]
    elastic: _Sides | None


@law
def _interfaces_of(table, elastic):
    """Return the interfaces, with the sides of elastic blocks unless ``elastic`` is None."""
    sides = None if elastic is None else _Sides(integer_rows(table.side_dof), float_pairs(table.side_rows))
    return _Interfaces(edges(table.edge), float_rows(table.contact_offset), float_rows(table.contact_area), sides)


@law
def _return_mapping_of(table, general):
    """Return the parameters of the return mapping."""
    return ReturnMapping(
        table.max_iterations,
        table.relative_tolerance,
        table.snap_back_ratio,
        table.dilatant_iterations,
        table.cap_slope_ratio,
        table.yield_tolerance,
        general,
    )


@law
def _state_of(table):
    """Return movement of the ground, history and displacements."""
    ground = _Ground(float_rows(table.ground_normal), float_rows(table.ground_shear))
    slip, dilatant_opening = float_rows(table.slip), float_rows(table.dilatant_opening)
    history = _History(slip, dilatant_opening, flag_rows(table.cracked), float_rows(table.kappa))
    return ground, history, floats(table.displacement)


@law
def _tresca_of(table):
    """Return the bounds of the Tresca problem."""
    return float_rows(table.tresca_bound), float_rows(table.tresca_dilatant_opening), float_rows(table.tresca_kappa)


@law
def _subtract_strain_forces(first, strain_stiffness, displacement, force):
    """Subtract the forces by which elastic blocks resist their strains."""
    for i in range(strain_stiffness.size):
        force[first + i] -= strain_stiffness[i] * displacement[first + i]


class JointUnits:
    """Units of the joints of walls of one kind.

    Parameters
    ----------
    general : bool or None
        None if all joints are plain; see ``ReturnMapping``.
    elastic : bool or None
        None if no block has a strain of its own.
    """

    def __init__(self, general, elastic):
        def add_joint_forces(address):
            """Add the forces of joints and strained blocks to ``force``, and fill tangents of joints ``stiffness``."""
            table = problem_at(address)
            ground, history, displacement = _state_of(table)
            internal_force.joint_forces(
                integers(table.joints),
                _interfaces_of(table, elastic),
                joint_parameters(table.properties),
                _return_mapping_of(table, general),
                ground,
                history,
                _tresca_of(table),
                table.coulomb != 0,
                displacement,
                floats(table.force),
                float_rows(table.stiffness),
            )
            if elastic is not None:
                stiffness = floats(table.strain_stiffness)
                _subtract_strain_forces(table.first_strain, stiffness, displacement, floats(table.force))

        def update_tresca_bounds(address):
            """Move the bounds of the Tresca problem by the share ``relaxation`` of the way to Coulomb's limits."""
            table = problem_at(address)
            ground, history, displacement = _state_of(table)
            internal_force.update_tresca_bounds(
                integers(table.joints),
                _interfaces_of(table, elastic),
                joint_parameters(table.properties),
                _return_mapping_of(table, general),
                ground,
                history,
                displacement,
                _tresca_of(table),
                table.relaxation,
            )

        def contact_stresses(address):
            """Fill ``opening``, ``normal_stress`` and ``shear_stress`` of all contacts."""
            table = problem_at(address)
            ground, history, displacement = _state_of(table)
            internal_force.contact_stresses(
                _interfaces_of(table, elastic),
                joint_parameters(table.properties),
                _return_mapping_of(table, general),
                ground,
                history,
                displacement,
                float_rows(table.opening),
                float_rows(table.normal_stress),
                float_rows(table.shear_stress),
            )

        def commit_joint_history(address):
            """Commit the history; set ``friction``, ``crushing``, ``mode_1_dissipation``, ``stored``, ``softened``."""
            table = problem_at(address)
            ground, history, displacement = _state_of(table)
            on_ground = _Ground(float_rows(table.ground_force_normal), float_rows(table.ground_force_shear))
            table.friction, table.crushing, table.mode_1_dissipation, table.stored, table.softened = (
                commit.commit_joint_history(
                    integers(table.joints),
                    _interfaces_of(table, elastic),
                    joint_parameters(table.properties),
                    _return_mapping_of(table, general),
                    ground,
                    history,
                    displacement,
                    flag_rows(table.never_opened),
                    on_ground,
                )
            )

        def bond_loads(address):
            """Fill ``bond_load`` of the interfaces, and set ``largest_bond_load``."""
            table = problem_at(address)
            ground, history, displacement = _state_of(table)
            table.largest_bond_load = checks.bond_loads(
                integers(table.joints),
                _interfaces_of(table, elastic),
                joint_parameters(table.properties),
                _return_mapping_of(table, general),
                ground,
                history,
                displacement,
                table.no_strength,
                table.block_stress,
                float_rows(table.bond_load),
            )

        def farthest_sliding(address):
            """Set ``farthest_sliding``, the farthest level at which one of the interfaces slides."""
            table = problem_at(address)
            ground, history, displacement = _state_of(table)
            table.farthest_sliding = checks.farthest_sliding(
                integers(table.joints),
                integers(table.interface_level),
                _interfaces_of(table, elastic),
                joint_parameters(table.properties),
                _return_mapping_of(table, general),
                ground,
                history,
                displacement,
            )

        def joint_law_violation(address):
            """Set ``violation``, the largest stress by which ``normal_stress`` and ``shear_stress`` violate the law."""
            table = problem_at(address)
            table.violation = checks.joint_law_violation_of(
                general,
                joint_parameters(table.properties),
                flag_rows(table.cracked),
                float_rows(table.kappa),
                float_rows(table.normal_stress),
                float_rows(table.shear_stress),
            )

        self.add_joint_forces, self.update_tresca_bounds = Unit(add_joint_forces), Unit(update_tresca_bounds)
        self.contact_stresses, self.commit_joint_history = Unit(contact_stresses), Unit(commit_joint_history)
        self.bond_loads, self.farthest_sliding = Unit(bond_loads), Unit(farthest_sliding)
        self.joint_law_violation = Unit(joint_law_violation)


JOINT_UNITS = {(g, e): JointUnits(g, e) for g in (None, True) for e in (None, True)}
"""By whether there are joints that are not plain, and elastic blocks: None if not."""
