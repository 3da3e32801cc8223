"""Coulomb friction by Tresca fixed-point iteration (Haslinger 1983; Wriggers 2006, ch. 10).

With fixed friction bounds (Tresca problem) the wall has a potential, convex in the displacements, which Newton's method
with line search minimises from any start. The bounds are updated and the minimisation repeated until both agree.
"""

from __future__ import annotations

import numpy as np

from damagepred.arrays import FloatArray
from damagepred.kernels.joint.limits import NO_LIMIT
from damagepred.solvers.quasi_static.line_search import SearchDirection, line_search
from damagepred.solvers.quasi_static.newton import newton
from damagepred.solvers.quasi_static.residual import Residual
from damagepred.solvers.state.wall_state import State
from damagepred.time_limit import check_time


def coulomb_fixed_point(problem: Residual, state: State, warm: bool, max_newton_iterations: int) -> float:
    """Coulomb friction by Tresca fixed-point iteration; return the unbalanced force ratio.

    Each iteration minimises the potential with fixed bounds, updates these, under-relaxed after the first updates, and
    tries Newton's method on the Coulomb law from there. The minimisation is inexact: its tolerance is a share of the
    residual of the Coulomb law, which the bounds leave anyhow (Dembo, Eisenstat and Steihaug 1982). A warm start takes
    the first bounds from the present displacements.

    Parameters
    ----------
    problem : Residual
        The wall.
    state : State
        Load, load factor and history; its displacements are the start and become those found.
    warm : bool
        Whether the start is a warm one.
    max_newton_iterations : int
        After which the search ends.
    """
    options = problem.options.coulomb
    bound, dilatant_opening, kappa = problem.tresca
    bound[:], dilatant_opening[:], kappa[:] = NO_LIMIT, state.history.dilatant_opening, state.history.kappa
    if warm:
        problem.update_tresca_bounds(state, 1.0)
    ratio, least, since, begun = np.inf, np.inf, 0, problem.newton_iterations
    forcing = _forcing(problem, state) if warm else options.first_forcing
    for attempt in range(options.warm_start_iterations if warm else options.max_iterations):
        _minimise(problem, state, forcing)
        if problem.has_diverged(state):
            break
        relaxation = 1.0
        if attempt >= options.full_updates:
            # bounds that overshoot are under-relaxed
            update = (attempt - options.full_updates) // options.updates_per_factor
            relaxation = _at_or_last(options.relaxation_factors, update)
        problem.update_tresca_bounds(state, relaxation)
        found, ratio = newton(problem, state, state.displacement)
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
    return max(problem.tolerance, min(options.forcing_share * ratio, options.first_forcing))


def _minimise(problem: Residual, state: State, tolerance: float) -> None:
    """Minimise the potential of a Tresca problem by Newton with line search."""
    u, search = state.displacement, problem.options.line_search
    force, ratio = problem.residual(state, u, coulomb=False)
    _correct_jack_load(problem, state, force, u)
    for taken in range(problem.options.coulomb.max_minimisation_iterations):
        # at least one step: bounds of the previous displacements may carry nothing
        if ratio < (tolerance if taken else problem.tolerance):
            allowed = problem.options.jacks.deflection_tolerance * max(tolerance / problem.tolerance, 1.0)
            if abs(problem.missing_deflection(state, u)) <= allowed:
                break
            # minimum under this jack load: correct the load for the deflection
            _correct_jack_load(problem, state, force, u)
        check_time()
        problem.equations.update(problem.stiffness)
        problem.newton_iterations += 1
        step = problem.equations.solve(force)
        slope = float(force @ step)
        if not slope > 0:
            break
        direction = SearchDirection(u, step, state.jack, 0.0, slope, coulomb=False)
        whole = direction.residual(problem, state, 1.0)
        step_length, force, ratio = line_search(
            problem, state, direction, whole, search.slope_tolerance, search.maximum_step
        )
        u += step_length * step
        if problem.has_diverged(state):
            break


def _correct_jack_load(problem: Residual, state: State, force: FloatArray, u: FloatArray) -> None:
    """Set the load of the jacks for the given deflection by the present tangent, and add it to the residual.

    Only under a given load does the wall have a potential: jacks do no work on the measured deflection.
    """
    if problem.jacks is None or problem.jacks.by_load:
        return
    _, jack_step = problem.solve(problem.stiffness, force, problem.missing_deflection(state, u))
    state.jack += jack_step
    force += np.where(problem.free, jack_step * problem.jacks.push, 0.0)
