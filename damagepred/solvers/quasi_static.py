"""The path of equilibria itself: no time, no damping, no loading rate.

For each step of the movement the blocks go where the energy of all joints is least. That energy is convex while the
friction limits are frozen, so Newton's method with a line search finds its minimum from anywhere; the limits are then
brought up to date and the minimum sought again, until both agree.

A bond that is overloaded breaks. Bonds break in the order in which the growing movement reaches their strength: where
a step would overload some, the movement at which the first of them breaks is found, that one is broken there (with
those that reach their strength together with it, so that symmetric walls crack symmetrically), and equilibrium is
sought anew at the same movement before the step goes on. What a broken bond overloads in turn breaks at once, the most
overloaded first.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import ThreadpoolController

from damagepred.assembly import Model
from damagepred.errors import ConvergenceError, InputError
from damagepred.kernels.frozen import NO_LIMIT, friction_bounds, joint_forces
from damagepred.scene import Solver
from damagepred.solvers.explicit import describe_block
from damagepred.solvers.increment import Increment
from damagepred.solvers.levels import LevelEquations
from damagepred.solvers.state import ContactFields, JointMemory, come_loose, contact_states, fields_of
from damagepred.solvers.stiffness import dof_arms, held_dofs

FloatArray = NDArray[np.float64]

TOGETHER = 1e-4
"""Bonds loaded within this share of the most loaded one break with it."""
LOOSE = (3.0, 1e-3, 1e-6)
"""How near (block weights) the minimum with frozen limits is sought before they are let go: ever nearer."""
ATTEMPTS, UNRELAXED, RELAXED = 120, 6, (0.5, 0.3, 0.15)
"""Minima sought for one equilibrium; after how many the limits change by only a share; and those shares."""
OVERLOAD = 1e-6
"""A bond breaks when its stress exceeds its strength by this share."""
HALVINGS = 8
"""Times a step is halved that finds no equilibrium."""
CUTS = 4
"""Times a step is cut to where a bond should break by its linear load; after that it is halved."""
SHORTEST = 1e-5
"""Share of a step so short that what breaks within it breaks at its end."""
NEAR = 0.01
"""The movement at which a bond breaks is found to this share of its strength."""


@dataclass
class Count:
    """Work done.

    Attributes
    ----------
    newton, factorisations, events : int
        Newton steps, changes of the stiffness that were factorised, and times at which bonds broke.
    """

    newton: int = 0
    factorisations: int = 0
    events: int = 0


@dataclass
class _State:
    """A point of the path: how far load and movement have come, where the blocks are, what the joints remember."""

    load: float
    progress: float
    displacement: FloatArray
    memory: JointMemory
    bound: FloatArray
    dilated: FloatArray

    def copy(self) -> _State:
        return _State(
            self.load,
            self.progress,
            self.displacement.copy(),
            JointMemory(
                self.memory.slip.copy(),
                self.memory.dilated.copy(),
                self.memory.cracked.copy(),
                self.memory.opened.copy(),
            ),
            self.bound.copy(),
            self.dilated.copy(),
        )


@dataclass
class _Path:
    model: Model
    settings: Solver
    condense: bool = True
    count: Count = field(default_factory=Count)

    def __post_init__(self) -> None:
        model = self.model
        self.tolerance = self.settings.tolerance_used
        self.dilates = bool((model.properties.dilation > 0).any())
        if (model.properties.residual_tensile_strength > 0).any():
            raise InputError("joint.residual_tensile_strength: must be 0 with method = 'quasi_static'.")
        self.held = held_dofs(model)
        self.equations = LevelEquations(model, self.held)
        self.load = np.append(model.supports.load, np.zeros(3))
        self.arm = dof_arms(model)
        self.weight = model.mean_block_weight
        self.condensed = False
        self.free = np.ones(self.load.size, dtype=np.bool_)
        self.free[self.held] = False
        self.pattern = self.equations.pattern.copy()
        self.force = np.zeros(self.load.size)
        # a bond without strength breaks at the first tension: one that a thousandth of a block's weight makes
        self.no_strength = 1e-3 * self.weight / float(model.interfaces.contact_area.max())
        size = float(np.ptp(model.blocks.vertices, axis=0).max())
        self.lost_at = 10.0 * size

    # -- forces -------------------------------------------------------------------------------------------------

    def begin(self) -> _State:
        """Return the wall before any load: joints without strength have no bond to break."""
        law = self.model.properties
        memory = JointMemory.fresh(self.model)
        bare = (law.tensile_strength <= 0) & (law.cohesion == law.residual_cohesion)
        memory.cracked[bare & (law.friction == law.residual_friction)] = True
        self.unopened = memory.cracked.copy()
        if self.condense:
            bare_levels = self.equations.interface_level[memory.cracked.any(axis=1)]
            self.open_up_to(int(bare_levels.max(initial=0)))
        return _State(
            0.0, 0.0, np.zeros(self.load.size), memory,
            np.full(memory.slip.shape, NO_LIMIT), np.zeros(memory.slip.shape),
        )  # fmt: skip

    def imbalance(self, state: _State, displacement: FloatArray, live: bool = False) -> tuple[FloatArray, float]:
        """Return the unbalanced force of every degree of freedom at a displacement, and its largest ratio.

        Parameters
        ----------
        state : _State
            Load, movement, memory and frozen friction limits.
        displacement : array (3 (n + 1),)
            Where.
        live : bool
            Whether the friction limits follow the normal stress there, instead of being the frozen ones.
        """
        self.force[:] = state.load * self.load
        model = self.model
        joint_forces(
            self.equations.active, model.interfaces, model.properties, model.ground, state.memory, state.bound,
            state.dilated, live, displacement, state.progress, self.force, self.pattern,
        )  # fmt: skip
        if self.condensed:
            self.force[self.equations.edge_dofs] += self.equations.edge_force(displacement, state.load)
        force = np.where(self.free, self.force, 0.0)
        return force, float(self.ratio(force).max(initial=0.0))

    def ratio(self, force: FloatArray) -> FloatArray:
        """Return unbalanced forces over the mean weight of a block."""
        return np.abs(force / self.arm) / self.weight

    # -- equilibrium --------------------------------------------------------------------------------------------

    def open_up_to(self, level: int) -> None:
        """Look at all joints up to a level one by one; what is beyond stays elastic and condensed."""
        if level + 1 > self.equations.in_play or not self.condensed:
            self.condensed = self.equations.condense(level + 1, self.load)
            self.free[:] = False
            self.free[self.equations.dofs[: self.equations.start[self.equations.in_play]]] = True

    def equilibrate(self, state: _State) -> float:
        """Move the blocks to equilibrium under the joint law; what is condensed is opened where it would slide.

        Returns
        -------
        float
            Largest unbalanced force over the mean block weight.
        """
        while True:
            worst = self.equilibrate_in_play(state)
            if not self.condensed:
                return worst
            self.equations.recover(state.displacement, state.load)
            if worst >= self.tolerance:
                return worst
            f, law = self.fields(state), self.model.properties
            slides = (f.shear_stress != law.shear_stiffness[:, None] * f.shear).any(axis=1)
            slides &= f.normal_stress.max(axis=1) <= law.tensile_strength
            slides[self.equations.active] = False
            if not slides.any():
                return worst
            self.open_up_to(int(self.equations.interface_level[slides].max()))

    def equilibrate_in_play(self, state: _State) -> float:
        """Move the blocks to equilibrium under the joint law, memory being that of the last equilibrium.

        Returns
        -------
        float
            Largest unbalanced force over the mean block weight.
        """
        supports = self.model.supports
        state.displacement[supports.prescribed] = state.progress * supports.prescribed_displacement
        worst, begun = np.inf, state.displacement.copy()
        for attempt in range(ATTEMPTS):
            self.minimise(state, max(self.tolerance, LOOSE[min(attempt, 2)]))
            if attempt == 0 and self.lost(state):
                # limits from before this step may hold nothing: begin where nothing slides
                state.displacement[:] = begun
                state.bound[:] = NO_LIMIT
                self.minimise(state, LOOSE[0])
            frozen = state.bound.copy()
            self.update_bounds(state)
            worst = self.follow_friction(state)
            if self.lost(state):
                break
            if worst < self.tolerance:
                if not self.dilates or self.update_bounds(state) < self.tolerance * self.weight:
                    break
                _, worst = self.imbalance(state, state.displacement, live=True)
            elif attempt >= UNRELAXED:
                # limits that overshoot from one minimum to the next: only part of the way
                share = RELAXED[min((attempt - UNRELAXED) // 12, len(RELAXED) - 1)]
                known = frozen < 0.5 * NO_LIMIT
                state.bound[known] = frozen[known] + share * (state.bound[known] - frozen[known])
        return worst

    def follow_friction(self, state: _State) -> float:
        """Newton's method with friction limits that follow the normal stress; keeps what it finds only if it helps.

        The limits near the solution known, it arrives in a few steps; from afar it may not, and is given up.
        """
        u = state.displacement.copy()
        force, worst = self.imbalance(state, u, live=True)
        start = worst
        for taken in range(16):
            if worst < self.tolerance:
                break
            self.equations.update(state.memory, self.pattern)
            self.count.newton += 1
            step = self.equations.solve(force)
            before, share = worst, 1.0
            force, worst = self.imbalance(state, u + step, live=True)
            while worst > before and share > 0.1 and taken >= 4:
                # contacts that change to and fro: part of the step
                share *= 0.5
                force, worst = self.imbalance(state, u + share * step, live=True)
            u = u + share * step
            if not np.isfinite(worst) or worst > 1e3 * max(start, 1.0):
                break
        if worst < self.tolerance:
            state.displacement[:] = u
            if not self.dilates:
                self.update_bounds(state)
            return worst
        return start

    def update_bounds(self, state: _State) -> float:
        model = self.model
        return float(
            friction_bounds(
                self.equations.active, model.interfaces, model.properties, model.ground, state.memory,
                state.displacement, state.progress, state.bound, state.dilated,
            )
        )  # fmt: skip

    def minimise(self, state: _State, tolerance: float) -> float:
        """Go to the minimum of the energy with frozen friction limits; return the largest unbalanced ratio."""
        u = state.displacement
        force, worst = self.imbalance(state, u)
        for taken in range(100):
            # at least one step: limits taken from where the blocks stood before may hold nothing
            if worst < (tolerance if taken else self.tolerance):
                break
            self.equations.update(state.memory, self.pattern)
            self.count.newton += 1
            step = self.equations.solve(force)
            slope = float(force @ step)
            if not slope > 0:
                break
            share, force, worst = self.search(state, u, step, slope)
            u += share * step
            if self.lost(state):
                break
        return worst

    def search(self, state: _State, u: FloatArray, step: FloatArray, slope: float) -> tuple[float, FloatArray, float]:
        """Find how far to go along a step: to where the energy no longer falls, the root of its falling slope."""
        low, high, slope_low, slope_high = 0.0, 1.0, slope, np.nan
        share = 1.0
        for _ in range(30):
            force, worst = self.imbalance(state, u + share * step)
            now = float(force @ step)
            if abs(now) <= 0.3 * slope or (now > 0 and share >= 64.0):
                break
            if now > 0:
                low, slope_low = share, now
                if np.isnan(slope_high):
                    share *= 2.0
                    continue
            else:
                high, slope_high = share, now
            # false position, kept away from the ends
            share = low + (high - low) * min(max(slope_low / (slope_low - slope_high), 0.05), 0.95)
        return share, force, worst

    def report(self, state: _State, number: int, worst: float, before: Count, collapsed: bool) -> Increment:
        """Take a picture of a state."""
        f = self.fields(state)
        self.imbalance(state, state.displacement)
        held = self.held[self.held % 3 == 1]
        return Increment(
            number=number,
            progress=state.progress,
            displacement=state.displacement[:-3].reshape(-1, 3).copy(),
            opening=f.opening,
            slip=state.memory.slip.copy(),
            normal_stress=f.normal_stress,
            shear_stress=f.shear_stress,
            state=contact_states(state.memory._replace(cracked=state.memory.cracked & ~self.unopened)),
            unbalanced_force_ratio=worst,
            base_reaction=-float(self.force[held].sum()),
            cycles=self.count.newton - before.newton,
            events=self.count.events - before.events,
            factorisations=self.count.factorisations - before.factorisations,
            collapsed=collapsed,
        )

    def lost(self, state: _State) -> bool:
        return not bool((np.abs(state.displacement[self.free]) < self.lost_at).all())

    # -- memory -------------------------------------------------------------------------------------------------

    def fields(self, state: _State) -> ContactFields:
        return fields_of(self.model, state.memory, state.displacement, state.progress)

    def remember(self, state: _State) -> None:
        """Let the joints remember how far they have slid in this equilibrium."""
        f = self.fields(state)
        k_s = self.model.properties.shear_stiffness[:, None]
        tau = np.clip(k_s * (f.shear - state.memory.slip), -state.bound, state.bound)
        slid = f.shear - tau / k_s
        moved = np.abs(k_s * (f.shear - state.memory.slip)) > state.bound
        state.memory.slip[moved] = slid[moved]
        self.unopened &= f.opening <= state.dilated
        state.memory.dilated[:] = state.dilated

    def overload(self, state: _State) -> FloatArray:
        """Return how far each bond (m, q) is loaded: 1 at its strength, 0 where it is broken already."""
        f, law = self.fields(state), self.model.properties
        stress = law.normal_stiffness[:, None] * (f.opening - state.dilated)
        load = stress / np.maximum(law.tensile_strength, self.no_strength)[:, None]
        if law.brittle_shear.any():
            limit = np.maximum(law.cohesion[:, None] - stress * law.friction[:, None], self.no_strength)
            sheared = np.abs(law.shear_stiffness[:, None] * (f.shear - state.memory.slip)) / limit
            load = np.where(law.brittle_shear[:, None], np.maximum(load, sheared), load)
        return np.where(state.memory.cracked, 0.0, load)

    def break_bonds(self, state: _State, load: FloatArray) -> None:
        """Break the most loaded bond, and those that are loaded alike."""
        broken = load >= load.max() * (1.0 - TOGETHER)
        if self.condensed:
            self.open_up_to(int(self.equations.interface_level[broken.any(axis=1)].max()))
        state.memory.cracked[broken] = True
        self.count.events += 1

    # -- path ---------------------------------------------------------------------------------------------------

    def advance(self, state: _State, load: float, progress: float) -> tuple[_State, float]:
        """Follow the path to a load and a movement, bond by bond; return the state there and its unbalanced ratio."""
        goal = far = (load, progress)
        shortest = SHORTEST * self.distance(state, goal)
        beyond: tuple[float, float] | None = None  # the nearest point at which a bond is known to be overloaded
        fallen: _State | None = None
        halvings = cuts = 0
        while True:
            trial, worst = self.moved(state, *far)
            if fallen is None and self.lost(trial):
                fallen = trial
            if worst >= self.tolerance and halvings < HALVINGS:
                # from nearer the last equilibrium it is easier to find the next, or clearer that there is none
                far, halvings = self.between(state, far, 0.5), halvings + 1
                continue
            if worst >= self.tolerance or self.lost(trial):
                return fallen or trial, worst
            fallen = None
            loaded = self.overload(trial)
            if loaded.max(initial=0.0) <= 1.0 + OVERLOAD:
                self.remember(trial)
                if far == goal:
                    return trial, worst
                # what was found to overload is kept in sight until it breaks, or is passed unbroken
                state, halvings = trial, max(halvings - 1, 0)
                far = goal if beyond is None or far == beyond or cuts < CUTS else beyond
                continue
            if loaded.max() <= 1.0 + NEAR or self.distance(state, far) <= shortest:
                state, worst = self.cascade(trial, loaded)
                if worst >= self.tolerance or self.lost(state):
                    return state, worst
                far, beyond, halvings, cuts = goal, None, 0, 0
                continue
            beyond, cuts = far, cuts + 1
            share = self.share_to_first_break(self.overload(state), loaded) if cuts < CUTS else 0.5
            far = self.between(state, far, min(max(share, 1e-4), 0.95))

    @staticmethod
    def distance(state: _State, far: tuple[float, float]) -> float:
        """Return how far load and movement are from a state."""
        return abs(far[0] - state.load) + abs(far[1] - state.progress)

    @staticmethod
    def between(state: _State, far: tuple[float, float], share: float) -> tuple[float, float]:
        """Return the load and movement at a share of the way from a state."""
        return state.load + share * (far[0] - state.load), state.progress + share * (far[1] - state.progress)

    def moved(self, state: _State, load: float, progress: float) -> tuple[_State, float]:
        trial = state.copy()
        trial.load, trial.progress = load, progress
        worst = self.equilibrate(trial)
        self.count.factorisations = self.equations.factorisations
        return trial, worst

    def share_to_first_break(self, before: FloatArray, after: FloatArray) -> float:
        """Return the share of a step at which the first bond reaches its strength, between linear loads."""
        over = after > 1.0 + OVERLOAD
        return float(np.min((1.0 + 0.5 * NEAR - before[over]) / (after[over] - before[over])))

    def cascade(self, state: _State, loaded: FloatArray) -> tuple[_State, float]:
        """Break what is overloaded at a standing movement, one after the other, until nothing is."""
        while True:
            self.remember(state)
            self.break_bonds(state, loaded)
            worst = self.equilibrate(state)
            loaded = self.overload(state)
            if worst >= self.tolerance or self.lost(state):
                return state, worst
            if loaded.max(initial=0.0) <= 1.0 + OVERLOAD:
                self.remember(state)
                return state, worst


def quasi_static_path(model: Model, settings: Solver, increments: int, *, condense: bool = True) -> Iterator[Increment]:
    """Follow the movement increment by increment.

    Parameters
    ----------
    model : Model
        The wall.
    settings : Solver
        Tolerance.
    increments : int
        Number of equal steps of the movement.
    condense : bool
        Whether levels of blocks whose joints stay elastic are condensed to what they do to the level before, and
        opened when one of their joints would slide or break. False looks at every joint in every step.

    Yields
    ------
    Increment
        First the state under dead load (number 0), then one each step. The path ends early after an increment in
        which a part of the wall came loose.
    """
    # the matrices are small: threads would spend their time waiting for each other
    one_thread = ThreadpoolController().select(user_api="blas")
    path = _Path(model, settings, condense)
    state = path.begin()
    for number in range(increments + 1):
        before = replace(path.count)
        with one_thread.limit(limits=1):
            state, worst = path.advance(state, 1.0, number / increments)
        collapsed = bool(come_loose(model, state.displacement, state.progress).any())
        if worst >= path.tolerance and not collapsed:
            force, _ = path.imbalance(state, state.displacement)
            block = int(path.ratio(force).argmax()) // 3
            raise ConvergenceError(
                f"increment {number}: no equilibrium found; the unbalanced force is {worst:.2g} block weights at "
                f"{describe_block(model, block)}, allowed is {path.tolerance:g}.",
                increment=number,
                block=block,
            )
        yield path.report(state, number, worst, before, collapsed)
        if collapsed:
            return
