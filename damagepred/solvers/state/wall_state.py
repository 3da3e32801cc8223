"""State of a wall on a static load path: displacements, loads, and the history of its joints."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from damagepred.arrays import BoolArray, FloatArray, Int8Array
from damagepred.assembly import Model
from damagepred.assembly.section import SectionMemory
from damagepred.enumerations import ContactKind, ContactState
from damagepred.kernels.interface.contact import contact_fields


class JointHistory(NamedTuple):
    """History variables of the contacts, arrays (m, q)."""

    slip: FloatArray  # plastic (m)
    dilatant_opening: FloatArray  # by dilation less crushing (m)
    cracked: BoolArray  # tensile strength passed, or bond broken by slip
    # softening joints: largest equivalent opening (m), 0 while intact, at least the critical opening after failure by
    # slip (infinite in the quasi-static solver); brittle joints: 0, infinite where the quasi-static solver opens them
    kappa: FloatArray

    @classmethod
    def fresh(cls, model: Model) -> JointHistory:
        """History at the start; a joint with a gap counts as crushed by the gap, and cracked."""
        shape = model.interfaces.contact_area.shape
        gap = np.broadcast_to(model.properties.gap[:, None], shape)
        return cls(np.zeros(shape), 0.0 - gap, gap > 0.0, np.zeros(shape))

    def copy(self, plain: bool = False) -> JointHistory:
        """Copy that may be changed."""
        dilatant_opening = self.dilatant_opening if plain else self.dilatant_opening.copy()
        return JointHistory(self.slip.copy(), dilatant_opening, self.cracked.copy(), self.kappa.copy())


def without_bond(model: Model) -> BoolArray:
    """Whether interfaces (m,) have no bond: no tensile strength, and a shear strength that does not drop."""
    law = model.properties
    bare = (law.tensile_strength <= 0) & (law.cohesion == law.residual_cohesion)
    return np.asarray(bare & (law.friction == law.residual_friction) | (law.gap > 0.0))


class ContactFields(NamedTuple):
    """Contacts at a displacement of the blocks, arrays (m, q)."""

    opening: FloatArray  # (m)
    shear: FloatArray  # (m)
    normal_stress: FloatArray  # tension positive (Pa)
    shear_stress: FloatArray  # (Pa)
    history: JointHistory  # updated by the joint law at the displacement


def fields_of(model: Model, history: JointHistory, displacement: FloatArray, load_factor: float) -> ContactFields:
    """Contact fields at a displacement of the blocks."""
    fields, after = np.empty((4, *model.interfaces.contact_area.shape)), history.copy()
    contact_fields(model.interface_records, model.ground.at(load_factor), after, displacement, fields)
    return ContactFields(fields[0], fields[1], fields[2], fields[3], after)


def contact_states(model: Model, history: JointHistory) -> Int8Array:
    """``ContactState`` of each contact; a control joint, which has no bond, is always intact."""
    states: Int8Array = (history.slip != 0.0) * np.int8(ContactState.SLIPPING)
    states[history.cracked] = ContactState.CRACKED
    states[model.interfaces.kind == ContactKind.CONTROL_JOINT] = ContactState.INTACT
    return states


Point = tuple[float, float]
"""Load and load factor."""
NO_ZONES = np.empty((0, 4))
"""Plastic strain of a wall of rigid blocks."""


@dataclass
class State:
    """A point of the path: load, load factor, displacements and history variables."""

    load: float  # share of the dead load
    load_factor: float
    displacement: FloatArray  # (size,)
    history: JointHistory
    plastic: FloatArray = field(default_factory=lambda: NO_ZONES)  # (z, 4) of the zones
    jack: float = 0.0  # load of each jack (N)
    sections: SectionMemory = field(default_factory=lambda: SectionMemory.fresh(0))
    zone_state: Int8Array = field(default_factory=lambda: np.empty(0, dtype=np.int8))  # (z,) at the last commit

    @classmethod
    def rest(cls, model: Model) -> State:
        """Unloaded wall."""
        zones = NO_ZONES if model.mesh is None else np.zeros((len(model.mesh.zones), 4))
        sections = SectionMemory.fresh(0) if model.sections is None else SectionMemory.at_first(model.sections)
        return cls(
            load=0.0,
            load_factor=0.0,
            displacement=np.zeros(model.size),
            history=JointHistory.fresh(model),
            plastic=zones,
            sections=sections,
            zone_state=np.zeros(len(zones), dtype=np.int8),
        )

    def copy(self) -> State:
        """Independent copy."""
        return self.at(self.load, self.load_factor)

    def at(self, load: float, load_factor: float, plain: bool = False) -> State:
        """Copy at another load and load factor, with the same displacements."""
        return State(
            load=load,
            load_factor=load_factor,
            displacement=self.displacement.copy(),
            history=self.history.copy(plain),
            plastic=self.plastic.copy(),
            jack=self.jack,
            sections=self.sections.copy(),
            zone_state=self.zone_state.copy(),
        )

    def distance(self, point: Point) -> float:
        """Distance to a point in load and load factor (1)."""
        return abs(point[0] - self.load) + abs(point[1] - self.load_factor)

    def towards(self, point: Point, share: float) -> Point:
        """Interpolate load and load factor."""
        return self.load + share * (point[0] - self.load), self.load_factor + share * (point[1] - self.load_factor)
