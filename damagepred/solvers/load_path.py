"""Path coordinates of the increments of a movement, and the creep of joints from one to the next."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from math import ceil
from typing import NamedTuple

import numpy as np

from damagepred.arrays import FloatArray
from damagepred.assembly import Model
from damagepred.assembly.imposed_history import ImposedHistory
from damagepred.assembly.joint_creep import Pair
from damagepred.assembly.model import Ground
from damagepred.solvers.options import CreepOptions
from damagepred.solvers.state.increment import Increment


class _UnitsInStep(NamedTuple):
    """Kelvin units in a step: displacement (m) and stresses (Pa) at its start, and its duration."""

    displacement: Pair
    stresses: Pair
    years: float


@dataclass
class LoadPath:
    """Path coordinates of the increments: load factors of the movement, or coordinates of an ``ImposedHistory``."""

    coordinates: list[float]  # from dead load on
    imposed: ImposedHistory | None  # ground, strain of bricks and creep of a history
    longest_step: float  # of creep over the relaxation time
    _units: _UnitsInStep | None = field(default=None, init=False)

    @classmethod
    def of(cls, model: Model, increments: int, creep: CreepOptions) -> LoadPath:
        """Path of a model."""
        imposed = model.ground if isinstance(model.ground, ImposedHistory) else None
        coordinates: FloatArray = np.arange(increments + 1) / increments
        if model.history is not None:
            coordinates = model.history.load_factors if imposed is None else imposed.coordinates
        return cls([float(coordinate) for coordinate in coordinates], imposed, creep.longest_step)

    def steps(self, number: int) -> list[float]:
        """Coordinates at the ends of the steps of an increment: one step unless joints creep fast."""
        end, imposed = self.coordinates[number], self.imposed
        if number == 0 or imposed is None or imposed.creep is None:
            return [end]
        count = ceil(self._years(number) / (self.longest_step * imposed.creep.relaxation_time) * (1.0 - 1e-9))
        inner = np.linspace(self.coordinates[number - 1], end, max(count, 1) + 1)[1:-1]
        return [*inner.tolist(), end]

    @property
    def creeps(self) -> bool:
        """Whether joints creep."""
        return self.imposed is not None and self.imposed.creep is not None

    def creep(self, number: int, stresses: Pair, between: tuple[float, float]) -> None:
        """Let the joints creep in a step: predictor at constant opening, corrected in the next step."""
        imposed = self.imposed
        assert imposed is not None
        assert imposed.creep is not None
        nothing = Ground(np.zeros_like(stresses[0]), np.zeros_like(stresses[1]))
        if number == 0:
            self._units = None
            imposed.creep_between(nothing, nothing, (0.0, 1.0))
            return
        last, before = self._units, imposed.viscous.end or nothing
        units = before if last is None else imposed.creep.after(last.displacement, last.stresses, stresses, last.years)
        share = (between[1] - between[0]) / (self.coordinates[number] - self.coordinates[number - 1])
        self._units = _UnitsInStep(units, stresses, share * self._years(number))
        imposed.creep_between(before, Ground(*imposed.creep.ahead(*self._units)), between)

    def _years(self, number: int) -> float:
        """Duration of an increment."""
        assert self.imposed is not None
        assert self.imposed.history.time is not None
        before, after = self.imposed.history.time[number - 1 : number + 1]
        return float(after - before)

    def in_load_factors(self, increment: Increment) -> Increment:
        """Increment with load factors of the movement instead of path coordinates."""
        if self.imposed is None:
            return increment
        table, broken_at = (self.imposed.coordinates, self.imposed.history.load_factors), increment.broken_at
        end = increment.end
        return replace(
            increment,
            load_factor=self.imposed.load_factor_at(increment.load_factor),
            end=end._replace(last_stable_load_factor=self.imposed.load_factor_at(end.last_stable_load_factor)),
            broken_at=None if broken_at is None else np.interp(broken_at, *table),
        )
