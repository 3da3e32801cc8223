"""Static condensation of elastic parts does not change results, and ends where they leave the elastic range."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from damagepred.assembly import Model, wall_model
from damagepred.assembly.house import house_model
from damagepred.scene import House, Scene, Solver
from damagepred.solvers.quasi_static import elimination_tree
from damagepred.solvers.quasi_static.elimination_tree import EliminationTree
from damagepred.solvers.quasi_static.linear_system import MultifrontalSystem
from damagepred.solvers.quasi_static.stepper import quasi_static_path
from damagepred.solvers.system.discrete_system import DiscreteSystem

DATA = Path(__file__).resolve().parents[2] / "data"


def coarse(name: str) -> Scene:
    """Wall of a file in bricks of twice the size."""
    scene = Scene.from_toml(DATA / f"{name}.toml")
    wall = scene.wall
    return replace(scene, wall=replace(wall, block_length=2 * wall.block_length, block_height=2 * wall.block_height))


@pytest.mark.parametrize(
    ("name", "dpc", "deflection"),
    [("bryant_dishing", True, 4e-3), ("bryant_dishing", False, 2e-3), ("bryant_window_doming", True, 3e-3)],
)
def test_condensed_and_full_systems_are_the_same(name: str, dpc: bool, deflection: float) -> None:
    scene = coarse(name).with_values({"movement.central_deflection": deflection})
    model = wall_model(scene if dpc else replace(scene, dpc=None))
    solver = Solver(method="quasi_static")
    pairs = zip(*(quasi_static_path(model, replace(solver, condense=c), 3) for c in (True, False)), strict=True)
    for condensed, whole in pairs:
        assert condensed.residuals.unbalanced_force_ratio < 1e-6
        assert whole.residuals.unbalanced_force_ratio < 1e-6
        np.testing.assert_allclose(condensed.opening, whole.opening, atol=1e-9)
        # friction balances a range of positions of a wall that slides at both ends; regularisation takes the same one
        np.testing.assert_allclose(condensed.displacement, whole.displacement, atol=2e-6)
        np.testing.assert_array_equal(condensed.state == 1, whole.state == 1)
        assert condensed.energy.elastic_energy == pytest.approx(whole.energy.elastic_energy, rel=1e-5)
    assert (whole.state == 1).any()


@pytest.mark.parametrize(("changed", "reused"), [("tensile_strength", True), ("shear_stiffness", False)])
def test_walls_that_differ_in_strength_share_elastic_factors(changed, reused, monkeypatch) -> None:
    """Joint strengths do not enter the elastic stiffness; paths are the same, to the last digit, without sharing."""
    scene = replace(coarse("bryant_dishing"), solver=Solver(symmetric_half=False))
    first = wall_model(scene)
    law = first.properties._replace(**{changed: 1.1 * getattr(first.properties, changed)})
    second = replace(first, properties=law)
    eliminated = []
    plain = MultifrontalSystem._eliminate_elastic

    def counted(system: MultifrontalSystem, *of: Any) -> bool:
        eliminated.append(system)
        return plain(system, *of)

    def path(model: Model) -> list[np.ndarray]:
        return [step.displacement for step in quasi_static_path(model, scene.solver, 4)]

    elimination_tree._recent.clear()
    alone = path(second)
    elimination_tree._recent.clear()
    monkeypatch.setattr(MultifrontalSystem, "_eliminate_elastic", counted)
    for model in (first, first):
        path(model)
    before = len(eliminated)
    shared = path(second)
    assert (len(eliminated) - before < before / 2) == reused
    np.testing.assert_array_equal(shared, alone)


def terrace() -> House:
    """Front and back walls of 24 m, six walls between them; the ground under one end settles."""
    bricks = {"height": 2.4, "block_length": 0.6, "block_height": 0.3}
    plan = {"front": ([0, 0], [24, 0]), "back": ([24, 6], [0, 6])}
    plan |= {f"party_{k}": ([4.8 * k, 0], [4.8 * k, 6]) for k in range(6)}
    walls = [{"name": name, "start": start, "end": end, **bricks} for name, (start, end) in plan.items()]
    mound = {"shape": "corner", "point": [0, 0], "reach": 4, "surface_movement": "15 mm"}
    house = Scene.from_dict(
        {"wall": walls, "mound": mound, "movement": {"kind": "settle"}, "solver": {"blocks": "rigid"}}
    )
    assert isinstance(house, House)
    return house


def test_fronts_of_a_terrace_take_hardly_more_memory_than_those_of_its_walls(monkeypatch: pytest.MonkeyPatch) -> None:
    """A terrace is divided in plan; its path is the path of undivided courses."""
    house = terrace()
    model = house_model(house)
    divided, *alone = (EliminationTree(DiscreteSystem.of(m), None) for m in (model, *model.walls))
    assert divided.matrix_entries < 1.7 * sum(tree.matrix_entries for tree in alone)  # 3.5 with undivided courses
    in_plan = list(quasi_static_path(model, house.solver, 2))
    monkeypatch.setattr(elimination_tree, "COURSE_SHARE", 0.0)
    elimination_tree._recent.clear()
    for divided_step, step in zip(in_plan, quasi_static_path(model, house.solver, 2), strict=True):
        np.testing.assert_allclose(divided_step.displacement, step.displacement, atol=1e-9)
        np.testing.assert_array_equal(divided_step.state, step.state)
    assert (step.state == 1).any()
    elimination_tree._recent.clear()
