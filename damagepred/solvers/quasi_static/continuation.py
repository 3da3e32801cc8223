"""Continuation of equilibria by events: bonds fail one after the other (sequentially linear analysis; Rots 2001).

Bonds fail in the order in which the growing movement reaches their strength. From each equilibrium a tangent predictor
gives the load factor of the next failure. Equilibrium is found there and that bond fails, together with all bonds that
reach their strength at the same load factor, so that symmetric walls crack symmetrically. Where opening, closing or
sliding joints make the predictor wrong, the event is bracketed and located by linear interpolation. After each event
equilibrium is found again at the same load factor, and the bonds that it overloads fail in turn (redistribution).
Where Newton's method finds no equilibrium, dynamic relaxation follows the snap-through to a distant one.
"""

from __future__ import annotations

from copy import copy
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from damagepred.arrays import FloatArray, IntArray
from damagepred.assembly import Model
from damagepred.diagnostics import Counters
from damagepred.kernels.equilibrium.predictor import EVENT_TOLERANCE, OVERLOAD_TOLERANCE
from damagepred.runtime.time_limit import check_time
from damagepred.scene import Solver
from damagepred.solvers.options import SolverOptions
from damagepred.solvers.quasi_static.bond_failures import BondFailures
from damagepred.solvers.quasi_static.dynamic_relaxation import is_detached, snap_through
from damagepred.solvers.quasi_static.energy_balance import EnergyBalance
from damagepred.solvers.quasi_static.equilibrium import Equilibrium, Methods
from damagepred.solvers.quasi_static.step_control import MAX_HALVINGS, Point, StepControl, next_length
from damagepred.solvers.state.wall_state import JointHistory, State, without_bond
from damagepred.solvers.system.loading_stages import unilateral_supports

FIRST_STEP = 0.005
"""First step of the movement of a wall without bonds, over the movement (1); the energy balance lengthens it."""
LEAST_HALVINGS = 1
"""Halvings that are tried at least where earlier ones were in vain."""
INTERPOLATION_AIM = 0.5
"""Overload at which interpolation in the bracket of an event aims, over the event tolerance (1)."""
MINIMUM_PREDICTED_SHARE = 1e-6
"""Least share of a step to the predicted event (1)."""
COLLAPSE_RELAXATION = 0.25
"""Share of the cycles of dynamic relaxation where collapse is known a little farther on (1)."""


