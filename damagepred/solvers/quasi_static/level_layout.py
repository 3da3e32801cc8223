"""Levels of a wall: the order in which block tridiagonal elimination takes its degrees of freedom and interfaces.

Blocks that touch the ground or a support are level 0, their neighbours level 1, and so on. An interface lies within a
level or couples two neighbouring ones.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from damagepred.arrays import IntArray
from damagepred.solvers.quasi_static.superelements import Superelements
from damagepred.solvers.system.discrete_system import DiscreteSystem
from damagepred.solvers.system.interface_kinematics import interface_kinematics


class LevelLayout:
    """Degrees of freedom, interfaces and superelements of each level.

    Parameters
    ----------
    system : DiscreteSystem
        Of n blocks and m interfaces.
    superelements : Superelements or None
        The deformable blocks; their interior degrees of freedom are in no level.

    Attributes
    ----------
    levels : int
        Number of levels.
    level_of_dof : array of int (size,)
        Level of each degree of freedom.
    dofs, size, start : array of int
        Free degrees of freedom in the order of the levels, their number in each level, and where each level starts.
    index_in_level : array of int (size,)
        Index of each degree of freedom in its level, -1 if it is in none.
    interface_level, interfaces_of_level
        Level of each interface, of a coupling the farther one; and the interfaces of each level.
    couplings, first_coupling, far_is_b, pair : array
        Interfaces between levels, those between k and k - 1 from ``first_coupling[k]`` to ``first_coupling[k + 1]``;
        whether block b is the one in the farther level; and the pair of sides that each couples.
    first_pair : array of int (levels + 1,)
        As ``first_coupling``, of the pairs: the parts of one joint couple the same sides.
    far_index, near_index : array of int (pairs, w / 2)
        Indices in their levels of the degrees of freedom of a pair's two sides, -1 where prescribed.
    superelement_level, superelements_of_level
        Level of each deformable block; and for each level the block, its free degrees of freedom and their indices.
    """

    def __init__(self, system: DiscreteSystem, superelements: Superelements | None) -> None:
        self.level_of_block = block_levels(system)
        self.level_of_dof = self.level_of_block[system.block_of_dof]
        dofs = system.free_dofs if superelements is None else np.setdiff1d(system.free_dofs, superelements.interior)
        self.dofs = dofs[np.lexsort((dofs, self.level_of_dof[dofs]))]
        self.levels = int(self.level_of_block.max()) + 1
        self.size = np.bincount(self.level_of_dof[self.dofs], minlength=self.levels).astype(np.int64)
        self.start = np.concatenate(([0], np.cumsum(self.size)))
        self.index_in_level = np.full(system.model.size, -1, dtype=np.int64)
        self.index_in_level[self.dofs] = np.arange(len(self.dofs)) - self.start[self.level_of_dof[self.dofs]]
        self.kinematics = interface_kinematics(system.model)
        self._list_interfaces(system)
        self.superelements_of_level: list[list[tuple[int, IntArray, IntArray]]] = [[] for _ in range(self.levels)]
        self.superelement_level = np.empty(0, dtype=np.int64)
        if superelements is not None:
            self.superelement_level = self.level_of_block[superelements.block]
            for d, k in enumerate(self.superelement_level):
                index = self.index_in_level[superelements.boundary[d]]
                free = np.flatnonzero(index >= 0)
                self.superelements_of_level[k].append((d, free, index[free]))

    def _list_interfaces(self, system: DiscreteSystem) -> None:
        face, n, levels = system.model.interfaces, system.model.n_blocks, np.arange(self.levels + 1)
        a, b = face.block_a, face.block_b
        level_a, level_b = self.level_of_block[a], self.level_of_block[b]
        self.interface_level = np.where(a == n, level_b, np.where(b == n, level_a, np.maximum(level_a, level_b)))
        couplings = np.flatnonzero((level_a != level_b) & (a != n) & (b != n))
        self.couplings = couplings[np.argsort(self.interface_level[couplings], kind="stable")]
        self.first_coupling = np.searchsorted(self.interface_level[self.couplings], levels)
        self.far_is_b = ~(level_a > level_b)[self.couplings]
        dof = self.kinematics.dof[self.couplings].reshape(len(self.couplings), 2, self.kinematics.dof.shape[1] // 2)
        index = np.where(dof >= 0, self.index_in_level[dof], -1)
        each, far, level = np.arange(len(self.couplings)), self.far_is_b.astype(np.int64), self.interface_level
        sides = np.column_stack((level[self.couplings], index[each, far], index[each, 1 - far]))
        _, first, pair = np.unique(sides, axis=0, return_index=True, return_inverse=True)
        in_order = np.argsort(first)  # as the couplings, which are in the order of the levels
        self.pair = np.argsort(in_order)[pair.ravel()]
        sides = sides[first[in_order]]
        self.first_pair = np.searchsorted(sides[:, 0], levels)
        self.far_index, self.near_index = map(np.ascontiguousarray, np.hsplit(sides[:, 1:], 2))
        order = np.argsort(self.interface_level, kind="stable")
        edges = np.searchsorted(self.interface_level[order], levels)
        of_level = [order[first:last] for first, last in pairwise(edges)]
        self.interfaces_at_level = [np.append(i, self.couplings_of(k + 1)) for k, i in enumerate(of_level[:-1])]
        self.interfaces_at_level.append(of_level[-1])

    def couplings_of(self, k: int) -> IntArray:
        """Return the interfaces between levels k and k - 1."""
        return self.couplings[self.first_coupling[k] : self.first_coupling[k + 1]]


def block_levels(system: DiscreteSystem) -> IntArray:
    """Return the level of each block and of the ground (n + 1,): its distance from ground and supports, in joints.

    Blocks without a connection to them are in the farthest level.
    """
    model, n = system.model, system.model.n_blocks
    a, b = model.interfaces.block_a, model.interfaces.block_b
    holds = ~model.guides  # distance from fully supported blocks
    # a footing is one level, wherever it is supported
    footing = np.empty(0, dtype=np.int64) if model.footing is None else model.footing
    start, end = np.append(a[holds], np.full(len(footing), n)), np.append(b[holds], footing)
    # dependent degrees of freedom are not prescribed
    constrained = np.setdiff1d(system.constrained_dofs, system.dependent_dofs)
    blocks, ways = np.unique(system.block_of_dof[constrained], return_counts=True)
    roots = blocks[ways >= 3]
    if len(roots) == 1 and not len(footing) and not ((a == n) | (b == n)).any():
        roots = blocks
    joined = csr_array((np.ones(len(start)), (start, end)), shape=(n + 1, n + 1))
    away = dijkstra(joined, directed=False, unweighted=True, indices=roots, min_only=True)
    # ground and supports are no level of their own: blocks that touch them are level 0
    connected = np.isfinite(away)
    levels = np.maximum(away - 1.0, 0.0)
    return np.where(connected, levels, levels[connected].max(initial=0.0)).astype(np.int64)
