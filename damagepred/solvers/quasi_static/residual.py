"""Residual force of a wall at a given load and movement, its linearisation, and condensed elastic courses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from damagepred.arrays import BoolArray, FloatArray, IntArray
from damagepred.assembly import Model
from damagepred.kernels.concrete_section.forces import section_forces
from damagepred.kernels.interface.checks import farthest_sliding as farthest_sliding_level
from damagepred.kernels.interface.internal_force import joint_forces, update_tresca_bounds
from damagepred.kernels.interface.residual import combine_loads, free_residual, within_limit
from damagepred.kernels.joint.limits import NO_LIMIT
from damagepred.solvers.options import DEFAULTS, SolverOptions
from damagepred.solvers.quasi_static.jacks import JackControl
from damagepred.solvers.quasi_static.linear_system import BlockTridiagonalSystem
from damagepred.solvers.quasi_static.superelements import Superelements
from damagepred.solvers.state.wall_state import State
from damagepred.solvers.system.collapse_criterion import DetachmentLimit, largest_elastic_displacement
from damagepred.solvers.system.discrete_system import DiscreteSystem


class Residual:
    """Residual force of a wall with condensed elastic courses, and its linearisation.

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
        self.return_mapping = options.return_mapping.for_kernels(model.joint_parameters)
        self.system = DiscreteSystem.of(model, options.elastic_solution)
        self.dead_load, self.live_load = self.system.dead_load, self.system.live_load
        self.jacks, self.superelements = JackControl.of(model), None
        if model.mesh is not None:
            self.superelements = Superelements(self.system, options.newton.interior_tolerance)
            self.dead_load, self.live_load = self.superelements.condensed_loads
        self.weight = model.mean_block_weight
        self.arms = self.system.arms
        self.per_weight = 1.0 / self.system.residual_scale
        self.newton_iterations = 0
        shape = model.interfaces.contact_area.shape
        self.force = np.zeros(self.dead_load.size)
        self.stiffness = np.zeros((shape[0], 9))
        all_interfaces = self._all_interfaces = np.arange(shape[0])
        self._in_section = np.zeros(shape[0], dtype=np.bool_)
        if model.sections is not None:
            self._in_section[model.sections.interface] = True
        self.tresca = (np.full(shape, NO_LIMIT), np.zeros(shape), np.zeros(shape))
        rest = State.rest(model)
        self._joint_forces(all_interfaces, rest, rest.displacement, coulomb=False)
        self.stiffness[model.properties.gap > 0.0] = 0.0  # until it closes
        self.tangent = self.stiffness.copy()
        self.equations = BlockTridiagonalSystem(
            self.system, self.stiffness.copy(), self.superelements, options.linear_system
        )
        self.rate = np.zeros(self.dead_load.size)
        supports = model.supports
        moves = supports.prescribed_displacement != 0.0
        # forces inside deformable blocks may depend on the load factor
        self._no_imposed_movement = self.superelements is None and not (moves.any() or model.ground.moves)
        self._moving_interfaces = (
            all_interfaces[:0] if self._no_imposed_movement else self._interfaces_of(self._blocks_of(moves))
        )
        if model.is_strained:
            self._moving_interfaces = all_interfaces
        # condensed courses have fixed supports, and no load but dead and live ones
        displaced = self._blocks_of(moves | (supports.start != 0.0))
        if self.jacks is not None and model.footing is None:  # a footing is never condensed
            acting = np.flatnonzero((self.jacks.push != 0.0) | (self.jacks.weights != 0.0))
            displaced = np.append(displaced, self.system.block_of_dof[acting])
        self._farthest_displaced_level = 0
        if displaced.size:
            beside = self._interfaces_of(displaced, ground=False)
            self._farthest_displaced_level = int(self.equations.layout.interface_level[beside].max(initial=0))
        if model.is_strained:
            self._farthest_displaced_level = int(self.equations.layout.interface_level.max(initial=0))
        self.store_tangent(rest, rest.displacement)
        self.free = np.zeros(self.dead_load.size, dtype=np.bool_)
        self.free[self.equations.active_dofs] = True
        self._detachment_limit = DetachmentLimit.of(model)
        self._initial_support_displacement = float(np.abs(supports.start).max(initial=0.0))

    def _blocks_of(self, prescribed: BoolArray) -> IntArray:
        """Return the blocks of some prescribed degrees of freedom."""
        return self.system.block_of_dof[self.model.supports.prescribed[prescribed]]

    def _interfaces_of(self, blocks: IntArray, ground: bool = True) -> IntArray:
        """Return the interfaces of some blocks, with those to the ground if asked for."""
        face, listed = self.model.interfaces, np.append(blocks, self.model.n_blocks) if ground else blocks
        return np.flatnonzero(np.isin(face.block_a, listed) | np.isin(face.block_b, listed))

    @property
    def condensed(self) -> bool:
        """Whether elastic courses are condensed."""
        return self.equations.condensation is not None

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
                model.interface_records,
                model.joint_parameters,
                displacement,
                self.force,
                self.stiffness,
            )
        joint_forces(
            active,
            model.interface_records,
            model.joint_parameters,
            self.return_mapping,
            model.ground.at(state.load_factor),
            state.history,
            self.tresca,
            coulomb,
            displacement,
            self.force,
            self.stiffness,
        )
        if model.elastic is not None:
            strains = self.system.strain_dofs
            self.force[strains] -= self.system.strain_stiffness * displacement[strains]
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
        if (superelement := self.equations.condensation) is not None:
            self.force[superelement.boundary_dofs] += superelement.force(displacement, state.load, state.load_factor)
        # NaN must not pass for balance; forces of a block that finds no equilibrium inside are NaN, too
        force = np.empty_like(self.force)
        ratio = free_residual(self.force, self.free, self.per_weight, force)
        if self.superelements is not None:
            ratio = max(ratio, self.superelements.largest_block_resultant(force) / self.weight)
        if coulomb and self.jacks is not None:
            # the constraint on the deflection, so scaled that both tolerances are met together
            missing = abs(self.missing_deflection(state, displacement))
            constraint = missing / self.options.jacks.deflection_tolerance * self.tolerance
            ratio = max(ratio, constraint if np.isfinite(constraint) else np.inf)
        return force, ratio

    def _loads(self, state: State) -> None:
        """Set the residual force to the external loads."""
        combine_loads(self.dead_load, self.live_load, state.load, state.load_factor, self.force)
        if self.jacks is not None:
            self.force += state.jack * self.jacks.push

    def missing_deflection(self, state: State, displacement: FloatArray) -> float:
        """Return the missing deflection of jacks whose deflection is given (m).

        Parameters
        ----------
        state : State
            Its load factor counts.
        displacement : array (size,)
            Of all degrees of freedom.
        """
        return 0.0 if self.jacks is None else self.jacks.missing_deflection(state.load_factor, displacement)

    def forces(self, state: State) -> FloatArray:
        """Return the force of joints and loads on all degrees of freedom, prescribed and condensed ones included."""
        self._loads(state)
        self._joint_forces(self._all_interfaces, state, state.displacement, coulomb=True)
        return self.force

    def condensed_energy(self, state: State) -> tuple[IntArray, float]:
        """Return the active interfaces, and the elastic energy of condensed levels and of strained elastic blocks (J).

        Condensed levels are in equilibrium with their loads f: they store (f u - F u_b) / 2 with the force F and the
        displacements u_b on the boundary level. With deformable blocks all interfaces are returned.
        """
        superelement, u, by_strain = self.equations.condensation, state.displacement, 0.0
        if self.model.elastic is not None:  # those of active levels
            strains = self.system.strain_dofs
            by_strain = 0.5 * float(self.system.strain_stiffness @ (u[strains] ** 2 * self.free[strains]))
        if superelement is None or self.superelements is not None:
            return self._all_interfaces, by_strain
        load_work = superelement.load_work(u, state.load, state.load_factor)
        boundary_work = superelement.force(u, state.load, state.load_factor) @ u[superelement.boundary_dofs]
        return self.equations.active, by_strain + 0.5 * (load_work - float(boundary_work))

    def load_increment(self, load: float, load_factor: float) -> FloatArray:
        """Return the force increment of a step, with sliding joints as in the last equilibrium (N, N m).

        Parameters
        ----------
        load, load_factor : float
            Increments of dead load and movement (1).
        """
        force = load * self.dead_load + load_factor * self.rate
        if (superelement := self.equations.condensation) is not None:
            force[superelement.boundary_dofs] += superelement.load(load, load_factor)
        return force

    def has_diverged(self, state: State, displacement: FloatArray | None = None) -> bool:
        """Return whether displacements are so large that no equilibrium is sought any more.

        Parameters
        ----------
        state : State
            Its load factor counts.
        displacement : array (size,), optional
            Of all degrees of freedom; by default the state's own.
        """
        displacement = state.displacement if displacement is None else displacement
        allowed = self._detachment_limit.at(state.load_factor)
        limit = self._initial_support_displacement + self.options.newton.divergence_displacement * allowed
        if within_limit(displacement, self.free, self.arms, limit):
            return False
        limit += 2.0 * largest_elastic_displacement(self.model, state.load_factor)
        return not within_limit(displacement, self.free, self.arms, limit)

    # -- linearisation ----------------------------------------------------------------------------------------------

    def store_tangent(self, state: State, displacement: FloatArray) -> None:
        """Store the tangent stiffness and the force per load factor for the predictor.

        Parameters
        ----------
        state : State
            Load, load factor and history of an equilibrium.
        displacement : array (size,)
            Its displacements.
        """
        self.tangent[self.equations.active] = self.stiffness[self.equations.active]
        self.rate = self.live_load.copy()
        if not self._no_imposed_movement:
            self.rate += self._joint_rate(state, displacement)
        if self.jacks is not None and self.jacks.by_load:
            self.rate += (self.jacks.load_at(1.0, 0.0) - self.jacks.load_at(0.0, 0.0)) * self.jacks.push

    def _joint_rate(self, state: State, displacement: FloatArray) -> FloatArray:
        """Return the force per load factor of moving ground and supports, by a forward difference."""
        supports, step = self.model.supports, self.options.newton.finite_difference_step
        perturbed = replace(state, load_factor=state.load_factor + step, displacement=displacement.copy())
        moved = step * self.model.ground.load_factor_rate(state.load_factor)
        perturbed.displacement[supports.prescribed] += moved * supports.prescribed_displacement
        self.force[:] = 0.0
        self._joint_forces(self._moving_interfaces, state, displacement, coulomb=True)
        before = self.force.copy()
        self.force[:] = 0.0
        self._joint_forces(self._moving_interfaces, perturbed, perturbed.displacement, coulomb=True)
        return (self.force - before) / step

    def solve(self, stiffness: FloatArray, force: FloatArray, missing_deflection: float) -> tuple[FloatArray, float]:
        """Solve the linear system, bordered by the condition on the deflection where jacks are controlled by it.

        Parameters
        ----------
        stiffness : array (m, 9)
            Of the joints.
        force : array (size,)
            Right-hand side (N, N m).
        missing_deflection : float
            Residual of that condition (m).

        Returns
        -------
        tuple of array (size,), float
            Displacements (m, rad) and load of each jack (N).
        """
        self.equations.update(stiffness)
        self.newton_iterations += 1
        if self.jacks is None or self.jacks.by_load:
            return self.equations.solve(force), 0.0
        responses = self.equations.solve(np.stack((force, self.jacks.push)))
        return self.jacks.bordered_step(responses[0], responses[1], missing_deflection)

    def volume_per_deflection(self) -> float | None:
        """Return the sum of the jacks' lifts, the volume they take, per deflection with the last tangent (1).

        None where their load is given, or where they do not bend the footing.
        """
        if self.jacks is None or self.jacks.by_load:
            return None
        self.equations.update(self.tangent)
        push_response = self.equations.solve(self.jacks.push)
        deflection, volume = float(self.jacks.weights @ push_response), float(self.jacks.push @ push_response)
        return volume / deflection if deflection > 0.0 else None

    # -- Tresca problem and condensation ----------------------------------------------------------------------------

    def update_tresca_bounds(self, state: State, relaxation: float) -> None:
        """Move the bounds of the Tresca problem towards Coulomb's limits at the displacements of a state.

        Parameters
        ----------
        state : State
            Displacements and history.
        relaxation : float
            Share of the way (1).
        """
        model = self.model
        update_tresca_bounds(
            self.equations.active,
            model.interface_records,
            model.joint_parameters,
            self.return_mapping,
            model.ground.at(state.load_factor),
            state.history,
            state.displacement,
            self.tresca,
            relaxation,
        )

    def uncondense_up_to(self, level: int) -> None:
        """Make all joints up to a level active; courses beyond it stay elastic and condensed."""
        level = max(level, self._farthest_displaced_level)
        if level + 1 > self.equations.active_levels or not self.condensed:
            self.equations.condense(level + 1, self.dead_load, self.live_load)
            self.free[:] = False
            self.free[self.equations.active_dofs] = True

    def uncondense_interfaces(self, interfaces: BoolArray | IntArray) -> None:
        """Make all levels up to the farthest of some interfaces and of active deformable blocks active."""
        self.uncondense_up_to(
            int(self.equations.layout.interface_level[interfaces].max(initial=self._farthest_active_block()))
        )

    def farthest_sliding(self, state: State) -> int:
        """Return the farthest level at which a condensed joint would slide; -1 if none does."""
        if not self.condensed:
            return -1
        model, equations = self.model, self.equations
        farthest = farthest_sliding_level(
            equations.condensed_interfaces,
            equations.layout.interface_level,
            model.interface_records,
            model.joint_parameters,
            self.return_mapping,
            model.ground.at(state.load_factor),
            state.history,
            state.displacement,
        )
        return int(farthest)

    def farthest_yielding(self, state: State) -> int:
        """Uncondense deformable blocks that would yield; return the farthest level of these, -1 if none does."""
        if self.superelements is None:
            return -1
        opened = self.superelements.activate_yielding(state.displacement, state.load, state.load_factor, state.plastic)
        return int(self.equations.layout.superelement_level[opened].max(initial=-1))

    def _farthest_active_block(self) -> int:
        """Return the farthest level of an uncondensed deformable block; 0 if there is none."""
        listed = np.empty(0, np.int64) if self.superelements is None else self.superelements.active
        return int(self.equations.layout.superelement_level[listed].max(initial=0))

    def complete(self, state: State, displacement: FloatArray | None = None) -> None:
        """Recover the displacements of condensed courses, and those inside deformable blocks.

        Parameters
        ----------
        state : State
            Load, load factor and history.
        displacement : array (size,), optional
            Changed; by default the state's own.
        """
        u = state.displacement if displacement is None else displacement
        if (superelement := self.equations.condensation) is not None:
            superelement.recover(u, state.load, state.load_factor)
        if self.superelements is not None:
            self.superelements.recover(u, state.load, state.load_factor, state.plastic)
