"""State of a wall on a static load path."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from damagepred.arrays import FloatArray, Int8Array
from damagepred.assembly import Model
from damagepred.assembly.section import SectionMemory
from damagepred.solvers.state.joint_history import JointHistory

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
