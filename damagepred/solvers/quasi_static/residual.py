"""Residual force of a wall at a given load and movement, its linearisation, and condensed elastic parts."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from damagepred.arrays import BoolArray, FloatArray, IntArray
from damagepred.assembly import Model
from damagepred.assembly.model import Ground
from damagepred.kernels.concrete_section.forces import section_forces
from damagepred.kernels.equilibrium.completion import Completed, complete, store_tangent
from damagepred.kernels.equilibrium.joints import (
    JointSteps,
    add_joint_forces,
    fill_bond_loads,
    find_inelastic,
    joint_steps,
)
from damagepred.kernels.equilibrium.newton import newton, newton_with_line_search, run_newton
from damagepred.kernels.equilibrium.predictor import interpolate_event, predict
from damagepred.kernels.equilibrium.residual import bordered_step, wall_residual, with_constraint
from damagepred.kernels.equilibrium.tresca import minimise, minimise_tresca
from damagepred.kernels.equilibrium.wall import (
    PARAMETERS,
    Bonds,
    Freedoms,
    History,
    Interfaces,
    Joints,
    SectionMemory,
    Sections,
    TrescaBounds,
    Wall,
)
from damagepred.kernels.equilibrium.wall import State as WallState
from damagepred.kernels.interface.residual import free_residual, within_limit
from damagepred.kernels.joint.limits import NO_LIMIT
from damagepred.kernels.linear.solver import solve_tangent
from damagepred.runtime.time_limit import check_time
from damagepred.solvers.options import DEFAULTS, SolverOptions
from damagepred.solvers.quasi_static.jacks import JackControl
from damagepred.solvers.quasi_static.linear_system import MultifrontalSystem
from damagepred.solvers.quasi_static.static_condensation import StaticCondensation, nothing_condensed
from damagepred.solvers.quasi_static.superelements import Superelements
from damagepred.solvers.state.wall_state import Point, State
from damagepred.solvers.system.collapse_criterion import DetachmentLimit, largest_elastic_displacement
from damagepred.solvers.system.discrete_system import DiscreteSystem


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
        self._completed = Completed(True, 0, 0.0, 0.0)
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
        return self.equations.iterations

    def change_model(self, model: Model) -> None:
        """Continue with other supports of the same stiffness."""
        self.model = model
        self._find_supports()
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
        size, count = self.dead_load.size, len(self._all_interfaces)
        self._force, self._stiffness = np.zeros(size), np.zeros((count, 9))
        self._external, self._room, self._rate = np.zeros(size), np.empty((4, size)), np.zeros(size)
        self._pairs, self._slides = np.empty((4, size)), np.zeros(count, dtype=np.bool_)
        self._loads_set: tuple[object, ...] = ()
        self._parameters = _parameters_of(self.options, self.tolerance)
        self._compiled = self.superelements is None
        elastic = self.model.interfaces.elastic
        self.steps: JointSteps = joint_steps(self.return_mapping.general, None if elastic is None else True)
        self._joint_records = self._make_joints()
        self._law = self.steps.law(self.model.sections is not None)
        self._sections, self._no_sections = _sections_of(self.model), SectionMemory.empty()
        options = self.options.continuation
        self._bonds = Bonds(
            load=self.bond_load,
            load_at_start=np.zeros_like(self.bond_load),
            slides=self._slides,
            overloaded=np.empty_like(self._all_interfaces),
            overload_tolerance=options.overload_tolerance,
            event_tolerance=options.event_tolerance,
            weak_bond_overload=options.weak_bond_overload,
        )
        self._bounds = TrescaBounds(**dict(zip(("bound", "dilatant_opening", "kappa"), self.tresca)))
        self._set_loads(rest)
        self._forces_at(self._all_interfaces, rest, rest.displacement, 0.0, coulomb=False)
        self._stiffness[self.model.properties.gap > 0.0] = 0.0  # until it closes
        return self._stiffness.copy()

    def _make_joints(self) -> Joints:
        """Interfaces and joint law, as kernels take them."""
        model, system, records = self.model, self.system, self.model.interface_records
        elastic = model.interfaces.elastic
        made: Joints = Joints(
            edge=records.edge,
            contact_offset=records.contact_offset,
            contact_area=records.contact_area,
            properties=model.joint_parameters,
            side_dof=np.full((len(records.edge), 2), -1) if elastic is None else elastic.dof,
            side_rows=np.zeros((len(records.edge), 2, 3, 2)) if elastic is None else elastic.rows,
            strain_stiffness=system.strain_stiffness,
            first_strain=system.strain_dofs.start,
            return_mapping=np.array(self.return_mapping[:-1], dtype=np.float64),
            block_stress=model.block_stress,
            # a bond without strength breaks at the first tension: one that balance, to its tolerance, does not explain
            no_strength=self.tolerance * model.block_stress,
        )
        return made

    def _set_problem(self) -> None:
        """Make the wall that the iterations take, with the present active fronts."""
        equations, jacks, none = self.equations, self.jacks, np.empty(0)
        if self.superelements is not None:
            active = np.append(equations.active_fronts, True)[equations.tree.superelement_front]
            self.superelements.set_condensed(~active)
        self.free = equations.active_dofs
        if not self._compiled:
            return
        condensation = equations.condensation
        self.wall = Wall(
            parameters=self._parameters,
            joints=self._joint_records,
            sections=self._sections,
            law=self._law,
            bounds=self._bounds,
            bonds=self._bonds,
            interfaces=Interfaces(
                all=self._all_interfaces,
                active=equations.active,
                condensed=equations.condensed_interfaces,
                jointed=self._joints(equations.active),
                moving=self._joints(self._moving_interfaces),
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
            condensation=nothing_condensed(equations.solver.substitution)
            if condensation is None
            else condensation.structure,
            solve_tangent=solve_tangent,
            stiffness=self._stiffness,
            tangent=self.tangent,
            rate=self._rate,
            rate_step=self.options.newton.finite_difference_step,
            force=self._force,
            room=self._room,
            pairs=self._pairs,
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

    def _history(self, state: State, load_factor: float | None = None) -> History:
        """History variables of a state, with the ground at its load factor or at another."""
        ground = self.model.ground.at(state.load_factor if load_factor is None else load_factor)
        made: History = History(
            **state.history._asdict(),
            ground_normal=np.ascontiguousarray(ground.normal),
            ground_shear=np.ascontiguousarray(ground.shear),
        )
        return made

    def _displacement_of(self, state: State, displacement: FloatArray | None) -> FloatArray:
        """Displacements (size,) that kernels take: those of a state by default."""
        u = state.displacement if displacement is None else displacement
        if u.shape != self._force.shape or u.dtype != np.float64 or not u.flags.c_contiguous:
            raise ValueError(
                f"displacements must be a contiguous array of float64 {self._force.shape}, not {u.dtype} {u.shape}"
            )
        return u

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
        listed, u = self._joints(interfaces), self._displacement_of(state, displacement)
        law, joints, history, bounds = self._law, self._joint_records, self._history(state), self._bounds
        add_joint_forces(law, joints, history, bounds, listed, coulomb, u, self._force, self._stiffness)
        if superelements is not None:
            superelements.scatter_facet_forces(self._force)
            condensed_too = interfaces is self._all_interfaces
            superelements.add_internal_forces(
                state.load, state.load_factor, displacement, state.plastic, self._force, condensed_too
            )

    def _in_state(self, state: State, limit: float = np.inf) -> WallState:
        """Return loads and history of a state, for the compiled iterations."""
        check_time()
        self._set_loads(state, self.equations.condensation)
        made: WallState = WallState(
            history=self._history(state),
            sections=self._no_sections if self.model.sections is None else SectionMemory(**state.sections._asdict()),
            external=self._external,
            load=float(state.load),
            live=float(state.load_factor),
            deflection=np.nan if self.jacks is None else self.jacks.required_deflection(state.load_factor),
            limit=limit,
        )
        return made

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
        force, u = np.empty_like(displacement), self._displacement_of(state, displacement)
        if not self._compiled:
            return force, self._interpreted(state).residual(state.jack, displacement, True, force)
        return force, wall_residual(self.wall, self._in_state(state), float(state.jack), u, True, force)

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
        begin, jack = self._displacement_of(state, start), float(state.jack)
        if self._compiled:
            inside = self._in_state(state, self._divergence_limit(state))
            ahead = self._ahead(state, inside.history)
            ratio, state.jack, completed = run_newton(self.wall, inside, *ahead, jack, begin, found, searching)
            self._completed, within = completed, ratio < self.tolerance and completed.within
        else:
            iterate = newton_with_line_search if searching else newton
            ratio, state.jack = iterate(self._interpreted(state), jack, begin, found, self._room)
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
        u, jack = self._displacement_of(state, None), float(state.jack)
        if self._compiled:
            state.jack = minimise_tresca(self.wall, self._in_state(state, limit), jack, tolerance, u)
        else:
            state.jack = minimise(self._interpreted(state), jack, tolerance, limit, u, self._room)

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

    def commit_joint_history(self, state: State, never_opened: BoolArray) -> tuple[JointEnergy, Ground]:
        """Commit the history of the joints to an equilibrium.

        Parameters
        ----------
        state : State
            The equilibrium.
        never_opened : array of bool (m, q)
            Contacts without bond that have never been open; updated.

        Returns
        -------
        joints : JointEnergy
            Energy stored in joints, condensed fronts and strained elastic blocks, and work that the joints have
            dissipated.
        on_ground : Ground
            Forces on the ground (N).
        """
        condensation, shape = self.equations.condensation, self.model.ground.full.normal.shape
        whole = condensation is None or self.superelements is not None
        listed, on_ground = self._all_interfaces if whole else self.equations.active, Ground(*np.zeros((2, *shape)))
        u, history = self._displacement_of(state, None), self._history(state)
        work = self.steps.commit_history(self._joint_records, history, listed, u, never_opened, *on_ground)
        joints = JointEnergy(*work)
        stored = joints.stored
        if condensation is not None and self.superelements is None:
            stored += condensation.elastic_energy(u, state.load, state.load_factor)
        if self.model.elastic is not None:  # those of active fronts
            strain = np.zeros_like(state.displacement)
            strain[self.free] = state.displacement[self.free]
            stored += 0.5 * float(self.system.strain_stiffness @ strain[self.system.strain_dofs] ** 2)
        return joints._replace(stored=stored), on_ground

    def contact_stresses(self, state: State) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return opening (m), normal and shear stress (Pa) of all contacts, arrays (m, q)."""
        opening, sigma, tau = np.empty((3, *self.bond_load.shape))
        u, history = self._displacement_of(state, None), self._history(state)
        self.steps.contact_stresses(self._joint_records, history, u, opening, sigma, tau)
        return opening, sigma, tau

    def joint_law_violation(self, state: State, normal_stress: FloatArray, shear_stress: FloatArray) -> float:
        """Return the largest stress by which stresses (m, q) violate the joint law (Pa)."""
        return float(self.steps.law_violation(self._joint_records, self._history(state), normal_stress, shear_stress))

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
            inside = self._in_state(ahead, self._divergence_limit(ahead))
            within, share = predict(
                self.wall,
                inside,
                self._history(state),
                increment,
                prescribed,
                self._displacement_of(state, None),
                ahead.displacement,
                not self.plain,
                aim,
            )
            if within:
                return ahead.displacement, float(share)
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
            self._fill_bond_loads(state, state.displacement)
        return max(self._completed.bond_load, self._completed.condensed_load)

    def _fill_bond_loads(self, state: State, displacement: FloatArray) -> None:
        """Fill the bond loads of active interfaces at a displacement, with the history of a state."""
        u, history, active = self._displacement_of(state, displacement), self._history(state), self.equations.active
        load = float(fill_bond_loads(self._law, self._joint_records, history, active, u, self.bond_load))
        self._completed = self._completed._replace(bond_load=load)

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
        u, history = self._displacement_of(state, None), self._history(state)
        return float(interpolate_event(self._bonds, self._joint_records, self._law, history, listed, u, aim))

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
            u = self._displacement_of(state, displacement)
            inside = self._in_state(state)
            store_tangent(self.wall, inside, *self._ahead(state, inside.history), u)
            return
        self.tangent[self.equations.active] = self._stiffness[self.equations.active]
        if self._no_imposed_movement:
            return
        step, moved, (_, support_step) = (
            self.options.newton.finite_difference_step,
            displacement.copy(),
            self._ahead(state, self._history(state)),
        )
        moved[self.model.supports.prescribed] += support_step
        self._rate[:] = self._moving_forces(replace(state, load_factor=state.load_factor + step), moved)
        self._rate -= self._moving_forces(state, displacement)
        self._rate /= step

    def _ahead(self, state: State, history: History) -> tuple[History, FloatArray]:
        """History with the ground, and movement of the supports, a step of the load factor ahead of a history."""
        step, ground, supports = self.options.newton.finite_difference_step, self.model.ground, self.model.supports
        if self._no_imposed_movement:
            return history, supports.prescribed_displacement
        moved = step * ground.load_factor_rate(state.load_factor) * supports.prescribed_displacement
        return self._history(state, state.load_factor + step), moved

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
        self.equations.count_iteration()
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
        u, history, active = self._displacement_of(state, None), self._history(state), self.equations.active
        self.steps.update_tresca_bounds(self._joint_records, history, self._bounds, active, u, relaxation)

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
        slides = self.condensed and self._completed.sliding > 0
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
            self._completed = complete(self.wall, self._in_state(state), self._displacement_of(state, u))
            return
        if (condensation := self.equations.condensation) is not None:
            condensation.recover(u, state.load, state.load_factor)
        if self.superelements is not None:
            self.superelements.recover(u, state.load, state.load_factor, state.plastic)
        self._fill_bond_loads(state, u)
        condensed, sliding, largest = self.equations.condensed_interfaces, 0, 0.0
        if self.condensed:
            joints, history = self._joint_records, self._history(state)
            largest = find_inelastic(self._law, joints, history, condensed, u, self._slides, self.bond_load)
            sliding = int(self._slides[condensed].sum())
        self._completed = self._completed._replace(sliding=sliding, condensed_load=float(largest))


class JointEnergy(NamedTuple):
    """Work of the joints, from rest or since the last commit (J).

    Attributes
    ----------
    friction, crushing, mode_1_dissipation : float
        Dissipated since the last commit; the last in tension by bonds that soften by slip.
    stored, softened : float
        Elastic energy, and softening work of all other bonds so far.
    """

    friction: float
    crushing: float
    mode_1_dissipation: float
    stored: float
    softened: float


def _sections_of(model: Model) -> Sections:
    """Sections of a concrete footing as kernels take them; none if it does not crack."""
    made: Sections = Sections.empty() if model.sections is None else Sections(**model.sections._asdict())
    return made


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
    """A wall with deformable blocks at the loads of a state, for the iterations in Python."""

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
        wall.equations.count_iteration()
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
