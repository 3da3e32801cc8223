"""Jacks of the explicit solver: one pump feeds all of them and is controlled by the footing's deflection.

Jacks with equal loads do work on the sum of their lifts, not on the controlled deflection: a load directly from the
deflection would feed energy into the blocks. So a stiff elastic line between pump and jacks gives the load. The volume
of the pump is extrapolated from the last increment; integral control, slower than the wall's oscillation, corrects the
deflection.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from damagepred.arrays import FloatArray, IntArray
from damagepred.assembly import Model
from damagepred.errors import ConvergenceError
from damagepred.kernels.explicit.cycle import LOAD, VOLUME
from damagepred.solvers.system.discrete_system import DiscreteSystem

LINE_STIFFNESS_RATIO = 100.0
"""Stiffness of the line between pump and jacks over the stiffness of the intact wall under the jacks (1). A stiffer
line
permits a faster control; much stiffer, it makes the jacked segments heavy."""
GAIN_RATIO = 0.12
"""Rate of the control over the decay rate, local damping times circular frequency, of the slower oscillation of the
intact wall on its jacks (1). Ten times the default may excite that oscillation; two to five times, where jacks stand
by the supports, far from where the deflection is measured."""


class PumpLine(NamedTuple):
    """Pump and line."""

    dof: IntArray  # (k,) with a jack or a weight in the deflection
    push: FloatArray  # (k,) force of jacks with 1 N each
    weight: FloatArray  # (k,) in the deflection
    state: FloatArray  # (2,) volume, the sum of all lifts of a rigid line (m), and load of each jack (N)
    stiffness: float  # load of each jack per volume (N/m); 0 for a prescribed load
    gain: float  # volume delivered per cycle and deflection error
    origin: float  # deflection at a load factor of 0 (m)
    goal: float  # deflection per load factor (m)
    volume_step: float  # volume delivered in advance per load factor (m)
    load: float  # prescribed at a load factor of 0 (N)
    load_step: float  # prescribed per load factor (N)


PumpState = tuple[PumpLine, FloatArray, tuple[float, float]]
"""State of the pump."""


class Pump:
    """Pump of a model's jacks, from no load to the level state and through the movement."""

    def __init__(self, model: Model) -> None:
        assert model.jacks is not None
        self.jacks, push, self.weights = model.jacks, model.jacks.push, model.jacks.weights
        system = DiscreteSystem.of(model)
        solved = system.elastic_solutions(system.dead_load, push, self.weights)
        if solved is None:
            raise ConvergenceError("nothing holds the footing on its supports", increment=0)
        alone, by_push, by_weight = solved
        bends, gives = float(self.weights @ by_push), float(push @ by_push)
        if not bends > 0.0:
            raise ConvergenceError("the jacks do not move the footing's middle against its ends", increment=0)
        self.level_load = -float(self.weights @ alone) / bends
        self.level = alone + self.level_load * by_push
        self.stiffness = LINE_STIFFNESS_RATIO / gives
        self._by_volume = by_push / (gives + 1.0 / self.stiffness)
        """Displacements per volume."""
        self._bent = by_weight - float(push @ by_weight) * self._by_volume
        """Displacements per force on the deflection, at constant volume."""
        self.volume_per_deflection = 1.0 / float(self.weights @ self._by_volume)
        self.level_volume = float(push @ self.level) + self.level_load / self.stiffness
        dofs = np.flatnonzero((push != 0.0) | (self.weights != 0.0))
        goal = self.jacks.goal
        self.line = PumpLine(
            dof=dofs,
            push=push[dofs],
            weight=self.weights[dofs],
            state=np.zeros(2),
            stiffness=self.stiffness,
            gain=0.0,
            origin=self.jacks.origin,
            goal=goal,
            volume_step=goal * self.volume_per_deflection,
            load=0.0,
            load_step=0.0,
        )
        self._from = (0.0, 0.0)
        """Load factor and volume at the end of the last increment."""
        self._load_factor_at = model.ground.load_factor_at

    def along(self, start: float, rate: float) -> PumpLine:
        """Line on a piece of the path whose load factor is linear in the coordinate: start + rate coordinate."""
        line = self.line
        return line._replace(
            origin=line.origin + start * line.goal, goal=rate * line.goal, volume_step=rate * line.volume_step
        )

    def row_sum(self, scale: FloatArray) -> FloatArray:
        """Row sums (size,) of the line's stiffness, degrees of freedom over ``scale`` (m or 1)."""
        push = np.abs(self.jacks.push) / scale
        return self.stiffness * push * push.sum()

    def set_gain(self, mass: FloatArray, damping: float) -> None:
        """Set a gain at which the control is slower than the wall's oscillation on the jacks."""
        free = np.isfinite(mass)
        swings = [
            # Rayleigh quotients of the wall lifted by a volume, and bent at constant volume
            float(force @ shape) / float(mass[free] @ shape[free] ** 2)
            for force, shape in ((self.stiffness * self.jacks.push, self._by_volume), (self.weights, self._bent))
        ]
        frequency = np.sqrt(min(swings))
        self.line = self.line._replace(gain=GAIN_RATIO * damping * frequency * self.volume_per_deflection)

    @property
    def time_constant(self) -> float:
        """Cycles in which the control reduces an error to 1/e; infinite without control."""
        return self.volume_per_deflection / self.line.gain if self.controlled else np.inf

    def halve_gain(self) -> None:
        """Halve the gain of the control."""
        self.line = self.line._replace(gain=0.5 * self.line.gain)

    @property
    def load(self) -> float:
        """Load of each jack (N)."""
        return float(self.line.state[LOAD])

    @property
    def controlled(self) -> bool:
        """Whether the load follows from the deflection."""
        return self.line.stiffness > 0.0

    def missing(self, coordinate: float, displacement: FloatArray) -> float:
        """Target less present deflection (m); 0 for a prescribed load."""
        wanted = self.line.origin + self._load_factor_at(coordinate) * self.line.goal
        return wanted - float(self.weights @ displacement) if self.controlled else 0.0

    def begin_level(self) -> None:
        """Set the volume that keeps the intact wall level under its dead load."""
        self.line.state[:] = self.level_volume, self.level_load
        self._from = (0.0, self.level_volume)

    def begin_at(self, displacement: FloatArray, load: float, volume_per_deflection: float) -> None:
        """Set the volume of a displacement under a load of each jack (N), without control."""
        self.line.state[:] = float(self.jacks.push @ displacement) + load / self.stiffness, load
        self.line = self.line._replace(gain=0.0, volume_step=self.line.goal * volume_per_deflection)

    def deliver(self, volume: float) -> None:
        """Add volume (m)."""
        self.line.state[VOLUME] += volume

    def extrapolate_volume(self, coordinate: float) -> None:
        """Extrapolate the volume per load factor from the states at rest at the last call and at this one."""
        load_factor, before, volume = self._load_factor_at(coordinate), self._from[0], float(self.line.state[VOLUME])
        if self.controlled and load_factor != before:
            self.line = self.line._replace(volume_step=(volume - self._from[1]) / (load_factor - before))
        self._from = (load_factor, volume)

    def control_load(self) -> None:
        """Prescribe the load instead of the deflection, if the jacks are controlled by load."""
        if self.jacks.by_load:
            self.line = self.line._replace(
                stiffness=0.0, gain=0.0, goal=0.0, load=self.load, load_step=self.jacks.load - self.load
            )

    def checkpoint(self) -> PumpState:
        """Copy of the present state."""
        return self.line, self.line.state.copy(), self._from

    def restore(self, state: PumpState) -> None:
        """Return to an earlier state."""
        line, volume_and_load, self._from = state
        self.line = line._replace(state=self.line.state)
        self.line.state[:] = volume_and_load
