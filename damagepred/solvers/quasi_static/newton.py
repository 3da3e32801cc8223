"""Newton's method on the Coulomb law: from a nearby equilibrium it converges in a few iterations.

Loose blocks make the tangent nearly singular, and its step far too long. Damping by the elastic stiffness bounds it.
"""

from __future__ import annotations

import numpy as np

from damagepred.arrays import FloatArray
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


def damped_newton(problem: Residual, state: State, start: FloatArray) -> tuple[FloatArray, float]:
    """Damped Newton's method on the Coulomb law; return the best iterate and its unbalanced force ratio.

    The matrix is (1 - s) K + s K_e with the tangent K, the elastic stiffness K_e of the joints, and a share s that
    adapts to the residual (Levenberg-Marquardt). With s = 0 this is Newton's method, with s = 1 the initial stress
    method (Zienkiewicz, Valliappan and King 1969).

    Parameters
    ----------
    problem, state, start
        As ``newton``.
    """
    options, elastic = problem.options.damped_newton, problem.equations.factors.elastic
    u = best = start
    load = state.jack
    force, ratio = problem.residual(state, u)
    tangent = problem.stiffness.copy()
    least, damping, stagnating = ratio, options.initial_damping, 0
    for _ in range(options.max_iterations):
        check_time()
        damped = tangent + damping * (elastic - tangent)
        step, jack_step = problem.solve(damped, force, problem.missing_deflection(state, u))
        before, last = ratio, state.jack
        state.jack = last + jack_step
        trial_force, ratio = problem.residual(state, u + step)
        if not ratio <= options.residual_growth * before:
            # step rejected
            ratio, state.jack = before, last
            damping = max(options.damping_growth * damping, options.initial_damping)
            if damping > 1.0:
                break
            continue
        u, force, tangent = u + step, trial_force, problem.stiffness.copy()
        stagnating = 0 if ratio < options.stagnation_ratio * least else stagnating + 1
        if ratio < least:
            best, least, load = u, ratio, state.jack
        if ratio < problem.tolerance:
            problem.store_tangent(state, u)
            break
        if stagnating > options.stagnation_limit:
            break
        if ratio < 0.5 * before:
            damping = options.damping_decay * damping if damping > options.minimum_damping else 0.0
        elif ratio > before:
            damping = min(max(options.damping_growth * damping, options.initial_damping), 1.0)
    state.jack = load
    if problem.has_diverged(state, best):
        least = np.inf
    return best, least
