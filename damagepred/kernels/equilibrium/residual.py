"""Residual of a wall and solution of its tangent equations, as the iterations need them.

The iterations are written once. Compiled, they work on a ``Problem``: a wall of rigid or elastic blocks. A wall with
deformable blocks has functions of the same names in Python, and the iterations run in Python.
"""

from functools import update_wrapper
from typing import Any, NamedTuple

import numpy as np
from numba.extending import overload

from damagepred.kernels.equilibrium.vectors import copy, dot, move_along
from damagepred.kernels.interface.residual import free_residual, within_limit
from damagepred.kernels.jit import FLAGS, kernel, law, rule
from damagepred.kernels.linear.condensation import subtract_boundary_forces
from damagepred.kernels.linear.solver import ITERATIONS


class Problem(NamedTuple):
    """A wall of rigid or elastic blocks in a state."""

    parameters: Any
    wall: Any
    state: Any


def offered(function):
    """Make a function of a ``Problem``, compiled; of another problem it is the problem's own method of that name."""

    def method(problem, *values):
        if isinstance(problem, Problem):  # nothing is compiled
            return function(problem, *values)
        return getattr(problem, function.__name__)(*values)

    overload(method, jit_options=FLAGS, strict=False)(lambda *kinds: function)
    return update_wrapper(method, function)


@law
def _deflection_is_given(state):
    return state.deflection == state.deflection  # NaN where it is not


@law
def missing_deflection(wall, state, displacement):
    """Missing deflection at the jacks (m), 0 where their load is given."""
    if _deflection_is_given(state):
        return state.deflection - dot(wall.freedoms.weights, displacement)
    return 0.0


@law
def with_constraint(parameters, ratio, missing, coulomb):
    """Unbalanced force ratio, or that of a missing deflection scaled to the same tolerance if it is larger.

    A Tresca problem is solved under a given load of the jacks.
    """
    if not coulomb:
        return ratio
    constraint = abs(missing) / parameters.deflection_tolerance * parameters.tolerance
    return max(ratio, constraint if constraint < np.inf else np.inf)


@kernel
def wall_residual(wall, state, jack, displacement, coulomb, residual):
    """Unbalanced force ratio; fills the residual force on free degrees of freedom and the tangents of the interfaces.

    ``jack`` is the load of each jack (N); ``coulomb`` tells the Coulomb law from the Tresca problem.
    """
    force, push = wall.force, wall.freedoms.push
    copy(state.external, force)
    for i in range(push.size):
        force[i] += jack * push[i]
    wall.law.add_section_forces(wall.sections, state.sections, wall.joints, displacement, force, wall.stiffness)
    wall.law.add_forces(
        wall.joints, state.history, wall.bounds, wall.interfaces.jointed, coulomb, displacement, force, wall.stiffness
    )
    subtract_boundary_forces(wall.condensation, displacement, force)
    ratio = free_residual(force, wall.freedoms.free, wall.freedoms.per_weight, residual)
    return with_constraint(wall.parameters[0], ratio, missing_deflection(wall, state, displacement), coulomb)


@offered
def residual(problem, jack, displacement, coulomb, force):
    """See ``wall_residual``."""
    return wall_residual(problem.wall, problem.state, jack, displacement, coulomb, force)


@law
def bordered_step(weights, responses, missing, step):
    """Solve the bordered system K du - p dq = r, w du = missing deflection, from the responses K^-1 r and K^-1 p.

    Fills the displacements du; returns the load step dq of the jacks (N).
    """
    deflection_per_load = dot(weights, responses[1])
    jack_step = 0.0
    if deflection_per_load > 0.0:  # otherwise the jacks lift nothing: leave the load as it is
        jack_step = (missing - dot(weights, responses[0])) / deflection_per_load
    move_along(responses[0], jack_step, responses[1], step)
    return jack_step


@rule
def solve_step(wall, state, stiffness, bordered, displacement, residual, step):
    """Solve the tangent equations for a residual; fills the step of displacements, returns the load step of jacks (N).

    ``bordered``: the load of the jacks is unknown, if their deflection is given.
    """
    wall.solver.counts[ITERATIONS] += 1
    if bordered and _deflection_is_given(state):
        right, solution = wall.pairs[:2], wall.pairs[2:]
        copy(residual, right[0])
        copy(wall.freedoms.push, right[1])
        wall.solve_tangent(wall.solver, stiffness, right, solution)
        missing = missing_deflection(wall, state, displacement)
        return bordered_step(wall.freedoms.weights, solution, missing, step)
    wall.solve_tangent(wall.solver, stiffness, residual.reshape(1, residual.size), step.reshape(1, step.size))
    return 0.0


@offered
def solve(problem, bordered, displacement, force, step):
    """Solve the tangent equations at the last residual; see ``solve_step``."""
    return solve_step(problem.wall, problem.state, problem.wall.stiffness, bordered, displacement, force, step)


@offered
def controls_deflection(problem):
    """Whether the deflection at the jacks is given, and their load unknown."""
    return _deflection_is_given(problem.state)


@offered
def goes_too_far(problem, displacement, limit):
    """Whether a displacement of an active degree of freedom exceeds a limit (m)."""
    freedoms = problem.wall.freedoms
    return not within_limit(displacement, freedoms.free, freedoms.arms, limit)


@offered
def missing(problem, displacement):
    """Missing deflection at the jacks (m), 0 where their load is given."""
    return missing_deflection(problem.wall, problem.state, displacement)


@offered
def add_jack_load(problem, load, force):
    """Add a load of the jacks (N) to the residual force of active degrees of freedom."""
    push = problem.wall.freedoms.push
    for i in problem.wall.freedoms.free:
        force[i] += load * push[i]
