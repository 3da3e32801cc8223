"""History variables of the joints, and the contact fields that follow from them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from damagepred.arrays import BoolArray, FloatArray, Int8Array
from damagepred.assembly import Model
from damagepred.enumerations import ContactKind, ContactState
from damagepred.kernels.interface.contact import contact_fields


class JointHistory(NamedTuple):
    """History variables of the contacts, arrays (m, q).

    Attributes
    ----------
    slip, dilatant_opening : array (m, q)
        Plastic slip, and opening by dilation less crushing (m).
    cracked : array of bool (m, q)
        Whether tensile strength was passed, or the bond broken by slip.
    kappa : array (m, q)
        Softening joints: largest equivalent opening of the cracked contact (m), 0 while intact; where slip has broken
        the bond at least the critical opening, infinite in the quasi-static solver. Brittle joints: 0, infinite where
        the quasi-static solver found them parted.
    """

    slip: FloatArray
    dilatant_opening: FloatArray
    cracked: BoolArray
    kappa: FloatArray

    @classmethod
    def fresh(cls, model: Model) -> JointHistory:
        """Return the initial state; a joint with a gap counts as crushed by it, and cracked."""
        shape = model.interfaces.contact_area.shape
        gap = np.broadcast_to(model.properties.gap[:, None], shape)
        return cls(np.zeros(shape), 0.0 - gap, gap > 0.0, np.zeros(shape))

    def copy(self, plain: bool = False) -> JointHistory:
        """Return a copy that may be changed.

        Parameters
        ----------
        plain : bool
            Whether all joints are plain: then dilatant openings never change, and both share them.
        """
        dilatant_opening = self.dilatant_opening if plain else self.dilatant_opening.copy()
        return JointHistory(self.slip.copy(), dilatant_opening, self.cracked.copy(), self.kappa.copy())


def without_bond(model: Model) -> BoolArray:
    """Whether interfaces (m,) have no bond: no tensile strength, and a shear strength that does not drop."""
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
        Updated by the joint law at the displacement.
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
        model.interface_records,
        model.joint_parameters,
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
    """Return the ``ContactState`` of each contact; a control joint, which has no bond, is always intact.

    Parameters
    ----------
    model : Model
        The model.
    history : JointHistory
        History variables.
    """
    states: Int8Array = (history.slip != 0.0) * np.int8(ContactState.SLIPPING)
    states[history.cracked] = ContactState.CRACKED
    states[model.interfaces.kind == ContactKind.CONTROL_JOINT] = ContactState.INTACT
    return states
