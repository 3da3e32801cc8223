"""Collapse: just above the limit load, bracketed with few iterations, by a limit that allows for elasticity."""

import itertools
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from damagepred import BlockMaterial, Footing, Joint, Movement, Rig, Scene, Solver, Wall, solve
from damagepred.assembly import Assembly, Model
from damagepred.assembly.assembly import rectangle
from damagepred.solvers import solve_path
from damagepred.solvers.quasi_static.continuation import Continuation
from damagepred.solvers.quasi_static.equilibrium import Equilibrium
from damagepred.solvers.quasi_static.step_control import COLLAPSE_BRACKET
from damagepred.solvers.system.collapse_criterion import detached_blocks, largest_elastic_displacement

METHODS = pytest.mark.parametrize("method", ["quasi_static", "explicit"])


def on_plate(width: float, height: float, friction: float, lean: float) -> Assembly:
    """Return a dry block on a heavy fixed plate, under inclined gravity."""
    wall = Assembly(gravity=(9.81 * lean, -9.81), joint=Joint(tensile_strength=0.0, cohesion=0.0, friction=friction))
    plate = wall.add_block(rectangle(-5.0, -1.0, 5.0, 0.0))
    wall.support(plate)
    wall.add_block(rectangle(0.0, 0.0, width, height))
    return wall


@METHODS
def test_a_pushed_wall_that_creeps_above_its_limit_load_has_collapsed(method: str) -> None:
    """Three courses, 1 % above the sliding load: collapse at the limit, although they hardly accelerate."""
    wall = on_plate(0.4, 0.1, 0.3, 0.0)
    for i in (1, 2):
        wall.add_block(rectangle(0.0, 0.1 * i, 0.4, 0.1 * (i + 1)))
    wall.push_body(x=0.3 * 1.01)
    settings = Solver(method=method, tolerance=None if method == "quasi_static" else 1e-5)
    last = list(solve_path(wall.build(settings), settings, 1))[-1]
    assert last.collapsed
    assert last.end.last_stable_load_factor == pytest.approx(1 / 1.01, abs=2e-3)


@pytest.mark.quick_cases
@pytest.mark.parametrize(
    ("method", "cohesion", "falls"),
    [
        ("quasi_static", 300.0, True),
        ("explicit", 300.0, True),
        ("quasi_static", 1.2e3, False),
        ("explicit", 1.2e3, False),
    ],
)
def test_a_brick_crushed_by_its_own_weight_collapses(method: str, cohesion: float, falls: bool) -> None:
    """The base carries W/A = 1.5 kPa: safe where 2 C is larger, collapse where 3.6 C is smaller, with C = 300 Pa."""
    weak = BlockMaterial(cohesion=cohesion, friction=0.0)
    wall = Assembly(joint=Joint(tensile_strength=1e9, cohesion=1e9), block=weak)
    wall.add_block(rectangle(0.0, 0.0, 0.24, 0.075), zone_size=0.08)
    wall.rest_on_ground([0])
    settings = Solver(method=method)
    first = next(iter(solve_path(wall.build(settings), settings, 1)))
    assert first.collapsed == falls
    assert np.isfinite(first.residuals.unbalanced_force_ratio)


def test_a_wall_that_balances_too_far_away_stood_an_increment_before() -> None:
    """A stiff footing is pressed into its supports until blocks leave the range of small displacements."""
    scene = Scene(
        wall=Wall(length=0.112, height=0.22, thickness=0.056, block_length=0.056, block_height=0.055),
        footing=Footing(width=0.46, depth=0.53),
        rig=Rig(supports=(0.0112, 0.1008), jacks=(0.028, 0.0784, 0.0952), stop_at_zero=False),
        movement=Movement(shape="jacks", central_deflection=1.2e-4, increments=7),
    )
    ds = solve(scene)
    assert ds.attrs["status"] == "collapsed"
    assert ds.attrs["collapse_progress"] == ds["progress"].values[-2]
    assert ds["unbalanced_force_ratio"].values[-1] < 1e-6


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
    """Friction depends on the path: with smaller steps a wall may stand up to a load that collapsed it before."""
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
    assert fell[0] - COLLAPSE_BRACKET <= path.last_stable_load_factor <= fell[0]
    assert path.state.load_factor == fell[0]


LENGTH, HEIGHT, WEIGHT = 0.24, 0.075, 2000.0 * 9.81 * 0.075


def tall(count: int, normal_stiffness: float) -> Assembly:
    bond = Joint(normal_stiffness=normal_stiffness, tensile_strength=1e12, cohesion=1e12)
    stack = Assembly(joint=bond)
    for i in range(count):
        stack.add_block(rectangle(0.0, HEIGHT * i, LENGTH, HEIGHT * (i + 1)))
    stack.rest_on_ground([0])
    return stack


def test_blocks_beyond_the_limit_are_detached() -> None:
    model = tall(40, 1e7).build(Solver(lump_block_elasticity=False))
    moved = np.zeros(model.size)
    far = largest_elastic_displacement(model, 0.0)
    assert far == pytest.approx(40 * 41 * WEIGHT / 2e7, rel=1e-6)
    # a suddenly applied load doubles the elastic displacement; half a brick is allowed besides,
    # and twice the settlement of the bed joint on the ground
    limit = 2.0 * far + 0.5 * np.sqrt(LENGTH * HEIGHT) + 2.0 * 40 * WEIGHT / 1e7
    for share, loose in ((0.999, []), (1.001, [20])):
        moved[3 * 20] = share * limit
        assert np.flatnonzero(detached_blocks(model, moved, 0.0)).tolist() == loose


def test_the_limit_of_an_unsupported_stack_has_no_elastic_part() -> None:
    wall = tall(2, 1e7)
    wall.add_block(rectangle(1.0, 0.0, 1.24, HEIGHT))  # in the air
    model = wall.build(Solver(lump_block_elasticity=False))
    assert largest_elastic_displacement(model, 1.0) == 0.0
