"""Static condensation (Guyan 1965) of subtrees that stay elastic, to superelements on their boundaries."""

from __future__ import annotations

from typing import TYPE_CHECKING
from weakref import proxy

import numpy as np

from damagepred.arrays import FloatArray
from damagepred.kernels.interface.residual import subtract_boundary_forces

if TYPE_CHECKING:
    from damagepred.solvers.quasi_static.linear_system import MultifrontalSystem


class StaticCondensation:
    """Superelements of the condensed subtrees.

    Parameters
    ----------
    equations : MultifrontalSystem
        Elastic and without regularisation in the condensed fronts: it would hold them in space.
    load, live_load : array (size,)
        Dead and live load at load factor 1 (N, N m); None: no live load.

    Attributes
    ----------
    boundary_dofs : array of int
        Degrees of freedom of active fronts on which superelements act.
    places, first_place : array of int
        Which of these each superelement acts on, and where those of each begin.
    stiffness : array
        Of the superelements, one matrix after the other.
    """

    def __init__(self, equations: MultifrontalSystem, load: FloatArray, live_load: FloatArray | None) -> None:
        # no reference cycle: the matrices of a wall would wait for garbage collection
        self._equations, tree, active = proxy(equations), equations.tree, equations.active_fronts
        loads = np.stack([load, np.zeros_like(load) if live_load is None else live_load])
        reduced = np.ascontiguousarray(loads[:, tree.dofs])
        self._particular = np.zeros(reduced.shape)
        equations.condense_forces(reduced, self._particular)
        self._condensed_dofs = tree.dofs[np.repeat(~active, tree.size)]
        self._load_on_condensed = loads[:, self._condensed_dofs]
        roots = np.flatnonzero(~active & np.append(active, False)[tree.parent])
        of_root = np.repeat(np.isin(np.arange(tree.count), roots), tree.boundary_size)
        boundary, self.places = np.unique(tree.boundary[of_root], return_inverse=True)
        self.first_place = np.concatenate(([0], np.cumsum(tree.boundary_size[roots])))
        self.boundary_dofs = tree.dofs[boundary]
        self._load = reduced[:, boundary] - loads[:, self.boundary_dofs]
        self._last = 0.0, 0.0, np.zeros(len(boundary))  # load factors, and their load
        first, complements = equations.arrays["complement_start"], equations.elastic_complements
        self.stiffness = np.concatenate([np.empty(0), *(complements[first[k] : first[k + 1]] for k in roots)])

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
        """Return the force of the superelements on the boundary degrees of freedom (N, N m).

        Parameters
        ----------
        displacement : array (size,)
            Of all degrees of freedom (m).
        load, live
            As ``load``.
        """
        force = self.load(load, live).copy()
        subtract_boundary_forces(self.places, self.first_place, self.stiffness, displacement[self.boundary_dofs], force)
        return force

    def load_work(self, displacement: FloatArray, load: float, live: float) -> float:
        """Return load times displacement on the condensed fronts (J).

        Parameters
        ----------
        displacement, load, live
            As ``force``.
        """
        u, (dead_load, live_load) = displacement[self._condensed_dofs], self._load_on_condensed
        return load * float(dead_load @ u) + live * float(live_load @ u)

    def recover(self, displacement: FloatArray, load: float, live: float = 0.0) -> None:
        """Recover the displacements of the condensed fronts by back substitution.

        Parameters
        ----------
        displacement, load, live
            As ``force``; displacements are updated.
        """
        dofs = self._equations.tree.dofs
        u, particular = displacement[dofs], load * self._particular[0] + live * self._particular[1]
        self._equations.recover(u[None], particular[None])
        displacement[dofs] = u
