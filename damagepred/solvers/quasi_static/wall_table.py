"""The table of a wall that kernels take, and what changes in it from call to call."""

from __future__ import annotations

from typing import Any

import numpy as np

from damagepred.arrays import FloatArray, IntArray
from damagepred.assembly.model import Ground
from damagepred.kernels.equilibrium.problem import PROBLEM
from damagepred.kernels.jit import Unit
from damagepred.kernels.table import Address, Addresses, fill
from damagepred.solvers.state.joint_history import JointHistory


class WallTable:
    """Table of a wall at given loads; see ``PROBLEM`` for its entries.

    Parameters
    ----------
    **entries
        Arrays, which are kept, and numbers by the names of their entries.

    Attributes
    ----------
    address : int
        Of the table.
    record : record
        The table itself: its numbers can be read and set.
    """

    def __init__(self, **entries: Any) -> None:
        self._table, self._kept = np.zeros(1, PROBLEM), dict[str, Any]()
        self.address, self.record = self._table.ctypes.data, self._table[0]
        self.fill(**entries)
        self._history = Addresses(self._table, "slip dilatant_opening cracked kappa")
        self._ground = Addresses(self._table, "ground_normal ground_shear")
        self._joints, self._displacement, self._start, self._best = (
            Address(self._table, name) for name in ("joints", "displacement", "start", "best")
        )
        self._places: dict[str, Address] = {}

    def fill(self, **entries: Any) -> None:
        """Set entries; their arrays are kept.

        Parameters
        ----------
        **entries
            By name.
        """
        self._kept.update(entries)
        fill(self.record, entries)

    def set_state(self, history: JointHistory, ground: Ground) -> None:
        """Set the history variables of the joints, and the ground.

        Parameters
        ----------
        history : JointHistory
            At the last equilibrium.
        ground : Ground
            In the present state.
        """
        self._history.set(history)
        self._ground.set(ground)

    def set(self, **entries: Any) -> None:
        """Set entries that change from call to call; of arrays only address and rows, and only if they are others.

        Parameters
        ----------
        **entries
            By name.
        """
        for name, value in entries.items():
            if isinstance(value, np.ndarray):
                if name not in self._places:
                    self.fill(**{name: value})
                    self._places[name] = Address(self._table, name)
                self._places[name].set(value)
            else:
                self.record[name] = value

    def run(self, unit: Unit, joints: IntArray, displacement: FloatArray, **entries: Any) -> np.void:
        """Run a unit; return the table with its results.

        Parameters
        ----------
        unit : Unit
            Of this table.
        joints : array of int
            Interfaces that it works on.
        displacement : array (size,)
            Of all degrees of freedom.
        **entries
            See ``set``.
        """
        self._joints.set(joints)
        self._displacement.set(displacement)
        self.set(**entries)
        unit(self.address)
        return self.record

    def iterate(self, unit: Unit, joints: IntArray, start: FloatArray, best: FloatArray, **entries: Any) -> np.void:
        """Run iterations; return the table with their results.

        Parameters
        ----------
        unit : Unit
            Of this table.
        joints : array of int
            The active interfaces.
        start, best : array (size,)
            First displacements, and where the best go.
        **entries
            See ``set``.
        """
        self._start.set(start)
        self._best.set(best)
        found = self.run(unit, joints, start, **entries)
        self._displacement.forget()  # the iterations have put their own there
        return found
