"""The driver on a wall of one number: where it stops, and how it locates zero support load and collapse."""

from dataclasses import dataclass, field, replace

import numpy as np

from damagepred.assembly import Model
from damagepred.diagnostics import Counters
from damagepred.errors import ConvergenceError
from damagepred.scene import Solver
from damagepred.solvers.driver import Bracket, Outcome, follow_movement
from damagepred.solvers.state.increment import Increment
from tests.solvers.walls import stack

NONE = np.zeros((1, 1))


@dataclass
class Scripted:
    """A stepper whose wall collapses and unloads its supports at given load factors."""

    collapses_at: float = np.inf
    unloads_at: float = np.inf
    hesitates: tuple[float, float] = (np.inf, np.inf)
    bracket: Bracket = field(default_factory=lambda: Bracket(1e-9, 1e-9, 40, 1e-3))
    load_factor: float = 0.0
    tried: list[float] = field(default_factory=list)
    number: int = -1

    def begin_increment(self, number: int) -> None:
        self.number = number

    def step_to(self, load_factor: float) -> Outcome:
        self.load_factor = load_factor
        self.tried.append(load_factor)
        if self.hesitates[0] < load_factor < self.hesitates[1]:
            raise ConvergenceError("neither", increment=self.number)
        fell = load_factor > self.collapses_at
        return Outcome(0.0, balanced=not fell, collapsed=fell)

    def support_load(self) -> float:
        return 100.0 * (self.unloads_at - self.load_factor)

    def checkpoint(self) -> float:
        return self.load_factor

    def restore(self, checkpoint: float) -> None:
        self.load_factor = checkpoint

    def report(self, outcome: Outcome) -> Increment:
        state = NONE.astype(np.int8)
        return Increment(
            self.number, self.load_factor, NONE, NONE, NONE, NONE, NONE, state, 0.0, collapsed=outcome.collapsed
        )

    def counters(self) -> Counters:
        return Counters(cycles=len(self.tried))

    def end_increment(self) -> None:
        """Do nothing."""

    def support_after_load(self) -> None:
        """Do nothing."""


def wall(live: bool = False) -> Model:
    """Return a stack, under live load if asked for."""
    model = stack(2, Solver())
    load = np.ones_like(model.supports.live_load) if live else np.zeros_like(model.supports.live_load)
    return replace(model, supports=model.supports._replace(live_load=load))


def test_collapse_is_bisected_under_live_load_alone() -> None:
    last = list(follow_movement(Scripted(collapses_at=0.6), wall(), 4))[-1]
    assert (last.number, last.load_factor, last.end.last_stable_load_factor) == (3, 0.75, 0.5)
    last = list(follow_movement(Scripted(collapses_at=0.6), wall(live=True), 4))[-1]
    assert last.end.last_stable_load_factor <= 0.6 < last.load_factor <= last.end.last_stable_load_factor + 1e-3
    located = Scripted(collapses_at=0.6, bracket=Bracket(1e-9, 1e-9, 40))
    assert list(follow_movement(located, wall(live=True), 4))[-1].load_factor == 0.75


def test_bisection_ends_where_a_wall_neither_balances_nor_collapses() -> None:
    last = list(follow_movement(Scripted(collapses_at=0.6, hesitates=(0.6, 0.65)), wall(live=True), 4))[-1]
    assert (last.end.last_stable_load_factor, last.load_factor) == (0.5, 0.75)
