"""Memory of the joints and motion of the blocks while a path is followed."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from damagepred.arrays import BoolArray, FloatArray, Int8Array
from damagepred.assembly import Model
from damagepred.enumerations import ContactKind, ContactState
from damagepred.kernels.interface.contact import contact_fields


class JointHistory(NamedTuple):
    """What a contact remembers, arrays (m, q).

    Attributes
    ----------
    slip, dilatant_opening : array (m, q)
        Plastic slip and opening by dilation (m).
    cracked : array of bool (m, q)
        Whether tensile strength was passed, or the bond broken by slip.
    kappa : array (m, q)
        In joints that soften, the largest opening less dilation (m) that a cracked contact has reached; at least
        the critical one, infinite in the quasi-static solver, where slip has broken the bond. 0 while intact, and in
        joints whose bond breaks at once; of these the quasi-static solver marks by infinity which have parted.
    """

    slip: FloatArray
    dilatant_opening: FloatArray
    cracked: BoolArray
    kappa: FloatArray

    @classmethod
    def fresh(cls, model: Model) -> JointHistory:
        """Return the memory of joints that have seen nothing yet; what has a gap is as if crushed by it, and parted."""
        shape = model.interfaces.contact_area.shape
        gap = np.broadcast_to(model.properties.gap[:, None], shape)
        return cls(np.zeros(shape), 0.0 - gap, gap > 0.0, np.zeros(shape))

    def copy(self) -> JointHistory:
        """Return a memory of its own."""
        return JointHistory(self.slip.copy(), self.dilatant_opening.copy(), self.cracked.copy(), self.kappa.copy())


def without_bond(model: Model) -> BoolArray:
    """Tell which interfaces (m,) have no bond to break: no strength, and what holds them in shear does not drop."""
    law = model.properties
    bare = (law.tensile_strength <= 0) & (law.cohesion == law.residual_cohesion)
    return np.asarray(bare & (law.friction == law.residual_friction) | (law.gap > 0.0))


class ContactFields(NamedTuple):
    """Contacts at a displacement of the blocks, arrays (m, q).

    Attributes
    ----------
    opening, shear : array (m, q)
        Relative displacement normal to the joint and along it (m).
    normal_stress, shear_stress : array (m, q)
        Tension positive (Pa).
    history : JointHistory
        What the joint law makes of the memory there: slip and stress belong together.
    """

    opening: FloatArray
    shear: FloatArray
    normal_stress: FloatArray
    shear_stress: FloatArray
    history: JointHistory


def fields_of(model: Model, history: JointHistory, displacement: FloatArray, load_factor: float) -> ContactFields:
    """Evaluate all contacts at a displacement of the blocks.

    Parameters
    ----------
    model : Model
        The model.
    history : JointHistory
        Left as it is.
    displacement : array (3 (n + 1),)
        Of the blocks and the ground.
    load_factor : float
        Share of the full movement.
    """
    opening, shear, sigma, tau = (np.empty(model.interfaces.contact_area.shape) for _ in range(4))
    after = history.copy()
    contact_fields(
        model.interfaces,
        model.properties,
        model.ground.at(load_factor),
        after,
        displacement,
        opening,
        shear,
        sigma,
        tau,
    )
    return ContactFields(opening, shear, sigma, tau, after)


def contact_states(model: Model, history: JointHistory) -> Int8Array:
    """Return the ``ContactState`` of each contact; a control joint, which has no bond, is always intact."""
    control = (model.interfaces.kind == ContactKind.CONTROL_JOINT)[:, None]
    states = np.where(
        history.cracked,
        ContactState.CRACKED,
        np.where(history.slip != 0.0, ContactState.SLIPPING, ContactState.INTACT),
    )
    return np.where(control, ContactState.INTACT, states).astype(np.int8)
