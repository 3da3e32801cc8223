"""Displacement imposed on all interfaces along a history: ground, strain of the bricks, and creep of the joints."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np

from damagepred.arrays import FloatArray
from damagepred.assembly.joint_creep import JointCreep
from damagepred.assembly.model import Ground, GroundMovement
from damagepred.scene.movement_stage import History


@dataclass
class ViscousDisplacement:
    """Viscous displacement of the joints in one step of a history: linear between its ends."""

    start: Ground | None = None  # displacement at the ends (m); None where joints do not creep
    end: Ground | None = None
    between: tuple[float, float] = (0.0, 1.0)  # path coordinates of the ends

    def at(self, coordinate: float) -> tuple[FloatArray | float, FloatArray | float]:
        """Displacement along normal and tangent at a path coordinate (m)."""
        if self.start is None or self.end is None:
            return 0.0, 0.0
        share = float(np.interp(coordinate, self.between, (0.0, 1.0)))
        normal, shear = ((1.0 - share) * a + share * b for a, b in zip(self.start, self.end))
        return normal, shear


@dataclass(frozen=True, eq=False)
class ImposedHistory(GroundMovement):
    """Displacement imposed on all interfaces along a history, as a function of an increasing path coordinate.

    In a history the same load factor returns with other strains. In each increment the coordinate grows by the
    change of the load factor, or of the strain over its largest value, whichever is more. Solvers use it as load
    factor.
    """

    history: History = field(kw_only=True)
    coordinates: FloatArray = field(kw_only=True)  # (increments + 1,): path coordinates of the increments, from 0
    strains: FloatArray = field(kw_only=True)  # (increments + 1,): strain of the bricks (1)
    creep: JointCreep | None = field(kw_only=True)
    viscous: ViscousDisplacement = field(kw_only=True)  # of the present step; see ``creep_between``
    forget: Callable[[], None] = field(kw_only=True)  # clears the cache of states

    @classmethod
    def of(
        cls,
        ground: GroundMovement,
        unit: Ground,
        history: History,
        strains: FloatArray | None,
        creep: JointCreep | None,
    ) -> ImposedHistory:
        """Displacement by ground movement, strain of the bricks (increments + 1,) and creep."""
        factors = history.load_factors
        strains = np.zeros_like(factors) if strains is None else strains
        largest = float(np.abs(strains).max()) or 1.0
        least = 1.0 / len(factors)
        steps = np.maximum(np.abs(np.diff(factors)), np.abs(np.diff(strains)) / largest).clip(least)
        coordinates = np.concatenate(([0.0], np.cumsum(steps)))
        viscous, first = ViscousDisplacement(), len(unit.normal) - len(ground.full.normal)

        @lru_cache(maxsize=32)  # solvers repeat the same few
        def state(coordinate: float) -> Ground:
            factor, strain = (float(np.interp(coordinate, coordinates, values)) for values in (factors, strains))
            by_bricks = zip(unit, viscous.at(coordinate))
            ground_state = Ground(*(strain * values + creeping for values, creeping in by_bricks))
            for values, by_ground in zip(ground_state, ground.at(factor)):
                values[first:] += by_ground
            return ground_state

        return cls(
            state(float(coordinates[-1])),
            state,
            proportional=False,
            forget=state.cache_clear,
            history=history,
            coordinates=coordinates,
            strains=strains,
            creep=creep,
            viscous=viscous,
        )

    @property
    def moves(self) -> bool:
        """Whether anything moves: joints may creep, even where the ground stays."""
        return True

    def creep_between(self, start: Ground, end: Ground, between: tuple[float, float]) -> None:
        """Set the viscous displacement (m) at the ends of the next step, and their path coordinates."""
        self.viscous.start, self.viscous.end, self.viscous.between = start, end, between
        self.forget()

    def states(self) -> tuple[Ground, ...]:
        """States at the extremes of movement and strain."""
        extremes = [number for v in (self.history.load_factors, self.strains) for number in (v.argmin(), v.argmax())]
        return tuple(self.at(float(self.coordinates[number])) for number in extremes)

    def largest_rate(self) -> float:
        """0: the displacement does not grow with the path coordinate."""
        return 0.0

    def largest_standing(self) -> float:
        """Largest displacement along the path (m)."""
        return max(state.largest() for state in self.states())

    def load_factor_at(self, coordinate: float) -> float:
        """Load factor of the movement at a path coordinate."""
        return float(np.interp(coordinate, self.coordinates, self.history.load_factors))

    def load_factor_rate(self, coordinate: float) -> float:
        """Load factor per path coordinate in the step that begins at a coordinate (1)."""
        last = len(self.coordinates) - 2
        piece = slice(min(int(np.searchsorted(self.coordinates, coordinate, side="right")) - 1, last), None)
        (before, after), (start, end) = self.history.load_factors[piece][:2], self.coordinates[piece][:2]
        return float((after - before) / (end - start))
