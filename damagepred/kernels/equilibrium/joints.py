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
from damagepred.kernels.linear.condensation import condensation_at
from damagepred.kernels.table import (
    flag_rows,
    flags,
    float_pairs,
    float_rows,
    floats,
    integer_rows,
    integers,
    records_of,
    run,
)

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
def _joints_of(table, general, elastic):
    """Return interfaces, properties, parameters of the return mapping, ground, history and displacements."""
    sides = None if elastic is None else _Sides(integer_rows(table.side_dof), float_pairs(table.side_rows))
    options = ReturnMapping(
        table.max_iterations,
        table.relative_tolerance,
        table.snap_back_ratio,
        table.dilatant_iterations,
        table.cap_slope_ratio,
        table.yield_tolerance,
        general,
    )
    slip, dilatant_opening = float_rows(table.slip), float_rows(table.dilatant_opening)
    return (
        _Interfaces(edges(table.edge), float_rows(table.contact_offset), float_rows(table.contact_area), sides),
        joint_parameters(table.properties),
        options,
        _Ground(float_rows(table.ground_normal), float_rows(table.ground_shear)),
        _History(slip, dilatant_opening, flag_rows(table.cracked), float_rows(table.kappa)),
        floats(table.displacement),
    )


@law
def _forces_of(table):
    """Return the interfaces listed, the bounds of the Tresca problem, forces and tangents."""
    bound, dilatant_opening = float_rows(table.tresca_bound), float_rows(table.tresca_dilatant_opening)
    tresca = bound, dilatant_opening, float_rows(table.tresca_kappa)
    return integers(table.joints), tresca, floats(table.force), float_rows(table.stiffness)


@law
def _stresses_of(table):
    """Return normal and shear stress."""
    return float_rows(table.normal_stress), float_rows(table.shear_stress)


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
            interfaces, properties, options, ground, history, u = _joints_of(table, general, elastic)
            listed, tresca, force, stiffness = _forces_of(table)
            internal_force.joint_forces(
                listed,
                interfaces,
                properties,
                options,
                ground,
                history,
                tresca,
                table.coulomb != 0,
                u,
                force,
                stiffness,
            )
            if elastic is not None:
                _subtract_strain_forces(table.first_strain, floats(table.strain_stiffness), u, force)

        def update_tresca_bounds(address):
            """Move the bounds of the Tresca problem by the share ``relaxation`` of the way to Coulomb's limits."""
            table = problem_at(address)
            interfaces, properties, options, ground, history, u = _joints_of(table, general, elastic)
            listed, tresca, _, _ = _forces_of(table)
            internal_force.update_tresca_bounds(
                listed, interfaces, properties, options, ground, history, u, tresca, table.relaxation
            )

        def contact_stresses(address):
            """Fill ``opening``, ``normal_stress`` and ``shear_stress`` of all contacts."""
            table = problem_at(address)
            interfaces, properties, options, ground, history, u = _joints_of(table, general, elastic)
            opening, (sigma, tau) = float_rows(table.opening), _stresses_of(table)
            internal_force.contact_stresses(interfaces, properties, options, ground, history, u, opening, sigma, tau)

        def commit_joint_history(address):
            """Commit the history; set ``friction``, ``crushing``, ``mode_1_dissipation``, ``stored``, ``softened``.

            Energy stored in condensed subtrees counts.
            """
            table = problem_at(address)
            interfaces, properties, options, ground, history, u = _joints_of(table, general, elastic)
            listed, never_opened = integers(table.joints), flag_rows(table.never_opened)
            on_ground = _Ground(float_rows(table.ground_force_normal), float_rows(table.ground_force_shear))
            table.friction, table.crushing, table.mode_1_dissipation, table.stored, table.softened = (
                commit.commit_joint_history(
                    listed, interfaces, properties, options, ground, history, u, never_opened, on_ground
                )
            )
            if table.condensation != 0:
                condensation = condensation_at(table.condensation)
                condensation.displacement.address = table.displacement.address
                run(table.elastic_energy, table.condensation)
                table.stored += condensation.energy

        def bond_loads(address):
            """Fill ``bond_load`` of the interfaces, and set ``largest_bond_load``."""
            table = problem_at(address)
            interfaces, properties, options, ground, history, u = _joints_of(table, general, elastic)
            listed, load = integers(table.joints), float_rows(table.bond_load)
            table.largest_bond_load = checks.bond_loads(
                listed, interfaces, properties, options, ground, history, u, table.no_strength, table.block_stress, load
            )

        def check_condensed(address):
            """Fill ``slides`` and ``bond_load`` of condensed interfaces; set ``sliding`` and their largest load."""
            table = problem_at(address)
            interfaces, properties, options, ground, history, u = _joints_of(table, general, elastic)
            listed, slides, load = integers(table.joints), flags(table.slides), float_rows(table.bond_load)
            table.sliding, table.largest_condensed_load = checks.check_elastic(
                listed,
                interfaces,
                properties,
                options,
                ground,
                history,
                u,
                table.no_strength,
                table.block_stress,
                slides,
                load,
            )

        def joint_law_violation(address):
            """Set ``violation``, the largest stress by which ``normal_stress`` and ``shear_stress`` violate the law."""
            table = problem_at(address)
            properties, cracked = joint_parameters(table.properties), flag_rows(table.cracked)
            kappa, (sigma, tau) = float_rows(table.kappa), _stresses_of(table)
            table.violation = checks.joint_law_violation_of(general, properties, cracked, kappa, sigma, tau)

        self.add_joint_forces, self.update_tresca_bounds = Unit(add_joint_forces), Unit(update_tresca_bounds)
        self.contact_stresses, self.commit_joint_history = Unit(contact_stresses), Unit(commit_joint_history)
        self.bond_loads, self.check_condensed = Unit(bond_loads), Unit(check_condensed)
        self.joint_law_violation = Unit(joint_law_violation)


JOINT_UNITS = {(g, e): JointUnits(g, e) for g in (None, True) for e in (None, True)}
"""By whether there are joints that are not plain, and elastic blocks: None if not."""
