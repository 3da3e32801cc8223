"""Displacement imposed on all interfaces along a history: ground, strain of the bricks, and creep of the joints."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np

from damagepred.arrays import FloatArray
from damagepred.assembly.joint_creep import JointCreep
from damagepred.assembly.model import Ground, GroundMovement
from damagepred.scene.movement import History


@dataclass
class ViscousDisplacement:
    """Viscous displacement of the joints in one step of a history: linear between its ends.

    Attributes
    ----------
    start, end : Ground or None
        At the ends (m); None where joints do not creep.
    between : (float, float)
        Path coordinates of the ends.
    """

    start: Ground | None = None
    end: Ground | None = None
    between: tuple[float, float] = (0.0, 1.0)

    def at(self, coordinate: float) -> tuple[FloatArray | float, FloatArray | float]:
        """Return the displacement along normal and tangent at a path coordinate (m)."""
        if self.start is None or self.end is None:
            return 0.0, 0.0
        share = float(np.interp(coordinate, self.between, (0.0, 1.0)))
        normal, shear = ((1.0 - share) * a + share * b for a, b in zip(self.start, self.end))
        return normal, shear


@dataclass(frozen=True, eq=False)
class ImposedHistory(GroundMovement):
    """Displacement imposed on all interfaces along a history, as a function of a path coordinate that always grows.

    In a history the same load factor returns with other strains. The coordinate grows in each increment by the change
    of the load factor, or of the strain over its largest value, whichever is more; solvers take it as load factor.

    Attributes
    ----------
    history : History
        Load factors of the increments.
    coordinates : array (increments + 1,)
        Path coordinates of the increments, from 0.
    strains : array (increments + 1,)
        Strain of the bricks (1).
    creep : JointCreep or None
        Of the joints.
    viscous : ViscousDisplacement
        Of the present step; see ``creep_between``.
    forget : callable
        Forgets known states.
    """

    history: History = field(kw_only=True)
    coordinates: FloatArray = field(kw_only=True)
    strains: FloatArray = field(kw_only=True)
    creep: JointCreep | None = field(kw_only=True)
    viscous: ViscousDisplacement = field(kw_only=True)
    forget: Callable[[], None] = field(kw_only=True)

    @classmethod
    def of(
        cls,
        ground: GroundMovement,
        unit_strain: Ground,
        history: History,
        strains: FloatArray | None,
        creep: JointCreep | None,
    ) -> ImposedHistory:
        """Return the imposed displacement of a history.

        Parameters
        ----------
        ground : GroundMovement
            Of the ground alone, a function of the load factor.
        unit_strain : Ground
            Displacement of all interfaces by a strain of 1 of the bricks.
        history : History
            Load factors of the increments.
        strains : array (increments + 1,) or None
            Strain of the bricks (1).
        creep : JointCreep or None
            Of the joints.
        """
        factors = history.load_factors
        strains = np.zeros_like(factors) if strains is None else strains
        largest = float(np.abs(strains).max()) or 1.0
        least = 1.0 / len(factors)
        steps = np.maximum(np.abs(np.diff(factors)), np.abs(np.diff(strains)) / largest).clip(least)
        coordinates = np.concatenate(([0.0], np.cumsum(steps)))
        viscous, first = ViscousDisplacement(), len(unit_strain.normal) - len(ground.full.normal)

        @lru_cache(maxsize=32)  # solvers ask for the same few again and again
        def state(coordinate: float) -> Ground:
            factor, strain = (float(np.interp(coordinate, coordinates, values)) for values in (factors, strains))
            found = Ground(*(strain * unit + creeping for unit, creeping in zip(unit_strain, viscous.at(coordinate))))
            for values, own in zip(found, ground.at(factor)):
                values[first:] += own
            return found

        return cls(
            state(float(coordinates[-1])),
            state,
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
        """Set the viscous displacement of the joints in the next step.

        Parameters
        ----------
        start, end : Ground
            At its ends (m).
        between : (float, float)
            Path coordinates of its ends.
        """
        self.viscous.start, self.viscous.end, self.viscous.between = start, end, between
        self.forget()

    def states(self) -> tuple[Ground, ...]:
        """Return the states at the extremes of movement and strain."""
        extremes = [number for v in (self.history.load_factors, self.strains) for number in (v.argmin(), v.argmax())]
        return tuple(self.at(float(self.coordinates[number])) for number in extremes)

    def largest_rate(self) -> float:
        """Return 0: the displacement does not grow with the path coordinate."""
        return 0.0

    def largest_standing(self) -> float:
        """Return the largest displacement (m), which may stand all along the path."""
        return max(state.largest() for state in self.states())

    def load_factor_at(self, coordinate: float) -> float:
        """Return the load factor of the movement at a path coordinate."""
        return float(np.interp(coordinate, self.coordinates, self.history.load_factors))

    def load_factor_rate(self, coordinate: float) -> float:
        """Return the load factor per path coordinate in the step that begins at a coordinate (1)."""
        last = len(self.coordinates) - 2
        piece = slice(min(int(np.searchsorted(self.coordinates, coordinate, side="right")) - 1, last), None)
        (before, after), (start, end) = self.history.load_factors[piece][:2], self.coordinates[piece][:2]
        return float((after - before) / (end - start))
