"""Bonds that soften by slip: the shear box, and walls in both solvers."""

from dataclasses import replace

import numpy as np
import pytest
import xarray as xr

import damagepred
from damagepred.assembly import wall_model
from damagepred.scene import Joint, Scene, Solver, Wall
from tests.solvers.test_cap import SOLVERS, B, T, boxes

SHEAR_ENERGY = 100.0
WEARS = Joint(fracture_energy=10.0, shear_fracture_energy=SHEAR_ENERGY, residual_cohesion=0.05e6, residual_friction=0.6)


@pytest.fixture(params=SOLVERS)
def solver(request: pytest.FixtureRequest) -> Solver:
    return SOLVERS[request.param]


def sheared(joint: Joint, pressure: float, moved: float, increments: int, solver: Solver) -> xr.Dataset:
    wall, box = boxes(joint)
    wall.load(box, y=-pressure * B * T)
    wall.support(box, x=True, y=False)
    wall.move(box, x=moved)
    return damagepred.solve(wall, solver=solver, increments=increments)


@pytest.mark.parametrize("pressure", [0.0, 0.3e6])
def test_a_shear_box_softens_to_its_residual_strength(solver: Solver, pressure: float) -> None:
    """k_s (u - s) falls linearly with s from C + p tan phi to the residual at s_c = 2 G_f / (C - C_r)."""
    joint = WEARS
    critical = 2 * SHEAR_ENERGY / (joint.cohesion - joint.residual_cohesion)
    assert joint.residual_friction is not None
    first = joint.cohesion + pressure * joint.friction
    left = joint.residual_cohesion + pressure * joint.residual_friction
    moved = 1.5 * critical
    ds = sheared(joint, pressure, moved, 12, solver)
    assert ds.attrs["status"] == "complete"
    u = np.linspace(0, 1, 13) * moved
    k_s = joint.shear_stiffness
    slip = np.maximum(k_s * u - first, 0.0) / (k_s - (first - left) / critical)
    slip = np.where(slip > critical, u - left / k_s, slip)
    np.testing.assert_allclose(np.abs(ds["contact_slip"].values[:, 1]), slip, rtol=1e-3, atol=1e-9)
    tau = np.minimum(k_s * u, np.maximum(first - (first - left) * slip / critical, left))
    np.testing.assert_allclose(np.abs(ds["contact_shear_stress"].values[:, 1]), tau, rtol=1e-3, atol=1e-3)
    if solver.method == "quasi_static":
        assert float(ds["joint_law_violation"].max()) < 1.0


@pytest.mark.parametrize("shear_energy", [None, SHEAR_ENERGY])
def test_joints_too_soft_to_soften_in_tension_are_counted(shear_energy: float | None) -> None:
    little = Joint(fracture_energy=0.1, shear_fracture_energy=shear_energy)
    model = wall_model(Scene(wall=Wall(length=1.2, height=0.3), joint=little))
    assert not model.properties.critical_opening.any()
    assert not model.properties.critical_slip.any()
    assert model.snap_back_limited == len(model.joints.kind)
    assert wall_model(Scene(wall=Wall(length=1.2, height=0.3))).snap_back_limited == 0


@pytest.mark.parametrize(
    "wrong", [{"fracture_energy": None}, {"dilation": 0.1}, {"brittle_shear": True}], ids=lambda w: next(iter(w))
)
def test_incompatible_settings_are_refused(wrong: dict[str, object]) -> None:
    with pytest.raises(ValueError, match="shear_fracture_energy"):
        replace(WEARS, **wrong)
