"""The path of equilibria, bond by bond.

A bond that is overloaded breaks. Bonds break in the order in which the growing movement reaches their strength: from
each equilibrium the tangent tells at which movement the next bond will. Equilibrium is sought there, and that bond is
broken (with those that reach their strength together with it, so that symmetric walls crack symmetrically). Where
joints that open, close or slide on the way make the tangent's word wrong, the movement is bracketed. Then equilibrium
is sought anew at the same movement before the step goes on. What a broken bond overloads in turn breaks at once, the
most overloaded first. Where there is no equilibrium near, the wall moves by itself to one that is farther off.
"""

from __future__ import annotations

from collections.abc import Iterator
from copy import copy
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from damagepred.arrays import BoolArray, FloatArray
from damagepred.assembly import Model
from damagepred.errors import ConvergenceError
from damagepred.kernels.concrete_section.forces import settle_sections
from damagepred.kernels.interface.equilibrium import bond_loads, break_in_shear, commit_joint_history, contact_stresses
from damagepred.one_thread import each_with_one_blas_thread
from damagepred.scene import Solver
from damagepred.solvers.options import DEFAULTS, SolverOptions
from damagepred.solvers.quasi_static.dynamic_relaxation import come_to_rest, pushed_on, unbalanced_on_its_way
from damagepred.solvers.quasi_static.energy_balance import Spent, WorkBalance, law_violation
from damagepred.solvers.quasi_static.equilibrium import Equilibrium, State
from damagepred.solvers.quasi_static.options import EnergyOptions
from damagepred.solvers.state.increment import Increment
from damagepred.solvers.state.joint_history import JointHistory, contact_states, without_bond
from damagepred.solvers.system.detached_blocks import come_loose
from damagepred.solvers.system.elastic_stiffness import base_reaction, block_of_dof, support_force
from damagepred.solvers.system.footing_forces import as_if_straight, section_response_of
from damagepred.solvers.system.loading_stages import held_after_load, level, pushing_supports, while_loading
from damagepred.solvers.system.zero_support_load import Vanishing, carried
from damagepred.time_limit import check_time

