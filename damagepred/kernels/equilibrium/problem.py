"""Residual and tangent equations of a wall, as the iterations of ``newton`` and ``tresca`` need them.

The iterations are written once. Compiled, they work on a ``Problem``: a wall of rigid or elastic blocks. A wall with
deformable blocks offers the same two functions in Python, and then the iterations run in Python.
"""

from typing import Any, NamedTuple

import numpy as np
from numba.extending import overload
from numpy.typing import NDArray

from damagepred.kernels.equilibrium.vectors import copy, dot, move_along
from damagepred.kernels.interface.internal_force import joint_forces
from damagepred.kernels.interface.kinematics import EDGE
from damagepred.kernels.interface.residual import free_residual, subtract_boundary_forces, within_limit
from damagepred.kernels.jit import UNCOUNTED, Unit, law
from damagepred.kernels.joint.parameters import JOINT_PARAMETERS
from damagepred.kernels.joint.return_mapping import ReturnMapping
from damagepred.kernels.linear.table import system_at
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
    table_at,
    table_type,
)

edges, joint_parameters = records_of(EDGE), records_of(JOINT_PARAMETERS)
"""What gives the records of interfaces and joints at a place."""


class NewtonParameters(NamedTuple):
    """Newton's method; meaning and defaults: ``NewtonOptions`` of the quasi-static solver."""

    max_iterations: int
    undamped_iterations: int
    minimum_step: float
    stagnation_tolerance: float
    early_divergence_ratio: float
    early_divergence_iterations: int
    divergence_ratio: float


class NewtonLineSearchParameters(NamedTuple):
    """Newton's method with line search: ``NewtonLineSearchOptions``."""

    max_iterations: int
    full_step_reduction: float
    slope_tolerance: float
    stagnation_ratio: float
    stagnation_limit: int


class LineSearchParameters(NamedTuple):
    """Line search: ``LineSearchOptions``."""

    max_iterations: int
    slope_tolerance: float
    maximum_step: float
    safeguard: float


class Parameters(NamedTuple):
    """Parameters of all iterations.

    Attributes
    ----------
    newton, newton_with_line_search, line_search
        Their own.
    tolerance : float
        Largest unbalanced force over the mean block weight.
    warm_start_residual : float
        Of ``CoulombOptions``.
    max_minimisation_iterations : int
        Of ``CoulombOptions``.
    deflection_tolerance : float
        Of ``JackOptions`` (m).
    """

    newton: NewtonParameters
    newton_with_line_search: NewtonLineSearchParameters
    line_search: LineSearchParameters
    tolerance: float
    warm_start_residual: float
    max_minimisation_iterations: int
    deflection_tolerance: float


