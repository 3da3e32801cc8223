"""A wall that collapses by movement alone: its last equilibrium, compared with closed forms, and its broken bonds."""

import numpy as np
import pytest

import damagepred
from damagepred.assembly import Assembly
from damagepred.assembly.assembly import rectangle
from damagepred.scene import Joint, Solver

B, H, T, K_N, K_S, DENSITY = 0.24, 0.075, 0.11, 10e9, 4e9, 2000.0
WEIGHT, AREA = DENSITY * 9.81 * B * H * T, H * T
FALLS_AT = 0.37
"""Share of the movement at which the block falls; no increment ends there."""
METHODS = pytest.mark.parametrize("method", ["quasi_static", "explicit"])
SIDES = pytest.mark.parametrize("side", [-1, 1])
INCREMENTS = pytest.mark.parametrize("increments", [3, 10])


def between_plates(side: int, joint: Joint) -> Assembly:
    """Return a block between two plates, of which that on one side (-1 left, 1 right) may be drawn away."""
    wall = Assembly(thickness=T, joint=joint)
    left = wall.add_block(rectangle(-0.1, 0.0, 0.0, H))
    wall.add_block(rectangle(0.0, 0.0, B, H))
    right = wall.add_block(rectangle(B, 0.0, B + 0.1, H))
    fixed, drawn = (left, right) if side > 0 else (right, left)
    wall.support(fixed)
    wall.support(drawn, x=False)
    return wall


def solved(wall: Assembly, method: str, increments: int) -> tuple[object, float, float]:
    """Return the path, the share of the movement at which the block stood last, and how much later it fell at most."""
    solver = Solver(method=method, lump_block_elasticity=False)
    ds = damagepred.solve(wall, solver=solver, increments=increments)
    assert ds.attrs["status"] == "collapsed"
    stood, bracket = ds.attrs["collapse_progress"], ds.attrs["collapse_progress_uncertainty"]
    # quasi-static: a step is halved five times, and where a bond breaks is an event; explicit: the increment
    assert 0.0 <= bracket <= (1.0 if method == "explicit" else 2.0**-5) / increments * (1.0 + 1e-9)
    assert ds["progress"].values[-1] == pytest.approx(stood + bracket)
    return ds, stood, bracket


@METHODS
@SIDES
@INCREMENTS
def test_a_clamped_block_falls_where_friction_no_longer_carries_it(method: str, side: int, increments: int) -> None:
    """Clamped by N_0 and drawn apart by u, N = N_0 - k_n A u / 2; it slides out where 2 mu N = W."""
    friction = 0.6
    joint = Joint(K_N, K_S, tensile_strength=0.0, cohesion=0.0, friction=friction)
    wall = between_plates(side, joint)
    drawn, least = (2 if side > 0 else 0), WEIGHT / (2.0 * friction)
    clamped = 5.0 * least
    wall.load(drawn, x=-side * clamped)
    wall.hold_after_load(drawn, y=False, rotation=False)
    wall.move(drawn, x=side * (clamped - least) / (0.5 * K_N * AREA) / FALLS_AT)
    _, stood, bracket = solved(wall, method, increments)
    assert stood - 1e-4 <= FALLS_AT <= stood + bracket + 1e-4


@METHODS
@SIDES
@INCREMENTS
def test_a_bonded_block_falls_where_its_bond_is_torn(method: str, side: int, increments: int) -> None:
    """Drawn apart by u, both joints are pulled by k_n u / 2, and break where that is f_t."""
    strength = 0.02e6
    joint = Joint(K_N, K_S, tensile_strength=strength, cohesion=1e6, friction=0.5)
    wall = between_plates(side, joint)
    wall.move(2 if side > 0 else 0, x=side * 2.0 * strength / K_N / FALLS_AT)
    ds, stood, bracket = solved(wall, method, increments)
    assert stood - 0.01 * FALLS_AT <= FALLS_AT <= stood + bracket + 1e-4
    broken_at = ds["contact_broken_at"].values
    assert np.isfinite(broken_at).any()
    assert np.nanmax(broken_at) <= ds["progress"].values[-1]
    assert np.nanmin(broken_at) == pytest.approx(FALLS_AT, rel=0.02)
