"""Tangent equations of a wall: multifrontal factorisation, with Woodbury corrections for few changes.

A change in one front leaves the factors of all but its ancestors as they are. Most Newton iterations change a few
interfaces only: then the last factorisation is corrected by the Woodbury identity. Subtrees that stay elastic are
statically condensed to a superelement on their boundary once.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba.extending import get_cython_function_address

from damagepred.arrays import BoolArray, FloatArray, IntArray
from damagepred.errors import InputError
from damagepred.kernels.linear import assembly, lapack, multifrontal, woodbury
from damagepred.kernels.linear.system import solve_tangent
from damagepred.kernels.linear.table import SYSTEM
from damagepred.kernels.table import Address, fill
from damagepred.solvers.quasi_static.elimination_tree import ElasticFactors, EliminationTree
from damagepred.solvers.quasi_static.options import LinearSystemOptions
from damagepred.solvers.quasi_static.static_condensation import StaticCondensation
from damagepred.solvers.quasi_static.superelements import Superelements
from damagepred.solvers.system.discrete_system import DiscreteSystem

DEFAULTS = LinearSystemOptions()
UNITS = {
    unit.name: unit
    for unit in (
        assembly.set_stiffness,
        assembly.assemble_front,
        lapack.invert,
        multifrontal.eliminate,
        multifrontal.forward,
        multifrontal.back,
        multifrontal.solve_columns,
        woodbury.add_compliance,
        woodbury.stiffness_changes,
        woodbury.relative_displacements,
        woodbury.fill_capacitance,
        woodbury.respond,
        woodbury.correct,
    )
}
"""Units of the tangent equations that others call, by name."""
_OF_FACTORS = ("inverses", "coupling", "upper", "complements", "stiffness", "matrices", "unsymmetric")
"""Arrays of the table that elimination fills."""


class MultifrontalSystem:
    """Tangent stiffness of a wall, factorised or corrected.

    Parameters
    ----------
    system : DiscreteSystem
        Of n blocks and m interfaces.
    elastic : array (m, 9)
        Stiffness of the interfaces while nothing is cracked or slides; see ``joint_forces``.
    superelements : Superelements, optional
        The deformable blocks; their interior degrees of freedom are condensed.
    options : LinearSystemOptions, optional
        Tolerances and costs.

    Attributes
    ----------
    tangent : SYSTEM
        The table of factors and corrections, as kernels take it.
    address : int
        Of the table.
    arrays : dict
        The arrays of the table, by name.
    tree : EliminationTree
        Order of elimination.
    condensation : StaticCondensation or None
        Superelements of the condensed subtrees; None if all fronts are active.
    elastic_complements : array
        Schur complements of condensed fronts without regularisation, as ``complements`` of the table; empty until then.
    active_fronts : array of bool (F,)
        Fronts that are not condensed.
    active, condensed_interfaces : array of int
        Interfaces of active and of condensed fronts.
    active_dofs : array of int
        Free degrees of freedom of active fronts, in the order of the fronts.
    """

    def __init__(
        self,
        system: DiscreteSystem,
        elastic: FloatArray,
        superelements: Superelements | None = None,
        options: LinearSystemOptions = DEFAULTS,
    ) -> None:
        self.model, self.options, self.elastic = system.model, options, elastic
        self.tree = EliminationTree.of(system, superelements, options)
        self._superelements = superelements
        self._stiffness = elastic
        self._table = np.zeros(1, SYSTEM)
        self.arrays: dict[str, np.ndarray] = {}
        self.tangent, self.address = self._table[0], self._table.ctypes.data
        self._wanted = Address(self._table, "wanted")
        self._allocate(system)
        self.elastic_complements = np.empty(0)
        self.active_fronts = np.zeros(self.tree.count, dtype=np.bool_)
        self.activate(np.ones(self.tree.count, dtype=np.bool_))

    def _allocate(self, system: DiscreteSystem) -> None:
        """Make the arrays that all active systems share."""
        tree, options, count = self.tree, self.options, len(self.elastic)
        size, edge = tree.size, tree.boundary_size
        largest = int((size + edge).max(initial=1))
        if (needed := 8e-9 * tree.matrix_entries) > options.max_memory:
            raise InputError(
                f"the quasi-static solver would need {needed:.0f} GB for its matrices, and takes "
                f"{options.max_memory:g} GB at most; take a larger solver.zone_size, cut fewer blocks, or take "
                f"method = 'explicit'."
            )
        strain = np.zeros(self.model.size)
        strain[system.strain_dofs] = system.strain_stiffness
        strain = strain[tree.dofs]
        diagonal = self._elastic_diagonal(strain)
        # a block without joints keeps its place
        typical = diagonal.max(initial=0.0) or 1.0
        (dof, displacement), slots = tree.kinematics, options.max_changed_interfaces
        children = np.argsort(tree.parent, kind="stable")
        first_child = np.searchsorted(tree.parent[children], np.arange(tree.count + 1))
        inverse_start, coupling_start, complement_start = (
            np.concatenate(([0], np.cumsum(n))) for n in (size**2, size * edge, edge**2)
        )
        rows = max(options.max_loop_rows, 2)
        # room for all degrees of freedom, of which active ones take a part: memory that is not touched costs nothing
        room_rows = {"response": 3 * slots, "rows": 2, "room": 2 * rows}
        self._rooms = {name: (number, np.empty(number * self.model.size)) for name, number in room_rows.items()}
        gathered = np.empty((max(rows, options.response_batch), max(int(edge.max(initial=0)), 1)))
        none = np.zeros(tree.count, dtype=np.bool_)
        self._set(
            start=tree.start,
            parent=tree.parent,
            first_boundary=tree.first_boundary,
            boundary_in_parent=tree.boundary_in_parent,
            children=children,
            first_child=first_child,
            inverse_start=inverse_start,
            coupling_start=coupling_start,
            complement_start=complement_start,
            inverses=np.zeros(inverse_start[-1]),
            coupling=np.zeros(coupling_start[-1]),
            upper=np.zeros(coupling_start[-1]),
            complements=np.zeros(complement_start[-1]),
            dof=dof,
            strain_displacement=displacement,
            front_interfaces=tree.front_interfaces,
            first_interface=tree.first_interface,
            interface_front=tree.interface_front,
            interface_index=tree.interface_index,
            gathered=gathered,
            gathered_columns=gathered.reshape(-1),
            unit=np.empty(options.response_batch * self.model.size),
            unit_response=np.empty(options.response_batch * self.model.size),
            **{name: none.copy() for name in ("reached", "outdated", "stale", "unsymmetric", "yields")},
            stiffness=np.full((count, 9), np.nan),
            matrices=np.empty((count, dof.shape[1], dof.shape[1])),
            strain_stiffness=strain,
            regularisation=options.regularisation * np.where(diagonal > 0.0, diagonal, typical),
            interface_of_slot=np.empty(slots, dtype=np.int64),
            compliance=np.empty((3 * slots, 3 * slots)),
            change=np.empty((slots, 9)),
            changed_rows=np.empty(3 * slots, dtype=np.int64),
            relative=np.empty((2, 3 * slots)),
            correction_force=np.empty(6 * slots),
            capacitance=np.empty(9 * slots**2),
            capacitance_pivots=np.empty(3 * slots, dtype=np.int32),
            corrected=np.empty(slots, dtype=np.int64),
            target=np.array(self.elastic),
            wanted=self.elastic,
            changed=np.empty(count, dtype=np.int64),
            new=np.empty(3 * count, dtype=np.int64),
            scratch=np.empty(largest**2),
            loop_rows=options.max_loop_rows,
            batch=options.response_batch,
            keep_unchanged_fronts=options.keep_unchanged_fronts,
            keep_responses=options.keep_responses,
            woodbury_tolerance=options.woodbury_tolerance,
            refactorisation_ratio=options.refactorisation_ratio,
            singular_pivot_ratio=options.singular_pivot_ratio,
            right=np.empty((2, self.model.size)),
            solution=np.empty((2, self.model.size)),
            here=self.address,
            **{name: unit.address for name, unit in UNITS.items()},
            **costs_of(size, edge, options),
            **lapack_routines(max(largest, 3 * slots), options.inversion_panel),
        )
        if self._superelements is not None:
            self._set_blocks(self._superelements)

    def _set(self, **values: Any) -> None:
        """Set entries of the table, and keep its arrays."""
        self.arrays.update((name, value) for name, value in values.items() if isinstance(value, np.ndarray))
        fill(self.tangent, values)

    def _elastic_diagonal(self, strain_stiffness: FloatArray) -> FloatArray:
        """Return the diagonal of the elastic stiffness in the order of the fronts."""
        dof, rows = self.tree.kinematics
        own = np.einsum("mjr,mjr->mr", rows, self.elastic.reshape(-1, 3, 3) @ rows)
        summed = np.bincount(dof[dof >= 0], own[dof >= 0], self.model.size)
        total = summed.astype(np.float64)  # without joints they would be whole numbers
        if self._superelements is not None:
            for boundary, stiffness in zip(self._superelements.boundary, self._superelements.elastic):
                total[boundary] += stiffness.diagonal()
        return total[self.tree.dofs] + strain_stiffness

    def _set_blocks(self, blocks: Superelements) -> None:
        """Set the deformable blocks of all fronts."""
        self._set(
            front_blocks=self.tree.front_superelements,
            first_block=self.tree.first_superelement,
            block_first_dof=np.concatenate(([0], np.cumsum([len(boundary) for boundary in blocks.boundary]))),
            block_index=self.tree.superelement_index,
            first_entry=blocks.first_entry,
            tangents=blocks.tangents,
            assemble_blocks=assembly.assemble_blocks.address,
        )

    def activate(self, fronts: BoolArray) -> None:
        """Set the active fronts; see ``condense`` for all others.

        Parameters
        ----------
        fronts : array of bool (F,)
            With the ancestors of each.
        """
        tree = self.tree
        stale = self.arrays["stale"]
        stale[:] = fronts & (stale | ~self.active_fronts)  # regularised only while active
        self.condensation: StaticCondensation | None = None
        self.active_fronts = fronts
        active = self._is_active = np.append(fronts, True)[tree.interface_front]
        self.active, self.condensed_interfaces = np.flatnonzero(active), np.flatnonzero(~active)
        self.active_dofs = tree.dofs[np.repeat(fronts, tree.size)]
        size = len(self.active_dofs)
        index = np.full(self.model.size, -1, dtype=np.int64)  # among the active degrees of freedom
        index[self.active_dofs] = np.arange(size)
        operations = tree.size * (tree.size + 2 * tree.boundary_size)
        self._set(
            active=self.active,
            active_dofs=self.active_dofs,
            index=index,
            slot=np.full(len(self.elastic), -1, dtype=np.int64),
            load_slot=np.full((len(self.elastic), 3), -1, dtype=np.int64),
            **{name: room[: number * size].reshape(number, size) for name, (number, room) in self._rooms.items()},
            occupied=0,
            loads=0,
            corrected_count=0,
            spent=0.0,
            any_stale=1,
            solution_operations=2.0 * float(operations[fronts].sum()),
        )
        self._set(**self._rows_of(fronts, fronts))
        self._condensed_rows = self._rows_of(~fronts, np.ones_like(fronts))

    def are_active(self, interfaces: BoolArray | IntArray) -> bool:
        """Whether no interface listed is of a condensed front."""
        return bool(self._is_active[interfaces].all())

    def _rows_of(self, fronts: BoolArray, in_rows: BoolArray) -> dict[str, IntArray]:
        """Return the fronts that units work on, and where the degrees of freedom of those ``in_rows`` are in a row."""
        tree = self.tree
        start = np.cumsum(in_rows * tree.size) - in_rows * tree.size
        row = np.cumsum(np.repeat(in_rows, tree.size)) - 1
        return {"fronts": np.flatnonzero(fronts), "row_start": start, "boundary_row": row[tree.boundary]}

    def condense(
        self, fronts: BoolArray, load: FloatArray, live_load: FloatArray | None = None
    ) -> StaticCondensation | None:
        """Condense all fronts but some and their ancestors, elastic; make all active if these do not hold them.

        Parameters
        ----------
        fronts : array of bool (F,)
            Fronts that are active.
        load, live_load : array (size,)
            Dead and live load at load factor 1 (N, N m); None: no live load.
        """
        fronts = self.tree.ancestors(fronts)
        condensed = self.active_fronts & ~fronts
        held = not fronts.all()
        if condensed.any():
            held = self._eliminate_condensed(condensed)
            parents = self.tree.parent[condensed]
            self.arrays["stale"][parents[parents >= 0]] = True
        if not held:
            fronts = np.ones(self.tree.count, dtype=np.bool_)
            self.active_fronts &= ~condensed  # those are not regularised now
        self.activate(fronts)
        if held:
            self.condensation = StaticCondensation(self, load, live_load)
        return self.condensation

    def _eliminate_condensed(self, fronts: BoolArray) -> bool:
        """Eliminate some fronts, elastic; return whether their ancestors hold them.

        Of walls of one geometry and elastic stiffness, all from the third on take over what the second has computed.
        """
        interfaces, tree = np.flatnonzero(self.tree.in_fronts(fronts)), self.tree
        self.arrays["target"][interfaces] = self.elastic[interfaces]
        small = 8e-9 * tree.matrix_entries <= self.options.max_shared_memory
        if not (small and np.isnan(self.arrays["stiffness"]).all()):
            return self._eliminate_elastic(fronts, interfaces)
        of, known = (self.elastic, self.arrays["strain_stiffness"], fronts), tree.elastic_factors
        again = known is not None and all(map(np.array_equal, known.of, of))
        if known is None or not (again and known.arrays):
            held = self._eliminate_elastic(fronts, interfaces)
            arrays = {name: self.arrays[name].copy() for name in _OF_FACTORS} if again else {}
            tree.elastic_factors = ElasticFactors(of, arrays, self.elastic_complements.copy(), held)
            return held
        for name, array in known.arrays.items():
            self.arrays[name][:] = array
        self.elastic_complements = known.elastic_complements.copy()
        return known.held

    def _eliminate_elastic(self, fronts: BoolArray, interfaces: IntArray) -> bool:
        """Eliminate some fronts with elastic interfaces; return whether their ancestors hold them.

        Twice: their regularisation belongs to the tangent, not to the forces on their boundaries. Where a wall may rest
        in several positions, regularisation decides between them, and should not depend on which fronts are condensed.
        """
        outdated = self.arrays["outdated"]
        self.arrays["changed"][: len(interfaces)] = interfaces
        outdated[:] = fronts
        self._set(elastic=0, changed_count=len(interfaces))
        multifrontal.eliminate(self.address)
        regularised = self.arrays["complements"]
        if not self.elastic_complements.size:
            self.elastic_complements = np.empty_like(regularised)
        outdated[:] = fronts
        self._set(elastic=1, changed_count=0, complements=self.elastic_complements)
        multifrontal.eliminate(self.address)
        self._set(complements=regularised)
        return bool(self.tangent["held"])

    def update(self, stiffness: FloatArray) -> None:
        """Set the stiffness of the interfaces for the next ``solve``.

        Parameters
        ----------
        stiffness : array (m, 9)
            See ``joint_forces``; only active interfaces count.
        """
        self._stiffness = stiffness

    def prepare(self) -> None:
        """Set the stiffness of the next ``solve`` for kernels that solve by themselves."""
        self._wanted.set(self._stiffness)

    def solve(self, force: FloatArray) -> FloatArray:
        """Solve for the displacements of all degrees of freedom.

        Parameters
        ----------
        force : array (size,) or (r, size)
            Right-hand side, or one in each row; two at most.

        Returns
        -------
        array
            Of the same shape; 0 where prescribed or condensed.
        """
        self._update_blocks()
        rows = force.reshape(-1, force.shape[-1])
        self.arrays["right"][: len(rows)] = rows
        self.prepare()
        self.tangent["row_count"] = len(rows)
        solve_tangent(self.address)
        return self.arrays["solution"][: len(rows)].reshape(force.shape).copy()

    def condense_forces(self, force: FloatArray, particular: FloatArray) -> None:
        """Condense forces on condensed fronts to the active ones.

        Parameters
        ----------
        force, particular : array (r, degrees of freedom)
            In the order of the fronts; updated, and filled with the solution, active fronts fixed.
        """
        self.arrays["reached"][:] = True
        table = self.condensed_table(force, particular)
        multifrontal.forward(table.ctypes.data)

    def condensed_table(self, current: FloatArray, particular: FloatArray) -> np.ndarray:
        """Return a table for units that work on the condensed fronts, with a row for every degree of freedom.

        Parameters
        ----------
        current, particular : array (r, degrees of freedom)
            In the order of the fronts; see ``SYSTEM``.
        """
        table = self._table.view(np.int64).copy().view(SYSTEM)  # much faster than entry by entry
        fill(table[0], {**self._condensed_rows, "current": current, "particular": particular})
        return table

    def _update_blocks(self) -> None:
        """Take over the tangents of active deformable blocks."""
        if (blocks := self._superelements) is None:
            return
        front, yields = self.tree.superelement_front, self.arrays["yields"]
        changed = blocks.update_tangents()
        self.arrays["stale"][front[changed]] = True
        self.tangent["any_stale"] |= len(changed) > 0
        yields[:] = False
        yields[front[blocks.yielding]] = True

    def continue_counts(self, before: MultifrontalSystem) -> None:
        """Count iterations and factorisations on from those of the same wall with other supports."""
        for name in ("iterations", "factorisations"):
            self.tangent[name] += before.tangent[name]

    @property
    def factorisations(self) -> int:
        """Number of factorisations so far."""
        return int(self.tangent["factorisations"])

    @property
    def corrections(self) -> int:
        """Number of Woodbury corrections so far."""
        return int(self.tangent["corrections"])


def lapack_routines(largest: int, panel: int = DEFAULTS.inversion_panel) -> dict[str, Any]:
    """Return the addresses of SciPy's LAPACK, and room for its arguments and for matrices up to a largest size.

    Parameters
    ----------
    largest : int
        Rows and columns.
    panel : int
        Columns that are inverted at a time.
    """
    return {
        **{name: _address(name) for name in ("dgemm", "dgetrf", "dgetri", "dgetrs")},
        "lapack_integers": np.zeros(8, dtype=np.int32),
        "lapack_reals": np.zeros(2),
        "lapack_letters": lapack.LETTERS,
        "pivots": np.zeros(largest, dtype=np.int32),
        "lapack_work": np.zeros(panel * largest),
        "inversion_panel": panel,
        "block_room": np.empty(panel * (3 * largest + panel)),
    }


def _address(name: str) -> int:
    """Return the address of a routine of SciPy's BLAS or LAPACK."""
    module = "scipy.linalg.cython_blas" if name == "dgemm" else "scipy.linalg.cython_lapack"
    return int(get_cython_function_address(module, name))


def costs_of(size: IntArray, edge: IntArray, options: LinearSystemOptions) -> dict[str, Any]:
    """Return the costs of factorisations and corrections.

    Parameters
    ----------
    size, edge : array of int (F,)
        Degrees of freedom of each front, and of its boundary.
    options : LinearSystemOptions
        Weights of operations.
    """
    n, b = size.astype(np.float64), edge.astype(np.float64)
    products = options.product_weight * 2.0 * n * b * (n + b)
    weights = ("call_overhead", "response_weight", "solution_weight", "vector_weight", "product_weight")
    return {
        "factorisation_cost": options.assembly_weight * n + options.inversion_weight * n**3 + products,
        **{name: getattr(options, name) for name in weights},
    }
