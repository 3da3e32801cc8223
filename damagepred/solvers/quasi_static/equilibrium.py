"""Equilibrium at a given load and movement: Newton's method, and Coulomb friction by Tresca fixed-point iteration.

Newton's method is applied to the Coulomb law first. From a nearby equilibrium it converges in a few iterations, which
holds for most of a path. If it fails, the friction bounds are fixed (Tresca problem): the wall then has a potential,
convex in the displacements, which Newton's method with line search minimises from any start. The bounds are updated
and the minimisation repeated until both agree (Haslinger 1983; Wriggers 2006, ch. 10).
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from damagepred.arrays import BoolArray, FloatArray, IntArray
from damagepred.assembly import Model
from damagepred.assembly.section import SectionMemory
from damagepred.kernels.concrete_section.forces import section_forces
from damagepred.kernels.interface.checks import farthest_sliding
from damagepred.kernels.interface.internal_force import joint_forces, update_tresca_bounds
from damagepred.kernels.interface.residual import combine_loads, free_residual, within_limit
from damagepred.kernels.joint.limits import NO_LIMIT
from damagepred.solvers.options import DEFAULTS, SolverOptions
from damagepred.solvers.quasi_static.jacks import JackControl
from damagepred.solvers.quasi_static.linear_system import BlockTridiagonalSystem
from damagepred.solvers.quasi_static.superelements import Superelements
from damagepred.solvers.state.joint_history import JointHistory
from damagepred.solvers.system.detached_blocks import DetachmentLimit, largest_elastic_displacement
from damagepred.solvers.system.discrete_system import DiscreteSystem
from damagepred.time_limit import check_time


def at_or_last(values: tuple[float, ...], index: int) -> float:
    """Return the value at an index; beyond the end, the last one.

    Parameters
    ----------
    values : tuple of float
        At least one.
    index : int
        From 0.
    """
    return values[min(index, len(values) - 1)]


def no_zones() -> FloatArray:
    """Return the plastic strain of a wall of rigid blocks."""
    return np.empty((0, 4))


@dataclass
class State:
    """A point of the path: load, load factor, displacements and history variables.

    Attributes
    ----------
    load, load_factor : float
        Shares of dead load and full movement.
    displacement : array (size,)
        Of all degrees of freedom.
    history : JointHistory
        Of the joints.
    plastic : array (z, 4)
        Plastic strain of the zones.
    jack : float
        Load of each jack (N).
    sections : SectionMemory
        Of the sections of a footing that cracks.
    """

    load: float
    load_factor: float
    displacement: FloatArray
    history: JointHistory
    plastic: FloatArray = field(default_factory=no_zones)
    jack: float = 0.0
    sections: SectionMemory = field(default_factory=lambda: SectionMemory.fresh(0))

    @classmethod
    def rest(cls, model: Model) -> State:
        """Return the unloaded wall."""
        zones = no_zones() if model.mesh is None else np.zeros((len(model.mesh.zones), 4))
        sections = SectionMemory.fresh(0) if model.sections is None else SectionMemory.at_first(model.sections)
        return cls(0.0, 0.0, np.zeros(model.size), JointHistory.fresh(model), zones, 0.0, sections)

    def copy(self) -> State:
        """Return an independent copy."""
        return self.at(self.load, self.load_factor)

    def at(self, load: float, load_factor: float) -> State:
        """Return a copy at another load and load factor, with the same displacements.

        Parameters
        ----------
        load, load_factor : float
            Shares of dead load and of movement (1).
        """
        return replace(
            self,
            load=load,
            load_factor=load_factor,
            displacement=self.displacement.copy(),
            history=self.history.copy(),
            plastic=self.plastic.copy(),
            sections=self.sections.copy(),
        )


class Equilibrium:
    """Finds equilibria of a wall.

    Parameters
    ----------
    model : Model
        The wall.
    tolerance : float
        Largest unbalanced force over the mean block weight.
    options : SolverOptions
        Of Newton's method, the line search, Coulomb friction and jacks.
    """

    def __init__(self, model: Model, tolerance: float, options: SolverOptions = DEFAULTS) -> None:
        self.model, self.tolerance, self.options = model, tolerance, options
        self.return_mapping = options.return_mapping.for_kernels()
        self.system = DiscreteSystem.of(model, options.elastic_solution)
        self.dead_load, self.live_load = self.system.dead_load, self.system.live_load
        self.jacks, self.superelements = JackControl.of(model), None
        if model.mesh is not None:
            self.superelements = Superelements(self.system, options.newton.interior_tolerance)
            self.dead_load, self.live_load = self.superelements.condensed_loads
        self.weight = model.mean_block_weight
        self.arms = self.system.arms
        self.per_weight = 1.0 / self.system.residual_scale
        self.newton = 0
        self.condensed = False
        shape = model.interfaces.contact_area.shape
        self.force = np.zeros(self.dead_load.size)
        self.stiffness = np.zeros((shape[0], 9))
        everything = self._everything = np.arange(shape[0])
        self._in_section = np.zeros(shape[0], dtype=np.bool_)
        if model.sections is not None:
            self._in_section[model.sections.interface] = True
        self._tresca = (np.full(shape, NO_LIMIT), np.zeros(shape), np.zeros(shape))
        rest = State.rest(model)
        self._joint_forces(everything, rest, rest.displacement, coulomb=False)
        self.stiffness[model.properties.gap > 0.0] = 0.0  # until it closes
        self.tangent = self.stiffness.copy()
        self.equations = BlockTridiagonalSystem(
            self.system, self.stiffness.copy(), self.superelements, options.linear_system
        )
        self.rate = np.zeros(self.dead_load.size)
        supports = model.supports
        moves = supports.prescribed_displacement != 0.0
        # what goes on inside deformable blocks may follow the load
        self._stands_still = self.superelements is None and not (moves.any() or model.ground.moves)
        self._moved = everything[:0] if self._stands_still else self._interfaces_of(self._blocks_of(moves))
        # what is condensed takes supports as standing still
        displaced = self._blocks_of(moves | (supports.start != 0.0))
        self._nearest = 0
        if displaced.size:
            beside = self._interfaces_of(displaced, ground=False)
            self._nearest = int(self.equations.interface_level[beside].max(initial=0))
        self._store_tangent(rest, rest.displacement)
        self.free = np.zeros(self.dead_load.size, dtype=np.bool_)
        self.free[self.equations.dofs] = True
        self._failures = self._searches_to_skip = 0
        self.detachment_limit, self._begun_at = (
            DetachmentLimit.of(model),
            float(np.abs(supports.start).max(initial=0.0)),
        )

    def _blocks_of(self, prescribed: BoolArray) -> IntArray:
        """Return the blocks of some prescribed degrees of freedom."""
        return self.system.block_of_dof[self.model.supports.prescribed[prescribed]]

    def _interfaces_of(self, blocks: IntArray, ground: bool = True) -> IntArray:
        """Return the interfaces of some blocks, with those to the ground if asked for."""
        face, listed = self.model.interfaces, np.append(blocks, self.model.n_blocks) if ground else blocks
        return np.flatnonzero(np.isin(face.block_a, listed) | np.isin(face.block_b, listed))

    # -- forces -----------------------------------------------------------------------------------------------------

    def _joint_forces(self, active: IntArray, state: State, displacement: FloatArray, coulomb: bool) -> None:
        """Add forces of joints, sections and deformable blocks to the residual, and set joint tangents."""
        model, superelements = self.model, self.superelements
        if superelements is not None:
            superelements.place_facets(displacement)
            self.force[superelements.facet_dofs] = 0.0
        if model.sections is not None:
            active = active[~self._in_section[active]]
            section_forces(
                model.sections,
                state.sections,
                model.interfaces,
                model.properties,
                displacement,
                self.force,
                self.stiffness,
            )
        joint_forces(
            active,
            model.interfaces,
            model.joint_parameters,
            self.return_mapping,
            model.ground.at(state.load_factor),
            state.history,
            self._tresca,
            coulomb,
            displacement,
            self.force,
            self.stiffness,
        )
        if superelements is not None:
            superelements.scatter_facet_forces(self.force)
            superelements.add_internal_forces(state.load, state.load_factor, displacement, state.plastic, self.force)

    def residual(self, state: State, displacement: FloatArray, coulomb: bool = True) -> tuple[FloatArray, float]:
        """Return the residual force of every degree of freedom, and the unbalanced force ratio.

        Parameters
        ----------
        state : State
            Load, load factor and history.
        displacement : array (size,)
            Of all degrees of freedom; facets and the inside of yielding blocks are updated.
        coulomb : bool
            Coulomb law, or a Tresca problem with fixed bounds.
        """
        self._loads(state)
        self._joint_forces(self.equations.active, state, displacement, coulomb)
        if self.condensed:
            self.force[self.equations.boundary_dofs] += self.equations.condensed_force(
                displacement, state.load, state.load_factor
            )
        # what is no number must not pass for balance; so are forces of a block in which no equilibrium is found
        force, worst = free_residual(self.force, self.free, self.per_weight)
        if self.superelements is not None:
            worst = max(worst, self.superelements.largest_block_resultant(force) / self.weight)
        if coulomb and self.jacks is not None:
            gap = abs(self.gap(state, displacement)) / self.options.jacks.deflection_tolerance * self.tolerance
            worst = max(worst, gap if np.isfinite(gap) else np.inf)
        return force, worst

    def _loads(self, state: State) -> None:
        """Set the residual force to the external loads."""
        combine_loads(self.dead_load, self.live_load, state.load, state.load_factor, self.force)
        if self.jacks is not None:
            self.force += state.jack * self.jacks.push

    def gap(self, state: State, displacement: FloatArray) -> float:
        """Return the missing deflection of jacks whose deflection is given (m).

        Parameters
        ----------
        state : State
            Its load factor counts.
        displacement : array (size,)
            Of all degrees of freedom.
        """
        return 0.0 if self.jacks is None else self.jacks.gap(state.load_factor, displacement)

    def forces(self, state: State) -> FloatArray:
        """Return the force of joints and loads on all degrees of freedom, prescribed and condensed ones included."""
        self._loads(state)
        self._joint_forces(self._everything, state, state.displacement, coulomb=True)
        return self.force

    def condensed_energy(self, state: State) -> tuple[IntArray, float]:
        """Return the interfaces whose energy is to be counted one by one, and what all others store (J).

        What is condensed is elastic and in equilibrium with its loads f: it stores (f u - F u_e) / 2 with the force F
        and the displacements u_e on the last level in play.
        """
        equations = self.equations
        if not self.condensed or self.superelements is not None:
            return self._everything, 0.0
        moved = state.displacement
        hanging = equations.condensed_load_work(moved, state.load, state.load_factor)
        edge = equations.condensed_force(moved, state.load, state.load_factor) @ moved[equations.boundary_dofs]
        return equations.active, 0.5 * (hanging - float(edge))

    def load_increment(self, load: float, load_factor: float) -> FloatArray:
        """Return the force increment of a step, with sliding joints as in the last equilibrium (N, N m).

        Parameters
        ----------
        load, load_factor : float
            Increments of dead load and movement (1).
        """
        force = load * self.dead_load + load_factor * self.rate
        if self.condensed:
            force[self.equations.boundary_dofs] += self.equations.condensed_load(load, load_factor)
        return force

    def has_diverged(self, state: State) -> bool:
        """Return whether displacements are so large that no equilibrium is sought any more."""
        return self._has_diverged(state, state.displacement)

    def _has_diverged(self, state: State, displacement: FloatArray) -> bool:
        limit = self._begun_at + self.options.newton.divergence_displacement * self.detachment_limit.at(
            state.load_factor
        )
        if within_limit(displacement, self.free, self.arms, limit):
            return False
        limit += 2.0 * largest_elastic_displacement(self.model, state.load_factor)
        return not within_limit(displacement, self.free, self.arms, limit)

    # -- condensation -----------------------------------------------------------------------------------------------

    def uncondense_up_to(self, level: int) -> None:
        """Look at all joints up to a level one by one; what is beyond stays elastic and condensed."""
        level = max(level, self._nearest)
        if level + 1 > self.equations.active_levels or not self.condensed:
            self.condensed = self.equations.condense(level + 1, self.dead_load, self.live_load)
            self.free[:] = False
            self.free[self.equations.active_dofs] = True

    def find(self, state: State, start: FloatArray | None = None, near: bool = False) -> float:
        """Find the equilibrium of a state; condensed courses are uncondensed where they would slide or yield.

        Parameters
        ----------
        state : State
            Its displacement is that of the last equilibrium, and becomes that of this one.
        start : array (3 (n + 1),), optional
            Other start of the iteration.
        near : bool
            Whether to try Newton's method alone.

        Returns
        -------
        float
            Unbalanced force ratio: largest residual force over the mean block weight.
        """
        while True:
            worst = self._find_active(state, start, near)
            self.complete(state)
            if worst >= self.tolerance:
                return worst
            farthest, start = max(self._farthest_sliding(state), self._farthest_yielding(state)), None
            if farthest < 0:
                return worst
            self.uncondense_up_to(int(farthest))

    def _farthest_sliding(self, state: State) -> int:
        """Return the farthest level at which a condensed joint would slide; -1 if none does."""
        if not self.condensed:
            return -1
        model, equations = self.model, self.equations
        farthest = farthest_sliding(
            equations.condensed_interfaces,
            equations.interface_level,
            model.interfaces,
            model.joint_parameters,
            self.return_mapping,
            model.ground.at(state.load_factor),
            state.history,
            state.displacement,
        )
        return int(farthest)

    def _farthest_yielding(self, state: State) -> int:
        """Uncondense deformable blocks that would yield; return the farthest level of these, -1 if none does."""
        if self.superelements is None:
            return -1
        opened = self.superelements.activate_yielding(state.displacement, state.load, state.load_factor, state.plastic)
        return int(self.equations.superelement_level[opened].max(initial=-1))

    def farthest_open(self) -> int:
        """Return the farthest level of an uncondensed deformable block; -1 if there is none."""
        listed = [] if self.superelements is None else list(self.superelements.tangent)
        return int(self.equations.superelement_level[listed].max(initial=-1))

    def complete(self, state: State, displacement: FloatArray | None = None) -> None:
        """Fill in what is condensed, what lies inside deformable blocks, and what follows from gridpoints.

        Parameters
        ----------
        state : State
            Load, movement, memory.
        displacement : array (size,), optional
            Where; by default at the state's own.
        """
        moved = state.displacement if displacement is None else displacement
        if self.condensed:
            self.equations.recover(moved, state.load, state.load_factor)
        if self.superelements is not None:
            self.superelements.recover(moved, state.load, state.load_factor, state.plastic)

    def _find_active(self, state: State, start: FloatArray | None, near: bool) -> float:
        supports = self.model.supports
        begun = state.displacement.copy()
        begun[supports.prescribed] = supports.displacement(state.load_factor)
        if self.jacks is not None:
            state.jack = self.jacks.load_at(state.load_factor, state.jack)
        first, load = begun if start is None else start, state.jack
        found, worst = self._newton(state, first)
        if worst < self.tolerance:
            state.displacement[:] = found
            return worst
        if near:
            return worst
        if self._searches_to_skip > 0:
            self._searches_to_skip -= 1
            return worst
        if worst < self.options.coulomb.warm_start_residual:
            state.displacement[:] = found
            worst = self._coulomb_fixed_point(state, near=True)
        if worst >= self.tolerance:
            state.displacement[:], state.jack = begun, load
            worst = self._coulomb_fixed_point(state, near=False)
        failed = worst >= self.tolerance
        self._failures = (
            min(self._failures + 1, self.options.coulomb.max_failures) if failed else max(self._failures - 1, 0)
        )
        self._searches_to_skip = 2 ** (self._failures - 1) - 1 if failed else 0
        return worst

    def find_nearby(self, state: State) -> tuple[float, FloatArray]:
        """Find an equilibrium by Newton iteration from a state; return its unbalanced force ratio and displacements."""
        found, worst = self._newton(state, state.displacement)
        if worst < self.tolerance:
            found = found.copy()
            self.complete(state, found)
        return worst, found

    def accept_unconverged(self, state: State) -> float:
        """Take a state that is no equilibrium as one; return its unbalanced force ratio."""
        _, worst = self.residual(state, state.displacement)
        self._store_tangent(state, state.displacement)
        self.complete(state)
        return worst

    # -- Newton's method --------------------------------------------------------------------------------------------

    def _newton(self, state: State, start: FloatArray) -> tuple[FloatArray, float]:
        """Newton's method with backtracking on the Coulomb law; return the best iterate and its unbalanced force ratio.

        The first iterations are undamped: active sets of contacts often settle although the residual grows. The load of
        the jacks becomes that of the best iterate.
        """
        options = self.options.newton
        u = best = start
        load = state.jack
        force, worst = self.residual(state, u)
        first = least = worst
        diverging = 0
        for taken in range(options.max_iterations + 1):
            if worst < self.tolerance:
                self._store_tangent(state, u)
                break
            diverging = diverging + 1 if worst > options.early_divergence_ratio * least else 0
            near = least < self.options.coulomb.warm_start_residual
            if diverging >= options.early_divergence_iterations and near:
                break
            check_time()
            step, more = self._step(force, self.gap(state, u))
            before, share, last = worst, 1.0, state.jack
            state.jack = last + more
            force, worst = self.residual(state, u + step)
            while share > options.minimum_step and (
                (worst > before and taken >= options.undamped_iterations) or worst == np.inf
            ):
                # active sets that alternate: backtracking
                share *= 0.5
                state.jack = last + share * more
                force, worst = self.residual(state, u + share * step)
            if not worst < options.divergence_ratio * max(first, 1.0):
                break
            u = u + share * step
            cycles = abs(worst - least) <= options.stagnation_tolerance * least
            if worst < least:
                best, least, load = u, worst, state.jack
            if cycles and worst >= self.tolerance:
                break
        state.jack = load
        if self._has_diverged(state, best):
            least = np.inf
        return best, least

    def _store_tangent(self, state: State, displacement: FloatArray) -> None:
        """Store the tangent stiffness and the force per load factor for the predictor."""
        self.tangent[self.equations.active] = self.stiffness[self.equations.active]
        self.rate = self.live_load.copy()
        if not self._stands_still:
            self.rate += self._joint_rate(state, displacement)
        if self.jacks is not None and self.jacks.by_load:
            self.rate += (self.jacks.load_at(1.0, 0.0) - self.jacks.load_at(0.0, 0.0)) * self.jacks.push

    def _joint_rate(self, state: State, displacement: FloatArray) -> FloatArray:
        """Return the force per load factor of moving ground and supports, by a forward difference."""
        supports, step = self.model.supports, self.options.newton.finite_difference_step
        nudged = replace(state, load_factor=state.load_factor + step, displacement=displacement.copy())
        nudged.displacement[supports.prescribed] += step * supports.prescribed_displacement
        self.force[:] = 0.0
        self._joint_forces(self._moved, state, displacement, coulomb=True)
        before = self.force.copy()
        self.force[:] = 0.0
        self._joint_forces(self._moved, nudged, nudged.displacement, coulomb=True)
        return (self.force - before) / step

    def _step(self, force: FloatArray, gap: float) -> tuple[FloatArray, float]:
        """Return the Newton step of displacements and jack load for a residual force and a missing deflection (m)."""
        self.equations.update(self.stiffness)
        return self.solve(force, gap)

    def solve(self, force: FloatArray, gap: float) -> tuple[FloatArray, float]:
        """Solve the linear system, bordered by the condition on the deflection where jacks are controlled by it.

        Parameters
        ----------
        force : array (size,)
            Right-hand side (N, N m).
        gap : float
            Missing deflection (m).

        Returns
        -------
        tuple of array (size,), float
            Displacements (m, rad) and load of each jack (N).
        """
        self.newton += 1
        if self.jacks is None or self.jacks.by_load:
            return self.equations.solve(force), 0.0
        alone, by_push = self.equations.solve(np.stack((force, self.jacks.push)))
        return self.jacks.step(alone, by_push, gap)

    def volume_per_deflection(self) -> float | None:
        """Return the sum of the jacks' lifts per deflection of the last tangent (1).

        None where their load is given, or where they do not bend the footing.
        """
        if self.jacks is None or self.jacks.by_load:
            return None
        self.equations.update(self.tangent)
        by_push = self.equations.solve(self.jacks.push)
        bends, gives = float(self.jacks.weights @ by_push), float(self.jacks.push @ by_push)
        return gives / bends if bends > 0.0 else None

    # -- Coulomb friction ----------------------------------------------------------------------------------------------

    def _coulomb_fixed_point(self, state: State, near: bool) -> float:
        """Coulomb friction by Tresca fixed-point iteration; return the unbalanced force ratio.

        Each iteration minimises the potential with fixed bounds to the tolerance of the forcing sequence, updates the
        bounds, under-relaxed after the first updates, and tries Newton's method on the Coulomb law from there. A warm
        start takes the first bounds from the present displacements.
        """
        options = self.options.coulomb
        bound, dilatant_opening, kappa = self._tresca
        bound[:], dilatant_opening[:], kappa[:] = NO_LIMIT, state.history.dilatant_opening, state.history.kappa
        if near:
            self._update_tresca_bounds(state, 1.0)
        worst, least, since, begun = np.inf, np.inf, 0, self.newton
        for attempt in range(options.warm_start_iterations if near else options.max_iterations):
            self._minimise(state, max(self.tolerance, at_or_last(options.forcing_sequence, attempt)))
            if self.has_diverged(state):
                break
            share = 1.0
            if attempt >= options.full_updates:
                # bounds that overshoot are under-relaxed
                update = (attempt - options.full_updates) // options.updates_per_factor
                share = at_or_last(options.relaxation_factors, update)
            self._update_tresca_bounds(state, share)
            found, worst = self._newton(state, state.displacement)
            if worst < self.tolerance:
                state.displacement[:] = found
                break
            since = 0 if worst < 0.5 * least else since + 1
            least = min(least, worst)
            if (
                since > options.stagnation_limit
                or self.newton - begun > options.max_newton_iterations >> self._failures
            ):
                break
        return worst

    def _update_tresca_bounds(self, state: State, share: float) -> None:
        model = self.model
        update_tresca_bounds(
            self.equations.active,
            model.interfaces,
            model.joint_parameters,
            self.return_mapping,
            model.ground.at(state.load_factor),
            state.history,
            state.displacement,
            self._tresca,
            share,
        )

    def _minimise(self, state: State, tolerance: float) -> float:
        """Minimise the potential of a Tresca problem by Newton with line search; return the unbalanced force ratio."""
        u = state.displacement
        force, worst = self.residual(state, u, coulomb=False)
        self._correct_jack_load(state, force, u)
        for taken in range(self.options.coulomb.max_minimisation_iterations):
            # at least one step: bounds of the previous displacements may carry nothing
            if worst < (tolerance if taken else self.tolerance):
                if abs(self.gap(state, u)) <= self.options.jacks.deflection_tolerance * max(
                    tolerance / self.tolerance, 1.0
                ):
                    break
                # minimum under this jack load: correct the load for the deflection
                self._correct_jack_load(state, force, u)
            check_time()
            self.equations.update(self.stiffness)
            self.newton += 1
            step = self.equations.solve(force)
            slope = float(force @ step)
            if not slope > 0:
                break
            share, force, worst = self._line_search(state, u, step, slope)
            u += share * step
            if self.has_diverged(state):
                break
        return worst

    def _correct_jack_load(self, state: State, force: FloatArray, u: FloatArray) -> None:
        """Set the load of the jacks for the given deflection by the present tangent, and add it to the residual.

        Only under a given load does the wall have a potential: jacks do no work on the measured deflection.
        """
        if self.jacks is None or self.jacks.by_load:
            return
        _, more = self._step(force, self.gap(state, u))
        state.jack += more
        force += np.where(self.free, more * self.jacks.push, 0.0)

    def _line_search(
        self, state: State, u: FloatArray, step: FloatArray, slope: float
    ) -> tuple[float, FloatArray, float]:
        """Line search: root of the slope of the potential along a step, by safeguarded regula falsi."""
        options = self.options.line_search
        low, high, slope_low, slope_high = 0.0, 1.0, slope, np.nan
        share = 1.0
        for _ in range(options.max_iterations):
            force, worst = self.residual(state, u + share * step, coulomb=False)
            now = float(force @ step)
            if abs(now) <= options.slope_tolerance * slope or (now > 0 and share >= options.maximum_step):
                break
            if now > 0:
                low, slope_low = share, now
                if np.isnan(slope_high):
                    share *= 2.0
                    continue
            else:
                high, slope_high = share, now
            # false position, kept away from the ends
            root = slope_low / (slope_low - slope_high)
            share = low + (high - low) * min(max(root, options.safeguard), 1.0 - options.safeguard)
        return share, force, worst
