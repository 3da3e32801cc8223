"""State of a wall under dead load, from which a run in physical time begins."""

from __future__ import annotations

from typing import NamedTuple

from damagepred.arrays import FloatArray
from damagepred.solvers.state.joint_history import JointHistory


class InitialState(NamedTuple):
    """State of a wall at rest.

    Attributes
    ----------
    displacement : array (size,)
        Of all degrees of freedom (m, rad).
    history : JointHistory
        Internal variables of the contacts.
    plastic : array (z, 4) or None
        Plastic strain of the zones; None if nothing has yielded.
    """

    displacement: FloatArray
    history: JointHistory
    plastic: FloatArray | None
