"""Correction of a factorised system for a few changed interfaces, by the Woodbury identity (Hager 1989)."""

from __future__ import annotations

import numpy as np
from scipy.linalg import lapack

from damagepred.arrays import FloatArray, IntArray
from damagepred.kernels.linear.block_tridiagonal import solve_columns
from damagepred.kernels.linear.woodbury import (
    capacitance_equations,
    correction_agrees,
    relative_displacements,
    stiffness_changes,
    subtract_correction,
    unit_loads,
)
from damagepred.solvers.quasi_static.block_tridiagonal import BlockTridiagonalFactors


class WoodburyCorrection:
    """Responses of the factorised system to unit loads in interfaces, and the corrections that they give.

    Parameters
    ----------
    factors : BlockTridiagonalFactors
        The factorised system.
    levels : int
        Number of active levels.

    Attributes
    ----------
    slot : array of int (m,)
        Slot of an interface among those with unit-load responses, -1 if it has none.
    occupied : int
        Number of occupied slots.
    """

    def __init__(self, factors: BlockTridiagonalFactors, levels: int) -> None:
        self._factors, self._levels, at = factors, levels, factors.layout
        size = int(at.start[levels])
        self._index = np.full(at.index_in_level.size, -1, dtype=np.int64)  # among the active degrees of freedom
        self._index[at.dofs[:size]] = np.arange(size)
        slots = factors.options.max_changed_interfaces
        self._interface_of_slot = np.empty(slots, dtype=np.int64)
        self._unit_load_response = np.empty((3 * slots, size))
        self._compliance = np.empty((3 * slots, 3 * slots))
        self.discard_responses()

    def discard_responses(self) -> None:
        """Discard all unit-load responses, as those of a new factorisation differ."""
        self.slot = np.full(len(self._factors.stiffness), -1, dtype=np.int64)
        self.occupied = 0

    def solve(self, force: FloatArray, changed: IntArray, target_stiffness: FloatArray) -> FloatArray | None:
        """Solve for rows of forces; None if the correction is too inaccurate.

        Parameters
        ----------
        force : array (r, active degrees of freedom)
            In the order of the levels; overwritten.
        changed : array of int
            Changed interfaces.
        target_stiffness : array (m, 9)
            Stiffness of the interfaces.
        """
        factors, kinematics = self._factors, self._factors.layout.kinematics
        new = changed[self.slot[changed] < 0]
        if len(new):
            self._add_unit_load_responses(new)
        slots, size = self.slot[changed], 3 * len(changed)
        change, rows = np.empty((len(changed), 9)), np.empty(size, dtype=np.int64)
        rows = rows[: stiffness_changes(changed, target_stiffness, factors.stiffness, change, rows)]
        u = factors.solve(force, self._levels, self._levels - 1)
        relative, forces = np.empty((size, len(force))), np.empty((len(force), len(rows)))
        relative_displacements(changed, kinematics, self._index, u, relative)
        matrix = np.empty((len(rows), len(rows)))
        capacitance_equations(self._compliance, slots, change, rows, relative, matrix, forces)
        # LAPACK is column-major: to it the transposed matrix is the matrix
        _, _, solution, singular = lapack.dgesv(matrix.T, forces.T, overwrite_a=1, overwrite_b=1)
        if singular:
            return None
        forces = solution.T
        subtract_correction(forces, rows, slots, self._unit_load_response, u)
        relative_displacements(changed, kinematics, self._index, u, relative)
        return u if correction_agrees(rows, change, relative, forces, factors.options.woodbury_tolerance) else None

    def _add_unit_load_responses(self, new: IntArray) -> None:
        """Compute the response to unit loads in new interfaces, and the compliance between all that have a slot."""
        factors, kinematics = self._factors, self._factors.layout.kinematics
        before, after = self.occupied, self.occupied + len(new)
        farthest = int(factors.layout.interface_level[new].max())
        response = self._unit_load_response[3 * before : 3 * after]
        force = np.zeros((self._unit_load_response.shape[1], 3 * len(new)))
        unit_loads(new, kinematics, self._index, force)
        if 3 * len(new) <= factors.options.max_loop_rows:
            response[:] = force.T
            factors.solve(response, self._levels, farthest)
        else:
            solve_columns(factors.levels, self._levels, farthest, force, np.empty_like(force))
            response[:] = force.T
        self._interface_of_slot[before:after] = new
        self.slot[new], self.occupied = np.arange(before, after), after
        columns = np.empty((3 * after, 3 * len(new)))
        relative_displacements(self._interface_of_slot[:after], kinematics, self._index, response, columns)
        self._compliance[: 3 * after, 3 * before : 3 * after] = columns
        if before:
            rows = np.empty((3 * len(new), 3 * before))
            relative_displacements(new, kinematics, self._index, self._unit_load_response[: 3 * before], rows)
            self._compliance[3 * before : 3 * after, : 3 * before] = rows
