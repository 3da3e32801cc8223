"""Residual and tangent equations of a wall, as the iterations of ``newton`` and ``tresca`` need them.

The iterations are written once. Compiled, they work on a ``Problem``: a wall of rigid or elastic blocks. A wall with
deformable blocks offers the same two functions in Python, and then the iterations run in Python.
"""

from functools import update_wrapper
from typing import NamedTuple

import numpy as np
from numba.extending import overload

from damagepred.kernels.equilibrium.vectors import copy, dot, move_along
from damagepred.kernels.interface.residual import free_residual, within_limit
from damagepred.kernels.jit import UNCOUNTED, Unit, law
from damagepred.kernels.linear.condensation import condensation_at
from damagepred.kernels.linear.table import system_at
from damagepred.kernels.table import address_of, float_rows, floats, integers, run, table_at, table_type

NEWTON = table_type(
    "",
    "max_iterations undamped_iterations early_divergence_iterations",
    "minimum_step stagnation_tolerance early_divergence_ratio divergence_ratio",
)
"""Newton's method; meaning and defaults: ``NewtonOptions`` of the quasi-static solver."""
NEWTON_LINE_SEARCH = table_type(
    "", "max_iterations stagnation_limit", "full_step_reduction slope_tolerance flat_slope stagnation_ratio"
)
"""Newton's method with line search: ``NewtonLineSearchOptions``."""
LINE_SEARCH = table_type("", "max_iterations", "slope_tolerance maximum_step safeguard")
"""Line search: ``LineSearchOptions``."""
_KINDS = (("newton", NEWTON), ("newton_with_line_search", NEWTON_LINE_SEARCH), ("line_search", LINE_SEARCH))
PARAMETERS = np.dtype(
    (
        np.record,
        [(name, (np.record, kind)) for name, kind in _KINDS]
        + [(name, np.float64) for name in ("tolerance", "warm_start_residual", "deflection_tolerance")]
        + [("max_minimisation_iterations", np.int64)],
    )
)
"""Parameters of all iterations, one record: a tuple would be handed over number by number.

newton, newton_with_line_search, line_search
    Their own.
tolerance : float
    Largest unbalanced force over the mean block weight.
warm_start_residual, max_minimisation_iterations
    Of ``CoulombOptions``.
deflection_tolerance : float
    Of ``JackOptions`` (m).
"""


PROBLEM = table_type(
    "joints external ground_normal ground_shear slip dilatant_opening cracked kappa tresca_bound "
    "tresca_dilatant_opening tresca_kappa strain_stiffness free per_weight arms force stiffness push weights edge "
    "contact_offset contact_area side_dof side_rows properties displacement residual step start best room tangent rate "
    "moving normal_ahead shear_ahead prescribed prescribed_step condensed slides never_opened ground_force_normal "
    "ground_force_shear bond_load bond_load_at_start room_joints all_joints prescribed_ahead normal_at_start "
    "shear_at_start opening normal_stress shear_stress",
    integers="here system parameters condensation subtract_boundary_forces recover add_joint_forces check_condensed "
    "compute_residual compute_step compute_bordered_step solve_tangent store_tangent complete elastic_energy "
    "bond_loads interpolate_event first_strain coulomb bordered bonds_of_all sliding within max_iterations "
    "dilatant_iterations",
    numbers="deflection jack jack_step ratio limit minimum_tolerance rate_step relative_tolerance snap_back_ratio "
    "cap_slope_ratio yield_tolerance relaxation no_strength block_stress largest_bond_load largest_condensed_load "
    "friction crushing mode_1_dissipation stored softened violation overload_tolerance event_tolerance "
    "weak_bond_overload aim share",
)
"""Attributes, with m interfaces of q contacts.

joints : array of int
    Interfaces that a unit works on; those that follow the joint law.
external : array (size,)
    External force, but that of jacks (N, N m).
ground_normal, ground_shear : array (g, q)
    Of the ground in its present state (m).
slip, dilatant_opening, cracked, kappa, tresca_bound, tresca_dilatant_opening, tresca_kappa : array (m, q)
    History and bounds; see ``joint_forces``.
first_strain, strain_stiffness : int, array
    First strain of elastic blocks among all degrees of freedom, and their stiffness.
free : array of int
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
start, best, limit, minimum_tolerance, room
    Arguments and results of ``run_newton`` and ``minimise_tresca``; ``room`` is scratch.
here, system, parameters, condensation : int
    Addresses of this table, of that of the tangent equations, of ``PARAMETERS``, and of the table of the condensed
    subtrees, 0 if there are none.
subtract_boundary_forces, recover, ... complete : int
    Addresses of units; ``compute_bordered_step`` is 0 without jacks.
tangent : array (m, 9)
    Tangents of the interfaces at the last equilibrium.
prescribed_ahead, normal_at_start, ..., bond_load_at_start, room_joints, all_joints, bonds_of_all, aim, share
    Arguments, results and scratch of ``predict`` and ``interpolate_event``.
overload_tolerance, event_tolerance, weak_bond_overload
    Of ``ContinuationOptions``.
slides, sliding, never_opened, ground_force_normal, ..., violation
    Arguments and results of the units of ``damagepred.kernels.equilibrium.joints``.
"""
problem_at, parameters_at = table_at(PROBLEM, "PROBLEM"), table_at(PARAMETERS, "PARAMETERS")
"""What gives the table, and the parameters, at an address."""


