"""Joints with a cap, and bonds that soften by slip, in both solvers."""

import tomllib
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr

import damagepred
from damagepred.assembly import Assembly, wall_model
from damagepred.assembly.assembly import rectangle
from damagepred.errors import InputError
from damagepred.scene import Dpc, Joint, Scene, Solver, Wall
from tests.verification.test_energy_accounts import brickwork

SOLVERS = {
    method: Solver(method=method, lump_block_elasticity=False, tolerance=tolerance)
    for method, tolerance in (("explicit", 1e-4), ("quasi_static", 1e-6))
}
T, B = 0.11, 0.6
STRENGTH = 2e6
CAPPED = Joint(compressive_strength=STRENGTH)


@pytest.fixture(params=SOLVERS)
def solver(request: pytest.FixtureRequest) -> Solver:
    return SOLVERS[request.param]


def boxes(joint: Joint) -> tuple[Assembly, int]:
    wall = Assembly(thickness=T, gravity=(0.0, 0.0), joint=joint)
    wall.support(wall.add_block(rectangle(0.0, -0.1, B, 0.0)))
    return wall, wall.add_block(rectangle(0.0, 0.0, B, 0.1))


def lost(ds: xr.Dataset) -> float:
    """Return the energy error at the end, over the work done."""
    names = ("elastic_energy", "friction_work", "fracture_work", "crushing_work", "released_energy")
    went = sum(float(ds[name][-1]) for name in names)
    return abs(float(ds["external_work"][-1]) - went) / float(ds["external_work"][-1])


def test_a_joint_is_crushed_at_its_strength(solver: Solver) -> None:
    """Compressed by 3 f_c/k_n: the stress is f_c from f_c/k_n on, and crushing dissipates 2 f_c^2/k_n."""
    wall, box = boxes(CAPPED)
    wall.support(box)
    crushing = 3 * STRENGTH / CAPPED.normal_stiffness
    wall.move(box, y=-crushing)
    ds = damagepred.solve(wall, solver=solver, increments=6)
    pressed = np.minimum(np.linspace(0, 3, 7), 1.0) * STRENGTH
    np.testing.assert_allclose(ds["contact_normal_stress"].values, -np.tile(pressed, (3, 1)).T, rtol=1e-9, atol=1e-3)
    np.testing.assert_allclose(ds["block_support_force_y"].values[:, box], -pressed * B * T, rtol=1e-6, atol=1e-3)
    if solver.method == "quasi_static":
        assert float(ds["crushing_work"][-1]) == pytest.approx(2 * STRENGTH**2 / CAPPED.normal_stiffness * B * T)
        assert lost(ds) < 1e-9
        assert float(ds["joint_law_violation"].max()) <= 1.0


def test_a_crushed_corner_carries_an_eccentric_load(solver: Solver) -> None:
    """Half of the strength at an eccentricity of 0.23 of the length: moments balance, and no stress exceeds f_c."""
    wall, box = boxes(replace(CAPPED, tensile_strength=0.0, cohesion=0.0))
    preload = 0.5 * STRENGTH * B * T
    wall.load(box, y=-preload)
    wall.push(box, moment=-preload * (0.23 * B))
    many = replace(solver, quadrature="midpoint", contacts_per_interface=9)
    ds = damagepred.solve(wall, solver=many, increments=4)
    assert ds.attrs["status"] == "complete"
    sigma = ds["contact_normal_stress"].values[-1]
    area = ds["contact_length"].values * T
    assert sigma.min() == pytest.approx(-STRENGTH, rel=1e-5)
    assert (sigma < -STRENGTH * (1 - 1e-5)).sum() == 2
    assert float((sigma * area).sum()) == pytest.approx(-preload, rel=1e-5)
    arm = ds["contact_x"].values - B / 2
    assert float((sigma * area * arm).sum()) == pytest.approx(-preload * (0.23 * B), rel=1e-4)
    if solver.method == "quasi_static":
        assert float(ds["crushing_work"][-1]) > 0
        assert lost(ds) < 0.02


def cone_and_ellipse(pressure: float, joint: Joint) -> float:
    """Return the shear stress a joint with a cap carries."""
    ellipse = np.sqrt((joint.compressive_strength**2 - pressure**2) / joint.cap_shear)
    return float(min(joint.cohesion + pressure * joint.friction, ellipse))


