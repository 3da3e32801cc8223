"""External load of a wall in a state: dead and live load, and the load of jacks."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from damagepred.arrays import FloatArray
from damagepred.assembly import Model
from damagepred.solvers.quasi_static.linear_system import StaticCondensation


class ExternalLoad:
    """Dead and live load at the load factors of a state, with the load of condensed fronts, without jacks."""

    def __init__(self, dead: FloatArray, live: FloatArray) -> None:
        self.dead, self.live, self.grows, self._force = dead, live, bool(live.any()), np.zeros(dead.size)
        self._factors: tuple[object, ...] = ()

    def at(self, load: float, load_factor: float, condensation: StaticCondensation | None) -> FloatArray:
        """Return the load at factors of dead and live load; the next call changes it."""
        factors = load, load_factor if self.grows else 0.0, condensation
        if factors != self._factors:
            np.multiply(self.dead, load, out=self._force)
            if self.grows:
                self._force += load_factor * self.live
            if condensation is not None:
                self._force[condensation.boundary_dofs] += condensation.load(load, load_factor)
            self._factors = factors
        return self._force


@dataclass
class JackControl:
    """Control of the jacks: by deflection, with the load unknown, until ``level_load`` is set, then by load."""

    push: FloatArray  # (size,) force of unit loads (N/N)
    weights: FloatArray  # (size,) weights of the displacements in the deflection
    goal: float  # deflection at full movement (m, upwards)
    origin: float = 0.0  # deflection from which it counts (m)
    load_factor_at: Callable[[float], float] = float  # path coordinate -> load factor of the movement
    load: float = 0.0  # load of each jack at full movement (N), and in the level state, None until it is controlled
    level_load: float | None = None

    @classmethod
    def of(cls, model: Model) -> JackControl | None:
        """Control of a model's jacks in the level state, or None without jacks."""
        jacks, at = model.jacks, model.ground.load_factor_at
        return jacks and cls(jacks.push, jacks.weights, jacks.goal, jacks.origin, at, jacks.load)

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