PROBLEM = table_type(
    "joints external ground_normal ground_shear slip dilatant_opening cracked kappa tresca_bound "
    "tresca_dilatant_opening tresca_kappa strain_stiffness boundary_dofs first_boundary boundary_stiffness free "
    "per_weight arms force stiffness push weights edge contact_offset contact_area side_dof side_rows properties "
    "displacement residual step",
    integers="here compute_residual compute_step solve_tangent system first_strain coulomb bordered max_iterations "
    "dilatant_iterations",
    numbers="deflection jack jack_step ratio relative_tolerance snap_back_ratio cap_slope_ratio yield_tolerance",
)
"""Attributes, with m interfaces of q contacts.

joints : array of int
    Interfaces that follow the joint law.
external : array (size,)
    External force, but that of jacks (N, N m).
ground_normal, ground_shear : array (g, q)
    Of the ground in its present state (m).
slip, dilatant_opening, cracked, kappa, tresca_bound, tresca_dilatant_opening, tresca_kappa : array (m, q)
    History and bounds; see ``joint_forces``.
first_strain, strain_stiffness : int, array
    First strain of elastic blocks among all degrees of freedom, and their stiffness.
boundary_dofs, first_boundary, boundary_stiffness : array of int, array of int, array
    Superelements of the condensed subtrees; see ``subtract_boundary_forces``.
free : array of bool (size,)
    Active degrees of freedom.
per_weight, arms : array (size,)
    See ``free_residual`` and ``within_limit``.
force, stiffness : array (size,), array (m, 9)
    Forces on all degrees of freedom, and tangents of the interfaces, at the last residual.
push, weights : array (size,)
    Force of unit loads of the jacks, and weights of the degrees of freedom in their deflection; empty without jacks.
deflection : float
    Required deflection at the jacks, NaN where their load is given (m).
edge, contact_offset, contact_area, side_dof, side_rows, properties
    Interfaces and joints as ``joint_forces`` takes them; ``side_dof`` and ``side_rows`` of elastic blocks.
max_iterations, dilatant_iterations, relative_tolerance, snap_back_ratio, cap_slope_ratio, yield_tolerance
    Of ``ReturnMapping``.
displacement, jack, coulomb
    Arguments of ``compute_residual``: displacements (m, rad), load of each jack (N), and whether the Coulomb law holds
    or the Tresca problem is solved.
residual, ratio : array (size,), float
    Its results: residual force, 0 where not free, and unbalanced force ratio.
step, jack_step : array (size,), float
    Results of ``compute_step``: steps of the displacements (m, rad) and of the load of each jack (N).
bordered : bool
    Whether the load of the jacks is unknown in that step, if their deflection is given.
here, system : int
    Addresses of this table and of that of the tangent equations.
compute_residual, compute_step, solve_tangent : int
    Addresses of units.
"""
problem_at = table_at(PROBLEM, "PROBLEM")
"""What gives the table at an address."""


class Problem(NamedTuple):
    """A wall of rigid or elastic blocks at given loads.

    Attributes
    ----------
    parameters : Parameters
        Of the iterations.
    table : int
        Address of the table of all the rest.
    """

    parameters: Parameters
    table: int


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


def residual(problem, jack, displacement, coulomb, force):
    """Compute the residual force, and the tangents of the interfaces; return the unbalanced force ratio.

    Parameters
    ----------
    problem : Problem
        The wall.
    jack : float
        Load of each jack (N).
    displacement : array (size,)
        Of all degrees of freedom (m, rad).
    coulomb : bool
        Whether the Coulomb law holds, or the Tresca problem is solved.
    force : array (size,)
        Filled: residual force on free degrees of freedom, 0 elsewhere (N, N m).
    """
    return problem.compute_residual(jack, displacement, coulomb, force)


def solve(problem, bordered, displacement, force, step):
    """Solve the tangent equations at the last residual; return the step of the load of the jacks (N).

    Parameters
    ----------
    problem, displacement
        As ``residual``.
    bordered : bool
        Whether the load of the jacks is unknown, if their deflection is given.
    force : array (size,)
        Residual force.
    step : array (size,)
        Filled: step of the displacements (m, rad).
    """
    return problem.compute_step(bordered, displacement, force, step)


@law
def deflection_is_given(table):
    """Whether the load of the jacks is unknown.

    Parameters
    ----------
    table : PROBLEM
        Of the wall.
    """
    return table.deflection == table.deflection  # NaN where it is not


@law
def missing_deflection(table, displacement):
    """Return the missing deflection at the jacks (m), 0 where their load is given.

    Parameters
    ----------
    table : PROBLEM
        Of the wall.
    displacement : array (size,)
        Of all degrees of freedom (m, rad).
    """
    if table.deflection == table.deflection:
        return table.deflection - dot(floats(table.weights), displacement)
    return 0.0


@law
def _subtract_strain_forces(first, strain_stiffness, displacement, force):
    """Subtract the forces by which elastic blocks resist their strains."""
    for i in range(strain_stiffness.size):
        force[first + i] -= strain_stiffness[i] * displacement[first + i]


