"""Coulomb friction by Tresca fixed-point iteration (Haslinger 1983; Wriggers 2006, ch. 10).

With fixed friction bounds (Tresca problem) the wall has a potential, convex in the displacements, which Newton's method
with line search minimises from any start. The bounds are updated and the minimisation repeated until both agree.
"""

from __future__ import annotations

import numpy as np

from damagepred.kernels.joint.limits import NO_LIMIT
from damagepred.solvers.quasi_static.residual import Residual
from damagepred.solvers.state.wall_state import State

FIRST_FORCING = 3.0
"""Largest residual tolerance of a Tresca problem, also the tolerance of the first (mean block weights)."""
WARM_START_ITERATIONS = 6
"""Tresca problems of that search."""
FULL_UPDATES = 6
"""Tresca problems after which the bounds are updated in full; later updates are under-relaxed."""
UPDATES_PER_FACTOR = 12
"""Updates with each of them; the last holds from there on."""


def coulomb_fixed_point(problem: Residual, state: State, warm: bool, max_newton_iterations: int) -> float:
    """Coulomb friction by Tresca fixed-point iteration from the displacements of a state, which it sets.

    Returns the unbalanced force ratio.

    Each iteration minimises the potential with fixed bounds, updates these, under-relaxed after the first updates, and
    tries Newton's method on the Coulomb law from there. The minimisation is inexact: its tolerance is a share of the
    residual of the Coulomb law, which remains with frozen bounds (Dembo, Eisenstat and Steihaug 1982). A warm start
    takes the first bounds from the present displacements.
    """
    options = problem.options.coulomb
    bounds, history = problem.components.bounds, state.history
    bounds.bound[:], bounds.dilatant_opening[:], bounds.kappa[:] = NO_LIMIT, history.dilatant_opening, history.kappa
    if warm:
        problem.update_tresca_bounds(state, 1.0)
    ratio, least, since, begun = np.inf, np.inf, 0, problem.newton_iterations
    forcing = _forcing(problem, state) if warm else FIRST_FORCING
    for attempt in range(WARM_START_ITERATIONS if warm else options.max_iterations):
        problem.minimise(state, forcing)
        if problem.has_diverged(state):
            break
        relaxation = 1.0
        if attempt >= FULL_UPDATES:
            # bounds that overshoot are under-relaxed
            update = (attempt - FULL_UPDATES) // UPDATES_PER_FACTOR
            relaxation = _at_or_last(options.relaxation_factors, update)
        problem.update_tresca_bounds(state, relaxation)
        found, ratio = problem.newton(state, state.displacement)
        if ratio < problem.tolerance:
            state.displacement[:] = found
            break
        forcing = _forcing(problem, state)
        since = 0 if ratio < 0.5 * least else since + 1
        least = min(least, ratio)
        if since > options.stagnation_limit or problem.newton_iterations - begun > max_newton_iterations:
            break
    return ratio


def _at_or_last(values: tuple[float, ...], index: int) -> float:
    """Return the value at an index; beyond the end, the last one."""
    return values[min(index, len(values) - 1)]


def _forcing(problem: Residual, state: State) -> float:
    """Return the residual tolerance of the next Tresca problem (mean block weights)."""
    options, (_, ratio) = problem.options.coulomb, problem.residual(state, state.displacement)
    return max(problem.tolerance, min(options.forcing_share * ratio, FIRST_FORCING))
