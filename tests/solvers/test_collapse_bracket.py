"""The load factor of collapse is bracketed, with few iterations."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from damagepred.assembly import Assembly, Model
from damagepred.assembly.assembly import rectangle
from damagepred.scene import Joint, Solver
from damagepred.solvers.options import DEFAULTS
from damagepred.solvers.quasi_static.continuation import Continuation
from damagepred.solvers.quasi_static.equilibrium import Equilibrium

CONTROL = DEFAULTS.continuation
DRY = Joint(tensile_strength=0.0, cohesion=0.0, friction=0.75)


def pushed(units: int, courses: int, share: float) -> Model:
    """Return a dry wall in running bond on a plate, pushed along x by a share of its weight."""
    wall, length = Assembly(joint=DRY), 0.24 * units
    wall.support(wall.add_block(rectangle(-0.12, -0.075, length + 0.12, 0.0)))
    for course in range(courses):
        inner = 0.24 * (np.arange(units) + 0.5) if course % 2 == 0 else 0.24 * np.arange(1, units)
        for left, right in itertools.pairwise([0.0, *inner, length]):
            wall.add_block(rectangle(left, 0.075 * course, right, 0.075 * (course + 1)))
    wall.push_body(x=share)
    return wall.build(Solver())


def within(calls: int, function: Callable[..., Any]) -> Callable[..., Any]:
    """Return a function that may be called a limited number of times."""
    remaining = itertools.count(calls, -1)

    def counted(*arguments: Any, **named: Any) -> Any:
        assert next(remaining) > 0, "too often"
        return function(*arguments, **named)

    return counted


def test_the_bracket_ends_where_a_wall_stands_in_smaller_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    """Friction depends on the path: with smaller steps a wall may stand up to a load that collapsed it in a larger
    step."""
    path = Continuation(pushed(2, 2, 0.1), Solver())
    path.advance(1.0, 0.0)
    snap_through, find, fell = path.snap_through, within(200, Equilibrium.find), []

    def fall_once(state: Any, start_load_factor: float, cycles_share: float = 1.0) -> Any:
        if fell:
            return snap_through(state, start_load_factor, cycles_share)
        fell.append(state.load_factor)
        state.displacement[::3] += 1.0
        return state, np.inf

    def not_before(self: Equilibrium, state: Any, *arguments: Any, **named: Any) -> float:
        worst = find(self, state, *arguments, **named)
        return worst if fell or state.load_factor < 0.5 else 1.0

    monkeypatch.setattr(path, "snap_through", fall_once)
    monkeypatch.setattr(Equilibrium, "find", not_before)
    assert path.advance(1.0, 1.0) == np.inf
    assert fell[0] - CONTROL.collapse_bracket <= path.last_stable_load_factor <= fell[0]
    assert path.state.load_factor == fell[0]
