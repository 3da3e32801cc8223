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
    """A point of the path: load, load factor, displacements and history variables.

    Attributes
    ----------
    load, load_factor : float
        Shares of dead load and full movement.
    displacement : array (size,)
        Of all degrees of freedom.
    history : JointHistory
        Of the joints.
    plastic : array (z, 4)
        Plastic strain of the zones.
    jack : float
        Load of each jack (N).
    sections : SectionMemory
        Of the sections of a footing that cracks.
    zone_state : array of int8 (z,)
        ``ZoneState`` of the zones at the last commit.
    """

    load: float
    load_factor: float
    displacement: FloatArray
    history: JointHistory
    plastic: FloatArray = field(default_factory=lambda: NO_ZONES)
    jack: float = 0.0
    sections: SectionMemory = field(default_factory=lambda: SectionMemory.fresh(0))
    zone_state: Int8Array = field(default_factory=lambda: np.empty(0, dtype=np.int8))

    @classmethod
    def rest(cls, model: Model) -> State:
        """Return the unloaded wall."""
        zones = NO_ZONES if model.mesh is None else np.zeros((len(model.mesh.zones), 4))
        sections = SectionMemory.fresh(0) if model.sections is None else SectionMemory.at_first(model.sections)
        zone_state = np.zeros(len(zones), dtype=np.int8)
        return cls(0.0, 0.0, np.zeros(model.size), JointHistory.fresh(model), zones, 0.0, sections, zone_state)

    def copy(self) -> State:
        """Return an independent copy."""
        return self.at(self.load, self.load_factor)

    def at(self, load: float, load_factor: float, plain: bool = False) -> State:
        """Return a copy at another load and load factor, with the same displacements.

        Parameters
        ----------
        load, load_factor : float
            Shares of dead load and of movement (1).
        plain : bool
            See ``JointHistory.copy``.
        """
        return State(
            load,
            load_factor,
            self.displacement.copy(),
            self.history.copy(plain),
            self.plastic.copy(),
            self.jack,
            self.sections.copy(),
            self.zone_state.copy(),
        )

    def distance(self, point: Point) -> float:
        """Return the distance to a point in load and load factor (1)."""
        return abs(point[0] - self.load) + abs(point[1] - self.load_factor)

    def towards(self, point: Point, share: float) -> Point:
        """Interpolate load and load factor.

        Parameters
        ----------
        point : (float, float)
            End.
        share : float
            0 here, 1 at the end.
        """
        return self.load + share * (point[0] - self.load), self.load_factor + share * (point[1] - self.load_factor)
