"""Newton's method on the Coulomb law, with line search or with backtracking.

Loose blocks make the tangent nearly singular, and its step far too long: a line search shortens it. The tangent of
Coulomb friction is not symmetric: sliding contacts gain resistance where they are pressed together, and lose it where
they part. Where a step has negative work of the residual, the tangent is indefinite and the step leads back to an
unstable equilibrium. The reversed step, a direction of negative curvature, leads away from it, as in minimisation
(Nocedal and Wright 2006, ch. 3).

Inside each block whose zones yield a second Newton runs in every residual: ``_correct_block`` of
kernels/zone/superelement.
"""

import numpy as np

from damagepred.kernels.equilibrium.completion import complete, store_tangent
from damagepred.kernels.equilibrium.line_search import MAXIMUM_STEP, line_search
from damagepred.kernels.equilibrium.residual import controls_deflection
from damagepred.kernels.equilibrium.vectors import copy, dot, move_along
from damagepred.kernels.jit import kernel, rule

UNDAMPED_ITERATIONS = 5
"""Iterations whose step is taken in full although the residual grows."""
MINIMUM_STEP = 0.1
"""Share of the Newton step below which backtracking ends (1)."""
STAGNATION_TOLERANCE = 1e-3
"""Relative difference from the least residual at which the iteration is a cycle of active sets (1)."""
EARLY_DIVERGENCE_RATIO = 10.0
"""Residual over the least before, where that was below ``WARM_START_RESIDUAL``, that counts as early divergence (1)."""
EARLY_DIVERGENCE_ITERATIONS = 2
"""Iterations in a row with such a residual, which end the attempt."""
DIVERGENCE_RATIO = 1e3
"""Growth of the residual, over the larger of its first value and one block weight, that ends the attempt (1)."""
FULL_STEP_REDUCTION = 0.5
"""Residual over that before the step, below which no line search is needed (1)."""
FLAT_SLOPE = 0.9999
"""Work of the residual at the end of a full step over that at its start, above which the step is lengthened (1)."""
STAGNATION_RATIO = 0.9
"""Residual over the least before, from which an iteration counts as stagnation (1)."""
SLOPE_TOLERANCE = 0.5
"""Work of the residual along a step over that at its start, at which the line search ends (1)."""
STAGNATION_LIMIT = 25
"""Iterations in a row with stagnation that are allowed."""
WARM_START_RESIDUAL = 30.0
"""Residual of the Newton iterate below which its Tresca bounds start the first search (mean block weights)."""


@rule
def newton(steps, wall, state, jack, start, best):
    """Newton's method with backtracking on the Coulomb law, from ``start``; fills the ``best`` iterate.

    Returns unbalanced force ratio and load of the jacks there. The first iterations are undamped: active sets of
    contacts often stabilise although the residual grows.
    """
    room, tolerance = wall.room, wall.tolerance
    u, trial, step, force = room[0], room[1], room[2], room[3]
    copy(start, u)
    copy(start, best)
    ratio = steps.residual(wall, state, jack, u, True, force)
    first, least, best_jack, diverging = ratio, ratio, jack, 0
    for taken in range(wall.newton_iterations + 1):
        if ratio < tolerance:
            break
        diverging = diverging + 1 if ratio > EARLY_DIVERGENCE_RATIO * least else 0
        if diverging >= EARLY_DIVERGENCE_ITERATIONS and least < WARM_START_RESIDUAL:
            break
        jack_step = steps.solve(wall, state, wall.stiffness, True, u, force, step)
        before, length = ratio, 1.0
        move_along(u, length, step, trial)
        ratio = steps.residual(wall, state, jack + jack_step, trial, True, force)
        while length > MINIMUM_STEP and ((ratio > before and taken >= UNDAMPED_ITERATIONS) or ratio == np.inf):
            # active sets that alternate: backtracking
            length *= 0.5
            move_along(u, length, step, trial)
            ratio = steps.residual(wall, state, jack + length * jack_step, trial, True, force)
        if not ratio < DIVERGENCE_RATIO * max(first, 1.0):
            break
        copy(trial, u)
        jack += length * jack_step
        stagnates = abs(ratio - least) <= STAGNATION_TOLERANCE * least
        if ratio < least:
            least, best_jack = ratio, jack
            copy(u, best)
        if stagnates and ratio >= tolerance:
            break
    return least, best_jack


@rule
def newton_with_line_search(steps, wall, state, jack, start, best):
    """Newton's method with line search on the Coulomb law, from ``start``; fills the ``best`` iterate.

    Returns unbalanced force ratio and load of the jacks there. A step that does not halve the residual ends where the
    work of the residual along it vanishes (Crisfield 1991, ch. 9). Joints that open far, or a loose block, would
    otherwise throw the iteration away. Where a part of the wall slides under constant friction, the residual stays the
    same along the step, whose length is the length of the regularisation: there the step is lengthened until a contact
    closes or sticks. A step of negative work is reversed, unless jacks control the deflection: then the residual is not
    the slope of a potential.
    """
    room, tolerance, most = wall.room, wall.tolerance, wall.line_search_iterations
    u, trial, step, force = room[0], room[1], room[2], room[3]
    copy(start, u)
    copy(start, best)
    ratio = steps.residual(wall, state, jack, u, True, force)
    least, best_jack, stagnating = ratio, jack, 0
    for taken in range(most + 1):
        if ratio < tolerance or taken == most or stagnating > STAGNATION_LIMIT:
            break
        jack_step = steps.solve(wall, state, wall.stiffness, True, u, force, step)
        slope, before, length = dot(force, step), ratio, 1.0
        if slope < 0.0 and not controls_deflection(state):
            slope = -slope
            move_along(step, -2.0, step, step)
        move_along(u, length, step, trial)
        ratio = steps.residual(wall, state, jack + jack_step, trial, True, force)
        if not ratio < FULL_STEP_REDUCTION * before and slope > 0.0:
            flat = ratio < np.inf and dot(force, step) > FLAT_SLOPE * slope
            longest = MAXIMUM_STEP if flat else 1.0
            length, ratio = line_search(
                steps, wall, state, jack, jack_step, u, step, slope, ratio, SLOPE_TOLERANCE, longest, True, trial, force
            )
        if ratio == np.inf:
            break
        copy(trial, u)
        jack += length * jack_step
        stagnating = 0 if ratio < STAGNATION_RATIO * least else stagnating + 1
        if ratio < least:
            least, best_jack = ratio, jack
            copy(u, best)
    return least, best_jack


@kernel
def run_newton(steps, wall, state, support_step, jack, start, best, searching):
    """Newton's method with line search (``searching``) or backtracking, and the steps after an equilibrium.

    Returns unbalanced force ratio and load of the jacks at the best iterate. If that is an equilibrium, its tangent is
    stored and it is completed; the third result is the result of ``complete``.
    """
    if searching:
        ratio, jack = newton_with_line_search(steps, wall, state, jack, start, best)
    else:
        ratio, jack = newton(steps, wall, state, jack, start, best)
    if not ratio < wall.tolerance:
        return ratio, jack, (False, 0, 0.0, 0.0)
    store_tangent(wall, state, support_step, best)
    return ratio, jack, complete(wall, state, best)
