"""Minimum of the potential of a Tresca problem: Newton's method with line search (Wriggers 2006, ch. 10)."""

from damagepred.kernels.equilibrium.line_search import line_search
from damagepred.kernels.equilibrium.residual import (
    Problem,
    add_jack_load,
    controls_deflection,
    goes_too_far,
    missing,
    residual,
    solve,
)
from damagepred.kernels.equilibrium.vectors import copy, dot, move_along
from damagepred.kernels.jit import kernel, rule


@rule
def minimise(problem, jack, tolerance, limit, u, room):
    """Minimise the potential of a Tresca problem from any start; return the load of the jacks.

    Parameters
    ----------
    problem : Problem
        A wall in a state.
    jack : float
        Load of each jack at the start (N).
    tolerance : float
        Unbalanced force ratio at which the minimisation ends, if it has taken a step.
    limit : float
        Displacement beyond which no minimum is sought (m).
    u : array (size,)
        Displacements: start, and minimum.
    room : array (4, size)
        Scratch.
    """
    parameters = problem.parameters
    search, trial, step, force = parameters.line_search, room[1], room[2], room[3]
    allowed = parameters.deflection_tolerance * max(tolerance / parameters.tolerance, 1.0)
    ratio = residual(problem, jack, u, False, force)
    jack += _correct_jack_load(problem, u, step, force)
    for taken in range(parameters.max_minimisation_iterations):
        # at least one step: bounds of the previous displacements may carry nothing
        if ratio < (tolerance if taken else parameters.tolerance):
            if abs(missing(problem, u)) <= allowed:
                break
            # minimum under this jack load: correct the load for the deflection
            jack += _correct_jack_load(problem, u, step, force)
        solve(problem, False, u, force, step)
        slope = dot(force, step)
        if not slope > 0.0:
            break
        move_along(u, 1.0, step, trial)
        ratio = residual(problem, jack, trial, False, force)
        _, ratio = line_search(
            problem,
            jack,
            0.0,
            u,
            step,
            slope,
            ratio,
            search.slope_tolerance,
            search.maximum_step,
            False,
            trial,
            force,
        )
        copy(trial, u)
        if goes_too_far(problem, u, limit):
            break
    return jack


@rule
def _correct_jack_load(problem, u, step, force):
    """Correct the load of the jacks for the given deflection by the present tangent, also in the residual; return it.

    Only under a given load does the wall have a potential: jacks do no work on the measured deflection.
    """
    if not controls_deflection(problem):
        return 0.0
    jack_step = solve(problem, True, u, force, step)
    add_jack_load(problem, jack_step, force)
    return jack_step


@kernel
def minimise_tresca(wall, state, jack, tolerance, u):
    """Minimise the potential of the Tresca problem of a wall, from ``u`` on, the minimum; the load of the jacks (N)."""
    return minimise(Problem(wall.parameters[0], wall, state), jack, tolerance, state.limit, u, wall.room)
