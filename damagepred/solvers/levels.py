"""Linear equations of a wall, solved level by level.

Blocks that touch the ground or a support are level 0, their neighbours level 1, and so on; a joint lies within a level
or between neighbouring ones. The stiffness is then block tridiagonal and is eliminated from the farthest level down to
the ground. A change of stiffness in one level leaves all that is farther from the ground as it was: elimination
restarts there. For a wall that separates along its damp-proof course, all above it is condensed once.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lapack
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from damagepred.assembly import Model
from damagepred.kernels.frozen import change_stiffness
from damagepred.solvers.state import JointMemory

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

ANCHOR = 1e-7
"""Share of the elastic stiffness that holds every degree of freedom where it is, so that loose blocks do not vanish."""


LOOSE = 1e-12
"""Smallest pivot over the largest below which what is condensed counts as not held."""


class LevelEquations:
    """Stiffness of the acting springs, factorised.

    Parameters
    ----------
    model : Model
        The wall.
    held : array of int
        Degrees of freedom that do not move freely.
    """

    def __init__(self, model: Model, held: IntArray) -> None:
        self.model = model
        n = model.n_blocks
        self.level = block_levels(model, held)
        free = np.ones(3 * (n + 1), dtype=np.bool_)
        free[held] = False
        dofs = np.flatnonzero(free)
        level_of = np.repeat(self.level, 3)
        order = np.lexsort((dofs, level_of[dofs]))
        self.dofs = dofs[order]
        self.size = np.bincount(level_of[self.dofs], minlength=int(self.level.max()) + 1).astype(np.int64)
        self.start = np.concatenate(([0], np.cumsum(self.size)))
        self.place = np.full(3 * (n + 1), -1, dtype=np.int64)
        self.place[self.dofs] = np.arange(len(self.dofs)) - self.start[level_of[self.dofs]]
        nearer = np.concatenate(([0], self.size[:-1]))
        self.at_diagonal = np.concatenate(([0], np.cumsum(self.size**2)))
        self.at_coupling = np.concatenate(([0], np.cumsum(self.size * nearer)))
        self.diagonal = np.zeros(self.at_diagonal[-1])
        self.down = np.zeros(self.at_coupling[-1])
        self.up = np.zeros(self.at_coupling[-1])
        self.pattern = np.zeros(len(model.interfaces.kind), dtype=np.int64)
        self.factorisations = 0
        levels = len(self.size)
        none = np.empty((0, 0))
        self._factor: list[tuple[FloatArray, Any]] = [(none, none)] * levels
        self._reach: list[FloatArray] = [none] * levels
        self._condensed: list[FloatArray | None] = [None] * levels
        points = model.interfaces.contact_area.shape[1]
        self._elastic = np.full_like(self.pattern, sum(3 << (4 * k) for k in range(points)))
        a, b = self.level[model.interfaces.block_a], self.level[model.interfaces.block_b]
        self.interface_level = np.where(model.interfaces.block_a == n, b, np.maximum(a, b))
        self._change(JointMemory.fresh(model), self._elastic, np.arange(len(self.pattern)))
        self._anchor = ANCHOR * np.concatenate([self._within(k).diagonal() for k in range(levels)])
        self.in_play = levels
        self._stale = levels - 1
        self.active = np.arange(len(self.pattern))

    def _within(self, k: int) -> FloatArray:
        return self.diagonal[self.at_diagonal[k] : self.at_diagonal[k + 1]].reshape(self.size[k], self.size[k])

    def _coupled(self, values: FloatArray, k: int, rows: int) -> FloatArray:
        return values[self.at_coupling[k] : self.at_coupling[k + 1]].reshape(rows, -1)

    def condense(self, in_play: int, load: FloatArray) -> bool:
        """Take all levels from ``in_play`` on as elastic, and replace them by what they do to the level before.

        Parameters
        ----------
        in_play : int
            Number of levels, from the ground on, that are looked at joint by joint.
        load : array (3 (n + 1),)
            Dead load in full.

        Returns
        -------
        bool
            Whether it can be done: what is beyond must be held by the levels in play.
        """
        levels, was = len(self.size), self.in_play
        if in_play >= levels:
            self._put_in_play(levels)
            return False
        if was == levels:  # for the first time: without anchors, for these would hold what is condensed in space
            for k in range(levels - 1, in_play - 1, -1):
                if not self._eliminate(k, anchored=False):
                    self._put_in_play(levels)
                    return False
        self._put_in_play(in_play)
        self._hang: list[FloatArray] = [np.empty(0)] * levels
        weight = load[self.dofs]
        for k in range(levels - 1, in_play - 1, -1):
            self._hang[k], _ = lapack.dgetrs(*self._factor[k], weight[self.start[k] : self.start[k + 1]])
            weight[self.start[k - 1] : self.start[k]] -= self._coupled(self.up, k, self.size[k - 1]) @ self._hang[k]
        edge = slice(self.start[in_play - 1], self.start[in_play])
        self.edge_dofs = self.dofs[edge]
        self._edge_load = weight[edge] - load[self.edge_dofs]
        bridge = np.flatnonzero((self.interface_level == in_play) & (self._nearer_level() == in_play - 1))
        condensed = self._condensed[in_play - 1]
        assert condensed is not None
        self._edge_stiffness = self._stiffness_within(in_play - 1, bridge) - condensed
        return True

    def _nearer_level(self) -> IntArray:
        return np.minimum(self.level[self.model.interfaces.block_a], self.level[self.model.interfaces.block_b])

    def _put_in_play(self, in_play: int) -> None:
        self._stale = max(self._stale if self._stale < in_play else -1, in_play - 1)
        self.in_play = in_play
        self.active = np.flatnonzero(self.interface_level < in_play)

    def _stiffness_within(self, k: int, interfaces: IntArray) -> FloatArray:
        """Return what some interfaces, elastic, contribute to the stiffness within a level."""
        diagonal, down, up = np.zeros_like(self.diagonal), np.zeros_like(self.down), np.zeros_like(self.up)
        change_stiffness(
            interfaces, self.model.interfaces, self.model.properties, JointMemory.fresh(self.model),
            self._elastic, np.zeros_like(self.pattern), self.place, self.level,
            diagonal, down, up, self.at_diagonal, self.at_coupling, self.size,
        )  # fmt: skip
        return diagonal[self.at_diagonal[k] : self.at_diagonal[k + 1]].reshape(self.size[k], self.size[k])

    def edge_force(self, displacement: FloatArray, load: float) -> FloatArray:
        """Return the force of the condensed levels on the last level in play, under a share of the dead load."""
        return load * self._edge_load - self._edge_stiffness @ displacement[self.edge_dofs]

    def recover(self, displacement: FloatArray, load: float) -> None:
        """Fill in the displacements of the condensed levels, from the last level in play outwards."""
        inner = displacement[self.dofs[self.start[self.in_play - 1] : self.start[self.in_play]]]
        for k in range(self.in_play, len(self.size)):
            inner = load * self._hang[k] - self._reach[k] @ inner
            displacement[self.dofs[self.start[k] : self.start[k + 1]]] = inner

    def _change(self, memory: JointMemory, pattern: IntArray, active: IntArray) -> int:
        return int(
            change_stiffness(
                active, self.model.interfaces, self.model.properties, memory, pattern, self.pattern, self.place,
                self.level, self.diagonal, self.down, self.up, self.at_diagonal, self.at_coupling, self.size,
            )
        )  # fmt: skip

    def update(self, memory: JointMemory, pattern: IntArray) -> None:
        """Take over the springs that act, and factorise what changed.

        Parameters
        ----------
        memory : JointMemory
            Which bonds are broken.
        pattern : array of int (m,)
            As ``joint_forces`` notes it.
        """
        farthest = max(self._change(memory, pattern, self.active), self._stale)
        self._stale = -1
        if farthest < 0:
            return
        self.factorisations += 1
        for k in range(farthest, -1, -1):
            self._eliminate(k)

    def _eliminate(self, k: int, anchored: bool = True) -> bool:
        stiffness = np.array(self._within(k), order="F")
        if anchored:
            stiffness.ravel(order="K")[:: len(stiffness) + 1] += self._anchor[self.start[k] : self.start[k + 1]]
        if (condensed := self._condensed[k]) is not None:
            stiffness -= condensed
        lu, pivots, singular = lapack.dgetrf(stiffness, overwrite_a=1)
        if not anchored and (singular or np.abs(lu.diagonal()).min() < LOOSE * np.abs(lu.diagonal()).max()):
            return False
        self._factor[k] = (lu, pivots)
        if k > 0:
            # displacement of this level for unit displacements of the next, and what that makes of the next's stiffness
            reach, _ = lapack.dgetrs(lu, pivots, self._coupled(self.down, k, self.size[k]))
            self._reach[k] = reach
            self._condensed[k - 1] = self._coupled(self.up, k, self.size[k - 1]) @ reach
        return True

    def solve(self, force: FloatArray) -> FloatArray:
        """Return the displacement of all degrees of freedom (3 (n + 1),) under a force, 0 where held or condensed."""
        end = self.start[self.in_play]
        right = force[self.dofs[:end]]
        for k in range(self.in_play - 1, -1, -1):
            here = slice(self.start[k], self.start[k + 1])
            right[here], _ = lapack.dgetrs(*self._factor[k], right[here])
            if k > 0:
                right[self.start[k - 1] : self.start[k]] -= self._coupled(self.up, k, self.size[k - 1]) @ right[here]
        for k in range(1, self.in_play):
            here = slice(self.start[k], self.start[k + 1])
            right[here] -= self._reach[k] @ right[self.start[k - 1] : self.start[k]]
        displacement = np.zeros(len(force))
        displacement[self.dofs[:end]] = right
        return displacement


def block_levels(model: Model, held: IntArray) -> IntArray:
    """Return how many joints each block (n,) is away from ground and supports; the ground itself is level 0.

    Blocks that no joint connects to them follow the farthest level by themselves.

    Parameters
    ----------
    model : Model
        The wall.
    held : array of int
        Degrees of freedom that do not move freely.
    """
    n = model.n_blocks
    a, b = model.interfaces.block_a, model.interfaces.block_b
    graph = csr_array((np.ones(len(a)), (a, b)), shape=(n + 1, n + 1))
    roots = np.unique(held // 3)
    distance = dijkstra(graph, directed=False, unweighted=True, indices=roots, min_only=True)
    # ground and supports have no free degrees of freedom worth a level: what touches them is level 0
    distance = np.maximum(np.where(np.isfinite(distance), distance, np.nan) - 1.0, 0.0)
    last = np.nanmax(distance)
    return np.where(np.isnan(distance), last, distance).astype(np.int64)
