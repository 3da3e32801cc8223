"""Newton's method on the Coulomb law: from a nearby equilibrium it converges in a few iterations.

Loose blocks make the tangent nearly singular, and its step far too long. A line search shortens it.
"""

from __future__ import annotations

import numpy as np

from damagepred.arrays import FloatArray
from damagepred.solvers.quasi_static.line_search import SearchDirection, line_search
from damagepred.solvers.quasi_static.residual import Residual
from damagepred.solvers.state.wall_state import State
from damagepred.time_limit import check_time


def newton(problem: Residual, state: State, start: FloatArray) -> tuple[FloatArray, float]:
    """Newton's method with backtracking on the Coulomb law; return the best iterate and its unbalanced force ratio.

    The first iterations are undamped: active sets of contacts often stabilise although the residual grows.

    Parameters
    ----------
    problem : Residual
        The wall.
    state : State
        Load, load factor and history; the load of the jacks becomes that of the best iterate.
    start : array (size,)
        First displacements.
    """
    options = problem.options.newton
    u = best = start
    load = state.jack
    force, ratio = problem.residual(state, u)
    first = least = ratio
    diverging = 0
    for taken in range(options.max_iterations + 1):
        if ratio < problem.tolerance:
            problem.store_tangent(state, u)
            break
        diverging = diverging + 1 if ratio > options.early_divergence_ratio * least else 0
        near = least < problem.options.coulomb.warm_start_residual
        if diverging >= options.early_divergence_iterations and near:
            break
        check_time()
        step, jack_step = problem.solve(problem.stiffness, force, problem.missing_deflection(state, u))
        before, step_length, last = ratio, 1.0, state.jack
        state.jack = last + jack_step
        force, ratio = problem.residual(state, u + step)
        while step_length > options.minimum_step and (
            (ratio > before and taken >= options.undamped_iterations) or ratio == np.inf
        ):
            # active sets that alternate: backtracking
            step_length *= 0.5
            state.jack = last + step_length * jack_step
            force, ratio = problem.residual(state, u + step_length * step)
        if not ratio < options.divergence_ratio * max(first, 1.0):
            break
        u = u + step_length * step
        stagnates = abs(ratio - least) <= options.stagnation_tolerance * least
        if ratio < least:
            best, least, load = u, ratio, state.jack
        if stagnates and ratio >= problem.tolerance:
            break
    state.jack = load
    if problem.has_diverged(state, best):
        least = np.inf
    return best, least


def newton_with_line_search(problem: Residual, state: State, start: FloatArray) -> tuple[FloatArray, float]:
    """Newton's method with line search on the Coulomb law; return the best iterate and its unbalanced force ratio.

    A step that does not halve the residual ends where the work of the residual along it vanishes (Crisfield 1991,
    ch. 9). Joints that open far, or a loose block, would otherwise throw the iteration away.

    Parameters
    ----------
    problem, state, start
        As ``newton``.
    """
    options = problem.options.newton_with_line_search
    u = best = start
    load = state.jack
    force, ratio = problem.residual(state, u)
    least, stagnating = ratio, 0
    for taken in range(options.max_iterations + 1):
        if ratio < problem.tolerance:
            problem.store_tangent(state, u)
            break
        if taken == options.max_iterations or stagnating > options.stagnation_limit:
            break
        check_time()
        step, jack_step = problem.solve(problem.stiffness, force, problem.missing_deflection(state, u))
        direction = SearchDirection(u, step, state.jack, jack_step, float(force @ step), coulomb=True)
        before, step_length = ratio, 1.0
        force, ratio = direction.residual(problem, state, 1.0)
        if not ratio < options.full_step_reduction * before and direction.slope > 0.0:
            step_length, force, ratio = line_search(
                problem, state, direction, (force, ratio), options.slope_tolerance, 1.0
            )
        if ratio == np.inf:
            break
        u = u + step_length * step
        stagnating = 0 if ratio < options.stagnation_ratio * least else stagnating + 1
        if ratio < least:
            best, least, load = u, ratio, state.jack
    state.jack = load
    if problem.has_diverged(state, best):
        least = np.inf
    return best, least
