"""Memory of the joints and motion of the blocks while a path is followed."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from damagepred.assembly import Kind, Model
from damagepred.kernels.contact import contact_fields
from damagepred.solvers.increment import ContactState

FloatArray = NDArray[np.float64]


class JointMemory(NamedTuple):
    """What a contact remembers, arrays (m, q).

    Attributes
    ----------
    slip, dilated : array (m, q)
        Plastic slip and opening by dilation (m).
    cracked : array of bool (m, q)
        Whether tensile strength was passed, or the bond broken by slip.
    opened : array (m, q)
        In joints that soften, the largest opening less dilation (m) that a cracked contact has reached; at least
        the critical one where slip has broken the bond. 0 while intact, and in joints whose bond breaks at once.
    """

    slip: FloatArray
    dilated: FloatArray
    cracked: NDArray[np.bool_]
    opened: FloatArray

    @classmethod
    def fresh(cls, model: Model) -> JointMemory:
        """Return the memory of joints that have seen nothing yet; what has a gap is as if crushed by it, and parted."""
        shape = model.interfaces.contact_area.shape
        gap = np.broadcast_to(model.properties.gap[:, None], shape)
        return cls(np.zeros(shape), 0.0 - gap, gap > 0.0, np.zeros(shape))

    def copy(self) -> JointMemory:
        """Return a memory of its own."""
        return JointMemory(self.slip.copy(), self.dilated.copy(), self.cracked.copy(), self.opened.copy())


def without_bond(model: Model) -> NDArray[np.bool_]:
    """Tell which interfaces (m,) have no bond to break: no strength, and what holds them in shear does not drop."""
    law = model.properties
    bare = (law.tensile_strength <= 0) & (law.cohesion == law.residual_cohesion)
    return np.asarray(bare & (law.friction == law.residual_friction) | (law.gap > 0.0))


class ContactFields(NamedTuple):
    """Opening, shear displacement (m), normal and shear stress (Pa, tension positive) of contacts, arrays (m, q)."""

    opening: FloatArray
    shear: FloatArray
    normal_stress: FloatArray
    shear_stress: FloatArray


def fields_of(model: Model, memory: JointMemory, displacement: FloatArray, progress: float) -> ContactFields:
    """Evaluate all contacts at a displacement of the blocks.

    Parameters
    ----------
    model : Model
        The model.
    memory : JointMemory
        Left as it is.
    displacement : array (3 (n + 1),)
        Of the blocks and the ground.
    progress : float
        Share of the full movement.
    """
    fields = ContactFields(*(np.empty(model.interfaces.contact_area.shape) for _ in range(4)))
    contact_fields(model.interfaces, model.properties, model.ground, memory, displacement, progress, *fields)
    return fields


def contact_states(model: Model, memory: JointMemory) -> NDArray[np.int8]:
    """Return the ``ContactState`` of each contact; a control joint, which has no bond, is always intact."""
    control = (model.interfaces.kind == Kind.CONTROL_JOINT)[:, None]
    states = np.where(
        memory.cracked,
        ContactState.CRACKED,
        np.where(memory.slip != 0.0, ContactState.SLIPPING, ContactState.INTACT),
    )
    return np.where(control, ContactState.INTACT, states).astype(np.int8)


def come_loose(model: Model, displacement: FloatArray, progress: float) -> NDArray[np.bool_]:
    """Tell which blocks (n,) have left the wall: further from home than the movement explains.

    Parameters
    ----------
    model : Model
        The wall.
    displacement : array (3 (n + 1),)
        Of the blocks and the ground.
    progress : float
        Share of the full movement.
    """
    moved = displacement[: 3 * model.n_blocks].reshape(-1, 3)
    ground = float(np.hypot(model.ground.normal, model.ground.shear).max(initial=0.0))
    supports = float(np.abs(model.supports.prescribed_displacement).max(initial=0.0))
    jacks = 0.0 if model.jacks is None else abs(model.jacks.deflection)
    # half the largest block that can move beyond twice what ground and supports have moved
    moves = model.moves if model.moves.any() else ~model.moves
    size = float(np.sqrt(model.blocks.area.max(where=moves, initial=0.0)))
    allowed = 0.5 * size + 2.0 * progress * max(ground, supports, jacks)
    allowed += 2.0 * _settlement(model)
    return np.asarray(np.hypot(moved[:, 0], moved[:, 1]) > allowed)


def _settlement(model: Model) -> float:
    """Return how far all of the dead load presses a wall into soft ground (m)."""
    on_ground = model.ground.normal.shape[0]
    if not on_ground:
        return 0.0
    area = model.interfaces.contact_area[-on_ground:].sum(axis=1)
    stiffness = float((model.properties.normal_stiffness[-on_ground:] * area).sum())
    return abs(float(model.supports.load.reshape(-1, 3)[:, 1].sum())) / stiffness