Point = tuple[float, float]


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
        """Return the length of a step whose imbalance would be just allowed: the next, or this one again if shorter.

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
class Count:
    """Work done: Newton steps, factorisations, and times at which bonds broke."""

    newton: int = 0
    factorisations: int = 0
    events: int = 0


class Path:
    """Follows the path of a wall.

    Parameters
    ----------
    model : Model
        The wall.
    settings : Solver
        Tolerance, and whether what stays elastic is condensed.
    """

    def __init__(self, model: Model, settings: Solver) -> None:
        self.model = model
        self.tolerance = settings.tolerance_used
        self.options = SolverOptions.of(settings)
        control = self.options.continuation
        self.equilibrium = Equilibrium(model, self.tolerance, self.options)
        self.standing, self._sharply = np.nan, bool(model.supports.live_load.any())
        self.events, self._halvings = 0, control.max_halvings + 1  # the first that are in vain do not count
        self.roughest = 0.0  # unbalanced force of states at rest since the last report that are no equilibria
        self.balance = WorkBalance(residual=self.tolerance / self.equilibrium.per_weight)
        self.control = EnergyControl(settings.step_energy_tolerance, self.options.energy)
        law = model.properties
        # a bond without strength breaks at the first tension: one that balance, to its tolerance, does not explain
        self._block_stress = model.block_stress
        self._no_strength = self.tolerance * self._block_stress
        weak = ((law.tensile_strength < self._block_stress) & ~law.brittle_shear)[:, None]
        self._weak = np.broadcast_to(weak, model.interfaces.contact_area.shape)
        overload = control.weak_bond_overload
        self._near = np.where(self._weak, overload, control.event_tolerance)
        self._ahead = np.where(self._weak, overload, control.overload_tolerance)
        self._load = np.zeros(model.interfaces.contact_area.shape)
        # weak bonds break while a wall relaxes: if all are, it relaxes, once it has had to, where Newton's method fails
        bonded, self._relaxes = ~without_bond(model), False
        self._all_weak = bool(bonded.any() and weak[bonded].all())
        self._lets_go_at = ((law.residual_tensile_strength > 0) & (law.critical_opening == 0))[:, None]
        plain = (law.residual_tensile_strength == 0) & (law.critical_opening == 0)
        self._climbs_at = ((law.dilation > 0) & plain)[:, None]
        self._slip_breaks_at = (law.brittle_shear & (law.critical_opening > 0))[:, None]
        self._lets_go = bool(self._lets_go_at.any())
        self._everything = np.arange(len(model.interfaces.kind))
        self.state = self._begin(settings.condense)
        self.balance.begin(model, self.state)

    def _begin(self, condense: bool) -> State:
        """Return the wall before any load: joints without strength have no bond to break."""
        law = self.model.properties
        history = JointHistory.fresh(self.model)
        history.cracked[without_bond(self.model)] = True
        self.never_opened = history.cracked.copy()
        self.broken_at, self._bonded = np.full(history.cracked.shape, np.nan), ~history.cracked
        if condense:  # what has a gap stays open until it closes
            open_up = history.cracked.any(axis=1) & (law.gap == 0.0)
            levels = self.equilibrium.equations.interface_level[open_up]
            self.equilibrium.uncondense_up_to(int(levels.max(initial=0)))
        return replace(State.rest(self.model), history=history)

    def hold(self, model: Model) -> None:
        """Go on from the present equilibrium with a model of the same wall that is held otherwise."""
        before, history = self.equilibrium, self.state.history
        self.model = model
        self.equilibrium = Equilibrium(model, self.tolerance, self.options)
        self.equilibrium.newton += before.newton
        self.equilibrium.equations.factorisations += before.equations.factorisations
        if before.solids is not None and self.equilibrium.solids is not None:
            self.equilibrium.solids.open_as(before.solids)
        if before.condensed:
            gave = history.cracked | (history.slip != 0.0) | (history.dilatant_opening != 0.0)
            levels = self.equilibrium.equations.interface_level[gave.any(axis=1)]
            self.equilibrium.uncondense_up_to(max(int(levels.max(initial=0)), self.equilibrium.farthest_open()))
        self.balance.go_on(model)
        self.equilibrium.find(self.state)  # it is one already: to learn how the path goes on
        self.commit(self.state, gave_way=False)

    def lifted(self, worst: float) -> bool:
        """Return whether the dead load lifted the footing off supports that push only as it came on, or found no rest.

        Parameters
        ----------
        worst : float
            Unbalanced ratio under the dead load.
        """
        free, state = pushing_supports(self.model), self.state
        rests = worst < self.tolerance and not come_loose(self.model, state.displacement, 0.0).any()
        return bool(free.size) and not (rests and self.never_opened[free].all())

    def release(self, model: Model) -> float:
        """Let supports that push only no longer hold the footing down; return the unbalanced ratio after it."""
        free = pushing_supports(model)
        for mask in (self.state.history.cracked, self.never_opened):
            mask[free] = True
        self._bonded[free] = False
        self.model = self.equilibrium.model = model  # of the same stiffness
        self.balance.go_on(model)
        if self.equilibrium.condensed:
            self.equilibrium.uncondense_up_to(int(self.equilibrium.equations.interface_level[free].max()))
        trial = self.state.copy()
        worst = self.equilibrium.find(trial)
        if jumped := worst >= self.tolerance or self.equilibrium.lost(trial):
            trial, worst = self.jump(self.state, self.state.progress)
        self.state = trial
        if worst < self.tolerance and not self.equilibrium.lost(trial):
            self.commit(trial, gave_way=True, snapped=jumped)
            self.state, worst = self.cascade(trial, worst)
        return worst

    @property
    def count(self) -> Count:
        """Work done so far."""
        return Count(self.equilibrium.newton, self.equilibrium.equations.factorisations, self.events)

    # -- bonds and memory -------------------------------------------------------------------------------------------

    def bond_loads(self, state: State) -> tuple[FloatArray, float]:
        """Return the load of each bond (m, q), 1 at its strength and 0 where it is broken; and the largest."""
        model = self.model
        most = bond_loads(
            self._everything,
            model.interfaces,
            model.properties,
            model.ground.at(state.progress),
            state.history,
            state.displacement,
            self._no_strength,
            self._block_stress,
            self._load,
        )
        return self._load, most

    def break_bonds(self, state: State, load: FloatArray) -> BoolArray:
        """Break the most loaded bond, and those that are loaded alike; tell which lost also what a crack had left.

        A softening bond that reaches its tensile strength only begins to soften. Slip breaks all of it where its shear
        is brittle; where tension and shear reach their limits together, tension comes first.
        """
        heaviest, options = load.max(), self.options.continuation
        broken = load >= heaviest * (1.0 - options.simultaneous_failures)
        weak = self._weak & ~state.history.cracked & (load > 1.0 + options.overload_tolerance)
        broken |= weak & (load >= 1.0 + options.weak_bond_group * (heaviest - 1.0))
        if self.equilibrium.condensed:
            levels = self.equilibrium.equations.interface_level[broken.any(axis=1)]
            self.equilibrium.uncondense_up_to(int(levels.max()))
        again = broken & state.history.cracked
        if self._climbs_at.any() or self._slip_breaks_at.any():
            _, sigma, _ = self.stresses(state)
            state.history.kappa[broken & self._climbs_at & (sigma > 0.0)] = np.inf  # parted, and climbs no more
            model = self.model
            least = load * (1.0 - options.simultaneous_failures) * model.properties.tensile_strength[:, None]
            in_tension = sigma >= least
            sheared = broken & self._slip_breaks_at & ~(in_tension & ~state.history.cracked)
            self.balance.softened(break_in_shear(sheared, model.interfaces, model.properties, state.history))
        state.history.kappa[again] = np.inf
        state.history.cracked[broken] = True
        self.note_broken(state)
        self.events += 1
        return again

    def note_broken(self, state: State) -> None:
        """Write down at which progress bonds broke that have broken since the last time."""
        self.broken_at[state.history.cracked & self._bonded & np.isnan(self.broken_at)] = state.progress

    def commit(self, state: State, gave_way: bool, snapped: bool = False) -> None:
        """Let the joints remember this equilibrium, which bonds that broke or a snap-through led to, or a step."""
        model = self.model
        friction, crushing, mode_1_dissipation = commit_joint_history(
            self.equilibrium.equations.active,
            model.interfaces,
            model.properties,
            model.ground.at(state.progress),
            state.history,
            state.displacement,
            self.never_opened,
        )
        self.note_broken(state)  # slip, too, breaks bonds that it wears
        if model.sections is not None:
            settle_sections(model.sections, state.sections, model.interfaces, state.displacement)
        solids, yielding = self.equilibrium.solids, 0.0
        if solids is not None:
            yielding = solids.settle(state.displacement, state.plastic)
        spent = Spent(friction, crushing, yielding)
        beyond = self.equilibrium.condensed_energy(state)
        self.balance.add(
            state, spent, mode_1_dissipation, self._support_power(state), gave_way, snapped, solids, beyond
        )

    def _support_power(self, state: State) -> float:
        """Return the work of what moves the supports per progress (J)."""
        supports = self.model.supports
        if not supports.prescribed_displacement.any():
            return 0.0
        force = self.equilibrium.forces(state)
        return -float(force[supports.prescribed] @ supports.prescribed_displacement)

    # -- steps ------------------------------------------------------------------------------------------------------

    def advance(self, load: float, progress: float) -> float:
        """Follow the path to a load and a movement, bond by bond; return the unbalanced ratio there."""
        state, options = self.state, self.options.continuation
        goal = (load, progress)
        shortest = options.minimum_event_step * distance(state, goal)
        beyond: Point | None = None  # the nearest point at which a bond is known to be overloaded
        falls: Point | None = None  # the nearest point at which the wall is known to fall
        fallen, fell_by = state, np.inf  # how it does there
        doubted: Point | None = None  # the nearest point at which no equilibrium was found near the last one
        pains = max(
            options.collapse_bracket, distance(state, goal) / 2**options.max_halvings
        )  # way to it from which on one is sought farther off
        bracket = (
            options.collapse_bracket if self._sharply else pains * (1.0 + 1e-9)
        )  # of the movement at which the wall falls
        halvings = cuts = 0
        misses = 0  # times the tangent saw a bond break too soon
        far: Point | None = None  # where to go next; None as far as the tangent sees no bond break
        longest = np.inf  # step that the energy balance allows
        least_step = distance(state, goal) / 2**self.control.options.refinements
        least_half = (
            1.5 * distance(state, goal) / 2**options.max_halvings
        )  # no step shorter than this is halved: it has its jump
        while True:
            check_time()
            if falls is not None and distance(state, falls) <= bracket:
                fallen.history.cracked[state.history.cracked] = True  # bonds that broke nearer than where it was found
                self.standing, self.state = state.progress, fallen
                return fell_by
            target = far or next_target(state, beyond or goal, doubted or falls, pains if doubted else 0.0)
            if distance(state, target) > longest:
                target = between(state, target, longest / distance(state, target))
            ahead, share = self.foresee(state, target)
            if far is None and share < 1.0 and not self._relaxes:
                share = min(share * 2.0**misses, 1.0)
                target = between(state, target, share)
                ahead = state.displacement + share * (ahead - state.displacement)
            trial = state.at(*target)
            # in small steps, equilibria under a growing load are near: where none is, the wall mostly falls
            near = self._sharply or self._relaxes
            worst, jumped = self.equilibrium.find(trial, ahead, near), False
            only_near = self._sharply and distance(state, target) > pains
            if worst >= self.tolerance and only_near:
                doubted, far = target, None
                continue
            may_halve = halvings < min(self._halvings, options.max_halvings) and distance(state, target) > least_half
            if worst >= self.tolerance and may_halve and not near:
                # from nearer the last equilibrium it is easier to find the next, or clearer that there is none
                far, halvings = between(state, target, 0.5), halvings + 1
                continue
            if worst < self.tolerance and halvings:
                self._halvings = min(self._halvings + 1, options.max_halvings + 1)
            if worst >= self.tolerance or self.equilibrium.lost(trial):
                self._halvings = max(self._halvings - 1, options.least_halvings)
                self._relaxes = self._all_weak
                astray, jumped = trial, True
                trial, worst = self.jump(
                    state.at(*target), state.progress, 1.0 if falls is None else options.collapse_relaxation
                )
                if near and falls is None and self.tolerance <= worst < np.inf:  # neither rests nor falls
                    astray = state.at(*target)
                    far_off = self.equilibrium.find(astray, ahead)
                    if far_off < self.tolerance and not self.equilibrium.lost(astray):
                        trial, worst, jumped = astray, far_off, False
                loose = [s for s in (trial, astray) if come_loose(self.model, s.displacement, target[1]).any()]
            if worst >= self.tolerance or self.equilibrium.lost(trial):
                self.standing = state.progress
                if loose or falls is None:
                    fallen = loose[0] if loose else trial
                fallen = replace(fallen, load=target[0], progress=target[1])
                self.state, fell_by = fallen, worst
                if distance(state, target) <= bracket or (falls is None and not loose):
                    return worst
                # whatever the reason: nearer to the last equilibrium there may be another
                falls, doubted, far, pains = target, None, None, options.collapse_bracket
                continue
            if target == doubted:
                doubted, pains = None, options.distant_step_growth * pains
            loaded, heaviest = self.bond_loads(trial)
            step = distance(state, target)
            at_event = heaviest <= 1.0 + options.event_tolerance or bool((loaded <= 1.0 + self._near).all())
            if at_event or step <= shortest:
                noted = self.never_opened.copy(), copy(self.balance), self.broken_at.copy()
                balance = noted[1]
                self.commit(trial, gave_way=jumped, snapped=jumped)
                length = np.inf if jumped else self.control.next_length(balance, self.balance, step)
                if length < step and step > least_step and not self._sharply:  # live loads go in small steps anyhow
                    (self.never_opened, self.balance, self.broken_at), longest, far = noted, length, None
                    continue
                longest = length if longest < np.inf else np.inf
            if heaviest <= 1.0 + options.overload_tolerance:
                state, far, halvings, misses = trial, None, max(halvings - 1, 0), misses + 1
                if self._lets_go:
                    state, worst = self.cascade(state, worst)
                if target == beyond:
                    beyond = None  # in small steps it is passed unbroken: friction remembers the way
                    shortest *= options.event_step_growth
                if target == goal:
                    self.state = state
                    return worst
            elif at_event or step <= shortest:
                state, worst = self.cascade(trial, worst)
                far, beyond, halvings, cuts, misses = None, None, 0, 0, 0
                if worst >= self.tolerance or self.equilibrium.lost(state):
                    self.standing, self.state = trial.progress, state
                    return worst
            else:
                beyond, cuts = target, cuts + 1
                over = loaded > 1.0 + self._ahead
                after, wanted = loaded[over], 1.0 + 0.5 * self._near[over]
                before = self.bond_loads(state)[0][over]
                share = float(np.min((wanted - before) / (after - before))) if cuts < options.max_event_cuts else 0.5
                far = between(state, target, min(max(share, 1e-4), 0.95))

    def foresee(self, state: State, target: Point) -> tuple[FloatArray, float]:
        """Return where the tangent takes the blocks by a target, and at which share of the way a bond breaks."""
        equilibrium, supports = self.equilibrium, self.model.supports
        equilibrium.equations.update(equilibrium.tangent)
        pull = equilibrium.pull(target[0] - state.load, target[1] - state.progress)
        ahead = replace(state, load=target[0], progress=target[1], displacement=state.displacement.copy())
        step, _ = equilibrium.solve(pull, equilibrium.gap(ahead, state.displacement))
        ahead.displacement += step
        ahead.displacement[supports.prescribed] = supports.displacement(ahead.progress)
        equilibrium.complete(ahead)
        if equilibrium.lost(ahead):
            return state.displacement, 1.0
        after_load, heaviest = self.bond_loads(ahead)
        tolerated = self.options.continuation.overload_tolerance
        if heaviest <= 1.0 + tolerated or not (over := after_load > 1.0 + self._ahead).any():
            return ahead.displacement, 1.0
        after_load, wanted = after_load[over], 1.0 + 0.1 * self._near[over]
        before_load = self.bond_loads(state)[0][over]
        share = float(np.min((wanted - before_load) / (after_load - before_load)))
        return ahead.displacement, min(max(share, 1e-6), 1.0)

    def jump(self, state: State, left: float, patience: float = 1.0) -> tuple[State, float]:
        """Let the wall move by itself to where it can rest; return the state there and its unbalanced ratio.

        Friction does not derive from an energy: there are loads under which two joints push each other to and fro by
        turns, and no choice of which of them slides is an equilibrium. The wall then trembles about a place; if that
        is as near to balance as the explicit solver asks for, it counts as rest, and is noted in ``roughest``. A wall
        that creeps may be as near to balance, but goes on when it is pushed: it falls.

        Parameters
        ----------
        state : State
            Load and movement to rest at; the blocks still are where they were in the last equilibrium.
        left : float
            Share of the movement of that.
        patience : float
            Share of the cycles that it is given, unless it is slowing down.
        """
        equilibrium, options, worst = self.equilibrium, self.options.continuation, np.inf
        nearest, least, mark, since = state, np.inf, np.inf, 0
        volume = equilibrium.volume_per_deflection()
        for resting in come_to_rest(self.model, state, left, patience, volume, self.options):
            if equilibrium.jacks is not None:
                resting.jack = equilibrium.jacks.load_at(resting.progress, resting.jack)
            if come_loose(self.model, resting.displacement, resting.progress).any():
                return resting, np.inf
            if equilibrium.solids is not None:
                equilibrium.solids.open_where_plastic(resting.plastic)
            if equilibrium.condensed:
                gave = (resting.history.slip != state.history.slip) | (resting.history.cracked != state.history.cracked)
                gave |= resting.history.dilatant_opening != state.history.dilatant_opening
                farthest = int(equilibrium.equations.interface_level[gave.any(axis=1)].max(initial=0))
                equilibrium.uncondense_up_to(max(farthest, equilibrium.farthest_open()))
            worst, found = equilibrium.directly(resting)
            if worst < self.tolerance:
                resting.displacement[:] = found
                return resting, worst
            if abs(equilibrium.gap(resting, found)) > options.fallback_deflection_tolerance:
                worst = max(
                    worst, options.fallback_residual_tolerance
                )  # a tremble is no reason for a deflection that is short
            if worst < least:
                nearest, least = resting, worst
                nearest.displacement[:] = found
            since, mark = (0, least) if least < 0.5 * mark else (since + 1, mark)
            if least < options.fallback_residual_tolerance and since >= options.stagnation_limit:
                break
        accepted = least < options.fallback_residual_tolerance
        falling = pushed_on(self.model, resting, nearly_at_rest=accepted)
        if falling is not None:
            return falling, np.inf
        if not accepted:
            return resting, worst
        self.roughest = max(self.roughest, equilibrium.accept_unconverged(nearest))
        return nearest, 0.0

    def cascade(self, state: State, worst: float) -> tuple[State, float]:
        """Break what is overloaded at a standing movement, one after the other, until nothing is."""
        let_go = np.zeros_like(state.history.cracked)
        while True:
            load, heaviest = self.bond_loads(state)
            overloaded = heaviest > 1.0 + self.options.continuation.overload_tolerance
            if overloaded:
                let_go |= self.break_bonds(state, load)
            if not (self.hold_again(state, except_for=let_go) or overloaded):
                return state, worst
            trial = state.copy()
            worst = self.equilibrium.find(trial)
            snapped = worst >= self.tolerance and not self.equilibrium.lost(trial)
            if snapped:
                trial, worst = self.jump(state, state.progress)
            if worst >= self.tolerance or self.equilibrium.lost(trial):
                return trial, worst
            state = trial
            self.commit(state, gave_way=True, snapped=snapped)

    def hold_again(self, state: State, except_for: BoolArray) -> bool:
        """Let cracked joints with residual tensile strength hold again where nearly closed; tell whether any does."""
        if not self._lets_go:
            return False
        law, (opening, _, _) = self.model.properties, self.stresses(state)
        stress = law.normal_stiffness[:, None] * (opening - state.history.dilatant_opening)
        near = self._lets_go_at & (state.history.kappa > 0) & (stress <= law.residual_tensile_strength[:, None])
        near &= ~except_for
        state.history.kappa[near] = 0.0
        return bool(near.any())

    def stresses(self, state: State) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return opening (m), normal and shear stress (Pa) of all contacts, arrays (m, q)."""
        model = self.model
        opening, sigma, tau = (np.empty(model.interfaces.contact_area.shape) for _ in range(3))
        contact_stresses(
            model.interfaces,
            model.properties,
            model.ground.at(state.progress),
            state.history,
            state.displacement,
            opening,
            sigma,
            tau,
        )
        if model.sections is not None:
            as_if_straight(model, section_response_of(model, state.sections, state.displacement), sigma, tau)
        return opening, sigma, tau

    def stood(self) -> str:
        """Say where a wall under a live load was in equilibrium last: near its limit it may only creep."""
        return f" The last equilibrium is at progress {self.standing:.5g}." if self._sharply else ""

    def report(self, number: int, worst: float, before: Count, collapsed: bool) -> Increment:
        """Take a picture of the present state."""
        model, state, solids = self.model, self.state, self.equilibrium.solids
        opening, sigma, tau = self.stresses(state)
        force = self.equilibrium.forces(state)
        now, balance = self.count, self.balance
        worst, self.roughest = max(worst, self.roughest), 0.0
        return Increment(
            number=number,
            progress=state.progress,
            displacement=state.displacement[: 3 * model.n_blocks].reshape(-1, 3).copy(),
            opening=opening,
            slip=state.history.slip.copy(),
            normal_stress=sigma,
            shear_stress=tau,
            state=contact_states(model, state.history._replace(cracked=state.history.cracked & ~self.never_opened)),
            unbalanced_force_ratio=worst,
            base_reaction=base_reaction(model, force),
            newton_iterations=now.newton - before.newton,
            events=now.events - before.events,
            factorisations=now.factorisations - before.factorisations,
            collapsed=collapsed,
            external_work=balance.external_work,
            elastic_energy=balance.elastic_energy,
            friction_work=balance.friction_work,
            fracture_work=balance.fracture_work,
            crushing_work=balance.crushing_work,
            plastic_work=balance.plastic_work,
            released_energy=balance.released_energy,
            snap_through_energy=balance.snap_through_energy,
            energy_error=balance.energy_error,
            joint_law_violation=law_violation(model, state, sigma, tau),
            standing_progress=self.standing if collapsed else np.nan,
            support_force=support_force(model, force),
            zones=None if solids is None else solids.picture(state.displacement, state.plastic),
            deflection=np.nan if model.deflection is None else float(model.deflection @ state.displacement),
            jack_load=np.nan if model.jacks is None else state.jack,
            broken_at=self.broken_at.copy(),
        )

    # -- jacks ------------------------------------------------------------------------------------------------------

    def control_load(self) -> None:
        """From the level state on, control the load of the jacks instead of the deflection."""
        jacks, known = self.equilibrium.jacks, self.model.jacks
        if jacks is not None and known is not None and known.by_load:
            jacks.level_load, jacks.load = self.state.jack, known.load
            self.equilibrium.find(self.state)  # it is one already: to learn how the path goes on

    def carried(self) -> float:
        """Return the load (N) at whose end the path ends; see ``damagepred.solvers.system.zero_support_load``."""
        _, sigma, _ = self.stresses(self.state)
        return carried(self.model, self.state.jack, sigma)

    def keep(self) -> Kept:
        """Return what it takes to come back here."""
        return Kept(
            self.state.copy(),
            self.never_opened.copy(),
            self.broken_at.copy(),
            copy(self.balance),
            self.events,
            self.carried(),
        )

    def go_back(self, kept: Kept) -> None:
        """Go back to a point of the path."""
        self.state, self.never_opened, self.broken_at = (
            kept.state.copy(),
            kept.never_opened.copy(),
            kept.broken_at.copy(),
        )
        self.balance, self.events = copy(kept.balance), kept.events
        self.equilibrium.find(self.state)

    def end_where_nothing_is_carried(self, before: Kept, worst: float) -> float:
        """Find the point between an earlier one and the present where the load is just gone; return the ratio there."""
        beyond, options = self.keep(), self.options.jacks
        search = Vanishing(
            before.state.progress,
            before.carried,
            beyond.state.progress,
            beyond.carried,
            enough=options.zero_load_ratio * float(np.abs(self.model.supports.load).sum()),
            close=options.zero_load_bracket,
        )
        for _ in range(options.max_iterations):
            if search.found:
                break
            at = search.between()
            self.go_back(before)
            worst = self.advance(1.0, at)
            if search.note(at, self.carried()):
                before = self.keep()
            else:
                beyond = self.keep()
        else:
            self.go_back(beyond)
        return worst


