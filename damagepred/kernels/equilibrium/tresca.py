"""Minimum of the potential of a Tresca problem: Newton's method with line search (Wriggers 2006, ch. 10)."""

from damagepred.kernels.equilibrium.line_search import MAXIMUM_STEP, line_search
from damagepred.kernels.equilibrium.residual import DEFLECTION_TOLERANCE, controls_deflection, missing_deflection
from damagepred.kernels.equilibrium.vectors import copy, dot, move_along
from damagepred.kernels.interface.residual import within_limit
from damagepred.kernels.jit import kernel, rule

MAX_MINIMISATION_ITERATIONS = 100
"""Newton iterations of one Tresca problem."""
SLOPE_TOLERANCE = 0.3
"""Work of the residual along a step over that at its start, at which the line search ends (1)."""


@kernel
def minimise_tresca(steps, wall, state, jack, tolerance, u):
    """Minimum of the potential of a Tresca problem by Newton's method with line search (Wriggers 2006, ch. 10).

    ``u`` is the start and becomes the minimum, within an unbalanced force ratio; returns the load of the jacks (N).
    """
    room, stiffness = wall.room, wall.stiffness
    trial, step, force = room[1], room[2], room[3]
    allowed = DEFLECTION_TOLERANCE * max(tolerance / wall.tolerance, 1.0)
    ratio = steps.residual(wall, state, jack, u, False, force)
    jack += _correct_jack_load(steps, wall, state, u, step, force)
    for taken in range(MAX_MINIMISATION_ITERATIONS):
        # at least one step: bounds of the previous displacements may carry nothing
        if ratio < (tolerance if taken else wall.tolerance):
            if abs(missing_deflection(wall, state, u)) <= allowed:
                break
            # minimum under this jack load: correct the load for the deflection
            jack += _correct_jack_load(steps, wall, state, u, step, force)
        steps.solve(wall, state, stiffness, False, u, force, step)
        slope = dot(force, step)
        if not slope > 0.0:
            break
        move_along(u, 1.0, step, trial)
        ratio = steps.residual(wall, state, jack, trial, False, force)
        _, ratio = line_search(
            steps, wall, state, jack, 0.0, u, step, slope, ratio, SLOPE_TOLERANCE, MAXIMUM_STEP, False, trial, force
        )
        copy(trial, u)
        if not within_limit(u, wall.freedoms.free, wall.freedoms.arms, state.limit):
            break
    return jack


@rule
def _correct_jack_load(steps, wall, state, u, step, force):
    """Correct the load of the jacks for the given deflection by the present tangent, also in the residual; return it.

    Only under a given load does the wall have a potential: jacks do no work on the measured deflection.
    """
    if not controls_deflection(state):
        return 0.0
    jack_step = steps.solve(wall, state, wall.stiffness, True, u, force, step)
    for i in wall.freedoms.free:
        force[i] += jack_step * wall.freedoms.push[i]
    return jack_step
