"""Step control of the continuation: next target, brackets of events and collapse, step length by the energy balance."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from damagepred.solvers.quasi_static.energy_balance import EnergyBalance
from damagepred.solvers.state.wall_state import Point, State

MAX_HALVINGS = 5
"""Halvings of a step without equilibrium."""
COLLAPSE_BRACKET = 1e-4
"""Load factor between the last equilibrium and collapse under live load (1)."""
STEP_SHARE = 0.2
"""Share of the tolerated energy error that one step may contribute (1)."""
SAFETY = 0.8
"""Factor on the step length that the error asks for (1)."""
REFINEMENTS = 7
"""Halvings of an increment, or of a shorter first step, down to its shortest step."""
EVENT_STEP_GROWTH = 4.0
"""Growth of the shortest step to an event when a bond that fails in a longer step holds in shorter ones (1)."""
DISTANT_STEP_GROWTH = 4.0
"""Growth of the minimum step after a distant equilibrium was accepted (1)."""
CLIPPED_STEP = 1e-3
"""Difference from the longest step, over that step, from which a step is shorter than the energy balance allows (1)."""
MAX_EVENT_CUTS = 4
"""Cuts of a step to where interpolation expects a bond to fail; after that the step is halved."""
MINIMUM_EVENT_SHARE = 1e-4
"""Least share of a step to the interpolated event (1)."""
MAXIMUM_EVENT_SHARE = 0.95
"""Largest share of a step to the interpolated event (1)."""
MINIMUM_EVENT_STEP = 1e-5
"""Step, over the increment, within which all bonds fail at its end (1)."""
DAMAGE_GROWTH = 1.0
"""Joints whose bond may soften to 0 in one step (1)."""
SHORTEST_CUT = 0.1
"""Least factor from one step to the next (1)."""
JUMP_SHARE = 0.75
"""Ratio of the energy errors of a step and of a step twice as long, above which the path jumps; usually 0.25 (1)."""
STEP_GROWTH = 4.0
"""Largest factor from one step to the next (1)."""


def next_length(tolerance: float, before: EnergyBalance, after: EnergyBalance, damage: float, step: float) -> float:
    """Step length by the energy balance, and by the ``damage`` of softening bonds in this step (Gutierrez 2004).

    Between two equilibria joints open and slide. Work by the trapezoidal rule and dissipation by the return mapping
    (backward Euler) are wrong there by second order of the step: the imbalance measures it. A step whose imbalance is
    too large is repeated with a part of its length. ``tolerance``: imbalance summed along the path over the largest
    external work (1).
    """
    error = (after.energy_error - before.energy_error) - (after.section_error - before.section_error)
    allowed = max(STEP_SHARE * tolerance * after.largest_work, after.residual_work)
    factor = SAFETY * float(np.sqrt(allowed / error)) if error > 0.0 else np.inf
    if damage > 0.0:
        factor = min(factor, SAFETY * DAMAGE_GROWTH / damage)
    longer = error <= allowed and damage <= DAMAGE_GROWTH
    return step * (min(max(factor, 1.0), STEP_GROWTH) if longer else max(factor, SHORTEST_CUT))


@dataclass
class StepControl:
    """Step control of one increment: the next target, and what bounds it. Each method is one transition."""

    goal: Point  # load and load factor at the end of the increment
    minimum_step: float  # distance to a rejected target below which a distant equilibrium is sought (1)
    collapse_bracket: float  # distance between the last equilibrium and collapse at which collapse is located (1)
    # length of step that is neither halved for want of an equilibrium nor refined by the energy balance (1)
    shortest_halved_step: float
    shortest_refined_step: float
    minimum_event_step: float  # step within which all bonds fail at its end (1)
    longest_step: float = np.inf  # step length allowed by the energy balance (1)
    next_point: Point | None = None  # next target; None: the predictor's target
    # nearest load and load factor at which no nearby equilibrium was found, at which a bond is overloaded, and at
    # which the wall collapses
    rejected_target: Point | None = None
    overloaded_point: Point | None = None
    collapse_point: Point | None = None
    collapsed_state: State | None = None  # the wall at ``collapse_point``
    collapse_residual: float = np.inf  # unbalanced force ratio there
    halvings: int = 0  # energy balance of the present step
    event_cuts: int = 0
    accepted_steps: int = 0  # steps since the last event: as often the predictor was too early
    relaxes: bool = False  # whether the path jumps in the present step
    refused: tuple[float, float] = (0.0, 0.0)  # length (1) and energy error (J) of the last step that was too long
    refined: bool = False  # whether the energy balance asked for this step: the next is not longer

    @classmethod
    def start(
        cls,
        state: State,
        goal: Point,
        locates_collapse: bool,
        longest_step: float = np.inf,
        first_step: float = np.inf,
    ) -> StepControl:
        """Return the step control at the start of an increment."""
        length = state.distance(goal)
        minimum_step = max(COLLAPSE_BRACKET, length / 2**MAX_HALVINGS)
        return cls(
            goal,
            minimum_step,
            COLLAPSE_BRACKET if locates_collapse else minimum_step * (1.0 + 1e-9),
            1.5 * length / 2**MAX_HALVINGS,
            min(length, first_step) / 2**REFINEMENTS,
            MINIMUM_EVENT_STEP * length,
            longest_step,
        )

    def target(self, state: State) -> Point:
        """Return the next target, within the longest step."""
        target = self.next_point or self._target_ahead(state)
        step = state.distance(target)
        return state.towards(target, self.longest_step / step) if step > self.longest_step else target

    def _target_ahead(self, state: State) -> Point:
        """Return the goal or overloaded point, or, if that is nearer, the rejected target or the midpoint to it."""
        goal, ceiling = self.overloaded_point or self.goal, self.rejected_target or self.collapse_point
        if ceiling is None or state.distance(goal) < state.distance(ceiling):
            return goal
        tried_itself = self.rejected_target is not None and state.distance(ceiling) <= self.minimum_step
        return ceiling if tried_itself else state.towards(ceiling, 0.5)

    def has_located_collapse(self, state: State) -> bool:
        """Whether collapse is bracketed closely enough from the last equilibrium."""
        return self.collapse_point is not None and state.distance(self.collapse_point) <= self.collapse_bracket

    def reject_target(self, target: Point) -> None:
        """Reject a target without nearby equilibrium: it is approached by midpoints."""
        self.rejected_target, self.next_point = target, None

    def may_halve(self, step: float, allowed: int) -> bool:
        """Whether a step without equilibrium may be halved."""
        return self.halvings < min(allowed, MAX_HALVINGS) and step > self.shortest_halved_step

    def halve_step(self, state: State, target: Point) -> None:
        """Go to the midpoint of a step without equilibrium."""
        self.next_point, self.halvings = state.towards(target, 0.5), self.halvings + 1

    def accept_distant(self, target: Point) -> None:
        """Pass a target that had been rejected; from here on, distant equilibria are sought earlier."""
        if target == self.rejected_target:
            self.rejected_target = None
            self.minimum_step *= DISTANT_STEP_GROWTH

    def bracket_collapse(self, target: Point, collapsed: State, residual: float) -> None:
        """Take a target as collapse; nearer to the last equilibrium there may be another."""
        self.collapse_point, self.collapse_residual = target, residual
        self.collapsed_state = replace(collapsed, load=target[0], load_factor=target[1])
        self.minimum_step = COLLAPSE_BRACKET
        self.rejected_target = self.next_point = None

    def allow_step(self, length: float, step: float) -> None:
        """Set the longest step after a step within the energy error; a step cut short does not shorten it."""
        if step < self.longest_step * (1.0 - CLIPPED_STEP):
            length = max(length, self.longest_step)
        if self.refined:  # the next step has the error of the shortened one, not less
            length, self.refined = min(length, self.longest_step), False
        self.longest_step = length if self.longest_step < np.inf else np.inf

    def refine_step(self, length: float, step: float, error: float) -> None:
        """Shorten a step, whose energy error (J) is too large, to a length that the energy balance asks for."""
        self.longest_step, self.next_point, self.refined, self.refused = length, None, True, (step, error)

    def is_jump(self, step: float, error: float) -> bool:
        """Whether the energy error (J) of a shorter step is nearly the same, so that the path jumps."""
        refused_step, refused_error = self.refused
        return step <= 0.5 * refused_step and error > JUMP_SHARE * refused_error

    def accept_step(self, target: Point) -> None:
        """Go on after a step that ended before any event."""
        self.next_point, self.halvings, self.accepted_steps = None, max(self.halvings - 1, 0), self.accepted_steps + 1
        if target == self.overloaded_point:
            # in small steps it is passed unbroken: friction is path-dependent
            self.overloaded_point = None
            self.minimum_event_step *= EVENT_STEP_GROWTH

    def bracket_event(self, state: State, target: Point, share: float) -> None:
        """Go back from a target that overloads a bond: to where interpolation expects it to fail, or halfway."""
        self.overloaded_point, self.event_cuts = target, self.event_cuts + 1
        if self.event_cuts >= MAX_EVENT_CUTS:
            share = 0.5
        share = min(max(share, MINIMUM_EVENT_SHARE), MAXIMUM_EVENT_SHARE)
        self.next_point = state.towards(target, share)

    def pass_event(self) -> None:
        """Start again after bonds failed at the end of a step."""
        self.next_point = self.overloaded_point = None
        self.halvings = self.event_cuts = self.accepted_steps = 0
