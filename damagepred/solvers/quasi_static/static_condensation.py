"""Static condensation (Guyan 1965) of the levels that stay elastic, to a superelement on the level before them."""

from __future__ import annotations

from typing import TYPE_CHECKING
from weakref import proxy

import numpy as np

from damagepred.arrays import FloatArray

if TYPE_CHECKING:
    from damagepred.solvers.quasi_static.linear_system import BlockTridiagonalSystem


class StaticCondensation:
    """Superelement of the condensed levels.

    Parameters
    ----------
    equations : BlockTridiagonalSystem
        Elastic and without regularisation in the condensed levels: it would hold them in space.
    load, live_load : array (size,)
        Dead and live load at load factor 1 (N, N m); None: no live load.

    Attributes
    ----------
    boundary_dofs : array of int
        Degrees of freedom of the farthest active level, on which the superelement acts.
    stiffness : array (b, b)
        Of these degrees of freedom.
    """

    def __init__(self, equations: BlockTridiagonalSystem, load: FloatArray, live_load: FloatArray | None) -> None:
        # no reference cycle: the matrices of a wall would wait for garbage collection
        self._equations, self._active_levels = proxy(equations), equations.active_levels
        at, level = equations.layout, equations.active_levels - 1
        loads = np.stack([load, np.zeros_like(load) if live_load is None else live_load])
        reduced = np.ascontiguousarray(loads[:, at.dofs])
        self._particular = np.zeros(reduced.shape)
        equations.condense_forces(self._active_levels, reduced, self._particular)
        self._condensed_dofs = at.dofs[at.start[self._active_levels] :]
        self._load_on_condensed = loads[:, self._condensed_dofs]
        boundary, size = slice(at.start[level], at.start[level + 1]), int(at.size[level])
        self.boundary_dofs = at.dofs[boundary]
        self._load = reduced[:, boundary] - loads[:, self.boundary_dofs]
        self._last = 0.0, 0.0, np.zeros(size)  # load factors, and their load
        first = equations.arrays["inverse_start"][level]
        complement = equations.arrays["complements"][first : first + size**2].reshape(size, size)
        self.stiffness = np.ascontiguousarray((equations.coupling_stiffness(level) - complement).T)

    def load(self, load: float, live: float) -> FloatArray:
        """Return the condensed load on the boundary degrees of freedom (N, N m).

        Parameters
        ----------
        load, live : float
            Load factors of dead and live load.
        """
        if self._last[:2] != (load, live):
            self._last = load, live, load * self._load[0] + live * self._load[1]
        return self._last[2]

    def force(self, displacement: FloatArray, load: float, live: float = 0.0) -> FloatArray:
        """Return the force of the superelement on the boundary degrees of freedom (N, N m).

        Parameters
        ----------
        displacement : array (size,)
            Of all degrees of freedom (m).
        load, live
            As ``load``.
        """
        return self.load(load, live) - self.stiffness @ displacement[self.boundary_dofs]

    def load_work(self, displacement: FloatArray, load: float, live: float) -> float:
        """Return load times displacement on the condensed levels (J).

        Parameters
        ----------
        displacement, load, live
            As ``force``.
        """
        u, (dead_load, live_load) = displacement[self._condensed_dofs], self._load_on_condensed
        return load * float(dead_load @ u) + live * float(live_load @ u)

    def recover(self, displacement: FloatArray, load: float, live: float = 0.0) -> None:
        """Recover the displacements of the condensed levels by back substitution.

        Parameters
        ----------
        displacement, load, live
            As ``force``; displacements are updated.
        """
        dofs = self._equations.layout.dofs
        u, particular = displacement[dofs], load * self._particular[0] + live * self._particular[1]
        self._equations.recover(self._active_levels, u[None], particular[None])
        displacement[dofs] = u
