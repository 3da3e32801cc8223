"""Residual force of a wall at a given load and movement, its linearisation, and condensed elastic parts."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from damagepred.arrays import BoolArray, FloatArray, IntArray
from damagepred.assembly import Model
from damagepred.assembly.model import Ground
from damagepred.kernels.concrete_section.forces import section_forces
from damagepred.kernels.equilibrium.completion import complete, store_tangent
from damagepred.kernels.equilibrium.joints import JOINT_UNITS
from damagepred.kernels.equilibrium.newton import (
    newton,
    newton_with_line_search,
    run_newton,
    run_newton_with_line_search,
)
from damagepred.kernels.equilibrium.predictor import interpolate_event, predict
from damagepred.kernels.equilibrium.problem import (
    PARAMETERS,
    bordered_step,
    compute_bordered_step,
    compute_residual,
    compute_step,
    with_constraint,
)
from damagepred.kernels.equilibrium.tresca import minimise, minimise_tresca
from damagepred.kernels.interface.residual import free_residual, within_limit
from damagepred.kernels.jit import Unit
from damagepred.kernels.joint.limits import NO_LIMIT
from damagepred.kernels.linear.condensation import elastic_energy, recover, subtract_boundary_forces
from damagepred.kernels.linear.system import solve_tangent
from damagepred.solvers.options import DEFAULTS, SolverOptions
from damagepred.solvers.quasi_static.jacks import JackControl
from damagepred.solvers.quasi_static.linear_system import MultifrontalSystem
from damagepred.solvers.quasi_static.static_condensation import StaticCondensation
from damagepred.solvers.quasi_static.superelements import Superelements
from damagepred.solvers.quasi_static.wall_table import WallTable
from damagepred.solvers.state.wall_state import Point, State
from damagepred.solvers.system.collapse_criterion import DetachmentLimit, largest_elastic_displacement
from damagepred.solvers.system.discrete_system import DiscreteSystem
from damagepred.time_limit import check_time


class Residual:
    """Residual force of a wall with condensed elastic parts, and its linearisation.

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
        self.plain = self.return_mapping.general is None
        self.system = DiscreteSystem.of(model, options.elastic_solution)
        self.dead_load, self.live_load = self.system.dead_load, self.system.live_load
        self.jacks, self.superelements = JackControl.of(model), None
        if model.mesh is not None:
            self.superelements = Superelements(self.system, options.newton.interior_tolerance)
            self.dead_load, self.live_load = self.superelements.condensed_loads
        self.weight, self._has_live_load = model.mean_block_weight, bool(self.live_load.any())
        self.per_weight = 1.0 / self.system.residual_scale
        shape = model.interfaces.contact_area.shape
        all_interfaces = self._all_interfaces = np.arange(shape[0])
        self.tresca = (np.full(shape, NO_LIMIT), np.zeros(shape), np.zeros(shape))
        self.bond_load: FloatArray = np.zeros(shape)
        rest, self.tangent = State.rest(model), np.zeros((shape[0], 9))
        elastic = self._elastic_stiffness(rest)
        self.tangent[:] = elastic
        self.equations = MultifrontalSystem(self.system, elastic, self.superelements, options.linear_system)
        supports = model.supports
        moves = supports.prescribed_displacement != 0.0
        # forces inside deformable blocks may depend on the load factor
        self._no_imposed_movement = self.superelements is None and not (moves.any() or model.ground.moves)
        self._moving_interfaces = (
            all_interfaces[:0] if self._no_imposed_movement else self._interfaces_of(self._blocks_of(moves))
        )
        if model.is_strained:
            self._moving_interfaces = all_interfaces
        # condensed fronts have fixed supports, and no load but dead and live ones
        displaced = self._blocks_of(moves | (supports.start != 0.0))
        if self.jacks is not None:
            acting = np.flatnonzero((self.jacks.push != 0.0) | (self.jacks.weights != 0.0))
            displaced = np.append(displaced, self.system.block_of_dof[acting])
        if model.footing is not None:
            displaced = np.append(displaced, model.footing)
        tree = self.equations.tree
        self._never_condensed = tree.fronts_of(self._interfaces_of(displaced))
        self._never_condensed[:1] = True
        if self.superelements is not None:
            self._never_condensed |= tree.fronts_of_superelements(np.isin(self.superelements.block, displaced))
        if model.is_strained:
            self._never_condensed[:] = True
        self._detachment_limit = DetachmentLimit.of(model)
        self._initial_support_displacement = float(np.abs(supports.start).max(initial=0.0))
        self._find_supports()
        self._set_problem()
        self._stiffness[:] = elastic
        self.store_tangent(rest, rest.displacement)

    @property
    def newton_iterations(self) -> int:
        """Number of Newton iterations so far."""
        return int(self.equations.tangent["iterations"])

    def change_model(self, model: Model) -> None:
        """Continue with other supports of the same stiffness."""
        self.model = model
        self._find_supports()
        self.table = self._make_table()
        self._set_problem()

    def _blocks_of(self, prescribed: BoolArray) -> IntArray:
        """Return the blocks of some prescribed degrees of freedom."""
        return self.system.block_of_dof[self.model.supports.prescribed[prescribed]]

    def _interfaces_of(self, blocks: IntArray) -> IntArray:
        """Return the interfaces of some blocks, and those to the ground but for guides, which do not move."""
        ground = np.array([self.model.n_blocks])
        return np.flatnonzero(self._are_on(blocks) | (self._are_on(ground) & ~self.model.guides))

    def _are_on(self, bodies: IntArray) -> BoolArray:
        """Whether interfaces (m,) are on some bodies; the last one is the ground."""
        face = self.model.interfaces
        return np.isin(face.block_a, bodies) | np.isin(face.block_b, bodies)

    def _find_supports(self) -> None:
        """Find the interfaces that act on ground and prescribed degrees of freedom; all if blocks are deformable."""
        supports, self._support_interfaces = self.model.supports, self._all_interfaces
        self.supports_move = bool(supports.prescribed_displacement.any())
        if self.superelements is None:
            held = self.system.block_of_dof[supports.prescribed]
            self._support_interfaces = np.flatnonzero(self._are_on(np.append(held, self.model.n_blocks)))

    @property
    def has_potential(self) -> bool:
        """Whether residual forces of the elastic wall are the slope of a potential, and a line search leads down it.

        Jacks do no work on the deflection that controls them: under them only a wall of given load has one.
        """
        return self.jacks is None or self.jacks.by_load

    @property
    def condensed(self) -> bool:
        """Whether elastic parts are condensed."""
        return self.equations.condensation is not None

    # -- what kernels take --------------------------------------------------------------------------------------------

    def _elastic_stiffness(self, rest: State) -> FloatArray:
        """Return the stiffness of the interfaces of the unloaded wall (m, 9)."""
        size = self.dead_load.size
        self._force, self._stiffness = np.zeros(size), np.zeros((len(self._all_interfaces), 9))
        self._external, self._room, self._rate = np.zeros(size), np.empty((4, size)), np.zeros(size)
        self._slides = np.zeros(len(self._all_interfaces), dtype=np.bool_)
        self._loads_set: tuple[object, ...] = ()
        self._parameters = _parameters_of(self.options, self.tolerance)
        self._compiled = self.superelements is None and self.model.sections is None
        self.table = self._make_table()
        self._set_loads(rest)
        self._forces_at(self._all_interfaces, rest, rest.displacement, 0.0, coulomb=False)
        self._stiffness[self.model.properties.gap > 0.0] = 0.0  # until it closes
        return self._stiffness.copy()

    def _make_table(self) -> WallTable:
        """Make the table that kernels take, at rest."""
        model, system, jacks, none = self.model, self.system, self.jacks, np.empty(0)
        records, elastic, own = model.interface_records, model.interfaces.elastic, self._room[0]
        strains = {} if elastic is None else {"side_dof": elastic.dof, "side_rows": elastic.rows}
        self._units = JOINT_UNITS[self.return_mapping.general, None if elastic is None else True]
        mapping = {name: value for name, value in self.return_mapping._asdict().items() if name != "general"}
        ground = model.ground.at(0.0)
        table = WallTable(
            external=self._external,
            force=self._force,
            stiffness=self._stiffness,
            strain_stiffness=system.strain_stiffness,
            first_strain=system.strain_dofs.start,
            per_weight=self.per_weight,
            arms=system.arms,
            push=none if jacks is None else jacks.push,
            weights=none if jacks is None else jacks.weights,
            deflection=np.nan,
            edge=records.edge,
            contact_offset=records.contact_offset,
            contact_area=records.contact_area,
            properties=model.joint_parameters,
            **dict.fromkeys(("displacement", "residual", "step", "start", "best"), own),
            room=self._room,
            tangent=self.tangent,
            rate=self._rate,
            moving=self._all_interfaces[:0],
            normal_ahead=ground.normal,
            shear_ahead=ground.shear,
            rate_step=self.options.newton.finite_difference_step,
            prescribed=model.supports.prescribed,
            prescribed_step=model.supports.prescribed_displacement,
            bond_load=self.bond_load,
            bond_load_at_start=np.zeros_like(self.bond_load),
            room_joints=np.empty_like(self._all_interfaces),
            all_joints=self._all_interfaces,
            bond_loads=self._units.bond_loads.address,
            interpolate_event=interpolate_event.address,
            elastic_energy=elastic_energy.address,
            overload_tolerance=self.options.continuation.overload_tolerance,
            event_tolerance=self.options.continuation.event_tolerance,
            weak_bond_overload=self.options.continuation.weak_bond_overload,
            slides=self._slides,
            ground_normal=ground.normal,
            ground_shear=ground.shear,
            **dict(zip(("tresca_bound", "tresca_dilatant_opening", "tresca_kappa"), self.tresca)),
            **strains,
            **mapping,
            block_stress=model.block_stress,
            # a bond without strength breaks at the first tension: one that balance, to its tolerance, does not explain
            no_strength=self.tolerance * model.block_stress,
            add_joint_forces=self._units.add_joint_forces.address,
        )
        table.fill(**State.rest(model).history._asdict())
        return table

    def _set_problem(self) -> None:
        """Set what the iterations take, with the present active fronts."""
        equations = self.equations
        if self.superelements is not None:
            active = np.append(equations.active_fronts, True)[equations.tree.superelement_front]
            self.superelements.set_condensed(~active)
        self.free = equations.active_dofs
        superelement = None if self.superelements is not None else self.equations.condensation
        self.table.fill(condensation=0 if superelement is None else superelement.address)
        if self._compiled:
            self.table.fill(
                free=self.free,
                moving=self._moving_interfaces,
                bonds_of_all=not self.plain,
                condensed=equations.condensed_interfaces,
                here=self.table.address,
                system=equations.address,
                parameters=self._parameters.ctypes.data,
                subtract_boundary_forces=subtract_boundary_forces.address,
                compute_residual=compute_residual.address,
                compute_step=compute_step.address,
                compute_bordered_step=0 if self.jacks is None else compute_bordered_step.address,
                solve_tangent=solve_tangent.address,
                store_tangent=store_tangent.address,
                complete=complete.address,
                recover=recover.address,
                check_condensed=self._units.check_condensed.address,
            )

    def _joints(self, interfaces: IntArray) -> IntArray:
        """Return those of some interfaces that follow the joint law, not that of a concrete section."""
        sections = self.model.sections
        return interfaces if sections is None else np.setdiff1d(interfaces, sections.interface)

    # -- forces -----------------------------------------------------------------------------------------------------

    def _set_loads(self, state: State, condensation: StaticCondensation | None = None) -> None:
        """Set the external load to that of a state, with that of condensed fronts, without the load of jacks."""
        loads = state.load, state.load_factor if self._has_live_load else 0.0, condensation
        if loads == self._loads_set:
            return
        np.multiply(self.dead_load, state.load, out=self._external)
        if self._has_live_load:
            self._external += state.load_factor * self.live_load
        if condensation is not None:
            self._external[condensation.boundary_dofs] += condensation.load(state.load, state.load_factor)
        self._loads_set = loads

    def evaluate_joints(
        self,
        unit: str,
        interfaces: IntArray | None,
        state: State,
        displacement: FloatArray | None = None,
        **entries: Any,
    ) -> np.void:
        """Run a unit of the joints at a state; return the table with its results.

        Parameters
        ----------
        unit : str
            Name of one of ``JointUnits``.
        interfaces : array of int or None
            Interfaces that it works on; None: all.
        state : State
            Load factor and history; the latter is updated by a commit.
        displacement : array (size,), optional
            Of all degrees of freedom; by default those of the state.
        **entries
            Other entries of the table.
        """
        at = state.displacement if displacement is None else displacement
        self.table.set_state(state.history, self.model.ground.at(state.load_factor))
        listed = self._all_interfaces if interfaces is None else interfaces
        return self.table.run(getattr(self._units, unit), listed, at, **entries)

    def _add_forces(self, interfaces: IntArray, state: State, displacement: FloatArray, coulomb: bool) -> None:
        """Add forces of joints, sections and deformable blocks to the residual, and set joint tangents."""
        model, superelements = self.model, self.superelements
        if superelements is not None:
            superelements.place_facets(displacement)
            self._force[superelements.facet_dofs] = 0.0
        if model.sections is not None:
            section_forces(
                model.sections,
                state.sections,
                model.interface_records,
                model.joint_parameters,
                displacement,
                self._force,
                self._stiffness,
            )
        listed = self._joints(interfaces)
        self.evaluate_joints("add_joint_forces", listed, state, displacement=displacement, coulomb=coulomb)
        if superelements is not None:
            superelements.scatter_facet_forces(self._force)
            condensed_too = interfaces is self._all_interfaces
            superelements.add_internal_forces(
                state.load, state.load_factor, displacement, state.plastic, self._force, condensed_too
            )

    def _iterate(
        self,
        unit: Unit,
        state: State,
        start: FloatArray,
        best: FloatArray,
        stiffness: FloatArray | None = None,
        **entries: Any,
    ) -> np.void:
        """Run compiled iterations from a start, under the loads of a state; return the table with their results.

        Their first tangent is that of a stiffness of the interfaces, by default that at the last residual.
        """
        check_time()
        condensation = self.equations.condensation
        self._set_loads(state, condensation)
        if condensation is not None:
            condensation.set_loads(state.load, state.load_factor)
        self.table.set_state(state.history, self.model.ground.at(state.load_factor))
        if self.jacks is not None:
            entries["deflection"] = self.jacks.required_deflection(state.load_factor)
        self.equations.update(self._stiffness if stiffness is None else stiffness)
        self.equations.prepare()
        return self.table.iterate(unit, self.equations.active, start, best, jack=state.jack, **entries)

    def _interpreted(self, state: State) -> _InterpretedProblem:
        """Set the loads of a state; return the problem for iterations in Python."""
        check_time()
        self._set_loads(state, self.equations.condensation)
        return _InterpretedProblem(self, state)

    def residual(self, state: State, displacement: FloatArray) -> tuple[FloatArray, float]:
        """Return the residual force of every degree of freedom, and the unbalanced force ratio.

        Parameters
        ----------
        state : State
            Load, load factor and history.
        displacement : array (size,)
            Of all degrees of freedom; facets and the inside of yielding blocks are updated.
        """
        force = np.empty_like(displacement)
        if not self._compiled:
            return force, self._interpreted(state).residual(state.jack, displacement, True, force)
        found = self._iterate(compute_residual, state, displacement, displacement, coulomb=True, residual=force)
        missing = self.missing_deflection(state, displacement)
        return force, float(with_constraint(self._parameters[0], float(found["ratio"]), missing, True))

    def newton(self, state: State, start: FloatArray, searching: bool | None = None) -> tuple[FloatArray, float]:
        """Run Newton's method; return its best iterate and the unbalanced force ratio there.

        Parameters
        ----------
        state : State
            Load, load factor and history; the load of the jacks becomes that of the best iterate.
        start : array (size,)
            First displacements.
        searching : bool, optional
            Whether with line search, or with backtracking; None: with line search if the wall has a potential.
        """
        searching, found = self.has_potential if searching is None else searching, np.empty_like(start)
        if self._compiled:
            unit = run_newton_with_line_search if searching else run_newton
            table = self._iterate(unit, state, start, found, limit=self._divergence_limit(state), **self._ahead(state))
            ratio, state.jack = float(table["ratio"]), float(table["jack"])
            within = ratio < self.tolerance and bool(table["within"])
        else:
            iterate = newton_with_line_search if searching else newton
            ratio, state.jack = iterate(self._interpreted(state), state.jack, start, found, self._room)
            within = False
            if ratio < self.tolerance:
                self.store_tangent(state, found)
                self.complete(state, found)
        return found, np.inf if not within and self.has_diverged(state, found) else ratio

    def minimise(self, state: State, tolerance: float) -> None:
        """Minimise the potential of the Tresca problem.

        Parameters
        ----------
        state : State
            Its displacements are the start, and become the minimum.
        tolerance : float
            Unbalanced force ratio at which the minimisation ends.
        """
        limit, u, arms = self._divergence_limit(state), state.displacement, self.system.arms
        self._minimise_within(limit, state, tolerance)
        if not (within_limit(u, self.free, arms, limit) or self.has_diverged(state)):
            # farther than rigid blocks move, not farther than the elastic wall
            limit += 2.0 * largest_elastic_displacement(self.model, state.load_factor)
            self._minimise_within(limit, state, tolerance)

    def _minimise_within(self, limit: float, state: State, tolerance: float) -> None:
        """Minimise the potential of the Tresca problem, up to a displacement."""
        if self._compiled:
            u = state.displacement
            table = self._iterate(minimise_tresca, state, u, u, limit=limit, minimum_tolerance=tolerance)
            state.jack = float(table["jack"])
        else:
            problem, u = self._interpreted(state), state.displacement
            state.jack = minimise(problem, state.jack, tolerance, limit, u, self._room)

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

    def forces_on_supports(self, state: State) -> FloatArray:
        """Return the force of joints and loads on prescribed degrees of freedom (N, N m); others are incomplete."""
        self._set_loads(state)
        return self._forces_at(self._support_interfaces, state, state.displacement, state.jack)

    def _forces_at(
        self, interfaces: IntArray, state: State, displacement: FloatArray, jack: float, coulomb: bool = True
    ) -> FloatArray:
        """Return the forces of the joints of some interfaces, of blocks, of jacks and of the external load set."""
        self._force[:] = self._external
        if self.jacks is not None:
            self._force += jack * self.jacks.push
        self._add_forces(interfaces, state, displacement, coulomb)
        return self._force

    def commit_joint_history(self, state: State, never_opened: BoolArray) -> tuple[np.void, Ground]:
        """Commit the history of the joints to an equilibrium.

        Parameters
        ----------
        state : State
            The equilibrium.
        never_opened : array of bool (m, q)
            Contacts without bond that have never been open; updated.

        Returns
        -------
        joints : PROBLEM
            Table with the energy stored in joints, condensed fronts and strained elastic blocks, and with the work that
            the joints have dissipated.
        on_ground : Ground
            Forces on the ground (N).
        """
        if (condensation := self.equations.condensation) is not None:
            condensation.set_loads(state.load, state.load_factor)
        whole, shape = condensation is None or self.superelements is not None, self.model.ground.full.normal.shape
        on_ground = Ground(np.zeros(shape), np.zeros(shape))
        joints = self.evaluate_joints(
            "commit_joint_history",
            None if whole else self.equations.active,
            state,
            never_opened=never_opened,
            ground_force_normal=on_ground.normal,
            ground_force_shear=on_ground.shear,
        )
        if self.model.elastic is not None:  # those of active fronts
            strain = np.zeros_like(state.displacement)
            strain[self.free] = state.displacement[self.free]
            joints["stored"] += 0.5 * float(self.system.strain_stiffness @ strain[self.system.strain_dofs] ** 2)
        return joints, on_ground

    def load_increment(self, load: float, load_factor: float) -> FloatArray:
        """Return the force increment of a step, with sliding joints as in the last equilibrium (N, N m).

        Parameters
        ----------
        load, load_factor : float
            Increments of dead load and movement (1).
        """
        force = load_factor * self._rate
        if load != 0.0:
            force += load * self.dead_load
        if self._has_live_load:
            force += load_factor * self.live_load
        if self.jacks is not None and self.jacks.by_load:
            force += load_factor * (self.jacks.load_at(1.0, 0.0) - self.jacks.load_at(0.0, 0.0)) * self.jacks.push
        loaded = load != 0.0 or self._has_live_load
        if (superelement := self.equations.condensation) is not None and loaded:
            force[superelement.boundary_dofs] += superelement.load(load, load_factor)
        return force

    def predict(self, state: State, target: Point) -> tuple[FloatArray, float]:
        """Predict displacements at a target with the tangent, and the share of the step at which the next bond fails.

        Of plain joints, bonds of condensed fronts do not count: where one fails first, the step to it is found by
        interpolation. Paths of softening joints amplify the difference.

        Parameters
        ----------
        state : State
            The last equilibrium.
        target : (float, float)
            Load and load factor.

        Returns
        -------
        displacement : array (size,)
            At the target, if no bond fails before it; that of the state if it diverges.
        share : float
            Share of the step to the next event; 1 if there is none.
        """
        increment = self.load_increment(target[0] - state.load, target[1] - state.load_factor)
        start, prescribed = state.displacement, self.model.support_displacement(target[1])
        ahead = replace(state, load=target[0], load_factor=target[1], displacement=np.empty_like(start))
        aim = self.options.continuation.predictor_aim
        if self._compiled:
            ground = self.model.ground.at(state.load_factor)
            table = self._iterate(
                predict,
                ahead,
                start,
                ahead.displacement,
                self.tangent,
                residual=increment,
                prescribed_ahead=prescribed,
                limit=self._divergence_limit(ahead),
                normal_at_start=ground.normal,
                shear_at_start=ground.shear,
                aim=aim,
            )
            if table["within"]:
                return ahead.displacement, float(table["share"])
        else:
            step, _ = self.solve(self.tangent, increment, self.missing_deflection(ahead, start))
            np.add(start, step, out=ahead.displacement)
            ahead.displacement[self.model.supports.prescribed] = prescribed
        self.complete(ahead)
        if self.has_diverged(ahead):
            return start, 1.0
        return ahead.displacement, self.event_share(state, aim, active_only=self.plain)

    def largest_bond_load(self, state: State) -> float:
        """Return the largest bond load of an equilibrium just completed, 1 at the strength; ``bond_load`` has all.

        Parameters
        ----------
        state : State
            The equilibrium. Its commit changes the bonds of joints that are not plain.
        """
        if not self.plain:
            self.evaluate_joints("bond_loads", self.equations.active, state)
        table = self.table.record
        return max(float(table["largest_bond_load"]), float(table["largest_condensed_load"]))

    def event_share(self, state: State, aim: float, active_only: bool = False) -> float:
        """Interpolate the share of a step at which the first bond fails; ``bond_load`` is that at its end.

        Parameters
        ----------
        state : State
            At the start of the step.
        aim : float
            Overload at which it counts as failing, over the event tolerance (1).
        active_only : bool
            Whether bonds of condensed fronts do not count.
        """
        listed = self.equations.active if active_only else self._all_interfaces
        self.table.set_state(state.history, self.model.ground.at(state.load_factor))
        return float(self.table.run(interpolate_event, listed, state.displacement, aim=aim)["share"])

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
        limit, arms = self._divergence_limit(state), self.system.arms
        if within_limit(displacement, self.free, arms, limit):
            return False
        limit += 2.0 * largest_elastic_displacement(self.model, state.load_factor)
        return not within_limit(displacement, self.free, arms, limit)

    def _divergence_limit(self, state: State) -> float:
        """Return the displacement beyond which no equilibrium is sought, but for those of the elastic wall (m)."""
        allowed = self._detachment_limit.at(state.load_factor)
        return self._initial_support_displacement + self.options.newton.divergence_displacement * allowed

    # -- linearisation ----------------------------------------------------------------------------------------------

    def store_tangent(self, state: State, displacement: FloatArray) -> None:
        """Store the last tangent stiffness, and the force of the joints per load factor, for the predictor.

        Parameters
        ----------
        state : State
            Load, load factor and history of an equilibrium.
        displacement : array (size,)
            Its displacements.
        """
        if self._compiled:
            self._iterate(store_tangent, state, displacement, displacement, **self._ahead(state))
            return
        self.tangent[self.equations.active] = self._stiffness[self.equations.active]
        if self._no_imposed_movement:
            return
        step, moved, ahead = self.options.newton.finite_difference_step, displacement.copy(), self._ahead(state)
        moved[self.model.supports.prescribed] += ahead["prescribed_step"]
        self._rate[:] = self._moving_forces(replace(state, load_factor=state.load_factor + step), moved)
        self._rate -= self._moving_forces(state, displacement)
        self._rate /= step

    def _ahead(self, state: State) -> dict[str, FloatArray]:
        """Return ground and movement of the supports a step of the load factor ahead."""
        if self._no_imposed_movement:
            return {}
        step, ground = self.options.newton.finite_difference_step, self.model.ground
        ahead = ground.at(state.load_factor + step)
        moved = step * ground.load_factor_rate(state.load_factor) * self.model.supports.prescribed_displacement
        return {"normal_ahead": ahead.normal, "shear_ahead": ahead.shear, "prescribed_step": moved}

    def _moving_forces(self, state: State, displacement: FloatArray) -> FloatArray:
        """Return the forces of the interfaces that ground and supports move, without external load."""
        self._external.fill(0.0)
        self._loads_set = ()
        return self._forces_at(self._moving_interfaces, state, displacement, 0.0)

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
        self.equations.tangent["iterations"] += 1
        if self.jacks is None or self.jacks.by_load:
            return self.equations.solve(force), 0.0
        responses, step = self.equations.solve(np.stack((force, self.jacks.push))), np.empty_like(force)
        return step, float(bordered_step(self.jacks.weights, responses, missing_deflection, step))

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
        self.evaluate_joints("update_tresca_bounds", self.equations.active, state, relaxation=relaxation)

    def uncondense(self, fronts: BoolArray) -> None:
        """Make some fronts (F,) and their ancestors active; all others stay elastic and condensed."""
        equations = self.equations
        wanted = fronts | self._never_condensed | self._active_block_fronts()
        if self.condensed:
            wanted |= equations.active_fronts
        if not self.condensed or (wanted & ~equations.active_fronts).any():
            equations.condense(wanted, self.dead_load, self.live_load)
            self._set_problem()

    def uncondense_interfaces(self, interfaces: BoolArray | IntArray) -> None:
        """Make the fronts of some interfaces and of active deformable blocks active."""
        equations = self.equations
        if self.condensed and self.superelements is None and equations.are_active(interfaces):
            return
        self.uncondense(equations.tree.fronts_of(interfaces))

    def inelastic_fronts(self, state: State) -> BoolArray | None:
        """Return the condensed fronts (F,) in which a joint slides or a block yields in the equilibrium just completed.

        None if there is none.

        Blocks that yield become active.

        Parameters
        ----------
        state : State
            Of the equilibrium.
        """
        tree, condensed = self.equations.tree, self.equations.condensed_interfaces
        slides = self.condensed and self.table.record["sliding"] > 0
        if (blocks := self.superelements) is None and not slides:
            return None
        found = np.zeros(tree.count, dtype=np.bool_)
        if slides:
            found |= tree.fronts_of(condensed[self._slides[condensed]])
        if blocks is not None:
            opened = blocks.activate_yielding(state.displacement, state.load, state.load_factor, state.plastic)
            found |= tree.fronts_of_superelements(opened)
        return found if found.any() else None

    def _active_block_fronts(self) -> BoolArray:
        """Return the fronts (F,) of uncondensed deformable blocks."""
        tree, blocks = self.equations.tree, self.superelements
        return tree.fronts_of_superelements(np.empty(0, dtype=np.int64) if blocks is None else blocks.active)

    def complete(self, state: State, displacement: FloatArray | None = None) -> None:
        """Recover the displacements of condensed fronts, and those inside deformable blocks, and compute bond loads.

        Parameters
        ----------
        state : State
            Load, load factor and history.
        displacement : array (size,), optional
            Changed; by default the state's own.
        """
        u = state.displacement if displacement is None else displacement
        if self._compiled:
            self._iterate(complete, state, u, u, limit=np.inf)
            return
        if (condensation := self.equations.condensation) is not None:
            condensation.recover(u, state.load, state.load_factor)
        if self.superelements is not None:
            self.superelements.recover(u, state.load, state.load_factor, state.plastic)
        self.evaluate_joints("bond_loads", self.equations.active, state, u)
        self.table.record["largest_condensed_load"] = 0.0
        if self.condensed:
            self.evaluate_joints("check_condensed", self.equations.condensed_interfaces, state, u)


