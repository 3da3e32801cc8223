"""A wall collapses just above its limit load, and stands just below it."""

import numpy as np
import pytest

from damagepred import solve
from damagepred.assembly import Assembly
from damagepred.assembly.assembly import rectangle
from damagepred.scene import BlockMaterial, Footing, Joint, Movement, Rig, Scene, Solver, Wall
from damagepred.solvers import solve_path

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
    settings = Solver(method=method, tolerance=None if method == "quasi_static" else 1e-5)  # type: ignore[arg-type]
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
    settings = Solver(method=method)  # type: ignore[arg-type]
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
