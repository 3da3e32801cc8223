"""Static condensation (Guyan 1965) of subtrees that stay elastic, to superelements on their boundaries."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from damagepred.arrays import FloatArray
from damagepred.kernels.linear.condensation import (
    CONDENSATION,
    recover,
    resist,
    subtract_boundary_forces,
)
from damagepred.kernels.linear.multifrontal import back
from damagepred.kernels.table import Address, fill

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
    address : int
        Of the table that kernels take.
    record : CONDENSATION
        The table itself.
    """

    def __init__(self, equations: MultifrontalSystem, load: FloatArray, live_load: FloatArray | None) -> None:
        tree, active = equations.tree, equations.active_fronts
        loads = np.stack([load, np.zeros_like(load) if live_load is None else live_load])
        reduced, particular = np.ascontiguousarray(loads[:, tree.dofs]), np.empty((2, len(tree.dofs)))
        equations.condense_forces(reduced, particular)
        condensed = tree.dofs[np.repeat(~active, tree.size)]
        roots = np.flatnonzero(~active & np.append(active, False)[tree.parent])
        of_root = np.repeat(np.isin(np.arange(tree.count), roots), tree.boundary_size)
        places = tree.boundary[of_root]
        boundary = np.unique(places)
        self.boundary_dofs = tree.dofs[boundary]
        self._load = reduced[:, boundary] - loads[:, self.boundary_dofs]
        first, complements = equations.arrays["complement_start"], equations.elastic_complements
        row, particular_in_state = np.empty((1, len(tree.dofs))), np.empty((1, len(tree.dofs)))
        self._system = equations.condensed_table(row, particular_in_state)
        self._table = np.zeros(1, CONDENSATION)
        self.address, self.record = self._table.ctypes.data, self._table[0]
        self._arrays = {
            "boundary_dofs": tree.dofs[places],
            "first_boundary": np.concatenate(([0], np.cumsum(tree.boundary_size[roots]))),
            "stiffness": np.concatenate([np.empty(0), *(complements[first[k] : first[k + 1]] for k in roots)]),
            "boundary_room": np.empty((2, len(places))),
            "dofs": tree.dofs,
            "particular": particular,
            "particular_in_state": particular_in_state,
            "current": row,
            "loaded_dofs": np.concatenate((condensed, self.boundary_dofs)),
            "loads": np.ascontiguousarray(np.concatenate((loads[:, condensed], -self._load), axis=1)),
            "displacement": load,  # of the same size
            "force": load,
        }
        units = {"back": back.address, "resist": resist.address}
        fill(self.record, {**self._arrays, **units, "system": self._system.ctypes.data})
        self._displacement, self._force = Address(self._table, "displacement"), Address(self._table, "force")

    def load(self, load: float, live: float) -> FloatArray:
        """Return the condensed load on the boundary degrees of freedom (N, N m).

        Parameters
        ----------
        load, live : float
            Load factors of dead and live load.
        """
        return load * self._load[0] + live * self._load[1]

    def subtract_boundary_forces(self, displacement: FloatArray, force: FloatArray) -> None:
        """Subtract the forces by which the superelements resist the displacements of their boundaries.

        Parameters
        ----------
        displacement, force : array (size,)
            Of all degrees of freedom (m, N); forces are updated.
        """
        self._place(self._displacement, displacement)
        self._place(self._force, force)
        subtract_boundary_forces(self.address)

    def recover(self, displacement: FloatArray, load: float, live: float = 0.0) -> None:
        """Recover the displacements of the condensed fronts by back substitution.

        Parameters
        ----------
        displacement : array (size,)
            Of all degrees of freedom (m); updated.
        load, live : float
            Load factors of dead and live load.
        """
        self.set_loads(load, live)
        self._place(self._displacement, displacement)
        recover(self.address)

    def set_loads(self, load: float, live: float) -> None:
        """Set the load factors for kernels that run by themselves.

        Parameters
        ----------
        load, live : float
            Of dead and live load.
        """
        self.record["load"], self.record["live"] = load, live

    @staticmethod
    def _place(address: Address, array: FloatArray) -> None:
        """Set the address of an array, whatever kernels have put there."""
        address.forget()
        address.set(array)
