"""Tangent equations of a wall: block tridiagonal factorisation, with Woodbury corrections for few changes.

A change in one level leaves the Schur complements of all farther ones as they are, so elimination restarts there. Most
Newton iterations change a few interfaces only: then the last factorisation is corrected by the Woodbury identity.
Levels that stay elastic are statically condensed to a superelement on the boundary level once.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba.extending import get_cython_function_address

from damagepred.arrays import FloatArray, IntArray
from damagepred.errors import InputError
from damagepred.kernels.linear import assembly, block_tridiagonal, lapack, woodbury
from damagepred.kernels.linear.system import solve_tangent
from damagepred.kernels.linear.table import SYSTEM
from damagepred.kernels.table import fill
from damagepred.solvers.quasi_static.level_layout import LevelLayout
from damagepred.solvers.quasi_static.options import LinearSystemOptions
from damagepred.solvers.quasi_static.static_condensation import StaticCondensation
from damagepred.solvers.quasi_static.superelements import Superelements
from damagepred.solvers.system.discrete_system import DiscreteSystem

DEFAULTS = LinearSystemOptions()
UNITS = {
    unit.name: unit
    for unit in (
        assembly.set_stiffness,
        assembly.assemble_level,
        assembly.assemble_couplings,
        block_tridiagonal.schur_complement,
        lapack.invert,
        block_tridiagonal.eliminate,
        block_tridiagonal.forward,
        block_tridiagonal.back,
        block_tridiagonal.solve_columns,
        woodbury.add_compliance,
        woodbury.stiffness_changes,
        woodbury.relative_displacements,
        woodbury.fill_capacitance,
        woodbury.respond,
        woodbury.correct,
    )
}
"""Units of the tangent equations that others call, by name."""


class BlockTridiagonalSystem:
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
    condensation : StaticCondensation or None
        Superelement of the condensed levels; None if all levels are active.
    active, condensed_interfaces : array of int
        Interfaces of active and of condensed levels.
    active_dofs : array of int
        Free degrees of freedom of active levels, in the order of the levels.
    """

    def __init__(
        self,
        system: DiscreteSystem,
        elastic: FloatArray,
        superelements: Superelements | None = None,
        options: LinearSystemOptions = DEFAULTS,
    ) -> None:
        self.model, self.options, self.elastic = system.model, options, elastic
        self.layout = LevelLayout(system, superelements)
        self._superelements = superelements
        self._stiffness = elastic
        self._table = np.zeros(1, SYSTEM)
        self.arrays: dict[str, np.ndarray] = {}
        self.tangent, self.address = self._table[0], self._table.ctypes.data
        self._allocate(system)
        self.set_active_levels(self.layout.levels)

    def _allocate(self, system: DiscreteSystem) -> None:
        """Make the arrays that all numbers of active levels share."""
        at, options, count = self.layout, self.options, len(self.elastic)
        inverse_start = np.concatenate(([0], np.cumsum(at.size**2)))
        entries, largest = int(inverse_start[-1]), int(at.size.max())
        if (needed := 16e-9 * entries) > options.max_memory:
            raise InputError(
                f"the quasi-static solver would need {needed:.0f} GB for its matrices, and takes "
                f"{options.max_memory:g} GB at most; take a larger solver.zone_size, cut fewer blocks, or take "
                f"method = 'explicit'."
            )
        strain = np.zeros(self.model.size)
        strain[system.strain_dofs] = system.strain_stiffness
        strain = strain[at.dofs]
        diagonal = self._elastic_diagonal(strain)
        # a block without joints keeps its place
        typical = diagonal.max(initial=0.0) or 1.0
        (dof, displacement), side, slots = at.kinematics, at.far_index.shape[1], options.max_changed_interfaces
        self._set(
            start=at.start,
            inverse_start=inverse_start,
            inverses=np.zeros(entries),
            complements=np.zeros(entries),
            first_pair=at.first_pair,
            far_index=at.far_index,
            near_index=at.near_index,
            near_far=np.zeros((len(at.far_index), side, side)),
            far_near=np.zeros((len(at.far_index), side, side)),
            dof=dof,
            strain_displacement=displacement,
            interface_level=at.interface_level,
            level_interfaces=np.concatenate(at.interfaces_at_level),
            first_interface=np.concatenate(([0], np.cumsum([len(i) for i in at.interfaces_at_level]))),
            index_in_level=at.index_in_level,
            level_of_dof=at.level_of_dof,
            couplings=at.couplings,
            first_coupling=at.first_coupling,
            pair=at.pair,
            far_is_b=at.far_is_b,
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
            target=np.array(self.elastic),
            changed=np.empty(count, dtype=np.int64),
            new=np.empty(count, dtype=np.int64),
            scratch=np.empty((2, largest**2)),
            blocks_level=-1,
            loop_rows=options.max_loop_rows,
            batch=options.response_batch,
            keep_farther_levels=options.keep_farther_levels,
            keep_responses=options.keep_responses,
            woodbury_tolerance=options.woodbury_tolerance,
            singular_pivot_ratio=options.singular_pivot_ratio,
            right=np.empty((2, self.model.size)),
            solution=np.empty((2, self.model.size)),
            here=self.address,
            **{name: unit.address for name, unit in UNITS.items()},
            **costs_of(at.size, options),
            **lapack_routines(max(largest, 3 * slots), options.inversion_panel),
        )
        if self._superelements is not None:
            self._set_blocks(self._superelements)

    def _set(self, **values: Any) -> None:
        """Set entries of the table, and keep its arrays."""
        self.arrays.update((name, value) for name, value in values.items() if isinstance(value, np.ndarray))
        fill(self.tangent, values)

    def _elastic_diagonal(self, strain_stiffness: FloatArray) -> FloatArray:
        """Return the diagonal of the elastic stiffness in the order of the levels."""
        (dof, rows), total = self.layout.kinematics, np.zeros(self.model.size)
        own = np.einsum("mjr,mjk,mkr->mr", rows, self.elastic.reshape(-1, 3, 3), rows)
        np.add.at(total, dof[dof >= 0], own[dof >= 0])
        if self._superelements is not None:
            for boundary, stiffness in zip(self._superelements.boundary, self._superelements.elastic):
                total[boundary] += stiffness.diagonal()
        return total[self.layout.dofs] + strain_stiffness

    def _set_blocks(self, blocks: Superelements) -> None:
        """Set the deformable blocks of all levels, and couple those that are divided among two."""
        at, places = self.layout, self.layout.block_places
        self._set(
            first_block=np.concatenate(([0], np.cumsum([len(i) for i in at.superelements_at_level]))),
            level_blocks=np.concatenate(at.superelements_at_level),
            block_first_dof=places.first_dof,
            block_dofs=places.dofs,
            first_entry=blocks.first_entry,
            tangents=blocks.tangents,
            assemble_blocks=assembly.assemble_blocks.address,
            has_blocks=1,
        )
        self._couple_blocks(blocks, np.arange(len(blocks.block)))

    def _couple_blocks(self, blocks: Superelements, listed: IntArray) -> None:
        """Compute the couplings of divided blocks."""
        near_far, far_near = self.arrays["near_far"], self.arrays["far_near"]
        places = self.layout.block_places
        assembly.couple_blocks(listed, places, blocks.first_entry, blocks.tangents, near_far, far_near)

    def set_active_levels(self, active_levels: int) -> None:
        """Set the number of active levels; see ``condense`` for those beyond."""
        at, slots = self.layout, self.options.max_changed_interfaces
        self.condensation: StaticCondensation | None = None
        self.active_levels = active_levels
        self.active = np.flatnonzero(at.interface_level < active_levels)
        self.condensed_interfaces = np.flatnonzero(at.interface_level >= active_levels)
        self.active_dofs = at.dofs[: at.start[active_levels]]
        size, batch = len(self.active_dofs), 3 * self.options.response_batch
        index = np.full(at.index_in_level.size, -1, dtype=np.int64)  # among the active degrees of freedom
        index[self.active_dofs] = np.arange(size)
        self._set(
            active_levels=active_levels,
            active=self.active,
            active_dofs=self.active_dofs,
            index=index,
            slot=np.full(len(self.elastic), -1, dtype=np.int64),
            response=np.empty((3 * slots, size)),
            unit=np.empty(batch * size),
            unit_response=np.empty(batch * size),
            rows=np.empty((2, size)),
            room=np.empty((2 * max(self.options.max_loop_rows, 2), size)),
            occupied=0,
            spent=0.0,
            farthest_changed=active_levels - 1,
        )

    def condense(
        self, active_levels: int, load: FloatArray, live_load: FloatArray | None = None
    ) -> StaticCondensation | None:
        """Condense all levels from ``active_levels`` on, elastic; make all active if these do not hold them.

        Parameters
        ----------
        active_levels : int
            Number of active levels, from the ground on.
        load, live_load : array (size,)
            Dead and live load at load factor 1 (N, N m); None: no live load.
        """
        active_levels, levels = int(self.layout.whole_blocks[active_levels]), self.layout.levels
        held = active_levels < levels
        if active_levels < self.active_levels:
            condensed = np.flatnonzero(self.layout.interface_level >= active_levels)
            self.arrays["target"][condensed] = self.elastic[condensed]
            self.arrays["changed"][: len(condensed)] = condensed
            self._set(farthest=levels - 1, nearest=active_levels, elastic=1, changed_count=len(condensed))
            block_tridiagonal.eliminate(self.address)
            held = bool(self.tangent["held"])
        self.set_active_levels(active_levels if held else levels)
        if held:
            self.condensation = StaticCondensation(self, load, live_load)
        return self.condensation

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
        if self.arrays.get("wanted") is not self._stiffness:
            self._set(wanted=self._stiffness)

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

    def condense_forces(self, nearest: int, force: FloatArray, particular: FloatArray) -> None:
        """Condense forces on all levels from ``nearest`` on to the next level.

        Parameters
        ----------
        nearest : int
            Nearest level that is condensed.
        force, particular : array (r, degrees of freedom)
            In the order of the levels; updated, and filled with the solution, nearer levels fixed.
        """
        self._set(current=force, particular=particular, farthest=self.layout.levels - 1, nearest=nearest)
        block_tridiagonal.forward(self.address)

    def recover(self, first: int, displacement: FloatArray, particular: FloatArray) -> None:
        """Recover the displacements of all levels from ``first`` on from those of the nearer ones.

        Parameters
        ----------
        first : int
            Nearest level that is recovered.
        displacement, particular : array (r, degrees of freedom)
            In the order of the levels; updated, and the particular solution, overwritten.
        """
        levels = {"first_back": first, "last_back": self.layout.levels}
        fill(self.tangent, {"current": displacement, "particular": particular, **levels})
        block_tridiagonal.back(self.address)

    def coupling_stiffness(self, k: int) -> FloatArray:
        """Return the elastic stiffness of the couplings between levels k + 1 and k within level k, transposed."""
        at, size = self.layout, int(self.layout.size[k])
        listed = at.couplings_of(k + 1)
        rows, dof = at.kinematics.rows[listed], at.kinematics.dof[listed]
        own = np.einsum("mjr,mjk,mkc->mrc", rows, self.elastic[listed].reshape(-1, 3, 3), rows)
        index = np.where((dof >= 0) & (at.level_of_dof[dof] == k), at.index_in_level[dof], -1)
        down, along = np.broadcast_to(index[:, :, None], own.shape), np.broadcast_to(index[:, None], own.shape)
        here = (down >= 0) & (along >= 0)
        matrix = np.zeros((size, size))
        np.add.at(matrix, (along[here], down[here]), own[here])
        return matrix

    def _update_blocks(self) -> None:
        """Take over the tangents of active deformable blocks."""
        if (blocks := self._superelements) is None:
            return
        changed = blocks.update_tangents()
        self._couple_blocks(blocks, changed)
        level = self.layout.superelement_level
        self._set(
            farthest_changed=max(int(self.tangent["farthest_changed"]), int(level[changed].max(initial=-1))),
            blocks_level=int(level[blocks.yielding].max(initial=-1)),
        )

    def continue_counts(self, before: BlockTridiagonalSystem) -> None:
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
        Columns that LAPACK inverts at a time.
    """
    return {
        **{name: _address(name) for name in ("dgemm", "dpotrf", "dpotri", "dgetrf", "dgetri", "dgesv")},
        "lapack_integers": np.zeros(4, dtype=np.int32),
        "lapack_reals": np.zeros(2),
        "lapack_letters": lapack.LETTERS,
        "pivots": np.zeros(largest, dtype=np.int32),
        "lapack_work": np.zeros(panel * largest),
    }


def _address(name: str) -> int:
    """Return the address of a routine of SciPy's BLAS or LAPACK."""
    module = "scipy.linalg.cython_blas" if name == "dgemm" else "scipy.linalg.cython_lapack"
    return int(get_cython_function_address(module, name))


def costs_of(size: IntArray, options: LinearSystemOptions) -> dict[str, Any]:
    """Return the costs of factorisations and corrections.

    Parameters
    ----------
    size : array of int (levels,)
        Degrees of freedom of each level.
    options : LinearSystemOptions
        Weights of operations.
    """
    n, squares = size.astype(np.float64), size.astype(np.float64) ** 2
    # an inversion takes n^3 operations, the Schur complement about 25 n^2: a block has two couplings of 9 entries
    dense, sparse = options.inversion_weight * n**3, options.elimination_weight * 25.0 * squares
    sums = (np.concatenate(([0.0], np.cumsum(v))) for v in (2.0 * options.call_overhead + dense + sparse, n, squares))
    weights = ("call_overhead", "solution_weight", "vector_weight", "product_weight")
    return {
        **dict(zip(("factorisation_cost", "level_sizes", "level_squares"), sums)),
        **{name: getattr(options, name) for name in weights},
    }