def _residual_unit(general, elastic):
    """Return the unit that computes the residual force of walls with or without general joints and elastic blocks."""

    def compute_residual(address):
        """Compute the residual force, the tangents of the interfaces and the unbalanced force ratio."""
        table = problem_at(address)
        force, stiffness, displacement = floats(table.force), float_rows(table.stiffness), floats(table.displacement)
        push = floats(table.push)
        copy(floats(table.external), force)
        for i in range(push.size):
            force[i] += table.jack * push[i]
        interfaces = _Interfaces(
            edges(table.edge),
            float_rows(table.contact_offset),
            float_rows(table.contact_area),
            None if elastic is None else _Sides(integer_rows(table.side_dof), float_pairs(table.side_rows)),
        )
        options = ReturnMapping(
            table.max_iterations,
            table.relative_tolerance,
            table.snap_back_ratio,
            table.dilatant_iterations,
            table.cap_slope_ratio,
            table.yield_tolerance,
            general,
        )
        history = _History(
            float_rows(table.slip),
            float_rows(table.dilatant_opening),
            flag_rows(table.cracked),
            float_rows(table.kappa),
        )
        tresca = (
            float_rows(table.tresca_bound),
            float_rows(table.tresca_dilatant_opening),
            float_rows(table.tresca_kappa),
        )
        joint_forces(
            integers(table.joints),
            interfaces,
            joint_parameters(table.properties),
            options,
            _Ground(float_rows(table.ground_normal), float_rows(table.ground_shear)),
            history,
            tresca,
            table.coulomb != 0,
            displacement,
            force,
            stiffness,
        )
        _subtract_strain_forces(table.first_strain, floats(table.strain_stiffness), displacement, force)
        subtract_boundary_forces(
            integers(table.boundary_dofs),
            integers(table.first_boundary),
            floats(table.boundary_stiffness),
            displacement,
            force,
        )
        table.ratio = free_residual(force, flags(table.free), floats(table.per_weight), floats(table.residual))

    return Unit(compute_residual)


RESIDUAL_UNITS = {(g, e): _residual_unit(g, e) for g in (None, True) for e in (None, True)}
"""By whether there are joints that are not plain, and elastic blocks: None if not, see ``ReturnMapping``."""


@law
def with_constraint(parameters, ratio, missing, coulomb):
    """Return the unbalanced force ratio, or that of a missing deflection scaled to the same tolerance if it is larger.

    Parameters
    ----------
    parameters : Parameters
        Tolerances.
    ratio, missing : float
        Unbalanced force ratio, and missing deflection (m).
    coulomb : bool
        Whether the Coulomb law holds: a Tresca problem is solved under a given load of the jacks.
    """
    if not coulomb:
        return ratio
    constraint = abs(missing) / parameters.deflection_tolerance * parameters.tolerance
    return max(ratio, constraint if constraint < np.inf else np.inf)


@overload(residual, jit_options=UNCOUNTED)
def _residual(problem, jack, displacement, coulomb, force):
    """Compile ``residual`` for a ``Problem``."""

    def compiled(problem, jack, displacement, coulomb, force):
        table = problem_at(problem.table)
        table.jack, table.coulomb = jack, coulomb
        table.displacement.address, table.residual.address = displacement.ctypes.data, force.ctypes.data
        run(table.compute_residual, table.here)
        return with_constraint(problem.parameters, table.ratio, missing_deflection(table, displacement), coulomb)

    return compiled


@law
def bordered_step(weights, responses, missing, step):
    """Solve the bordered system K du - p dq = r, w du = missing deflection; return dq (N).

    Parameters
    ----------
    weights : array (size,)
        Weights w of the degrees of freedom in the deflection.
    responses : array (2, size)
        K^-1 r of the residual force r, and K^-1 p.
    missing : float
        Residual of the constraint (m).
    step : array (size,)
        Filled: displacements du.
    """
    deflection_per_load = dot(weights, responses[1])
    jack_step = 0.0
    if deflection_per_load > 0.0:  # otherwise the jacks lift nothing: leave the load as it is
        jack_step = (missing - dot(weights, responses[0])) / deflection_per_load
    move_along(responses[0], jack_step, responses[1], step)
    return jack_step


