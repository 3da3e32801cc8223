"""Driver of a static load path for both static solvers: dead load, then the movement in increments, with creep.

A solver is a ``Stepper``. The path ends at full movement or with the last stage of a history, at collapse, or where
jacks or outer supports carry no load.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from math import ceil
from typing import Generic, NamedTuple, Protocol, TypeVar

import numpy as np

from damagepred.arrays import FloatArray
from damagepred.assembly import Model
from damagepred.assembly.imposed_history import ImposedHistory
from damagepred.assembly.joint_creep import Pair
from damagepred.assembly.model import Ground
from damagepred.diagnostics import Counters
from damagepred.errors import ConvergenceError
from damagepred.solvers.options import DEFAULTS
from damagepred.solvers.state.increment import Increment, PathEnd
from damagepred.solvers.system.footing_forces import outer_support_loads

MAX_TRIALS = 40
"""Points of the path tried in the search for zero support load."""


def least_support_load(model: Model, jack_load: float, sigma: FloatArray) -> float:
    """Load (N) whose loss ends the path: of a jack, or of the less loaded outer support."""
    jacks = model.jacks
    if jacks is None or not jacks.stop:
        return np.inf
    if jacks.stop == "jacks":
        return jack_load
    return float(outer_support_loads(model, jacks.ends, sigma).min())


@dataclass
class LoadPath:
    """Path coordinates of the increments: load factors of the movement, or coordinates of an ``ImposedHistory``."""

    coordinates: list[float]  # from dead load on
    imposed: ImposedHistory | None  # ground, strain of bricks and creep of a history
    longest_step: float  # of creep over the relaxation time
    # Kelvin units in a step: displacement (m) and stresses (Pa) at its start, and its duration
    _units: tuple[Pair, Pair, float] | None = field(default=None, init=False)

    @classmethod
    def of(cls, model: Model, increments: int, longest_step: float) -> LoadPath:
        """Path of a model."""
        imposed = model.ground if isinstance(model.ground, ImposedHistory) else None
        coordinates: FloatArray = np.arange(increments + 1) / increments
        if model.history is not None:
            coordinates = model.history.load_factors if imposed is None else imposed.coordinates
        return cls([float(coordinate) for coordinate in coordinates], imposed, longest_step)

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
        units = before if last is None else imposed.creep.after(last[0], last[1], stresses, last[2])
        share = (between[1] - between[0]) / (self.coordinates[number] - self.coordinates[number - 1])
        self._units = units, stresses, share * self._years(number)
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


CheckpointT = TypeVar("CheckpointT")


class Outcome(NamedTuple):
    """End of a step; the ratio is the largest residual over the mean block weight."""

    unbalanced_force_ratio: float
    balanced: bool
    collapsed: bool


class Bracket(NamedTuple):
    """Tolerances with which the end of a path is located."""

    support_load: float  # counts as zero (N)
    load_factor: float  # bracket at zero support load
    collapse: float | None = None  # bracket of collapse under live load; None: the steps locate it


class _Start(NamedTuple, Generic[CheckpointT]):
    """Start of an increment: a checkpoint, its load factor, and the support load there (N)."""

    checkpoint: CheckpointT
    load_factor: float
    support_load: float


class Stepper(Protocol[CheckpointT]):
    """Static solver of one wall."""

    bracket: Bracket

    def begin_increment(self, number: int) -> None:
        """Begin to count the work of an increment."""

    def step_to(self, load_factor: float) -> Outcome:
        """Equilibrium or collapse at a load factor; ConvergenceError without either."""

    def support_load(self) -> float:
        """Load (N) whose loss ends the path."""

    def checkpoint(self) -> CheckpointT:
        """Copy of the present state."""

    def restore(self, checkpoint: CheckpointT) -> None:
        """Return to a checkpoint."""

    def report(self, outcome: Outcome) -> Increment:
        """Present state as an increment, without counters."""

    def counters(self) -> Counters:
        """Work of the current increment."""

    def end_increment(self) -> None:
        """Prepare the jacks for the next increment."""

    def support_after_load(self) -> None:
        """Continue from the present state with the supports that act after the dead load."""


def follow_movement(
    stepper: Stepper[CheckpointT],
    model: Model,
    increments: int,
    longest_step: float = DEFAULTS.creep.longest_step,
) -> Iterator[Increment]:
    """Increments of the movement, first the state under dead load; histories replace the number of increments."""
    jacks = model.jacks
    stop, begins_later = ("", False) if jacks is None else (jacks.stop, jacks.after_load)
    # where bonds break, the load of a test falls to zero from above
    nothing = stepper.bracket.support_load if begins_later else 0.0
    bisects = stepper.bracket.collapse is not None and bool(model.supports.live_load.any())
    along = LoadPath.of(model, increments, longest_step)
    path = along.coordinates
    for number, load_factor in enumerate(path):
        stepper.begin_increment(number)
        start = None
        if number > 0 and (stop or bisects):
            start = _Start(stepper.checkpoint(), path[number - 1], stepper.support_load())
        outcome = _follow_increment(stepper, along, number)
        ended = bool(stop) and outcome.balanced and stepper.support_load() <= nothing
        if ended and start is not None:
            outcome = _locate_zero_support_load(stepper, start, load_factor, outcome)
            ended = outcome.balanced
        increment = stepper.report(outcome)
        if ended:
            increment = replace(increment, end=PathEnd(unloaded=stop))
        elif outcome.collapsed:
            stable = path[max(number - 1, 0)]
            increment = _locate_collapse(stepper, start if bisects else None, increment, stable)
        yield along.in_load_factors(replace(increment, counters=stepper.counters()))
        if ended or outcome.collapsed:
            return
        stepper.end_increment()
        if number == 0 and (model.supports.after_load.any() or begins_later):
            stepper.support_after_load()


def _follow_increment(stepper: Stepper[CheckpointT], along: LoadPath, number: int) -> Outcome:
    """Outcome at the end of an increment, in several steps for fast creep."""
    start, largest, outcome = along.coordinates[max(number - 1, 0)], 0.0, Outcome(0.0, balanced=True, collapsed=False)
    for end in along.steps(number):
        if along.creeps:
            state = stepper.report(outcome)
            largest = max(largest, state.residuals.unbalanced_force_ratio)
            along.creep(number, (state.normal_stress, state.shear_stress), (start, end))
        outcome = stepper.step_to(end)
        largest = max(largest, outcome.unbalanced_force_ratio)
        if not outcome.balanced:
            return outcome
        start = end
    return outcome._replace(unbalanced_force_ratio=largest)


def _locate_zero_support_load(
    stepper: Stepper[CheckpointT], start: _Start[CheckpointT], load_factor: float, outcome: Outcome
) -> Outcome:
    """Outcome at zero support load, by the Illinois variant of regula falsi (Dowell and Jarratt 1971)."""
    loaded, unloaded, tolerance = start.checkpoint, stepper.checkpoint(), stepper.bracket.support_load
    left, load_left = start.load_factor, start.support_load
    right, load_right = load_factor, stepper.support_load()
    found, side = abs(load_right) <= tolerance, 0
    for _ in range(MAX_TRIALS):
        if found or right - left < stepper.bracket.load_factor:
            return outcome
        trial = left + load_left / (load_left - load_right) * (right - left)
        stepper.restore(loaded)
        outcome = stepper.step_to(trial)
        if not outcome.balanced:
            return outcome
        load = stepper.support_load()
        if load > tolerance:
            load_right *= 0.5 if side > 0 else 1.0  # second trial in a row on one side
            left, load_left, side, loaded = trial, load, 1, stepper.checkpoint()
        else:
            load_left *= 0.5 if side < 0 else 1.0
            right, load_right, side, unloaded = trial, load, -1, stepper.checkpoint()
            found = abs(load) <= tolerance
    stepper.restore(unloaded)
    return outcome


def _locate_collapse(
    stepper: Stepper[CheckpointT], start: _Start[CheckpointT] | None, increment: Increment, stable: float
) -> Increment:
    """Increment with the load factor of collapse, bisected from the start of the increment if it has one."""
    if np.isfinite(increment.end.last_stable_load_factor):  # the steps located it
        return increment
    if start is None or stepper.bracket.collapse is None:
        return replace(increment, end=PathEnd(last_stable_load_factor=stable))
    checkpoint, collapse = start.checkpoint, increment.load_factor
    forwards = 1.0 if collapse >= stable else -1.0
    while abs(collapse - stable) > stepper.bracket.collapse:
        middle = 0.5 * (stable + collapse)
        stepper.restore(checkpoint)
        try:
            outcome = stepper.step_to(middle)
        except ConvergenceError:
            break  # neither collapse nor equilibrium found this close to the limit load
        if outcome.collapsed:
            collapse = middle
        else:
            checkpoint, stable = stepper.checkpoint(), middle
    broken_at, end = increment.broken_at, increment.load_factor
    if broken_at is not None:  # bonds that broke beyond the collapse load factor broke in the collapse
        beyond = (forwards * (broken_at - collapse) > 0.0) & (forwards * (broken_at - end) <= 0.0)
        broken_at = np.where(beyond, collapse, broken_at)
    located = PathEnd(last_stable_load_factor=stable)
    return replace(increment, load_factor=collapse, end=located, broken_at=broken_at)
