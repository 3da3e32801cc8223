"""Tangent equations of a wall: multifrontal factorisation, with Woodbury corrections for few changes.

A change in one front leaves the factors of all but its ancestors as they are. Most Newton iterations change a few
interfaces only: then the last factorisation is corrected by the Woodbury identity. Subtrees that stay elastic are
statically condensed to a superelement on their boundary once.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from damagepred.arrays import BoolArray, FloatArray, IntArray
from damagepred.enumerations import ContactKind
from damagepred.errors import InputError
from damagepred.kernels.linear.condensation import Condensation, condense_forces, elastic_energy
from damagepred.kernels.linear.correction import MAX_LOOP_ROWS, Correction, correct, respond
from damagepred.kernels.linear.dense import dense_workspace, invert
from damagepred.kernels.linear.factors import BlockTangents, Factors, Tree, eliminate
from damagepred.kernels.linear.solver import (
    CORRECTIONS,
    FACTORISATIONS,
    ITERATIONS,
    RESPONSE_BATCH,
    Solver,
    TangentSolution,
    eliminate_outdated,
    solve_from_python,
    solve_tangent,
)
from damagepred.kernels.linear.substitution import Rows, Substitution, back, forward, solve_columns
from damagepred.solvers.options import DEFAULTS
from damagepred.solvers.quasi_static.elimination_tree import ElasticFactors, EliminationTree
from damagepred.solvers.quasi_static.superelements import Superelements
from damagepred.solvers.system.discrete_system import DiscreteSystem

REGULARISATION = 1e-7
"""Share of the elastic diagonal stiffness that is added to the diagonal, so that detached blocks stay finite (1)."""
MAX_CHANGED_INTERFACES = 200
"""Interfaces that a Woodbury correction may have; the unit-load responses of as many take memory."""
MAX_SHARED_MEMORY = 0.1
"""Up to which the factors of condensed fronts are kept for the next wall of the same geometry and stiffness (GB)."""


class ActivePart(NamedTuple):
    """Fronts that are not condensed (F,), interfaces in them and in condensed fronts, and free degrees of freedom."""

    fronts: BoolArray
    interfaces: IntArray
    condensed_interfaces: IntArray
    dofs: IntArray  # in the order of the fronts


class MultifrontalSystem:
    """Tangent stiffness of a wall, factorised or corrected; ``solver`` and ``factors`` are for kernels."""

    def __init__(
        self,
        system: DiscreteSystem,
        elastic: FloatArray,
        superelements: Superelements | None = None,
        max_memory: float = DEFAULTS.linear_system.max_memory,
    ) -> None:
        self.model, self.elastic = system.model, elastic
        self.tree = EliminationTree.of(system, superelements)
        if (needed := 8e-9 * self.tree.matrix_entries) > max_memory:
            raise InputError(
                f"the quasi-static solver would need {needed:.0f} GB for its matrices, and takes "
                f"{max_memory:g} GB at most; take a larger solver.zone_size, cut fewer blocks, or take "
                f"method = 'explicit'."
            )
        self._superelements, self._stiffness = superelements, elastic
        self._solution = TangentSolution(solve=solve_tangent)
        self._make_factors(system)
        self.counts = np.zeros(3, dtype=np.int64)
        self.factorisation_cost = factorisation_costs(self.tree.size, self.tree.boundary_size)
        self.elastic_complements = np.empty(0)  # of condensed fronts, without regularisation; empty until then
        self.reached, none = np.zeros((2, self.tree.count), dtype=np.bool_)
        self.active = ActivePart(none, *np.empty((3, 0), dtype=np.int64))
        self.activate(np.ones(self.tree.count, dtype=np.bool_))

    def _make_factors(self, system: DiscreteSystem) -> None:
        """Allocate the factors of all fronts."""
        tree, count = self.tree, len(self.elastic)
        size, edge = tree.size, tree.boundary_size
        largest = int((size + edge).max(initial=1))
        strain = np.zeros(self.model.size)
        strain[system.strain_dofs] = system.strain_stiffness
        self._strain_stiffness = strain = strain[tree.dofs]
        diagonal = self._elastic_diagonal(strain)
        # a block without joints keeps its place
        typical = diagonal.max(initial=0.0) or 1.0
        dof, displacement = tree.kinematics
        children = np.argsort(tree.parent, kind="stable")
        inverse_start, coupling_start, complement_start = (
            np.concatenate(([0], np.cumsum(n))) for n in (size**2, size * edge, edge**2)
        )
        none = np.zeros(tree.count, dtype=np.bool_)
        fixed = Tree(
            start=tree.start,
            parent=tree.parent,
            children=children,
            first_child=np.searchsorted(tree.parent[children], np.arange(tree.count + 1)),
            first_boundary=tree.first_boundary,
            boundary_in_parent=tree.boundary_in_parent,
            inverse_start=inverse_start,
            coupling_start=coupling_start,
            complement_start=complement_start,
            dof=dof,
            strain_displacement=displacement,
            front_interfaces=tree.interfaces.listed,
            first_interface=tree.interfaces.first,
            interface_front=tree.interfaces.front,
            interface_index=tree.interfaces.index_in_front,
            strain_stiffness=strain,
            regularisation=REGULARISATION * np.where(diagonal > 0.0, diagonal, typical),
        )
        self._arrays = {
            "inverses": np.zeros(inverse_start[-1]),
            "coupling": np.zeros(coupling_start[-1]),
            "upper": np.zeros(coupling_start[-1]),
            "complements": np.zeros(complement_start[-1]),
            "stiffness": np.full((count, 9), np.nan),
            "matrices": np.empty((count, dof.shape[1], dof.shape[1])),
            "unsymmetric": none.copy(),
        }
        self._stale = none.copy()
        self.factors: Any = Factors(
            tree=fixed,
            blocks=self._block_tangents(),
            dense=dense_workspace(max(largest, 3 * MAX_CHANGED_INTERFACES)),
            yields=none.copy(),
            outdated=none.copy(),
            front=np.empty(largest**2),
            invert=invert,
            **self._arrays,
        )

    def _elastic_diagonal(self, strain_stiffness: FloatArray) -> FloatArray:
        """Diagonal of the elastic stiffness in the order of the fronts: scale of the regularisation."""
        dof, rows = self.tree.kinematics
        own = np.einsum("mjr,mjr->mr", rows, self.elastic.reshape(-1, 3, 3) @ rows)
        own[self.model.interfaces.kind == ContactKind.BRICK_JOINT] = 0.0  # nearly rigid: no scale of a wall's motion
        summed = np.bincount(dof[dof >= 0], own[dof >= 0], self.model.size)
        total = summed.astype(np.float64)  # without joints they would be whole numbers
        if self._superelements is not None:
            for boundary, stiffness in zip(self._superelements.boundary, self._superelements.elastic):
                total[boundary] += stiffness.diagonal()
        return total[self.tree.dofs] + strain_stiffness

    def _block_tangents(self) -> BlockTangents:
        """Tangents of the deformable blocks of all fronts; empty if all blocks are rigid or elastic."""
        blocks, elements = self._superelements, self.tree.superelements
        boundary = [] if blocks is None else blocks.boundary
        return BlockTangents(
            front_blocks=elements.listed,
            first_block=elements.first,
            first_dof=np.cumsum([0, *map(len, boundary)], dtype=np.int64),
            index=elements.index_in_front,
            first_entry=np.zeros(1, dtype=np.int64) if blocks is None else blocks.first_entry,
            tangents=np.empty(0) if blocks is None else blocks.tangents,
            front=elements.front,
        )

    def activate(self, fronts: BoolArray) -> None:
        """Set the active fronts and make their ``solver``; the next solution factorises. ``condense`` calls it."""
        tree, count, slots = self.tree, len(self.elastic), MAX_CHANGED_INTERFACES
        self.condensation: StaticCondensation | None = None
        self._stale[:] = fronts & (self._stale | ~self.active.fronts)  # regularised only while active
        active, dofs = np.append(fronts, True)[tree.interfaces.front], tree.dofs[np.repeat(fronts, tree.size)]
        self.active, size = ActivePart(fronts, np.flatnonzero(active), np.flatnonzero(~active), dofs), len(dofs)
        index = np.full(self.model.size, -1, dtype=np.int64)  # among the active degrees of freedom
        index[dofs] = np.arange(size)
        operations = tree.size * (tree.size + 2 * tree.boundary_size)
        self.solver: Any = Solver(  # memory that is not touched costs nothing
            substitution=self.substitution(fronts, fronts, np.empty((2 * MAX_LOOP_ROWS, size))),
            correction=Correction(
                index=index,
                slot=np.full(count, -1, dtype=np.int64),
                interface_of_slot=np.empty(slots, dtype=np.int64),
                load_slot=np.full((count, 3), -1, dtype=np.int64),
                response=np.empty((3 * slots, size)),
                compliance=np.empty((3 * slots, 3 * slots)),
                change=np.empty((slots, 9)),
                changed_rows=np.empty(3 * slots, dtype=np.int64),
                relative=np.empty((2, 3 * slots)),
                force=np.empty(6 * slots),
                capacitance=np.empty(9 * slots**2),
                pivots=np.empty(3 * slots, dtype=np.int32),
                corrected=np.empty(slots, dtype=np.int64),
                corrected_count=0,
                unit=np.empty(RESPONSE_BATCH * size),
                unit_response=np.empty(RESPONSE_BATCH * size),
                occupied=0,
                loads=0,
            ),
            factorisation_cost=self.factorisation_cost,
            solution_cost=2.0 * float(operations[fronts].sum()),
            spent=0.0,
            active=self.active.interfaces,
            active_dofs=dofs,
            target=self.elastic.copy(),
            changed=np.empty(count, dtype=np.int64),
            new=np.empty(3 * count, dtype=np.int64),
            right=np.empty((2, size)),
            stale=self._stale,
            must_factorise=np.ones(1, dtype=np.bool_),
            counts=self.counts,
            eliminate=eliminate,
            respond=respond,
            correct=correct,
        )

    def substitution(self, fronts: BoolArray, in_rows: BoolArray, particular: FloatArray) -> Substitution:
        """Substitution in some ``fronts``; forces have one entry per degree of freedom of the fronts ``in_rows``."""
        tree, widest = self.tree, max(int(self.tree.boundary_size.max(initial=0)), 1)
        start = np.cumsum(in_rows * tree.size) - in_rows * tree.size
        row = np.cumsum(np.repeat(in_rows, tree.size)) - 1
        rows = Rows(
            fronts=np.flatnonzero(fronts),
            row_start=start,
            boundary_row=row[tree.boundary],
            reached=self.reached,
            gathered=np.empty((RESPONSE_BATCH, widest)),
        )
        return Substitution(
            factors=self.factors,
            rows=rows,
            particular=particular,
            forward=forward,
            back=back,
            solve_columns=solve_columns,
        )

    def are_active(self, interfaces: BoolArray | IntArray) -> bool:
        """Whether all listed interfaces are in active fronts."""
        return bool(np.append(self.active.fronts, True)[self.tree.interfaces.front[interfaces]].all())

    def condense(self, fronts: BoolArray, load: FloatArray, live_load: FloatArray) -> StaticCondensation | None:
        """Condense all fronts except the given ones and their ancestors; None: the condensed part would be loose."""
        fronts = self.tree.ancestors(fronts)
        condensed = self.active.fronts & ~fronts
        held = not fronts.all()
        if condensed.any():
            held = self._eliminate_condensed(condensed)
            parents = self.tree.parent[condensed]
            self._stale[parents[parents >= 0]] = True
        if not held:
            fronts = np.ones(self.tree.count, dtype=np.bool_)
            self.active.fronts[condensed] = False  # those are not regularised now
        self.activate(fronts)
        if held:
            self.condensation = StaticCondensation(self, load, live_load)
        return self.condensation

    def _eliminate_condensed(self, fronts: BoolArray) -> bool:
        """Eliminate elastic fronts, or copy their factors from an equal wall; whether their ancestors hold them."""
        interfaces, tree = np.flatnonzero(np.append(fronts, False)[self.tree.interfaces.front]), self.tree
        self.solver.target[interfaces] = self.elastic[interfaces]
        small = 8e-9 * tree.matrix_entries <= MAX_SHARED_MEMORY
        if not (small and np.isnan(self._arrays["stiffness"]).all()):
            return self._eliminate_elastic(fronts, interfaces)
        of, known = (self.elastic, self._strain_stiffness, fronts), tree.elastic_factors
        again = known is not None and all(map(np.array_equal, known.of, of))
        if known is None or not (again and known.arrays):
            held = self._eliminate_elastic(fronts, interfaces)
            arrays = {name: array.copy() for name, array in self._arrays.items()} if again else {}
            tree.elastic_factors = ElasticFactors(of, arrays, self.elastic_complements.copy(), held)
            return held
        for name, array in known.arrays.items():
            self._arrays[name][:] = array
        self.elastic_complements = known.elastic_complements.copy()
        return known.held

    def _eliminate_elastic(self, fronts: BoolArray, interfaces: IntArray) -> bool:
        """Eliminate some fronts with elastic interfaces; whether their ancestors hold them."""
        # twice: regularisation belongs to the tangent, not to the forces on boundaries, and where a wall may rest in
        # several positions it decides between them: this should not depend on which fronts are condensed
        regularised = self._arrays["complements"]
        self.factors.outdated[:] = fronts
        eliminate_outdated(self.solver, interfaces, regularised, False)
        if not self.elastic_complements.size:
            self.elastic_complements = np.empty_like(regularised)
        self.factors.outdated[:] = fronts
        return bool(eliminate_outdated(self.solver, interfaces[:0], self.elastic_complements, True))

    def update(self, stiffness: FloatArray) -> None:
        """Set the stiffness of the interfaces for the next ``solve``."""
        self._stiffness = stiffness

    def solve(self, force: FloatArray) -> FloatArray:
        """Solve for the displacements of all degrees of freedom."""
        if self._superelements is not None:
            self._superelements.update_tangents(self.solver)
        rows = np.ascontiguousarray(force.reshape(-1, force.shape[-1]))
        if rows.shape[1] != self.model.size or len(rows) > 2 or self._stiffness.shape != self.elastic.shape:
            raise ValueError(
                f"a wall of {self.model.size} degrees of freedom and {len(self.elastic)} interfaces takes one or two "
                f"forces of that length and a stiffness of {self.elastic.shape}, not {force.shape} and "
                f"{self._stiffness.shape}"
            )
        displacement = np.empty_like(rows)
        solve_from_python(self._solution, self.solver, self._stiffness, rows, displacement)
        return displacement.reshape(force.shape)

    def continue_counts(self, before: MultifrontalSystem) -> None:
        """Continue the counts of iterations and factorisations of the same wall with other supports."""
        self.counts[[ITERATIONS, FACTORISATIONS]] += before.counts[[ITERATIONS, FACTORISATIONS]]

    @property
    def iterations(self) -> int:
        """Number of solutions in iterations."""
        return int(self.counts[ITERATIONS])

    @property
    def factorisations(self) -> int:
        """Number of factorisations."""
        return int(self.counts[FACTORISATIONS])

    @property
    def corrections(self) -> int:
        """Number of Woodbury corrections."""
        return int(self.counts[CORRECTIONS])


ASSEMBLY_WEIGHT, INVERSION_WEIGHT = 1.7e4, 3.2
"""Operations per degree of freedom in the assembly of a front, and per operation in the inversion of its stiffness."""


def factorisation_costs(size: IntArray, edge: IntArray) -> FloatArray:
    """Weighted operations to factorise fronts of some sizes with boundaries of some sizes."""
    n, b = size.astype(np.float64), edge.astype(np.float64)
    costs: FloatArray = ASSEMBLY_WEIGHT * n + INVERSION_WEIGHT * n**3 + 2.0 * n * b * (n + b)
    return costs


class StaticCondensation:
    """Static condensation (Guyan 1965) of elastic subtrees to superelements on ``boundary_dofs`` of active fronts."""

    def __init__(self, equations: MultifrontalSystem, load: FloatArray, live_load: FloatArray) -> None:
        tree, active = equations.tree, equations.active.fronts
        # with the condensed fronts, in rows of all degrees of freedom
        substitution = equations.substitution(~active, np.ones_like(active), np.empty((0, len(tree.dofs))))
        # dead and live load, eliminated from the condensed fronts up to their boundaries
        loads = np.stack((load, live_load))
        reduced, particular = np.ascontiguousarray(loads[:, tree.dofs]), np.empty((2, len(tree.dofs)))
        equations.reached[:] = True
        condense_forces(substitution, reduced, particular)
        condensed = tree.dofs[np.repeat(~active, tree.size)]
        # a superelement for each condensed front with an active parent; places in the order of the fronts
        roots = np.flatnonzero(~active & np.append(active, False)[tree.parent])
        places = tree.boundary[np.repeat(np.isin(np.arange(tree.count), roots), tree.boundary_size)]
        boundary = np.unique(places)
        self.boundary_dofs = tree.dofs[boundary]
        self._load = reduced[:, boundary] - loads[:, self.boundary_dofs]
        ends, complements = np.cumsum(tree.boundary_size**2), equations.elastic_complements
        squares = [complements[ends[k] - tree.boundary_size[k] ** 2 : ends[k]] for k in roots]
        self.structure = Condensation(
            substitution=substitution,
            boundary_dofs=tree.dofs[places],
            first_boundary=np.concatenate(([0], np.cumsum(tree.boundary_size[roots]))),
            stiffness=np.concatenate([np.empty(0), *squares]),
            boundary=np.empty((2, len(places))),
            dofs=tree.dofs,
            particular=particular,
            particular_in_state=np.empty((1, len(tree.dofs))),
            current=np.empty((1, len(tree.dofs))),
            loaded_dofs=np.concatenate((condensed, self.boundary_dofs)),
            loads=np.ascontiguousarray(np.concatenate((loads[:, condensed], -self._load), axis=1)),
        )

    def load(self, load: float, live: float) -> FloatArray:
        """Load on ``boundary_dofs`` from condensed subtrees (N, N m), at factors of dead and live load."""
        return load * self._load[0] + live * self._load[1]

    def elastic_energy(self, displacement: FloatArray, load: float, live: float) -> float:
        """Energy stored in the condensed subtrees (J)."""
        return float(elastic_energy(self.structure, displacement, float(load), float(live)))