class Kept(NamedTuple):
    """A point of the path to come back to."""

    state: State
    never_opened: BoolArray
    broken_at: FloatArray
    balance: WorkBalance
    events: int
    carried: float


def next_target(state: State, goal: Point, ceiling: Point | None, pains: float) -> Point:
    """Return the point to go to next.

    Parameters
    ----------
    state : State
        The last equilibrium.
    goal : (float, float)
        Load and movement to come to.
    ceiling : (float, float), optional
        Where the wall falls, or no equilibrium was found.
    pains : float
        Way to the ceiling from which on it is tried itself.
    """
    if ceiling is None or distance(state, goal) < distance(state, ceiling):
        return goal
    return ceiling if distance(state, ceiling) <= pains else between(state, ceiling, 0.5)


def distance(state: State, far: Point) -> float:
    """Return how far load and movement are from a state."""
    return abs(far[0] - state.load) + abs(far[1] - state.progress)


def between(state: State, far: Point, share: float) -> Point:
    """Return the load and movement at a share of the way from a state."""
    return state.load + share * (far[0] - state.load), state.progress + share * (far[1] - state.progress)


@each_with_one_blas_thread
def quasi_static_path(model: Model, settings: Solver, increments: int) -> Iterator[Increment]:
    """Follow the movement increment by increment.

    Parameters
    ----------
    model : Model
        The wall.
    settings : Solver
        Tolerance; whether levels of blocks whose joints stay elastic are condensed.
    increments : int
        Number of equal steps of the movement.

    Yields
    ------
    Increment
        First the state under dead load (number 0), then one each step. The path ends early after an increment in
        which a part of the wall came loose.

    Raises
    ------
    ConvergenceError
        If no equilibrium is found although nothing has come loose.
    """
    path = Path(while_loading(model), settings)
    stops = model.jacks is not None and bool(model.jacks.stop)
    for number in range(increments + 1):
        before, kept, ended = replace(path.count), path.keep() if stops and number > 0 else None, False
        worst = path.advance(1.0, number / increments)
        if number == 0 and path.lifted(worst):
            path = Path(level(path.model), settings)
            worst = path.advance(1.0, 0.0)
            worst = path.release(model) if worst < path.tolerance else worst
        if kept is not None and worst < path.tolerance and path.carried() <= 0.0:
            worst, ended = path.end_where_nothing_is_carried(kept, worst), True
        if number == 0 and stops and worst < path.tolerance:
            ended = path.carried() <= 0.0  # nothing is, not even in the level state
        state = path.state
        collapsed = bool(come_loose(model, state.displacement, state.progress).any())
        if collapsed and not np.isfinite(worst):
            worst = unbalanced_on_its_way(path.model, state)
        if collapsed and number > 0 and np.isnan(path.standing):
            path.standing = (number - 1) / increments  # it balances again where it has come loose
        if worst >= path.tolerance and not collapsed:
            force, _ = path.equilibrium.residual(state, state.displacement)
            block = block_of_dof(path.model, int(np.abs(force * path.equilibrium.per_weight).argmax()))
            raise ConvergenceError(
                f"increment {number}: no equilibrium found; the unbalanced force is {worst:.2g} block weights at "
                f"{model.describe_block(block)}, allowed is {path.tolerance:g}." + path.stood(),
                increment=number,
                block=block,
            )
        increment = path.report(number, worst, before, collapsed)
        if ended and model.jacks is not None:
            yield replace(increment, ended=model.jacks.stop)
            return
        yield increment
        if collapsed:
            return
        if number == 0:
            path.control_load()
        if number == 0 and model.supports.after_load.any():
            path.hold(held_after_load(model, state.displacement))
