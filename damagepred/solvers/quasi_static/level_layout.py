"""Levels of a wall: the order in which block tridiagonal elimination takes its degrees of freedom and interfaces.

Blocks that touch the ground or a support are level 0, their neighbours level 1, and so on. A level of deformable blocks
is divided in two: gridpoints that touch the level before, then all others. An interface, and a divided block, lies
within a level or couples two neighbouring ones.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from damagepred.arrays import IntArray
from damagepred.kernels.linear.assembly import BlockPlaces
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
    whole_blocks : array of int (levels + 1,)
        Smallest number of levels, at least as large, that ends with whole blocks.
    level_of_dof : array of int (size,)
        Level of each degree of freedom.
    dofs, size, start : array of int
        Free degrees of freedom in the order of the levels, their number in each level, and where each level starts.
    index_in_level : array of int (size,)
        Index of each degree of freedom in its level, -1 if it is in none.
    kinematics : InterfaceKinematics
        Of the interfaces; the sides of one within divided blocks are its degrees of freedom in either level.
    interface_level, interfaces_at_level
        Level of each interface, of a coupling the farther one; and the interfaces with a side in each level.
    couplings, first_coupling, far_is_b, pair : array
        Interfaces between levels, those between k and k - 1 from ``first_coupling[k]`` to ``first_coupling[k + 1]``;
        whether the second side is the one in the farther level; and the pair of sides that each couples.
    first_pair : array of int (levels + 1,)
        As ``first_coupling``, of the pairs: the parts of one joint couple the same sides. Pairs of divided blocks
        follow those of interfaces.
    far_index, near_index : array of int (pairs, w / 2)
        Indices in their levels of the degrees of freedom of a pair's two sides, -1 where prescribed.
    superelement_level, superelements_at_level
        Farther level of each deformable block; and the blocks with degrees of freedom in each level.
    block_places : BlockPlaces
        Where the blocks act in the levels.
    """

    def __init__(self, system: DiscreteSystem, superelements: Superelements | None) -> None:
        level_of_block, self.kinematics = block_levels(system), interface_kinematics(system.model)
        self.level_of_dof, self.whole_blocks = level_of_block[system.block_of_dof], np.arange(level_of_block.max() + 2)
        dofs = system.free_dofs
        if superelements is not None:
            dofs = np.setdiff1d(dofs, superelements.interior)
            self._divide_levels(system, level_of_block)
        self.dofs = dofs[np.lexsort((dofs, self.level_of_dof[dofs]))]
        self.levels = len(self.whole_blocks) - 1
        self.size = np.bincount(self.level_of_dof[self.dofs], minlength=self.levels).astype(np.int64)
        self.start = np.concatenate(([0], np.cumsum(self.size)))
        self.index_in_level = np.full(system.model.size, -1, dtype=np.int64)
        self.index_in_level[self.dofs] = np.arange(len(self.dofs)) - self.start[self.level_of_dof[self.dofs]]
        self._side = self.kinematics.dof.shape[1] // 2
        boundary = [] if superelements is None else superelements.boundary
        self.superelement_level = np.array([self.level_of_dof[dofs].max() for dofs in boundary], dtype=np.int64)
        self._list_interfaces(system, boundary)

    def _divide_levels(self, system: DiscreteSystem, level_of_block: IntArray) -> None:
        """Divide each level, unless an interface would couple three levels, or more than half its width to another."""
        face, n, (dof, rows) = system.model.interfaces, system.model.n_blocks, self.kinematics
        block, half = np.stack((face.block_a, face.block_b), axis=1), dof.shape[1] // 2
        level = np.where(block == n, -1, level_of_block[block])  # (m, 2)
        on_block = (dof >= 0) & np.repeat(block != n, half, axis=1)
        touches = np.zeros(system.model.size, dtype=np.bool_)
        nearer = (level > level[:, ::-1]) & ~system.model.guides[:, None]
        touches[dof[np.repeat(nearer, half, axis=1) & on_block]] = True
        near = on_block & touches[dof]
        count, others = near.sum(axis=1), (on_block & ~near).sum(axis=1)
        divided = np.bincount(self.level_of_dof[touches], minlength=len(self.whole_blocks) - 1) > 0
        farther = (level < level[:, ::-1]) & (level >= 0)
        divided[level[farther & near.reshape(-1, 2, half).any(axis=2)]] = False
        of_one = (level[:, 0] == level[:, 1]) | (level < 0).any(axis=1)
        divided[level.max(axis=1)[of_one & (count > 0) & (others > 0) & (np.maximum(count, others) > half)]] = False
        last = np.cumsum(1 + divided) - 1
        self.whole_blocks = (last + 1)[np.searchsorted(last + 1, np.arange(last[-1] + 2))]
        self.whole_blocks[0] = 0
        for i in np.flatnonzero(of_one & (count > 0) & (others > 0) & divided[level.max(axis=1)]):
            first, second = np.flatnonzero(near[i]), np.flatnonzero(on_block[i] & ~near[i])
            none = np.flatnonzero(~on_block[i])
            order = np.concatenate((first, none[: half - len(first)], second, none[half - len(first) :]))
            dof[i], rows[i] = dof[i, order], rows[i][:, order]
        own = divided[self.level_of_dof]
        self.level_of_dof = last[self.level_of_dof] - (own & touches)

    def _pair_block(self, boundary: IntArray, k: int) -> IntArray:
        """Return the places on the boundary (p, 2, w / 2) of the pairs that couple a block's levels k and k - 1."""
        level, side = np.where(self.index_in_level[boundary] >= 0, self.level_of_dof[boundary], -1), self._side
        parts = [np.flatnonzero(level == k), np.flatnonzero(level == k - 1) if k else np.empty(0, dtype=np.int64)]
        far, near = (np.pad(p, (0, -len(p) % side), constant_values=-1).reshape(-1, side) for p in parts)
        return np.stack((np.repeat(far, len(near), axis=0), np.tile(near, (len(far), 1))), axis=1)

    def _list_interfaces(self, system: DiscreteSystem, boundary: list[IntArray]) -> None:
        """List interfaces, deformable blocks, and the pairs of sides that they couple, level by level."""
        n, levels, count = system.model.n_blocks, np.arange(self.levels + 1), len(self.kinematics.dof)
        dof = self.kinematics.dof.reshape(count, 2, self._side)
        level = np.where((dof >= 0) & (dof // 3 != n), self.level_of_dof[dof], -1).max(axis=2)  # (m, 2), ground -1
        self.interface_level = level.max(axis=1)
        couplings = np.flatnonzero((level[:, 0] != level[:, 1]) & (level >= 0).all(axis=1))
        self.couplings = couplings[np.argsort(self.interface_level[couplings], kind="stable")]
        self.first_coupling = np.searchsorted(self.interface_level[self.couplings], levels)
        self.far_is_b = (level[:, 1] > level[:, 0])[self.couplings]
        index = np.where(dof >= 0, self.index_in_level[dof], -1)[self.couplings]
        each, far = np.arange(len(self.couplings)), self.far_is_b.astype(np.int64)
        sides = np.column_stack((self.interface_level[self.couplings], index[each, far], index[each, 1 - far]))
        _, first, pair = np.unique(sides, axis=0, return_index=True, return_inverse=True)
        in_order = np.argsort(first)  # as the couplings, which are in the order of the levels
        sides = sides[first[in_order]]
        blocks = [np.empty((0, sides.shape[1]), dtype=np.int64)]
        places = [np.empty((0, 2, self._side), dtype=np.int64)]
        for dofs, k in zip(boundary, self.superelement_level):
            places.append(self._pair_block(dofs, k))
            index = np.where(places[-1] >= 0, self.index_in_level[dofs[places[-1]]], -1)
            blocks.append(np.column_stack((np.full(len(index), k), index.reshape(-1, 2 * self._side))))
        sides = np.concatenate((sides, *blocks))
        order = np.argsort(sides[:, 0], kind="stable")
        sides, place = sides[order], np.argsort(order)
        self.pair = place[np.argsort(in_order)[pair.ravel()]]
        far, near = np.concatenate(places).swapaxes(0, 1)
        self.block_places = BlockPlaces(
            np.cumsum([0, *map(len, boundary)]),
            np.concatenate((blocks[0][:0, 0], *boundary)),
            np.cumsum([len(p) for p in places]),
            place[len(first) :],
            np.ascontiguousarray(far),
            np.ascontiguousarray(near),
        )
        # a block lies in its farther level, and in the one before if it is divided
        near = self.superelement_level - (np.diff(self.block_places.first_pair) > 0)
        of_levels = [(self.superelement_level == k) | (near == k) for k in range(self.levels)]
        self.superelements_at_level = [np.flatnonzero(listed) for listed in of_levels]
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
