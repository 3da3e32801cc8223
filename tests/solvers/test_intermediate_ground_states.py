"""Intermediate movements: the state of a path at a smaller movement is that of a path to this movement."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from damagepred.assembly.wall import wall_model
from damagepred.scene import Dpc, Joint, Mound, Movement, Scene, Solver, Wall
from damagepred.solvers import Increment, solve_path

pytestmark = pytest.mark.quick_cases()

WALL = Wall(length=3.6, height=0.9, block_length=0.24, block_height=0.09)
CONSTANT: Mapping[str, Mound] = {
    "mitchell": Mound(shape="mitchell", surface_movement=0.06, suction_depth=2.5),
    "tree": Mound(shape="tree", surface_movement=0.03, reach=4.0),
    "pipe": Mound(shape="pipe", surface_movement=0.03, reach=1.0),
    "tunnel": Mound(shape="tunnel", surface_movement=0.03, tunnel_depth=4.0, position=1.0),
    "table": Mound(shape="table", surface_movement=0.03, table=((0.0, 0.0), (0.3, 0.8), (1.0, 0.2))),
}
MOUNDS = {
    ("walsh", "doming"): Mound(surface_movement=0.06, suction_depth=2.0),
    ("walsh", "dishing"): Mound(surface_movement=0.03, dishing_edge_base=0.1, dishing_movement_divisor=40.0),
    **{(name, kind): mound for name, mound in CONSTANT.items() for kind in ("doming", "dishing")},
}
SYMMETRIC = ("walsh", "mitchell", "pipe")
"""Mounds of which half is solved, unless the solver has the whole wall."""
UNBROKEN = Joint(tensile_strength=1e9, cohesion=1e9)
WAYS = {
    "quasi_static": Solver(),
    "whole": Solver(symmetric_half=False),
    "explicit": Solver(method="explicit", tolerance=1e-4, ramp_cycles=2000),
    "explicit whole": Solver(method="explicit", tolerance=1e-4, ramp_cycles=2000, symmetric_half=False),
}


def on_mound(mound: Mound, kind: str, solver: Solver, share: float = 1.0) -> Scene:
    return Scene(
        wall=WALL,
        dpc=Dpc(course=2),
        joint=Joint(tensile_strength=2e5, cohesion=3e5),
        movement=Movement(kind=kind, shape="mound"),
        mound=replace(mound, surface_movement=share * mound.surface_movement),
        solver=solver,
    )


def states(scene: Scene, increments: int) -> list[Increment]:
    return list(solve_path(wall_model(scene), scene.solver, increments))


def assert_same(one: Increment, other: Increment, tolerance: float) -> None:
    moved = float(np.abs(other.displacement).max())
    assert moved > 1e-4
    np.testing.assert_allclose(one.displacement, other.displacement, rtol=0, atol=tolerance * moved)
    np.testing.assert_allclose(one.opening, other.opening, rtol=0, atol=tolerance * moved)
    # the few contacts where the footing just separates from the soil, which has four contacts for one
    assert (one.state == other.state).mean() > 0.998


@pytest.mark.parametrize(
    ("way", "shape", "kind"),
    [("quasi_static", *mound) for mound in MOUNDS] + [("whole", *mound) for mound in MOUNDS if mound[0] in SYMMETRIC],
)
def test_a_path_read_in_between_is_the_path_to_the_smaller_surface_movement(way: str, shape: str, kind: str) -> None:
    scene = on_mound(MOUNDS[shape, kind], kind, WAYS[way])
    path = states(scene, 4)
    for reached in (1, 3):
        smaller = states(on_mound(MOUNDS[shape, kind], kind, WAYS[way], reached / 4), reached)
        assert_same(path[reached], smaller[-1], 1e-6)


@pytest.mark.parametrize("way", ["explicit", "explicit whole"])
@pytest.mark.parametrize(("shape", "kind"), [("walsh", "doming"), ("walsh", "dishing"), ("pipe", "doming")])
def test_the_same_with_the_explicit_solver(shape: str, kind: str, way: str) -> None:
    scene = on_mound(MOUNDS[shape, kind], kind, WAYS[way])
    path, smaller = states(scene, 2), states(on_mound(MOUNDS[shape, kind], kind, WAYS[way], 0.5), 1)
    assert_same(path[1], smaller[-1], 1e-6)


@pytest.mark.parametrize("method", ["quasi_static", "explicit"])
def test_the_path_to_an_arc_passes_through_flatter_arcs(method: str) -> None:
    """The circle of half the deflection differs from half of the circle, by 4e-4 here."""
    wall = replace(WALL, height=0.36)
    solver = Solver(method=method, tolerance=1e-6, ramp_cycles=2000)
    scenes = [
        Scene(wall=wall, joint=UNBROKEN, movement=Movement(central_deflection=d, shape="arc"), solver=solver)
        for d in (0.2, 0.1)
    ]
    path, smaller = states(scenes[0], 2), states(scenes[1], 1)
    assert_same(path[1], smaller[-1], 1e-6)
    assert np.abs(2 * path[1].displacement - path[2].displacement).max() > 1e-4


def test_linear_interpolation_of_the_ground_is_accurate_enough() -> None:
    """The ground is interpolated linearly between exact states: ten times as many hardly change the result."""
    solver = replace(WAYS["explicit whole"], ramp_pieces=100)
    ends = [
        states(on_mound(MOUNDS["walsh", "doming"], "doming", replace(solver, ramp_pieces=pieces)), 1)[-1]
        for pieces in (100, 1000)
    ]
    assert_same(ends[0], ends[1], 1e-2)
