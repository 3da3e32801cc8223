"""Residual of a wall and solution of its tangent equations, as the iterations need them."""

import numpy as np
from numba import types

from damagepred.kernels.equilibrium.joints import internal_forces
from damagepred.kernels.equilibrium.vectors import copy, dot, move_along
from damagepred.kernels.equilibrium.wall import State, Wall
from damagepred.kernels.interface.residual import free_residual
from damagepred.kernels.jit import kernel, law, phase
from damagepred.kernels.linear.condensation import subtract_boundary_forces
from damagepred.kernels.linear.solver import ITERATIONS
from damagepred.kernels.structures import FLOAT_ROWS, FLOATS, Structure

DEFLECTION_TOLERANCE = 1e-9
"""Difference between the deflection at the jacks and its given value in equilibrium (m)."""


@law
def controls_deflection(state):
    """Whether the deflection at the jacks is given, and their load unknown."""
    return state.deflection == state.deflection  # NaN where it is not


@law
def missing_deflection(wall, state, displacement):
    """Missing deflection at the jacks (m), 0 where their load is given."""
    if controls_deflection(state):
        return state.deflection - dot(wall.freedoms.weights, displacement)
    return 0.0


RESIDUAL = types.float64(Wall.kind, State.kind, types.float64, FLOATS, types.boolean, FLOATS)


@phase(RESIDUAL)
def wall_residual(wall, state, jack, displacement, coulomb, residual):
    """Unbalanced force ratio; fills the residual force on free degrees of freedom and the tangents of the interfaces.

    ``jack``: load of each jack (N). ``displacement`` gets the motion of facets and the interior of yielding blocks.
    """
    force, push, freedoms, blocks = wall.force, wall.freedoms.push, wall.freedoms, wall.components.blocks
    copy(state.external, force)
    for i in range(push.size):
        force[i] += jack * push[i]
    listed, stiffness = wall.interfaces.jointed, wall.stiffness
    internal_forces(
        wall.components, state, state.ground, state.live, listed, coulomb, False, displacement, force, stiffness
    )
    subtract_boundary_forces(wall.condensation, displacement, force)
    # NaN must not pass for balance; forces of a block that finds no equilibrium inside are NaN, too
    ratio = free_residual(force, freedoms.free, freedoms.per_weight, residual)
    if blocks.present:
        ratio = max(ratio, blocks.largest_resultant(blocks.blocks, residual))
    if not coulomb:  # a Tresca problem is solved under a given load of the jacks
        return ratio
    constraint = abs(missing_deflection(wall, state, displacement)) / DEFLECTION_TOLERANCE * wall.tolerance
    return max(ratio, constraint if constraint < np.inf else np.inf)


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


SOLVE_STEP = types.float64(Wall.kind, State.kind, FLOAT_ROWS, types.boolean, FLOATS, FLOATS, FLOATS)


@phase(SOLVE_STEP)
def solve_step(wall, state, stiffness, bordered, displacement, residual, step):
    """Solve the tangent equations for a residual; fills the step of displacements, returns the load step of jacks (N).

    ``bordered``: the load of the jacks is unknown, if their deflection is given.
    """
    blocks = wall.components.blocks
    wall.solver.counts[ITERATIONS] += 1
    if blocks.present and blocks.yielding.present:
        blocks.yielding.update_tangents(blocks.blocks, wall.solver)
    if bordered and controls_deflection(state):
        right, solution = wall.pairs[:2], wall.pairs[2:]
        copy(residual, right[0])
        copy(wall.freedoms.push, right[1])
        wall.solve_tangent(wall.solver, stiffness, right, solution)
        missing = missing_deflection(wall, state, displacement)
        return bordered_step(wall.freedoms.weights, solution, missing, step)
    wall.solve_tangent(wall.solver, stiffness, residual.reshape(1, residual.size), step.reshape(1, step.size))
    return 0.0


class Steps(Structure):
    """Steps of all iterations."""

    residual = types.FunctionType(RESIDUAL)
    solve = types.FunctionType(SOLVE_STEP)


@kernel
def residual_from_python(steps, wall, state, jack, displacement, residual):
    """``wall_residual`` with the Coulomb law."""
    return steps.residual(wall, state, jack, displacement, True, residual)