@pytest.mark.parametrize("share", [0.0, 0.1, 0.3, 0.6, 0.9, 0.99])
@pytest.mark.parametrize("softens", [False, True])
def test_a_shear_box_traces_the_cone_and_then_the_ellipse(solver: Solver, share: float, softens: bool) -> None:
    joint = replace(CAPPED, fracture_energy=10.0 if softens else None, residual_cohesion=0.1e6)
    wall, box = boxes(joint)
    wall.load(box, y=-share * STRENGTH * B * T)
    wall.support(box, x=True, y=False)
    expected = cone_and_ellipse(share * STRENGTH, joint)
    assert (expected < joint.cohesion + share * STRENGTH * joint.friction) == (share > 0.2)
    wall.move(box, x=2 * expected / joint.shear_stiffness)
    ds = damagepred.solve(wall, solver=solver, increments=4)
    assert ds.attrs["status"] == "complete"
    u = np.linspace(0, 2, 5) * expected
    np.testing.assert_allclose(np.abs(ds["contact_shear_stress"].values[:, 1]), np.minimum(u, expected), rtol=1e-3)
    slip = np.maximum(u - expected, 0.0) / joint.shear_stiffness
    np.testing.assert_allclose(np.abs(ds["contact_slip"].values[:, 1]), slip, rtol=5e-3, atol=1e-10)
    assert (ds["contact_state"].values[-1] == 2).all()
    if solver.method == "quasi_static":
        assert lost(ds) < 1e-3


def test_brittle_shear_breaks_the_bond_on_the_cone_and_not_on_the_ellipse(solver: Solver) -> None:
    joint = replace(CAPPED, brittle_shear=True, residual_cohesion=0.1e6)
    for share, breaks in ((0.1, True), (0.9, False)):
        wall, box = boxes(joint)
        wall.load(box, y=-share * STRENGTH * B * T)
        wall.support(box, x=True, y=False)
        wall.move(box, x=3 * cone_and_ellipse(share * STRENGTH, joint) / joint.shear_stiffness)
        ds = damagepred.solve(wall, solver=solver, increments=3)
        left = replace(joint, cohesion=joint.residual_cohesion) if breaks else joint
        tau = np.abs(ds["contact_shear_stress"].values[-1])
        np.testing.assert_allclose(tau, cone_and_ellipse(share * STRENGTH, left), rtol=1e-3)
        assert (ds["contact_state"].values[-1] == 1).all() == breaks


def pushed_wall(joint: Joint, **other: object) -> xr.Dataset:
    """Push a small wall over under preload, so that its toe is crushed."""
    wall = brickwork(joint)
    beam = wall.add_block(rectangle(0.0, 0.4, 0.6, 0.5), course=4)
    wall.rest_on_ground(range(4))
    wall.load(beam, y=-25e3)
    wall.support(beam, x=True, y=False, rotation=False)
    wall.move(beam, x=0.4e-3)
    return damagepred.solve(wall, solver=Solver(symmetric_half=False, **other), increments=8)


def test_condensed_courses_are_activated_where_they_would_be_crushed() -> None:
    joint = Joint(compressive_strength=2.0e6)
    one, other = pushed_wall(joint), pushed_wall(joint, condense=False)
    beam = one.sizes["block"] - 1
    force = [ds["block_support_force_x"].values[:, beam] for ds in (one, other)]
    np.testing.assert_allclose(*force, rtol=1e-3, atol=1.0)


def test_a_cap_of_a_scene_is_also_that_of_its_dpc() -> None:
    from damagepred.assembly import wall_model

    scene = Scene(wall=Wall(length=1.2, height=0.3), joint=CAPPED, dpc=Dpc(course=1))
    again = Scene.from_dict(tomllib.loads(scene.to_toml()))
    assert again.joint == CAPPED
    law = wall_model(again).properties
    assert (law.compressive_strength == STRENGTH).all()
    assert np.isinf(wall_model(replace(scene, joint=Joint())).properties.compressive_strength).all()
    with pytest.raises((ValueError, InputError), match="compressive_strength"):
        Joint(compressive_strength=1e6, dilation=0.1)


SHEAR_ENERGY = 100.0
WEARS = Joint(fracture_energy=10.0, shear_fracture_energy=SHEAR_ENERGY, residual_cohesion=0.05e6, residual_friction=0.6)


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