class Problem(NamedTuple):
    """A wall of rigid or elastic blocks at given loads.

    Attributes
    ----------
    parameters : PARAMETERS
        Of the iterations.
    table : int
        Address of the table of all the rest.
    """

    parameters: np.record
    table: int


def offered(function):
    """Make a function of a problem: compiled for a ``Problem``; in Python, the problem's own method of that name.

    Parameters
    ----------
    function : callable
        Of a ``Problem`` and other arguments, to be compiled.
    """

    def method(problem, *values):
        return getattr(problem, function.__name__)(*values)

    overload(method, jit_options=UNCOUNTED, strict=False)(lambda *kinds: function)
    return update_wrapper(method, function)


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


@Unit
def compute_residual(address):
    """Compute the residual force, the tangents of the interfaces and the unbalanced force ratio.

    Parameters
    ----------
    address : int
        Of the table.
    """
    table = problem_at(address)
    force, push = floats(table.force), floats(table.push)
    copy(floats(table.external), force)
    for i in range(push.size):
        force[i] += table.jack * push[i]
    run(table.add_joint_forces, address)
    if table.condensation != 0:
        condensation = condensation_at(table.condensation)
        condensation.displacement.address, condensation.force.address = table.displacement.address, table.force.address
        run(table.subtract_boundary_forces, table.condensation)
    table.ratio = free_residual(force, integers(table.free), floats(table.per_weight), floats(table.residual))


@law
def with_constraint(parameters, ratio, missing, coulomb):
    """Return the unbalanced force ratio, or that of a missing deflection scaled to the same tolerance if it is larger.

    Parameters
    ----------
    parameters : PARAMETERS
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


@offered
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
    table = problem_at(problem.table)
    table.jack, table.coulomb = jack, coulomb
    table.displacement.address, table.residual.address = address_of(displacement, 0), address_of(force, 0)
    run(table.compute_residual, table.here)
    return with_constraint(problem.parameters, table.ratio, missing_deflection(table, displacement), coulomb)


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
    """Solve the tangent equations for ``residual``.

    Parameters
    ----------
    address : int
        Of the table.
    """
    table = problem_at(address)
    system = system_at(table.system)
    system.iterations += 1
    if table.bordered != 0 and deflection_is_given(table):
        run(table.compute_bordered_step, address)
        return
    right, solution = system.right.address, system.solution.address
    system.right.address, system.solution.address = table.residual.address, table.step.address
    system.row_count, table.jack_step = 1, 0.0
    run(table.solve_tangent, table.system)
    system.right.address, system.solution.address = right, solution


@Unit
def compute_bordered_step(address):
    """Solve the tangent equations bordered by the condition on the deflection of the jacks.

    Parameters
    ----------
    address : int
        Of the table.
    """
    table = problem_at(address)
    system = system_at(table.system)
    right = float_rows(system.right)
    copy(floats(table.residual), right[0])
    copy(floats(table.push), right[1])
    system.row_count = 2
    run(table.solve_tangent, table.system)
    missing = missing_deflection(table, floats(table.displacement))
    table.jack_step = bordered_step(floats(table.weights), float_rows(system.solution), missing, floats(table.step))


@offered
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
    table = problem_at(problem.table)
    table.displacement.address, table.residual.address = address_of(displacement, 0), address_of(force, 0)
    table.step.address, table.bordered = address_of(step, 0), bordered
    run(table.compute_step, table.here)
    return table.jack_step


@offered
def controls_deflection(problem):
    """Whether the deflection at the jacks is given, and their load unknown.

    Parameters
    ----------
    problem : Problem
        The wall.
    """
    return deflection_is_given(problem_at(problem.table))


@offered
def goes_too_far(problem, displacement, limit):
    """Whether a displacement of an active degree of freedom exceeds a limit.

    Parameters
    ----------
    problem, displacement
        As ``residual``.
    limit : float
        The limit (m).
    """
    table = problem_at(problem.table)
    return not within_limit(displacement, integers(table.free), floats(table.arms), limit)


@offered
def missing(problem, displacement):
    """Return the missing deflection at the jacks (m), 0 where their load is given.

    Parameters
    ----------
    problem, displacement
        As ``residual``.
    """
    return missing_deflection(problem_at(problem.table), displacement)


@offered
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
    table = problem_at(problem.table)
    push = floats(table.push)
    for i in integers(table.free):
        force[i] += load * push[i]