@Unit
def compute_step(address):
    """Solve the tangent equations for ``residual``, bordered by the condition on the deflection of the jacks.

    Parameters
    ----------
    address : int
        Of the table.
    """
    table = problem_at(address)
    system, step = system_at(table.system), floats(table.step)
    right, solution = float_rows(system.right), float_rows(system.solution)
    borders = table.bordered != 0 and deflection_is_given(table)
    copy(floats(table.residual), right[0])
    if borders:
        copy(floats(table.push), right[1])
    system.row_count = 2 if borders else 1
    system.iterations += 1
    run(table.solve_tangent, table.system)
    if borders:
        missing = missing_deflection(table, floats(table.displacement))
        table.jack_step = bordered_step(floats(table.weights), solution, missing, step)
    else:
        copy(solution[0], step)
        table.jack_step = 0.0


@overload(solve, jit_options=UNCOUNTED)
def _solve(problem, bordered, displacement, force, step):
    """Compile ``solve`` for a ``Problem``."""

    def compiled(problem, bordered, displacement, force, step):
        table = problem_at(problem.table)
        table.displacement.address, table.residual.address = displacement.ctypes.data, force.ctypes.data
        table.step.address, table.bordered = step.ctypes.data, bordered
        run(table.compute_step, table.here)
        return table.jack_step

    return compiled


def controls_deflection(problem):
    """Whether the deflection at the jacks is given, and their load unknown.

    Parameters
    ----------
    problem : Problem
        The wall.
    """
    return problem.controls_deflection()


@overload(controls_deflection, jit_options=UNCOUNTED)
def _controls_deflection(problem):
    """Compile ``controls_deflection`` for a ``Problem``."""

    def compiled(problem):
        return deflection_is_given(problem_at(problem.table))

    return compiled


def goes_too_far(problem, displacement, limit):
    """Whether a displacement of an active degree of freedom exceeds a limit.

    Parameters
    ----------
    problem, displacement
        As ``residual``.
    limit : float
        The limit (m).
    """
    return problem.goes_too_far(displacement, limit)


@overload(goes_too_far, jit_options=UNCOUNTED)
def _goes_too_far(problem, displacement, limit):
    """Compile ``goes_too_far`` for a ``Problem``."""

    def compiled(problem, displacement, limit):
        table = problem_at(problem.table)
        return not within_limit(displacement, flags(table.free), floats(table.arms), limit)

    return compiled


def missing(problem, displacement):
    """Return the missing deflection at the jacks (m), 0 where their load is given.

    Parameters
    ----------
    problem, displacement
        As ``residual``.
    """
    return problem.missing_deflection(displacement)


@overload(missing, jit_options=UNCOUNTED)
def _missing(problem, displacement):
    """Compile ``missing`` for a ``Problem``."""

    def compiled(problem, displacement):
        return missing_deflection(problem_at(problem.table), displacement)

    return compiled


def add_jack_load(problem, load, force):
    """Add a load of the jacks to the residual force of active degrees of freedom.

    Parameters
    ----------
    problem : Problem
        The wall.
    load : float
        Of each jack (N).
    force : array (size,)
        Added to (N, N m).
    """
    problem.add_jack_load(load, force)


@overload(add_jack_load, jit_options=UNCOUNTED)
def _add_jack_load(problem, load, force):
    """Compile ``add_jack_load`` for a ``Problem``."""

    def compiled(problem, load, force):
        table = problem_at(problem.table)
        push, free = floats(table.push), flags(table.free)
        for i in range(push.size):
            if free[i]:
                force[i] += load * push[i]

    return compiled