def _parameters_of(options: SolverOptions, tolerance: float) -> np.ndarray:
    """Return the parameters of the iterations, as kernels take them: one record."""
    parameters = np.zeros(1, PARAMETERS)
    for kind in ("newton", "newton_with_line_search", "line_search"):
        for name in parameters[kind].dtype.names or ():
            parameters[kind][name] = getattr(getattr(options, kind), name)
    for name in ("warm_start_residual", "max_minimisation_iterations"):
        parameters[name] = getattr(options.coulomb, name)
    parameters["tolerance"], parameters["deflection_tolerance"] = tolerance, options.jacks.deflection_tolerance
    return parameters


class _InterpretedProblem:
    """A wall with deformable blocks or concrete sections at the loads of a state, for the iterations in Python."""

    def __init__(self, wall: Residual, state: State) -> None:
        self._wall, self._state, self.parameters = wall, state, wall._parameters[0]

    def residual(self, jack: float, displacement: FloatArray, coulomb: bool, force: FloatArray) -> float:
        """Compute the residual force; see ``damagepred.kernels.equilibrium.problem.residual``."""
        wall, state = self._wall, self._state
        total = wall._forces_at(wall.equations.active, state, displacement, jack, coulomb)
        if wall.equations.condensation is not None:
            wall.equations.condensation.subtract_boundary_forces(displacement, total)
        # NaN must not pass for balance; forces of a block that finds no equilibrium inside are NaN, too
        ratio = free_residual(total, wall.free, wall.per_weight, force)
        if wall.superelements is not None:
            ratio = max(ratio, wall.superelements.largest_block_resultant(force) / wall.weight)
        return float(with_constraint(self.parameters, ratio, self.missing(displacement), coulomb))

    def solve(self, bordered: bool, displacement: FloatArray, force: FloatArray, step: FloatArray) -> float:
        """Solve the tangent equations; see ``damagepred.kernels.equilibrium.problem.solve``."""
        wall = self._wall
        if bordered:
            step[:], jack_step = wall.solve(wall._stiffness, force, self.missing(displacement))
            return jack_step
        wall.equations.update(wall._stiffness)
        wall.equations.tangent["iterations"] += 1
        step[:] = wall.equations.solve(force)
        return 0.0

    def controls_deflection(self) -> bool:
        """Whether the deflection at the jacks is given, and their load unknown."""
        return not self._wall.has_potential

    def missing(self, displacement: FloatArray) -> float:
        """Return the missing deflection at the jacks (m), 0 where their load is given."""
        return self._wall.missing_deflection(self._state, displacement)

    def goes_too_far(self, displacement: FloatArray, limit: float) -> bool:
        """Whether a displacement of an active degree of freedom exceeds a limit (m)."""
        return not within_limit(displacement, self._wall.free, self._wall.system.arms, limit)

    def add_jack_load(self, load: float, force: FloatArray) -> None:
        """Add a load of the jacks (N) to the residual force of active degrees of freedom."""
        if self._wall.jacks is not None:
            force[self._wall.free] += load * self._wall.jacks.push[self._wall.free]
