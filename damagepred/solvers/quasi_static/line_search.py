"""Line search along a step: root of the work of the residual, by safeguarded regula falsi (Crisfield 1991, ch. 9)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from damagepred.arrays import FloatArray
from damagepred.solvers.quasi_static.residual import Residual
from damagepred.solvers.state.wall_state import State


class SearchDirection(NamedTuple):
    """A step from an iterate, along which the work of the residual is positive at first.

    Attributes
    ----------
    start, step : array (size,)
        Displacements of the iterate, and those of the whole step.
    jack, jack_step : float
        Load of the jacks at the iterate, and its step (N).
    slope : float
        Work of the residual at the iterate along the step (J).
    coulomb : bool
        Coulomb law, or a Tresca problem, whose residual is the slope of a convex potential.
    """

    start: FloatArray
    step: FloatArray
    jack: float
    jack_step: float
    slope: float
    coulomb: bool

    def residual(self, problem: Residual, state: State, step_length: float) -> tuple[FloatArray, float]:
        """Return residual force and unbalanced force ratio at a share of the step; sets the load of the jacks.

        Parameters
        ----------
        problem : Residual
            The wall.
        state : State
            Load, load factor and history.
        step_length : float
            Share of the step (1).
        """
        state.jack = self.jack + step_length * self.jack_step
        return problem.residual(state, self.start + step_length * self.step, self.coulomb)


def line_search(
    problem: Residual,
    state: State,
    direction: SearchDirection,
    first: tuple[FloatArray, float],
    slope_tolerance: float,
    maximum_step: float,
) -> tuple[float, FloatArray, float]:
    """Return the step length at which the residual does next to no work, with residual force and ratio there.

    Parameters
    ----------
    problem : Residual
        The wall.
    state : State
        Load, load factor and history.
    direction : SearchDirection
        The step.
    first : tuple of array (size,), float
        Residual force and unbalanced force ratio at the whole step.
    slope_tolerance : float
        Work over that at the start of the step, at which the search ends (1).
    maximum_step : float
        Largest multiple of the step (1).
    """
    options = problem.options.line_search
    low, high, slope_low, slope_high = 0.0, 1.0, direction.slope, np.nan
    step_length, (force, ratio) = 1.0, first
    for _ in range(options.max_iterations):
        slope_here = float(force @ direction.step) if ratio < np.inf else -np.inf
        if abs(slope_here) <= slope_tolerance * direction.slope or (slope_here > 0 and step_length >= maximum_step):
            break
        if slope_here > 0:
            low, slope_low = step_length, slope_here
        else:
            high, slope_high = step_length, slope_here
        if np.isnan(slope_high):
            step_length *= 2.0
        else:
            # false position, kept away from the ends
            root = slope_low / (slope_low - slope_high)
            step_length = low + (high - low) * min(max(root, options.safeguard), 1.0 - options.safeguard)
        force, ratio = direction.residual(problem, state, step_length)
    return step_length, force, ratio
