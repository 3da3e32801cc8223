"""Bonds that soften by slip: the shear box, and walls in both solvers."""

from dataclasses import replace

import numpy as np
import pytest
import xarray as xr

import damagepred
from damagepred.assembly import wall_model
from damagepred.kernels.joint.explicit_update import explicit_update
from damagepred.kernels.joint.softening import Softening
from damagepred.scene import Joint, Scene, Solver, Wall
from tests.kernels.one_joint import one_joint
from tests.solvers.test_cap import SOLVERS, B, T, boxes, lost

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


@pytest.mark.parametrize("pressure", [0.0, 0.3e6])
def test_softening_by_slip_dissipates_the_fracture_energy(pressure: float) -> None:
    """With constant friction the work beyond the residual strength is G_f, in short steps."""
    joint = replace(WEARS, residual_friction=None)
    critical = 2 * SHEAR_ENERGY / (joint.cohesion - joint.residual_cohesion)
    ds = sheared(joint, pressure, 1.5 * critical, 200, SOLVERS["quasi_static"])
    slip = abs(float(ds["contact_slip"].values[-1, 1]))
    left = joint.residual_cohesion + pressure * joint.friction
    extra = float(ds["friction_work"][-1]) / (B * T) - left * slip
    assert extra == pytest.approx(SHEAR_ENERGY, rel=0.02)
    assert lost(ds) < 1e-3 + 0.01


@pytest.mark.parametrize("share", [0.0, 0.25, 0.8, 1.2])
def test_slip_reduces_the_tensile_strength_too(share: float) -> None:
    """Slip under pressure by a share of s_c, then tension: the residual f_t is the largest stress."""
    k_n, k_s, f_t, cohesion, friction, w_c, s_c = 82e9, 36e9, 0.25e6, 0.35e6, 0.75, 1e-4, 7e-4
    slip_weight = (w_c - f_t / k_n) / s_c
    joint = one_joint(k_n, k_s, (f_t, cohesion, friction), (0.0, 0.0, friction), w_c=w_c, slip_weight=slip_weight)

    def step(u_n: float, u_s: float, history: tuple) -> tuple[float, tuple]:
        for _ in range(5):
            sigma, _, *history = explicit_update(u_n, u_s, *history, joint, True, Softening(None))
        return sigma, tuple(history)

    history: tuple = (0.0, 0.0, False, 0.0)
    for u_s in np.linspace(0, share * s_c, 400):
        _, history = step(-1e6 / k_n, float(u_s), history)
    slid = abs(history[0])
    bond = max(1.0 - slid / s_c, 0.0)
    most = 0.0
    for u_n in np.linspace(-1e6 / k_n, 1.2 * w_c, 4000):
        sigma, history = step(float(u_n), history[0], history)
        most = max(most, sigma)
    assert most == pytest.approx(f_t * bond, rel=0.02, abs=1.0)
    assert (slid > 0.15 * s_c) == (share > 0.0)


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
