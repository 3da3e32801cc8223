"""Single blocks and joints against closed forms, through `Assembly` and both solvers.

Tension and opening are positive. The blocks are rigid and nothing is lumped, so the joint alone is elastic.
"""

from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from scipy import optimize

import damagepred
from damagepred import Assembly
from damagepred.assembly.assembly import rectangle
from damagepred.scene import BlockMaterial, Joint, Solver

SOLVERS = {
    method: Solver(method=method, lump_block_elasticity=False, tolerance=1e-6)  # type: ignore[arg-type]
    for method in ("explicit", "quasi_static")
}
B, H, T = 0.6, 0.4, 0.11
WEIGHT = 2000.0 * B * H * T * 9.81


def block_on_plate(joint: Joint, gravity: tuple[float, float] = (0.0, -9.81), density: float = 2000.0) -> Assembly:
    assembly = Assembly(thickness=T, gravity=gravity, joint=joint)
    plate = assembly.add_block(rectangle(-0.5, -0.1, 1.1, 0.0))
    assembly.add_block(rectangle(0.0, 0.0, B, H), BlockMaterial(density=density))
    assembly.support(plate)
    return assembly


@pytest.fixture(params=SOLVERS)
def solver(request: pytest.FixtureRequest) -> Solver:
    return SOLVERS[request.param]


def settle(assembly: Assembly, solver: Solver, increments: int = 1) -> xr.Dataset:
    return damagepred.solve(assembly, solver=solver, increments=increments)


@pytest.mark.parametrize("share", [0.05, 0.15, 0.25, 0.35])
@pytest.mark.parametrize("contacts", [9])
def test_a_joint_without_tension_opens_under_an_eccentric_load(solver: Solver, share: float, contacts: int) -> None:
    """M <= N b/6: theta = 12 M/(k_n t b^3); beyond: theta = 2 N/(k_n t a^2) with a = 3 (b/2 - M/N)."""
    k_n, force = 1e9, 1e4
    joint = Joint(normal_stiffness=k_n, tensile_strength=0.0, cohesion=0.0)
    assembly = block_on_plate(joint, density=0.0)
    assembly.load(1, y=-force, at=(B / 2 + share * B, H / 2))
    ds = settle(assembly, replace(solver, quadrature="midpoint", contacts_per_interface=contacts))
    moment = force * share * B
    if share <= 1 / 6:
        exact = 12 * moment / (k_n * T * B**3)
    else:
        a = 3 * (B / 2 - moment / force)
        exact = 2 * force / (k_n * T * a**2)
    found = -ds["block_rotation"].values[-1, 1]
    # nine midpoints: 1.25 % too soft in the closed joint, coarser where only part of them is in touch
    assert found == pytest.approx(exact, rel=0.08 if share > 1 / 6 else 0.013)
    assert found == pytest.approx(springs_without_tension(contacts, k_n, force, moment), rel=1e-5)


def springs_without_tension(count: int, k_n: float, force: float, moment: float) -> float:
    """Return the rotation of a plate on springs that carry no tension, by a root finder of its own."""
    x = ((np.arange(count) + 0.5) / count - 0.5) * B
    stiffness = k_n * B * T / count

    def imbalance(unknown: np.ndarray) -> list[float]:
        sink, turn = unknown * np.array([1e-5, 1e-3])
        push = stiffness * np.maximum(sink + turn * x, 0.0)
        return [push.sum() / force - 1.0, (push * x).sum() / moment - 1.0]

    found = optimize.root(imbalance, [force / (k_n * B * T) / 1e-5, 12 * moment / (k_n * T * B**3) / 1e-3])
    assert found.success
    return float(found.x[1] * 1e-3)


@pytest.mark.parametrize(("over", "cracks"), [(0.98, False), (1.02, True)])
def test_a_bond_breaks_at_its_strength_under_eccentric_tension(solver: Solver, over: float, cracks: bool) -> None:
    """F (1/A + 6 e/(b^2 t)) = f_t, the elastic joint being exact with three Lobatto contacts."""
    strength, e = 0.2e6, 0.05
    joint = Joint(tensile_strength=strength, cohesion=1e6)
    force = over * strength / (1 / (B * T) + 6 * e / (B**2 * T))
    assembly = block_on_plate(joint, density=0.0)
    assembly.load(1, y=force, at=(B / 2 + e, H / 2))
    ds = settle(assembly, replace(solver, ramp_cycles=4000))
    assert (ds["contact_state"].values[-1] == 1).any() == cracks
    assert ds.attrs["status"] == ("collapsed" if cracks else "complete")
    if not cracks:
        assert ds["contact_normal_stress"].values[-1].max() == pytest.approx(over * strength, rel=1e-6)


