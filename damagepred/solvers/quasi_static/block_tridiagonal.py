"""Block tridiagonal factorisation of the tangent stiffness, level by level from the farthest to the ground.

A change in one level leaves the Schur complements of all farther ones as they are, so elimination restarts there.
"""

from __future__ import annotations

import numpy as np

from damagepred.arrays import FloatArray, IntArray
from damagepred.errors import InputError
from damagepred.kernels.linear.assembly import (
    assemble_blocks,
    assemble_couplings,
    assemble_level,
    couple_blocks,
    farthest_unsymmetric,
    interface_stiffness,
)
from damagepred.kernels.linear.block_tridiagonal import Levels, back_substitution, forward_elimination, schur_complement
from damagepred.solvers.quasi_static.dense_inverse import invert
from damagepred.solvers.quasi_static.level_layout import LevelLayout
from damagepred.solvers.quasi_static.options import LinearSystemOptions
from damagepred.solvers.quasi_static.superelements import Superelements
from damagepred.solvers.system.discrete_system import DiscreteSystem


class BlockTridiagonalFactors:
    """Inverses, Schur complements and couplings of the levels of a wall.

    Its arguments are those of ``BlockTridiagonalSystem``, with the layout of the levels.

    Attributes
    ----------
    stiffness : array (m, 9)
        Factorised stiffness of the interfaces.
    interface_matrices : array (m, w, w)
        The same between the degrees of freedom of their sides.
    schur_complements : list of array (s, s)
        What the elimination of the next level subtracts from the stiffness of each level, transposed.
    levels : Levels
        Inverses and couplings of all levels, as the kernels of elimination take them.
    """

    def __init__(
        self,
        system: DiscreteSystem,
        layout: LevelLayout,
        elastic: FloatArray,
        superelements: Superelements | None,
        options: LinearSystemOptions,
    ) -> None:
        self.layout, self.elastic, self.options = layout, elastic, options
        self._superelements = superelements
        self._first_strain, self._strain_stiffness = system.strain_dofs.start, system.strain_stiffness
        inverse_start = np.concatenate(([0], np.cumsum(layout.size**2)))
        if (needed := 16e-9 * float(inverse_start[-1])) > options.max_memory:
            raise InputError(
                f"the quasi-static solver would need {needed:.0f} GB for its matrices, and takes "
                f"{options.max_memory:g} GB at most; take a larger solver.zone_size, cut fewer blocks, or take "
                f"method = 'explicit'."
            )
        self.stiffness = elastic.copy()
        width = layout.kinematics.dof.shape[1]
        self.interface_matrices = np.empty((len(elastic), width, width))
        self.set_stiffness(np.arange(len(elastic)), elastic)
        side = layout.far_index.shape[1]
        indices, couplings = (layout.far_index, layout.near_index), np.zeros((2, len(layout.far_index), side, side))
        inverses = np.zeros(inverse_start[-1])
        self.levels = Levels(layout.start, inverses, inverse_start, layout.first_pair, *indices, *couplings)
        if superelements is not None:
            self._couple_blocks(np.arange(len(superelements.block)))
        self.schur_complements = [np.zeros((s, s)) for s in layout.size]
        diagonals = [self._level_stiffness(k).diagonal() for k in range(layout.levels)]
        # a block without joints keeps its place
        typical_diagonal = max((float(values.max(initial=0.0)) for values in diagonals), default=0.0) or 1.0
        self._regularisation = [options.regularisation * np.where(d > 0.0, d, typical_diagonal) for d in diagonals]

    def set_stiffness(self, listed: IntArray, stiffness: FloatArray) -> None:
        """Set the stiffness of some interfaces for the next factorisation.

        Parameters
        ----------
        listed : array of int
            The interfaces.
        stiffness : array (m, 9)
            Of all interfaces.
        """
        self.stiffness[listed] = stiffness[listed]
        interface_stiffness(listed, self.layout.kinematics, self.stiffness, self.interface_matrices)

    def solve(self, force: FloatArray, levels: int, farthest: int) -> FloatArray:
        """Solve for rows of forces, which become displacements.

        Parameters
        ----------
        force : array (r, active degrees of freedom)
            In the order of the levels; overwritten.
        levels : int
            Number of active levels.
        farthest : int
            Level beyond which there are no forces.
        """
        particular = np.zeros_like(force)
        forward_elimination(self.levels, farthest, 0, force, particular)
        back_substitution(self.levels, 0, levels, particular, force, np.empty_like(force))
        return force

    def update_superelements(self) -> int:
        """Take over the tangents of active deformable blocks; return the farthest level that they change, or -1."""
        if self._superelements is None:
            return -1
        changed = self._superelements.update_tangents()
        self._couple_blocks(changed)
        return int(self.layout.superelement_level[changed].max(initial=-1))

    def _couple_blocks(self, blocks: IntArray) -> None:
        """Compute the couplings of divided blocks."""
        assert self._superelements is not None
        of_blocks = self._superelements.first_entry, self._superelements.tangents
        couple_blocks(blocks, self.layout.block_places, *of_blocks, self.levels.near_far, self.levels.far_near)

    def refactorise(self, farthest: int, active: IntArray) -> None:
        """Eliminate all levels from the farthest changed one to the ground.

        Parameters
        ----------
        farthest : int
            Farthest level that has changed.
        active : array of int
            Interfaces that may be unsymmetric.
        """
        self._assemble_couplings(farthest)
        # Schur complements inherit symmetry from farther levels; tangents of yielding blocks need not have it
        yields = -1
        if self._superelements is not None:
            yields = int(self.layout.superelement_level[self._superelements.yielding].max(initial=-1))
        farthest_unsymmetric_level = max(
            farthest_unsymmetric(active, self.layout.interface_level, self.stiffness), yields
        )
        for k in range(farthest, -1, -1):
            self._eliminate(k, symmetric=k > farthest_unsymmetric_level)

    def eliminate_elastic(self, nearest: int) -> bool:
        """Eliminate the levels from the farthest to ``nearest``, elastic; return whether the nearer ones hold them.

        They are not regularised, which would hold them in space.
        """
        at = self.layout
        self.set_stiffness(np.flatnonzero(at.interface_level >= nearest), self.elastic)
        self._assemble_couplings(at.levels - 1)
        return all(self._eliminate(k, regularised=False) for k in range(at.levels - 1, nearest - 1, -1))

    def _assemble_couplings(self, farthest: int) -> None:
        """Assemble the couplings of all levels up to a farthest one with their nearer neighbours."""
        at = self.layout
        last, pairs = at.first_coupling[farthest + 1], at.first_pair[farthest + 1]
        couplings, pair, far_is_b = at.couplings[:last], at.pair[:last], at.far_is_b[:last]
        near_far, far_near = self.levels.near_far[:pairs], self.levels.far_near[:pairs]
        assemble_couplings(couplings, pair, far_is_b, self.interface_matrices, near_far, far_near)

    def _eliminate(self, k: int, regularised: bool = True, symmetric: bool = True) -> bool:
        """Invert a level, farther ones eliminated, and compute its Schur complement; False if nothing holds it."""
        at = self.layout
        if at.size[k] == 0:
            if k > 0:
                self.schur_complements[k - 1][:] = 0.0
            return True
        matrix = self._level_stiffness(k)
        if regularised:
            matrix.ravel()[:: len(matrix) + 1] += self._regularisation[k]
        if k + 1 < at.levels:
            matrix -= self.schur_complements[k]
        first, last = self.levels.inverse_start[k : k + 2]
        inverse = self.levels.inverses[first:last].reshape(matrix.shape)
        pivot_ratio = invert(matrix, symmetric, inverse, self.options.inversion_panel)
        if not regularised and pivot_ratio < self.options.singular_pivot_ratio:
            return False
        if k > 0:
            work = np.empty((at.size[k - 1], at.size[k]))
            schur_complement(self.levels, k, inverse, work, self.schur_complements[k - 1])
        return True

    def assemble_level(self, k: int, interfaces: IntArray) -> FloatArray:
        """Return the stiffness of some interfaces within a level, transposed, the displacements of all others held.

        Parameters
        ----------
        k : int
            The level.
        interfaces : array of int
            The interfaces.
        """
        at, matrix = self.layout, np.zeros((self.layout.size[k], self.layout.size[k]))
        dofs = at.kinematics.dof
        assemble_level(interfaces, dofs, self.interface_matrices, at.index_in_level, at.level_of_dof, k, matrix)
        return matrix

    def _level_stiffness(self, k: int) -> FloatArray:
        """Return the stiffness within a level, transposed."""
        at = self.layout
        matrix = self.assemble_level(k, at.interfaces_at_level[k])
        if len(self._strain_stiffness):
            strain = at.dofs[at.start[k] : at.start[k + 1]] - self._first_strain
            strains = np.flatnonzero(strain >= 0)
            matrix[strains, strains] += self._strain_stiffness[strain[strains]]
        if (blocks := self._superelements) is not None:
            of_blocks = at.block_places, blocks.first_entry, blocks.tangents, at.index_in_level, at.level_of_dof
            assemble_blocks(at.superelements_at_level[k], *of_blocks, k, len(matrix), matrix.ravel())
        return matrix
