"""Static condensation of elastic parts does not change results, and ends where they leave the elastic range."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from damagepred.assembly import Model, wall_model
from damagepred.scene import Scene, Solver
from damagepred.solvers.quasi_static import elimination_tree
from damagepred.solvers.quasi_static.linear_system import MultifrontalSystem
from damagepred.solvers.quasi_static.stepper import quasi_static_path

DATA = Path(__file__).resolve().parents[2] / "data"


@pytest.mark.parametrize(
    ("name", "dpc", "deflection"),
    [("bryant_dishing", True, 4e-3), ("bryant_dishing", False, 2e-3), ("bryant_window_doming", True, 3e-3)],
)
def test_condensed_and_full_systems_are_the_same(name: str, dpc: bool, deflection: float) -> None:
    scene = Scene.from_toml(DATA / f"{name}.toml").with_values({"movement.central_deflection": deflection})
    model = wall_model(scene if dpc else replace(scene, dpc=None))
    solver = Solver(method="quasi_static")
    pairs = zip(
        quasi_static_path(model, solver, 5), quasi_static_path(model, replace(solver, condense=False), 5), strict=True
    )
    for condensed, whole in pairs:
        assert condensed.residuals.unbalanced_force_ratio < 1e-6
        assert whole.residuals.unbalanced_force_ratio < 1e-6
        np.testing.assert_allclose(condensed.opening, whole.opening, atol=1e-9)
        # friction balances a range of positions of a wall that slides at both ends; regularisation takes the same one
        np.testing.assert_allclose(condensed.displacement, whole.displacement, atol=2e-6)
        np.testing.assert_array_equal(condensed.state == 1, whole.state == 1)
        assert condensed.energy.elastic_energy == pytest.approx(whole.energy.elastic_energy, rel=1e-5)


@pytest.mark.parametrize(("changed", "reused"), [("tensile_strength", True), ("shear_stiffness", False)])
def test_walls_that_differ_in_strength_share_elastic_factors(
    changed: str, reused: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Joint strengths do not enter the elastic stiffness; paths are the same, to the last digit, without sharing."""
    scene = replace(Scene.from_toml(DATA / "bryant_dishing.toml"), solver=Solver(symmetric_half=False))
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
