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

ANCHOR = 1e-9
"""Share of the elastic stiffness that holds every degree of freedom where it is, so that loose blocks do not vanish."""


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
        self.factorisations = self.levels_eliminated = 0
        levels = len(self.size)
        none = np.empty((0, 0))
        self._factor: list[tuple[FloatArray, Any]] = [(none, none)] * levels
        self._reach: list[FloatArray] = [none] * levels
        self._condensed: list[FloatArray | None] = [None] * levels
        points = model.interfaces.contact_area.shape[1]
        self._change(JointMemory.fresh(model), np.full_like(self.pattern, sum(3 << (4 * k) for k in range(points))))
        self._anchor = ANCHOR * np.concatenate([self._within(k).diagonal() for k in range(levels)])
        self._fresh = False

    def _within(self, k: int) -> FloatArray:
        return self.diagonal[self.at_diagonal[k] : self.at_diagonal[k + 1]].reshape(self.size[k], self.size[k])

    def _coupled(self, values: FloatArray, k: int, rows: int) -> FloatArray:
        return values[self.at_coupling[k] : self.at_coupling[k + 1]].reshape(rows, -1)

    def _change(self, memory: JointMemory, pattern: IntArray) -> int:
        return int(
            change_stiffness(
                self.model.interfaces, self.model.properties, memory, pattern, self.pattern, self.place, self.level,
                self.diagonal, self.down, self.up, self.at_diagonal, self.at_coupling, self.size,
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
        farthest = self._change(memory, pattern)
        if not self._fresh:
            farthest, self._fresh = len(self.size) - 1, True
        if farthest < 0:
            return
        self.factorisations += 1
        self.levels_eliminated += farthest + 1
        for k in range(farthest, -1, -1):
            self._eliminate(k)

    def _eliminate(self, k: int) -> None:
        stiffness = np.array(self._within(k), order="F")
        stiffness[np.diag_indices_from(stiffness)] += self._anchor[self.start[k] : self.start[k + 1]]
        if (condensed := self._condensed[k]) is not None:
            stiffness -= condensed
        lu, pivots, _ = lapack.dgetrf(stiffness, overwrite_a=1)
        self._factor[k] = (lu, pivots)
        if k > 0:
            # displacement of this level for unit displacements of the next, and what that makes of the next's stiffness
            reach, _ = lapack.dgetrs(lu, pivots, self._coupled(self.down, k, self.size[k]))
            self._reach[k] = reach
            self._condensed[k - 1] = self._coupled(self.up, k, self.size[k - 1]) @ reach

    def solve(self, force: FloatArray) -> FloatArray:
        """Return the displacement of all degrees of freedom (3 (n + 1),) under a force, 0 where held."""
        right = force[self.dofs]
        levels = len(self.size)
        for k in range(levels - 1, -1, -1):
            here = slice(self.start[k], self.start[k + 1])
            right[here], _ = lapack.dgetrs(*self._factor[k], right[here])
            if k > 0:
                right[self.start[k - 1] : self.start[k]] -= self._coupled(self.up, k, self.size[k - 1]) @ right[here]
        for k in range(1, levels):
            here = slice(self.start[k], self.start[k + 1])
            right[here] -= self._reach[k] @ right[self.start[k - 1] : self.start[k]]
        displacement = np.zeros(len(force))
        displacement[self.dofs] = right
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
