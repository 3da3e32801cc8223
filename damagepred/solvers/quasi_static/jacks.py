"""Jacks under the footing: under deflection control their load is one more unknown.

The path begins at the level state: while the dead load is applied, the jacks keep the footing's deflection at zero.
Then either the deflection grows with the movement and the load is found with the displacements, or the load grows in
proportion to its final value.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from damagepred.arrays import FloatArray
from damagepred.assembly import Model


@dataclass
class JackControl:
    """Control of the jacks: by deflection until ``Continuation.control_load`` sets ``level_load``, then by load."""

    push: FloatArray  # (size,) force of unit loads (N/N)
    weights: FloatArray  # (size,) weights of the displacements in the deflection
    goal: float  # deflection at full movement (m, upwards)
    origin: float = 0.0  # deflection from which it counts (m)
    load_factor_at: Callable[[float], float] = float  # path coordinate -> load factor of the movement
    # load of each jack (N) in the level state, None until the load is controlled, and at full movement
    level_load: float | None = None
    load: float = 0.0

    @classmethod
    def of(cls, model: Model) -> JackControl | None:
        """Control of a model's jacks in the level state, or None without jacks."""
        jacks = model.jacks
        weights = model.deflection if jacks is None or jacks.weights is None else jacks.weights
        if jacks is None or weights is None:
            return None
        goal = 0.0 if jacks.by_load else jacks.deflection
        return cls(jacks.push, weights, goal, jacks.origin, model.ground.load_factor_at)

    @property
    def by_load(self) -> bool:
        """Whether the load is given."""
        return self.level_load is not None

    def load_at(self, load_factor: float, found: float) -> float:
        """Load of each jack (N): the given load at a load factor, or ``found``, the unknown of the equilibrium."""
        if self.level_load is None:
            return found
        return self.level_load + load_factor * (self.load - self.level_load)

    def missing_deflection(self, coordinate: float, displacement: FloatArray) -> float:
        """Return the missing deflection (m); 0 where the load is given."""
        if self.by_load:
            return 0.0
        return self.required_deflection(coordinate) - float(self.weights @ displacement)

    def required_deflection(self, coordinate: float) -> float:
        """Return the deflection at a path coordinate (m); NaN where the load is given."""
        return np.nan if self.by_load else self.origin + self.load_factor_at(coordinate) * self.goal
