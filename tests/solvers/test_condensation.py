"""Condensing what stays elastic changes nothing, and opens what does not stay so."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from damagepred.assembly import wall_model
from damagepred.scene import Scene, Solver
from damagepred.solvers.quasi_static import quasi_static_path

DATA = Path(__file__).resolve().parents[2] / "data"


@pytest.mark.parametrize(
    ("name", "dpc", "deflection"),
    [("bryant_dishing", True, 4e-3), ("bryant_dishing", False, 2e-3), ("bryant_window_doming", True, 1e-3)],
)
def test_condensed_and_looked_at_joint_by_joint_are_the_same(name: str, dpc: bool, deflection: float) -> None:
    scene = Scene.from_toml(DATA / f"{name}.toml").with_values({"movement.central_deflection": deflection})
    model = wall_model(scene if dpc else replace(scene, dpc=None))
    solver = Solver(method="quasi_static")
    pairs = zip(
        quasi_static_path(model, solver, 5),
        quasi_static_path(model, replace(solver, condense=False), 5),
        strict=True,
    )
    for condensed, whole in pairs:
        assert condensed.unbalanced_force_ratio < 1e-6
        assert whole.unbalanced_force_ratio < 1e-6
        np.testing.assert_allclose(condensed.opening, whole.opening, atol=1e-9)
        # a wall that slides at both its ends has no one place along the footing: friction holds it anywhere near
        np.testing.assert_allclose(condensed.displacement, whole.displacement, atol=1e-4)
        np.testing.assert_array_equal(condensed.state == 1, whole.state == 1)