@pytest.mark.parametrize("degrees", [10.0, 25.0])
def test_a_block_on_an_incline_sticks_below_the_friction_angle(solver: Solver, degrees: float) -> None:
    angle = np.radians(degrees)
    joint = Joint(tensile_strength=0.0, cohesion=0.0, friction=0.6)
    ds = settle(block_on_plate(joint, (9.81 * np.sin(angle), -9.81 * np.cos(angle))), solver)
    assert ds.attrs["status"] == "complete"
    # what slides at the middle of the joint; the block leans a little on top of that
    shear = ds["contact_shear_stress"].values[-1] * ds["contact_length"].values * T
    assert abs(shear.sum()) == pytest.approx(WEIGHT * np.sin(angle), rel=1e-5)
    moved = ds["block_displacement_x"].values[-1, 1] + ds["block_rotation"].values[-1, 1] * H / 2
    elastic = WEIGHT * np.sin(angle) / (36e9 * B * T)
    if (ds["contact_slip"].values[-1] == 0).all():
        assert moved == pytest.approx(elastic, rel=1e-4)
    else:
        # leaning, it presses less on its upper end, which slips before the rest: still held, but moved further
        assert degrees > 20
        assert elastic < moved < 2 * elastic


def test_a_block_on_an_incline_slides_beyond_the_friction_angle(solver: Solver) -> None:
    angle = np.arctan(0.6) + np.radians(1.0)
    joint = Joint(tensile_strength=0.0, cohesion=0.0, friction=0.6)
    ds = settle(block_on_plate(joint, (9.81 * np.sin(angle), -9.81 * np.cos(angle))), solver)
    assert ds.attrs["status"] == "collapsed"
    assert ds["block_displacement_x"].values[-1, 1] > 0.1


@pytest.mark.parametrize(("offset", "falls"), [(-2.0, False), (2.0, True)])
def test_a_slender_block_topples_where_its_weight_leaves_the_base(solver: Solver, offset: float, falls: bool) -> None:
    """tan(alpha) = b/h."""
    b, h = 0.1, 0.4
    angle = np.arctan(b / h) + np.radians(offset)
    assembly = Assembly(
        thickness=T,
        gravity=(9.81 * np.sin(angle), -9.81 * np.cos(angle)),
        joint=Joint(tensile_strength=0.0, cohesion=0.0, friction=1.0),
    )
    plate = assembly.add_block(rectangle(-1.0, -0.1, 1.0, 0.0))
    assembly.add_block(rectangle(0.0, 0.0, b, h))
    assembly.support(plate)
    ds = settle(assembly, solver)
    assert (ds.attrs["status"] == "collapsed") == falls


@pytest.mark.parametrize("pressure", [0.0, 0.1e6, 0.5e6])
@pytest.mark.parametrize("dilation", [0.0, 0.2])
def test_a_shear_box_yields_where_coulomb_says(solver: Solver, pressure: float, dilation: float) -> None:
    """u_p = (C + sigma tan phi)/k_s with compression sigma; beyond, the stress stays and the slip is what is left."""
    joint = Joint(dilation=dilation)
    assembly = Assembly(thickness=T, gravity=(0.0, 0.0), joint=joint)
    plate = assembly.add_block(rectangle(0.0, -0.1, B, 0.0))
    box = assembly.add_block(rectangle(0.0, 0.0, B, 0.1))
    assembly.support(plate)
    assembly.support(box, y=False)
    assembly.load(box, y=-pressure * B * T)
    limit = (0.375e6 + 0.75 * pressure) / 36e9
    assembly.move(box, x=3 * limit)
    ds = settle(assembly, replace(solver, tolerance=1e-4), increments=12)
    tau = ds["contact_shear_stress"].values[:, 1]
    moved = np.arange(13) / 12 * 3 * limit
    np.testing.assert_allclose(np.abs(tau), np.minimum(36e9 * moved, 36e9 * limit), rtol=2e-4, atol=50.0)
    slip = np.maximum(moved - limit, 0.0)
    np.testing.assert_allclose(np.abs(ds["contact_slip"].values[:, 1]), slip, rtol=1e-3, atol=1e-9)
    rise = ds["block_displacement_y"].values[:, 1] - ds["block_displacement_y"].values[0, 1]
    np.testing.assert_allclose(rise, dilation * slip, rtol=1e-3, atol=2e-9)