class Continuation:
    """Path of equilibria: the last one (``state``, ``bonds``, ``balance``), and the steps to the next."""

    def __init__(self, model: Model, settings: Solver) -> None:
        self.model = model
        self.tolerance = settings.tolerance_used
        self.options = SolverOptions.of(settings)
        self.equilibrium = Equilibrium(model, self.tolerance, self.options)
        self.last_stable_load_factor, self._locates_collapse = np.nan, bool(model.supports.live_load.any())
        self.events, self._allowed_halvings = 0, MAX_HALVINGS + 1  # the first that are in vain do not count
        # largest residual since the last report of accepted states that are no equilibria
        self.largest_accepted_residual = 0.0
        self.balance = EnergyBalance(self.tolerance / self.equilibrium.per_weight)
        self._energy_tolerance = settings.step_energy_tolerance
        history = JointHistory.fresh(model)
        history.cracked[without_bond(model)] = True
        self.bonds = BondFailures(model, history)
        # weak bonds break while a wall relaxes: if all are, it relaxes, once it has had to, where Newton's method fails
        self._relaxes = False
        # an error as large as the work controls nothing
        controls = settings.step_energy_tolerance < 1.0 and not self._locates_collapse
        # of the movement; no event shortens it in a wall without bonds
        self._first_step = FIRST_STEP if controls and not self.bonds.bonded.any() else np.inf
        self._longest_step = self._first_step  # allowed by the energy balance at the end of the last increment
        if settings.condense:  # joints with a gap carry nothing until they close
            self.equilibrium.uncondense_interfaces(history.cracked.any(axis=1) & (model.properties.gap == 0.0))
        self.state = replace(State.rest(model), history=history)
        self.balance.begin(model, self.state)

    def change_supports(self, model: Model) -> None:
        """Continue from the present equilibrium with other supports of the same wall."""
        before, history = self.equilibrium, self.state.history
        self.model = model
        self.equilibrium = Equilibrium(model, self.tolerance, self.options)
        self.equilibrium.equations.continue_counts(before.equations)
        if before.superelements is not None and self.equilibrium.superelements is not None:
            self.equilibrium.superelements.law.blocks.active[before.superelements.active] = True
        if before.condensed:
            inelastic = history.cracked | (history.slip != 0.0) | (history.dilatant_opening != 0.0)
            self.equilibrium.uncondense_interfaces(inelastic.any(axis=1))
        self.balance.change_supports(model)
        self.equilibrium.find(self.state)  # for its tangent
        self.commit(self.state, unstable=False)

    def release_supports(self, model: Model) -> float:
        """Release unilateral supports of the footing in tension; return the unbalanced force ratio after it."""
        free = unilateral_supports(model)
        for mask in (self.state.history.cracked, self.bonds.never_opened):
            mask[free] = True
        self.bonds.bonded[free] = False
        self.model = model
        self.equilibrium.change_model(model)
        self.balance.change_supports(model)
        if self.equilibrium.condensed:
            self.equilibrium.uncondense_interfaces(free)
        trial = self.state.copy()
        ratio = self.equilibrium.find(trial)
        if snapped := ratio >= self.tolerance:
            trial, ratio = self.snap_through(self.state, self.state.load_factor)
        self.state = trial
        if ratio < self.tolerance:
            self.commit(trial, unstable=True, snapped=snapped)
            self.state, ratio = self._redistribute_failures(trial, ratio)
        return ratio

    @property
    def counters(self) -> Counters:
        """Accumulated work."""
        equations = self.equilibrium.equations
        return Counters(self.events, equations.iterations, equations.factorisations, equations.corrections)

    # -- bonds and history -------------------------------------------------------------------------------------------

    def fail_bonds(self, state: State, heaviest: float) -> IntArray:
        """Fail the most loaded bonds of a state; return the flat indices of bonds that lost their residual strength."""
        # a bond that softens in tension fails only if its shear is brittle: then slip breaks all of it
        bonds, equilibrium, cracked = self.bonds, self.equilibrium, state.history.cracked.ravel()
        broken = bonds.fail_together(equilibrium.bond_load, heaviest, cracked)
        failed = np.flatnonzero(broken)
        if equilibrium.condensed:
            equilibrium.uncondense_interfaces(failed // broken.shape[1])
        again = failed[cracked[failed]]
        if bonds.depend_on_stress:
            _, sigma, _ = self.equilibrium.contact_stresses(state)
            work = bonds.wear(self.model, broken, sigma, state.history)
            self.balance.add_mode_1_dissipation(work)
        state.history.kappa.ravel()[again], cracked[failed] = np.inf, True
        bonds.record(state, failed)
        self.events += 1
        return again

    def commit(self, state: State, unstable: bool, snapped: bool = False) -> None:
        """Commit an equilibrium, at constant load if ``unstable``: update its history, ``bonds`` and ``balance``."""
        model, superelements = self.model, self.equilibrium.superelements
        joints, on_ground = self.equilibrium.commit_joint_history(state, self.bonds.never_opened)
        if snapped or not self.equilibrium.plain:
            self.bonds.record(state)  # slip, too, breaks bonds that it wears
        if model.sections is not None:
            self.equilibrium.commit_sections(state)
        yielding = 0.0 if superelements is None else superelements.commit(state)
        reaction = self._support_power(state)
        sections = None if model.sections is None else self.equilibrium.section_response(state)
        self.balance.add(state, joints, on_ground, yielding, reaction, unstable, snapped, superelements, sections)

    def _support_power(self, state: State) -> float:
        """Return the work of the moving supports per load factor (J)."""
        if not self.equilibrium.supports_move:
            return 0.0
        supports, force = self.model.supports, self.equilibrium.forces_on_supports(state)
        return -float(force[supports.prescribed] @ supports.prescribed_displacement)

    # -- steps ------------------------------------------------------------------------------------------------------

    def advance(self, load: float, load_factor: float) -> float:
        """Follow the path to a target, event by event; return the unbalanced force ratio there.

        A step ends at the target, at the event found by predictor or interpolation, or at the midpoint of a
        bracket. It is shortened where no equilibrium is found, where a bond is overloaded beyond the event tolerance,
        and where the energy balance asks for it. Under live load, collapse is bracketed by bisection.
        """
        state = self.state
        steps = (self._longest_step, self._first_step) if load == state.load else ()
        control = StepControl.start(state, (load, load_factor), self._locates_collapse, *steps)
        while True:
            check_time()
            if control.has_located_collapse(state) and control.collapsed_state is not None:
                # bonds that failed before the collapse point
                control.collapsed_state.history.cracked[state.history.cracked] = True
                self.last_stable_load_factor, self.state = state.load_factor, control.collapsed_state
                return control.collapse_residual
            target, ahead = self._next_target(state, control)
            trial = self._solve_step(state, target, ahead, control)
            if trial is None:
                continue
            if trial.residual >= self.tolerance:
                if self._bracket_collapse(state, target, trial, control):
                    return trial.residual
                continue
            control.accept_distant(target)
            state, residual, ended = self._end_step(state, target, trial, control)
            if ended:
                return residual

    def _solve_step(self, state: State, target: Point, ahead: FloatArray, control: StepControl) -> _Trial | None:
        """Equilibrium at a target, near or distant, or None where a shorter step comes first.

        Newton's method and the Tresca fixed point come first, then dynamic relaxation. Where the path jumps
        (``control.relaxes``), relaxation comes before them; where only Newton's method is tried, the Tresca fixed point
        comes last.
        """
        step, trial = state.distance(target), state.at(*target, plain=self.equilibrium.plain)
        # in small steps, equilibria under a growing load are near; without one, the wall mostly collapses
        newton_only = self._locates_collapse or self._relaxes
        may_halve = not newton_only and control.may_halve(step, self._allowed_halvings)
        methods = Methods.BOTH_FORMS if newton_only else Methods.ALL
        if may_halve and self.equilibrium.has_potential:
            methods = Methods.NEWTON
        if control.relaxes:
            distant = _Trial(*self._find_distant(state, trial, ahead, newton_only=False, collapse_known=False))
            if distant.residual < self.tolerance:
                return distant
        residual = self.equilibrium.find(trial, ahead, methods)
        if residual >= self.tolerance and self._locates_collapse and step > control.minimum_step:
            control.reject_target(target)
            return None
        if residual >= self.tolerance and may_halve:
            # a shorter step converges more easily, or shows more clearly that no equilibrium exists
            control.halve_step(state, target)
            return None
        if residual < self.tolerance and control.halvings:
            self._allowed_halvings = min(self._allowed_halvings + 1, MAX_HALVINGS + 1)
        if residual < self.tolerance:
            return _Trial(trial, residual, trial)
        collapse_known = control.collapse_point is not None
        return _Trial(*self._find_distant(state, trial, ahead, newton_only, collapse_known))

    def _bracket_collapse(self, state: State, target: Point, trial: _Trial, control: StepControl) -> bool:
        """Take a target without equilibrium as collapse; return whether that locates the collapse."""
        known = control.collapse_point is not None
        detached = [s for s in (trial.state, trial.unconverged) if is_detached(self.model, s)]
        if detached or control.collapsed_state is None:
            control.collapsed_state = detached[0] if detached else trial.state
        control.bracket_collapse(target, control.collapsed_state, trial.residual)
        self.last_stable_load_factor, self.state = state.load_factor, control.collapsed_state
        return state.distance(target) <= control.collapse_bracket or not (detached or known)

    def _end_step(self, state: State, target: Point, trial: _Trial, control: StepControl) -> tuple[State, float, bool]:
        """State to continue from, its unbalanced force ratio, and whether the increment ends with it."""
        step = state.distance(target)
        heaviest = self.equilibrium.largest_bond_load(trial.state)
        # beyond a jump no shorter step comes nearer to the event that fails the middles of bricks in shear
        located = trial.snapped and self.bonds.fail_in_shear and step <= control.shortest_halved_step
        at_event = heaviest <= 1.0 + EVENT_TOLERANCE or step <= control.minimum_event_step or located
        if self.bonds.any_weak and not at_event:
            at_event = bool((self.equilibrium.bond_load <= 1.0 + self.bonds.event_overload).all())
        if at_event and not self._commit_within_energy_error(trial.state, step, trial.snapped, control):
            return state, np.inf, False
        if heaviest <= 1.0 + OVERLOAD_TOLERANCE:
            state, residual = trial.state, trial.residual
            if self.bonds.can_reclose:
                state, residual = self._redistribute_failures(state, residual)
            control.accept_step(target)
            if target == control.goal:
                self.state = state
            return state, residual, target == control.goal
        if at_event:
            state, residual = self._redistribute_failures(trial.state, trial.residual)
            control.pass_event()
            failed = residual >= self.tolerance
            if failed:
                self.last_stable_load_factor, self.state = trial.state.load_factor, state
            return state, residual, failed
        control.bracket_event(state, target, self.equilibrium.event_share(state, INTERPOLATION_AIM))
        return state, np.inf, False

    def _next_target(self, state: State, control: StepControl) -> tuple[Point, FloatArray]:
        """Return the next target, at the predicted event if that is nearer, and displacements to start from."""
        target = control.target(state)
        ahead, share = self.equilibrium.predict(state, target)
        if control.next_point is None and share < 1.0 and not self._relaxes:
            share = max(share, MINIMUM_PREDICTED_SHARE)
            share = min(share * 2.0**control.accepted_steps, 1.0)
            target = state.towards(target, share)
            ahead = state.displacement + share * (ahead - state.displacement)
        return target, ahead

    def _find_distant(
        self, state: State, unconverged: State, ahead: FloatArray, newton_only: bool, collapse_known: bool
    ) -> tuple[State, float, State]:
        """Distant equilibrium, its unbalanced force ratio, and the state of the last iteration at the target."""
        self._allowed_halvings = max(self._allowed_halvings - 1, LEAST_HALVINGS)
        self._relaxes = self.bonds.all_weak
        start = state.at(unconverged.load, unconverged.load_factor)
        trial, ratio = self.snap_through(start, state.load_factor, COLLAPSE_RELAXATION if collapse_known else 1.0)
        # neither at rest nor collapsing
        if newton_only and not collapse_known and self.tolerance <= ratio < np.inf:
            unconverged = state.at(unconverged.load, unconverged.load_factor)
            residual = self.equilibrium.find(unconverged, ahead)
            if residual < self.tolerance:
                return unconverged, residual, unconverged
        return trial, ratio, unconverged

    def _commit_within_energy_error(self, trial: State, step: float, snapped: bool, control: StepControl) -> bool:
        """Commit an equilibrium unless its energy error is too large; return whether it was committed."""
        before, damage = (copy(self.bonds), copy(self.balance)), self.bonds.damage(trial.history)
        self.commit(trial, unstable=snapped, snapped=snapped)
        growth = self.bonds.damage(trial.history) - damage
        length = np.inf
        if not snapped:
            length = next_length(self._energy_tolerance, before[1], self.balance, growth, step)
        error = self.balance.energy_error - before[1].energy_error
        # live loads already use small steps
        if length < step and step > control.shortest_refined_step and not self._locates_collapse:
            control.refine_step(length, step, error)
            self.bonds, self.balance = before
            return False
        softens = growth > 0.0 and not self._locates_collapse
        if softens and length < step and control.is_jump(step, error):
            if not control.relaxes:  # dynamic relaxation finds where the wall comes to rest
                control.relaxes, control.next_point = True, (trial.load, trial.load_factor)
                self.bonds, self.balance = before
                return False
            self.balance.count_as_snap_through(before[1])
        control.relaxes = False
        control.allow_step(length, step)
        if self.state.load == control.goal[0]:  # dead load and movement are measured by different load factors
            self._longest_step = control.longest_step
        return True

    def snap_through(self, state: State, start_load_factor: float, cycles_share: float = 1.0) -> tuple[State, float]:
        """Distant equilibrium at the load of a state, and its unbalanced force ratio; see ``snap_through``."""
        rest = snap_through(self.equilibrium, state, start_load_factor, cycles_share)
        self.largest_accepted_residual = max(self.largest_accepted_residual, rest.accepted_residual)
        return rest.state, rest.ratio

    def _redistribute_failures(self, state: State, ratio: float) -> tuple[State, float]:
        """Fail overloaded bonds at constant load, the most overloaded first, until every bond holds."""
        parted_again = np.zeros(state.history.cracked.size, dtype=np.bool_)
        while True:
            heaviest = self.equilibrium.largest_bond_load(state)
            overloaded = heaviest > 1.0 + OVERLOAD_TOLERANCE
            if overloaded:
                parted_again[self.fail_bonds(state, heaviest)] = True
            closed = False
            if self.bonds.can_reclose:  # cracked joints whose trial stress is within their residual strength
                opening, _, _ = self.equilibrium.contact_stresses(state)
                parted = parted_again.reshape(opening.shape)
                closed = self.bonds.reclose(state.history, opening, except_for=parted)
            if not (closed or overloaded):
                return state, ratio
            trial = state.at(state.load, state.load_factor, plain=self.equilibrium.plain)
            ratio = self.equilibrium.find(trial)
            snapped = ratio >= self.tolerance and not self.equilibrium.has_diverged(trial)
            if snapped:
                trial, ratio = self.snap_through(state, state.load_factor)
            if ratio >= self.tolerance:
                return trial, ratio
            state = trial
            self.commit(state, unstable=True, snapped=snapped)

    def control_load(self) -> None:
        """Prescribe the load of the jacks instead of the deflection, from the level state on."""
        jacks, given = self.equilibrium.jacks, self.model.jacks
        if jacks is not None and given is not None and given.by_load:
            jacks.level_load = self.state.jack
            self.equilibrium.find(self.state)  # for its tangent

    def checkpoint(self) -> Checkpoint:
        """Return a copy of the present point of the path."""
        return Checkpoint(self.state.copy(), copy(self.bonds), copy(self.balance), self.events)

    def restore(self, checkpoint: Checkpoint) -> None:
        """Return to a checkpoint."""
        state, bonds, balance, self.events = checkpoint
        self.state, self.bonds, self.balance = state.copy(), copy(bonds), copy(balance)
        self.equilibrium.find(self.state)


class _Trial(NamedTuple):
    """Result of a step: state, unbalanced force ratio, and the state in which the last iteration ended."""

    state: State
    residual: float
    unconverged: State

    @property
    def snapped(self) -> bool:
        """Whether the wall snapped through to a distant equilibrium."""
        return self.state is not self.unconverged


class Checkpoint(NamedTuple):
    """A point of the path to which the continuation can return."""

    state: State
    bonds: BondFailures
    balance: EnergyBalance
    events: int
