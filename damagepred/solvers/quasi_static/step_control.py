"""Step control of the continuation: next target, brackets of events and collapse, step length by the energy balance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from damagepred.solvers.options import DEFAULTS
from damagepred.solvers.quasi_static.energy_balance import WorkBalance
from damagepred.solvers.quasi_static.equilibrium import State
from damagepred.solvers.quasi_static.options import EnergyOptions

Point = tuple[float, float]
"""Load and load factor."""


@dataclass(frozen=True)
class EnergyControl:
    """Step control by the energy balance.

    Between two equilibria joints open and slide. Work by the trapezoidal rule and dissipation by the return mapping
    (backward Euler) are wrong there by second order of the step: the imbalance measures it. A step whose imbalance is
    too large is repeated with a part of its length.

    Attributes
    ----------
    tolerance : float
        Energy error summed along the path over the largest external work (1).
    options : EnergyOptions
        How far steps are refined.
    """

    tolerance: float
    options: EnergyOptions = DEFAULTS.energy

    def next_length(self, before: WorkBalance, after: WorkBalance, step: float) -> float:
        """Return the step length whose imbalance is just allowed.

        It is that of the next step, or of this step repeated if shorter. The imbalance is of second order in the step,
        which gives the square root.

        Parameters
        ----------
        before, after : WorkBalance
            At the two ends of the step.
        step : float
            Its length.
        """
        error = (after.energy_error - before.energy_error) - (after.section_error - before.section_error)
        options = self.options
        allowed = max(options.step_share * self.tolerance * after.largest_work, after.residual_work)
        factor = options.safety * float(np.sqrt(allowed / error)) if error > 0.0 else np.inf
        return step * (max(factor, options.shortest_cut) if error > allowed else min(max(factor, 1.0), options.growth))


@dataclass
class StepControl:
    """Step control of one increment: what is known of the way to its target.

    Attributes
    ----------
    collapsed_state : State
        The wall at ``collapse_point``; the start of the increment while there is none.
    minimum_step : float
        Distance to a rejected target below which a distant equilibrium is sought (1).
    minimum_event_step : float
        Step within which all bonds fail at its end (1).
    collapse_residual : float
        Unbalanced force ratio at ``collapse_point``.
    overloaded_point, collapse_point, rejected_target : (float, float) or None
        Nearest load and load factor at which a bond is overloaded, at which the wall collapses, and at which no nearby
        equilibrium was found.
    next_point : (float, float) or None
        Next target; None: that of the predictor.
    longest : float
        Step length allowed by the energy balance (1).
    halvings, event_cuts : int
        Of the present step.
    accepted_steps : int
        Steps since the last event: as often the predictor was too early.
    """

    collapsed_state: State
    minimum_step: float
    minimum_event_step: float
    collapse_residual: float = np.inf
    overloaded_point: Point | None = None
    collapse_point: Point | None = None
    rejected_target: Point | None = None
    next_point: Point | None = None
    longest: float = np.inf
    halvings: int = 0
    event_cuts: int = 0
    accepted_steps: int = 0

    def accept_step(self) -> None:
        """Count a step that ended before any event."""
        self.next_point, self.halvings, self.accepted_steps = None, max(self.halvings - 1, 0), self.accepted_steps + 1

    def pass_event(self) -> None:
        """Start anew after an event."""
        self.next_point = self.overloaded_point = None
        self.halvings = self.event_cuts = self.accepted_steps = 0


def next_target(state: State, goal: Point, ceiling: Point | None, minimum_step: float) -> Point:
    """Return the next target of the continuation: the goal, the ceiling, or the midpoint of the way to it.

    Parameters
    ----------
    state : State
        The last equilibrium.
    goal : (float, float)
        Load and load factor to reach.
    ceiling : (float, float), optional
        Where the wall collapses, or no equilibrium was found.
    minimum_step : float
        Distance to the ceiling below which it is tried itself.
    """
    if ceiling is None or distance(state, goal) < distance(state, ceiling):
        return goal
    return ceiling if distance(state, ceiling) <= minimum_step else between(state, ceiling, 0.5)


def distance(state: State, point: Point) -> float:
    """Return the distance in load and load factor (1).

    Parameters
    ----------
    state : State
        From here.
    point : (float, float)
        Load and load factor.
    """
    return abs(point[0] - state.load) + abs(point[1] - state.load_factor)


def between(state: State, point: Point, share: float) -> Point:
    """Interpolate load and load factor.

    Parameters
    ----------
    state : State
        Start.
    point : (float, float)
        End.
    share : float
        0 at the start, 1 at the end.
    """
    return state.load + share * (point[0] - state.load), state.load_factor + share * (point[1] - state.load_factor)
