"""Residual force of a wall at a given load and movement, its linearisation, and condensed elastic parts.

Python's side of ``damagepred.kernels.equilibrium``: makes its structures, with ``components``, and checks their arrays.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any, NamedTuple

import numpy as np

from damagepred.arrays import BoolArray, FloatArray, IntArray
from damagepred.assembly import Model
from damagepred.assembly.model import Ground
from damagepred.kernels.equilibrium.completion import RATE_STEP, Completed, complete, store_tangent
from damagepred.kernels.equilibrium.joints import (
    add_internal_forces,
    commit_section_history,
    fill_bond_loads,
    fill_section_values,
    joint_steps,
)
from damagepred.kernels.equilibrium.newton import run_newton
from damagepred.kernels.equilibrium.predictor import interpolate_event, predict
from damagepred.kernels.equilibrium.residual import Steps, residual_from_python, solve_step, wall_residual
from damagepred.kernels.equilibrium.tresca import minimise_tresca
from damagepred.kernels.equilibrium.wall import Bonds, Freedoms, Interfaces, Wall, empty_state, fill_state
from damagepred.kernels.equilibrium.wall import State as WallState
from damagepred.kernels.interface.residual import within_limit
from damagepred.kernels.joint.return_mapping import all_plain
from damagepred.kernels.linear.condensation import Condensation
from damagepred.kernels.linear.solver import solve_tangent
from damagepred.runtime.time_limit import check_time
from damagepred.solvers.options import DEFAULTS, SolverOptions
from damagepred.solvers.quasi_static.components import make_components
from damagepred.solvers.quasi_static.external_load import ExternalLoad, JackControl
from damagepred.solvers.quasi_static.linear_system import MultifrontalSystem
from damagepred.solvers.quasi_static.superelements import Superelements
from damagepred.solvers.state.wall_state import Point, State
from damagepred.solvers.system.collapse_criterion import DetachmentLimit, largest_elastic_displacement
from damagepred.solvers.system.discrete_system import DiscreteSystem
from damagepred.solvers.system.footing_forces import set_linear_stresses

DIVERGENCE_DISPLACEMENT = 10.0
"""Displacement over the detachment limit beyond which no equilibrium is sought (1)."""
PREDICTOR_AIM = 0.1
"""Overload at which the tangent predictor aims, over the event tolerance (1)."""


@cache
def _steps() -> Steps:
    """Steps that all iterations take."""
    return Steps(residual=wall_residual, solve=solve_step)


FLOAT, FLAG = np.dtype(np.float64), np.dtype(np.bool_)


def _require(name: str, array: np.ndarray, kind: np.dtype, shape: tuple[int, ...]) -> None:
    """Refuse an array of another wall or type: kernels check nothing."""
    if array.shape != shape or array.dtype != kind or not array.flags.c_contiguous:
        raise ValueError(f"{name} must be a contiguous array of {kind} {shape}, not {array.dtype} {array.shape}")


class Residual:
    """Residual force of a wall with condensed elastic parts, and its linearisation; ``wall`` is for kernels."""

    def __init__(self, model: Model, tolerance: float, options: SolverOptions = DEFAULTS) -> None:
        self.model, self.tolerance, self.options = model, tolerance, options
        self.system = DiscreteSystem.of(model)
        self.jacks, self.superelements = JackControl.of(model), None
        loads = self.system.dead_load, self.system.live_load
        if model.mesh is not None:
            self.superelements = Superelements(self.system)
            loads = self.superelements.condensed_loads[0], self.superelements.condensed_loads[1]
        self.loads, self._inside = ExternalLoad(*loads), empty_state()
        self._completed = Completed(True)
        rest, supports = State.rest(model), model.supports
        self._make_components()
        elastic = self._elastic_stiffness(rest)
        self.equations = MultifrontalSystem(self.system, elastic, self.superelements, options.linear_system.max_memory)
        self._moving = self._moving_interfaces()
        self._never_condensed = self._always_active_fronts()
        self._detachment_limit = float(np.abs(supports.start).max(initial=0.0)), DetachmentLimit.of(model)
        self.change_model(model)
        self._lasting["stiffness"][:] = elastic
        self.store_tangent(rest, rest.displacement)

    def _moving_interfaces(self) -> IntArray | None:
        """Interfaces whose forces change with the load factor alone, or None in a wall where nothing moves."""
        moves = self.model.supports.prescribed_displacement != 0.0
        if self.model.is_strained:
            return self._all_interfaces
        # forces inside deformable blocks may depend on the load factor
        if self.superelements is not None or moves.any() or self.model.ground.moves:
            return self._interfaces_of(self._blocks_of(moves))
        return None

    def _always_active_fronts(self) -> BoolArray:
        """Fronts (F,) with moved supports, jacks, footing or strains, and the root: never condensed."""
        tree, supports = self.equations.tree, self.model.supports
        displaced = self._blocks_of((supports.prescribed_displacement != 0.0) | (supports.start != 0.0))
        if self.jacks is not None:
            acting = np.flatnonzero((self.jacks.push != 0.0) | (self.jacks.weights != 0.0))
            displaced = np.append(displaced, self.system.block_of_dof[acting])
        if self.model.footing is not None:
            displaced = np.append(displaced, self.model.footing)
        fronts = tree.fronts_of(self._interfaces_of(displaced))
        fronts[:1] = True
        if self.superelements is not None:
            fronts |= tree.fronts_of_superelements(np.isin(self.superelements.block, displaced))
        return fronts | self.model.is_strained

    @property
    def plain(self) -> bool:
        """Whether all joints are plain."""
        return bool(self.steps.plain)

    @property
    def per_weight(self) -> FloatArray:
        """One over the reference force of each degree of freedom (1/N, 1/(N m))."""
        return 1.0 / self.system.residual_scale

    @property
    def bond_load(self) -> FloatArray:
        """Loads of all bonds (m, q), 1 at the strength."""
        load: FloatArray = self._lasting["bonds"].load
        return load

    @property
    def free(self) -> IntArray:
        """Free degrees of freedom of active fronts."""
        return self.equations.active.dofs

    @property
    def has_potential(self) -> bool:
        """Whether residual forces of the elastic wall are the slope of a potential, and a line search leads down it."""
        # jacks do no work on the deflection that controls them
        return self.jacks is None or self.jacks.by_load

    @property
    def condensed(self) -> bool:
        """Whether elastic parts are condensed."""
        return self.equations.condensation is not None

    def change_model(self, model: Model) -> None:
        """Continue with other supports of the same stiffness."""
        self.model, listed = model, self._all_interfaces
        if self.superelements is None:
            held = self.system.block_of_dof[model.supports.prescribed]
            listed = np.flatnonzero(self._are_on(np.append(held, model.n_blocks)))
        self._supported = self._jointed(listed)  # interfaces of supported blocks and of the ground
        self.supports_move = bool(model.supports.prescribed_displacement.any())
        self._make_wall()

    @property
    def _all_interfaces(self) -> IntArray:
        return np.arange(len(self.model.interfaces.kind))

    def _blocks_of(self, prescribed: BoolArray) -> IntArray:
        """Return the blocks of some prescribed degrees of freedom."""
        return self.system.block_of_dof[self.model.supports.prescribed[prescribed]]

    def _interfaces_of(self, blocks: IntArray) -> IntArray:
        """Interfaces of some blocks, and interfaces to the ground except guides, which do not move."""
        ground = np.array([self.model.n_blocks])
        return np.flatnonzero(self._are_on(blocks) | (self._are_on(ground) & ~self.model.guides))

    def _are_on(self, bodies: IntArray) -> BoolArray:
        """Whether interfaces (m,) are on some bodies; the last one is the ground."""
        face = self.model.interfaces
        return np.isin(face.block_a, bodies) | np.isin(face.block_b, bodies)

    # -- what kernels take --------------------------------------------------------------------------------------------

    def _make_components(self) -> None:
        """Make the components that resist, and the arrays that iterations fill."""
        model, shape = self.model, self.model.interfaces.contact_area.shape
        self.steps = joint_steps(None if all_plain(model.joint_parameters) else True)
        self.components = make_components(self.system, self.steps, self.superelements, self.tolerance)
        bonds = Bonds(
            load=np.zeros(shape),
            load_at_start=np.zeros(shape),
            slides=np.zeros(shape[0], dtype=np.bool_),
            overloaded=self._all_interfaces,
        )
        size, count = model.size, shape[0]
        self._lasting: dict[str, Any] = {
            "components": self.components,
            "bonds": bonds,
            "tolerance": self.tolerance,
            "newton_iterations": self.options.newton.max_iterations,
            "line_search_iterations": self.options.newton_with_line_search.max_iterations,
            "stiffness": np.zeros((count, 9)),
            "tangent": np.zeros((count, 9)),
            "rate": np.zeros(size),
            "force": np.zeros(size),
            "room": np.empty((4, size)),
            "pairs": np.empty((4, size)),
        }

    def _elastic_stiffness(self, rest: State) -> FloatArray:
        """Return the stiffness of the interfaces of the unloaded wall (m, 9)."""
        stiffness: FloatArray = self._lasting["stiffness"]
        listed, force = self._jointed(self._all_interfaces), np.zeros(self.model.size)
        inside = self._fill(rest, force)
        add_internal_forces(self.components, inside, listed, False, rest.displacement, force, stiffness)
        stiffness[self.model.properties.gap > 0.0] = 0.0  # until it closes
        return stiffness.copy()

    def _make_wall(self) -> None:
        """Make the wall that the iterations take, with the present active fronts."""
        equations, jacks, none = self.equations, self.jacks, np.empty(0)
        if self.superelements is not None:
            active = np.append(equations.active.fronts, True)[equations.tree.superelements.front]
            self.superelements.law.blocks.condensed[:] = ~active
        condensation, moving, part = equations.condensation, self._moving, equations.active
        self.wall = Wall(
            interfaces=Interfaces(
                all=self._all_interfaces,
                active=part.interfaces,
                condensed=part.condensed_interfaces,
                jointed=self._jointed(part.interfaces),
                moving=self._jointed(part.interfaces[:0] if moving is None else moving),
            ),
            freedoms=Freedoms(
                free=self.free,
                prescribed=self.model.supports.prescribed,
                per_weight=self.per_weight,
                arms=self.system.arms,
                push=none if jacks is None else jacks.push,
                weights=none if jacks is None else jacks.weights,
            ),
            solver=equations.solver,
            condensation=Condensation.empty() if condensation is None else condensation.structure,
            solve_tangent=solve_tangent,
            **self._lasting,
        )

    def _jointed(self, interfaces: IntArray) -> IntArray:
        """Interfaces among the given ones that follow the joint law, not the law of a concrete section."""
        sections = self.model.sections
        return interfaces if sections is None else np.setdiff1d(interfaces, sections.interface)

    def _checked(self, displacement: FloatArray) -> FloatArray:
        """Displacements (size,) for kernels."""
        _require("displacements", displacement, FLOAT, self.system.arms.shape)
        return displacement

    def _fill(
        self, state: State, external: FloatArray, limit: float = np.inf, other: Ground | None = None
    ) -> WallState:
        """Structure of loads, history and grounds of a state; the next call replaces them."""
        check_time()
        ground, inside = self.model.ground.at(state.load_factor), self._inside
        for name, array in state.history._asdict().items():
            _require(name, array, FLAG if name == "cracked" else FLOAT, self.model.interfaces.contact_area.shape)
        arrays = (*map(tuple, (state.history, ground, other or ground, state.sections)), state.plastic, external)
        deflection = np.nan if self.jacks is None else self.jacks.required_deflection(state.load_factor)
        fill_state(inside, *arrays, float(state.load), float(state.load_factor), deflection, limit)
        return inside

    def _in_state(self, state: State, limit: float = np.inf, other: Ground | None = None) -> WallState:
        """Structure of a state with the present condensed fronts; the next call replaces it."""
        external = self.loads.at(state.load, state.load_factor, self.equations.condensation)
        return self._fill(state, external, limit, other)

    def _ahead(self, state: State) -> tuple[Ground | None, FloatArray]:
        """Ground, if it moves, and movement of the supports, a small step of the load factor ahead of a state."""
        ground, supports, load_factor = self.model.ground, self.model.supports, state.load_factor
        if self._moving is None:
            return None, supports.prescribed_displacement
        moved = RATE_STEP * ground.load_factor_rate(load_factor) * supports.prescribed_displacement
        return ground.at(load_factor + RATE_STEP), moved

    # -- forces -----------------------------------------------------------------------------------------------------

    def residual(self, state: State, displacement: FloatArray) -> tuple[FloatArray, float]:
        """Residual force of every degree of freedom, and its ratio; facets and yielding blocks follow."""
        force, u = np.empty_like(displacement), self._checked(displacement)
        return force, residual_from_python(_steps(), self.wall, self._in_state(state), float(state.jack), u, force)

    def newton(self, state: State, start: FloatArray, searching: bool | None = None) -> tuple[FloatArray, float]:
        """Best iterate, and its unbalanced force ratio, inf if diverged; ``searching``: with line search."""
        searching, found = self.has_potential if searching is None else searching, np.empty_like(start)
        begin, (ahead, moved) = self._checked(start), self._ahead(state)
        inside = self._in_state(state, self._divergence_limit(state), ahead)
        ratio, state.jack, completed = run_newton(
            _steps(), self.wall, inside, moved, float(state.jack), begin, found, searching
        )
        self._completed = Completed(*completed)
        within = ratio < self.tolerance and self._completed.within
        return found, np.inf if not within and self.has_diverged(state, found) else ratio

    def minimise(self, state: State, tolerance: float) -> None:
        """Minimise the potential of the Tresca problem from the displacements of the state, in place."""
        limit, u, arms = self._divergence_limit(state), state.displacement, self.system.arms
        self._minimise_within(limit, state, tolerance)
        if not (within_limit(u, self.free, arms, limit) or self.has_diverged(state)):
            # beyond the limit of rigid blocks, but within the elastic displacement
            limit += 2.0 * largest_elastic_displacement(self.model, state.load_factor)
            self._minimise_within(limit, state, tolerance)

    def _minimise_within(self, limit: float, state: State, tolerance: float) -> None:
        """Minimise the potential of the Tresca problem within a limit of displacements (m)."""
        u = self._checked(state.displacement)
        state.jack = minimise_tresca(_steps(), self.wall, self._in_state(state, limit), float(state.jack), tolerance, u)

    def with_supports_moved(self, state: State) -> FloatArray:
        """Displacements of a state, with prescribed ones as at its load factor."""
        displacement = state.displacement.copy()
        displacement[self.model.supports.prescribed] = self.model.support_displacement(state.load_factor)
        return displacement

    def forces_on_supports(self, state: State) -> FloatArray:
        """Force of joints, loads and jacks on prescribed degrees of freedom (N, N m); all others are incomplete."""
        u = self._checked(state.displacement)
        force = self.loads.at(state.load, state.load_factor, None).copy()
        inside = self._fill(state, force)
        if self.jacks is not None:
            force += state.jack * self.jacks.push
        stiffness = self._lasting["stiffness"]
        add_internal_forces(self.components, inside, self._supported, True, u, force, stiffness)
        return force

    def commit_joint_history(self, state: State, never_opened: BoolArray) -> tuple[JointEnergy, Ground]:
        """Commit the history of active joints, in place; their energy, and forces on the ground (N)."""
        condensation = self.equations.condensation
        whole = condensation is None or self.superelements is not None
        listed = self._all_interfaces if whole else self.equations.active.interfaces
        on_ground = Ground(*map(np.zeros_like, self.model.ground.full))
        u, inside = self._checked(state.displacement), self._in_state(state)
        joints = self.components.joints
        work = JointEnergy(*self.steps.commit_history(joints, inside, listed, u, never_opened, *on_ground))
        stored = work.stored
        if condensation is not None and self.superelements is None:
            stored += condensation.elastic_energy(u, state.load, state.load_factor)
        if self.model.elastic is not None:  # strains in active fronts: the energy of condensed ones is included
            strain = np.zeros_like(state.displacement)
            strain[self.free] = state.displacement[self.free]
            stored += 0.5 * float(self.system.strain_stiffness @ strain[self.system.strain_dofs] ** 2)
        return work._replace(stored=stored), on_ground

    def contact_stresses(self, state: State) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Opening (m), normal and shear stress (Pa) of all contacts (m, q); linear in sections of a footing."""
        opening, sigma, tau = np.empty((3, *self.bond_load.shape))
        u, inside = self._checked(state.displacement), self._in_state(state)
        self.steps.contact_stresses(self.components.joints, inside, u, opening, sigma, tau)
        if self.model.sections is not None:
            set_linear_stresses(self.model, self.section_response(state), sigma, tau)
        return opening, sigma, tau

    def section_response(self, state: State) -> FloatArray:
        """Opening, shear (m), rotation, axial and shear force (N) and moment (N m) of cracking sections (s, 6)."""
        inside, u = self._in_state(state), self._checked(state.displacement)
        values = np.empty((len(state.sections.cracked), 6))
        joints, footing = self.components.joints, self.components.footing
        force, stiffness = np.zeros_like(u), np.zeros_like(self._lasting["stiffness"])
        fill_section_values(footing, inside, joints, u, force, stiffness, values)
        return values

    def commit_sections(self, state: State) -> None:
        """Commit the history variables of the footing's sections to an equilibrium."""
        inside, u = self._in_state(state), self._checked(state.displacement)
        commit_section_history(self.components.footing, inside, self.components.joints, u)

    def joint_law_violation(self, state: State, normal_stress: FloatArray, shear_stress: FloatArray) -> float:
        """Return the largest stress by which stresses (m, q) violate the joint law (Pa)."""
        inside = self._in_state(state)
        return float(self.steps.law_violation(self.components.joints, inside, normal_stress, shear_stress))

    def load_increment(self, load: float, load_factor: float) -> FloatArray:
        """Force of a step by loads, jacks, and ground and supports at the last ``wall.rate`` (N, N m)."""
        loads, force = self.loads, load_factor * self._lasting["rate"]
        if load != 0.0:
            force += load * loads.dead
        if loads.grows:
            force += load_factor * loads.live
        if self.jacks is not None and self.jacks.by_load:
            force += load_factor * (self.jacks.load_at(1.0, 0.0) - self.jacks.load_at(0.0, 0.0)) * self.jacks.push
        if (superelement := self.equations.condensation) is not None and (load != 0.0 or loads.grows):
            force[superelement.boundary_dofs] += superelement.load(load, load_factor)
        return force

    def predict(self, state: State, target: Point) -> tuple[FloatArray, float]:
        """Displacements at a target by the last tangent, and the share of the step at which the next bond fails.

        Of plain joints, bonds of condensed fronts do not count: where one fails first, the step to it is found by
        interpolation. Paths of softening joints amplify the difference.
        """
        increment = self.load_increment(target[0] - state.load, target[1] - state.load_factor)
        start, prescribed = self._checked(state.displacement), self.model.support_displacement(target[1])
        ahead = replace(state, load=target[0], load_factor=target[1], displacement=np.empty_like(start))
        inside = self._in_state(ahead, self._divergence_limit(ahead), self.model.ground.at(state.load_factor))
        found, aim = ahead.displacement, PREDICTOR_AIM
        within, share = predict(_steps(), self.wall, inside, increment, prescribed, start, found, not self.plain, aim)
        if within:
            return found, float(share)
        self.complete(ahead)
        if self.has_diverged(ahead):
            return start, 1.0
        return found, self.event_share(state, aim, active_only=self.plain)

    def largest_bond_load(self, state: State) -> float:
        """Largest bond load of the equilibrium just completed, 1 at the strength; ``bond_load`` has all."""
        if not self.plain:
            u, inside = self._checked(state.displacement), self._in_state(state)
            active = self.equations.active.interfaces
            load = float(fill_bond_loads(self.components, inside, active, u, self.bond_load))
            self._completed = self._completed._replace(bond_load=load)
        return max(self._completed.bond_load, self._completed.condensed_load)

    def event_share(self, state: State, aim: float, active_only: bool = False) -> float:
        """Share of a step from a state at which the first bond fails, by interpolation to ``bond_load`` at its end."""
        listed = self.equations.active.interfaces if active_only else self._all_interfaces
        u, inside = self._checked(state.displacement), self._in_state(state)
        history, ground = inside.history, inside.ground
        return float(interpolate_event(self.wall.bonds, self.components, history, ground, listed, u, aim))

    def has_diverged(self, state: State, displacement: FloatArray | None = None) -> bool:
        """Whether displacements, by default of the state, are beyond any equilibrium that is sought."""
        displacement = state.displacement if displacement is None else displacement
        limit, arms = self._divergence_limit(state), self.system.arms
        if within_limit(displacement, self.free, arms, limit):
            return False
        limit += 2.0 * largest_elastic_displacement(self.model, state.load_factor)
        return not within_limit(displacement, self.free, arms, limit)

    def _divergence_limit(self, state: State) -> float:
        """Displacement beyond which no equilibrium is sought, unless the elastic wall moves farther (m)."""
        at_start, allowed = self._detachment_limit
        return at_start + DIVERGENCE_DISPLACEMENT * allowed.at(state.load_factor)

    # -- linearisation ----------------------------------------------------------------------------------------------

    def store_tangent(self, state: State, displacement: FloatArray) -> None:
        """Store the tangent of the last residual, which must be at these displacements, for the next prediction."""
        u, (ahead, moved) = self._checked(displacement), self._ahead(state)
        store_tangent(self.wall, self._in_state(state, other=ahead), moved, u)

    def volume_per_deflection(self) -> float | None:
        """Volume that the jacks take per deflection with the last tangent (1); None: given load, or no bending."""
        if self.jacks is None or self.jacks.by_load:
            return None
        self.equations.update(self._lasting["tangent"])
        push_response = self.equations.solve(self.jacks.push)
        deflection, volume = float(self.jacks.weights @ push_response), float(self.jacks.push @ push_response)
        return volume / deflection if deflection > 0.0 else None

    # -- Tresca problem and condensation ----------------------------------------------------------------------------

    def update_tresca_bounds(self, state: State, relaxation: float) -> None:
        """Move the bounds of the Tresca problem by a share of the way to Coulomb's limits at a state."""
        u, inside = self._checked(state.displacement), self._in_state(state)
        joints, bounds = self.components.joints, self.components.bounds
        active = self.equations.active.interfaces
        self.steps.update_tresca_bounds(joints, inside, bounds, active, u, relaxation)

    def uncondense(self, fronts: BoolArray) -> None:
        """Make some fronts (F,) and their ancestors active too; all others are elastic and condensed."""
        equations, wanted = self.equations, fronts | self._never_condensed
        if self.superelements is not None:
            wanted |= equations.tree.fronts_of_superelements(self.superelements.active)
        if self.condensed:
            wanted |= equations.active.fronts
        if not self.condensed or (wanted & ~equations.active.fronts).any():
            equations.condense(wanted, self.loads.dead, self.loads.live)
            self._make_wall()

    def uncondense_interfaces(self, interfaces: BoolArray | IntArray) -> None:
        """Make the fronts of some interfaces and of active deformable blocks active."""
        equations = self.equations
        if self.condensed and self.superelements is None and equations.are_active(interfaces):
            return
        self.uncondense(equations.tree.fronts_of(interfaces))

    def inelastic_fronts(self, state: State) -> BoolArray | None:
        """Condensed fronts (F,) with sliding joints or yielding blocks (then active), or None."""
        tree, condensed = self.equations.tree, self.equations.active.condensed_interfaces
        slides = self.condensed and self._completed.sliding > 0
        if (blocks := self.superelements) is None and not slides:
            return None
        found = np.zeros(tree.count, dtype=np.bool_)
        if slides:
            found |= tree.fronts_of(condensed[self.wall.bonds.slides[condensed]])
        if blocks is not None:
            found |= tree.fronts_of_superelements(blocks.activate_yielding(state.displacement, state.plastic))
        return found if found.any() else None

    def complete(self, state: State) -> None:
        """Recover condensed fronts and the inside of blocks in the displacements of a state; fill bond loads."""
        self._completed = Completed(*complete(self.wall, self._in_state(state), self._checked(state.displacement)))


class JointEnergy(NamedTuple):
    """Work of the joints, from rest or since the last commit (J)."""

    friction: float  # dissipated since the last commit; the last in tension by bonds that soften by slip
    crushing: float
    mode_1_dissipation: float
    stored: float  # elastic energy, and accumulated softening work of all other bonds
    softened: float
