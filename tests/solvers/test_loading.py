"""Live loads that grow with the movement, blocks fixed after the dead load, beams that stay level."""

from dataclasses import replace

import numpy as np
import pytest

import damagepred
from damagepred import Assembly, BlockMaterial, InputError, Joint, Solver
from damagepred.assembly.assembly import rectangle
from damagepred.solvers import solve_path
from damagepred.solvers.quasi_static.step_control import COLLAPSE_BRACKET
from damagepred.solvers.symmetry import reduce_by_symmetry
from tests.verification.test_energy_accounts import brickwork

SOLVERS = {
    method: Solver(method=method, lump_block_elasticity=False, tolerance=tolerance)
    for method, tolerance in (("explicit", 1e-5), ("quasi_static", 1e-6))
}
DRY = Joint(tensile_strength=0.0, cohesion=0.0, friction=0.6)
T = 0.11


@pytest.fixture(params=SOLVERS)
def solver(request: pytest.FixtureRequest) -> Solver:
    return SOLVERS[request.param]


def block_on_plate(width: float, height: float, joint: Joint) -> tuple[Assembly, float]:
    """Return a block on a fixed plate, and its weight (N)."""
    wall = Assembly(thickness=T, joint=joint)
    wall.support(wall.add_block(rectangle(-1.0, -0.1, 1.0 + width, 0.0)))
    wall.add_block(rectangle(0.0, 0.0, width, height))
    return wall, 2000.0 * width * height * T * 9.81


@pytest.mark.parametrize("increments", [3, 10])
def test_a_pushed_block_slides_at_the_friction_angle(solver: Solver, increments: int) -> None:
    """Pushed low by P lambda, it slides where P lambda = W tan(phi)."""
    wall, weight = block_on_plate(0.6, 0.3, DRY)
    wall.push(1, x=weight, at=(0.3, 0.0))
    ds = damagepred.solve(wall, solver=solver, increments=increments)
    assert ds.attrs["status"] == "collapsed"
    gap = ds.attrs["collapse_progress_uncertainty"]
    # so near its limit load the explicit solver may find neither collapse nor equilibrium
    assert 0 < gap <= (5e-3 if solver.method == "explicit" else COLLAPSE_BRACKET * 1.0001)
    assert ds.attrs["collapse_progress"] - gap < 0.6 < ds.attrs["collapse_progress"] + 2 * gap
    assert ds["progress"].values[-1] == pytest.approx(ds.attrs["collapse_progress"] + gap)


def test_a_body_force_is_a_multiple_of_the_weight() -> None:
    wall, weight = block_on_plate(0.6, 0.3, DRY)
    wall.push_body(x=0.25, y=-0.5)
    wall.push(1, y=3.0, moment=2.0)
    live = wall.build().supports.live_load.reshape(-1, 3)
    np.testing.assert_allclose(live[1], [0.25 * weight, -0.5 * weight + 3.0, 2.0], rtol=1e-12)
    with pytest.raises(InputError, match="finite"):
        wall.push(1, x=np.nan)
    with pytest.raises(InputError, match="finite"):
        wall.push_body(y=np.inf)


def test_a_live_load_is_mirrored_or_the_wall_is_solved_in_full() -> None:
    quasi_static = SOLVERS["quasi_static"]
    wall = brickwork(Joint(tensile_strength=5e6, cohesion=5e6))
    wall.rest_on_ground(range(4))
    wall.push_body(y=-0.5)
    top = [b for b in range(wall.n_blocks) if wall._course[b] == 3]
    wall.push(top[0], x=300.0)
    wall.push(top[-1], x=-300.0)
    wall.hold_after_load(top[1], x=False, y=True, rotation=False)
    model = wall.build(quasi_static)
    assert reduce_by_symmetry(model) is not None
    for half, whole in zip(
        *(solve_path(model, replace(quasi_static, symmetric_half=half), 2) for half in (True, False)), strict=True
    ):
        for name in ("displacement", "normal_stress", "support_force"):
            there = getattr(whole, name)
            np.testing.assert_allclose(getattr(half, name), there, atol=1e-6 * (np.abs(there).max() + 1e-9))
        assert half.energy.external_work == pytest.approx(whole.energy.external_work, rel=1e-6)
    assert abs(whole.support_force[top[1], 1]) > 1.0
    wall.push(top[0], x=1.0)
    assert reduce_by_symmetry(wall.build(quasi_static)) is None


@pytest.mark.parametrize("dilation", [0.0, 0.2])
def test_a_dilatant_box_at_fixed_height_compresses_itself(solver: Solver, dilation: float) -> None:
    """Held slip s dilates by s tan(psi): s = (k_s u - C - p tan phi)/(k_s + k_n tan phi tan psi)."""
    width, pressure = 0.6, 0.2e6
    joint = Joint(dilation=dilation)
    wall = Assembly(thickness=T, gravity=(0.0, 0.0), joint=joint)
    wall.support(wall.add_block(rectangle(0.0, -0.1, width, 0.0)))
    box = wall.add_block(rectangle(0.0, 0.0, width, 0.1))
    wall.load(box, y=-pressure * width * T)
    wall.support(box, x=False, y=False)
    wall.hold_after_load(box, x=True, rotation=False)
    limit = (joint.cohesion + pressure * joint.friction) / joint.shear_stiffness
    moved = 3 * limit
    wall.move(box, x=moved)
    ds = damagepred.solve(wall, solver=solver, increments=6)
    assert ds.attrs["status"] == "complete"
    sunk = pressure / joint.normal_stiffness
    np.testing.assert_allclose(ds["block_displacement_y"].values[:, box], -sunk, rtol=1e-5)
    assert abs(ds["block_support_force_y"].values[0, box]) < 1.0
    u = np.linspace(0, 1, 7) * moved
    k_n, k_s, mu = joint.normal_stiffness, joint.shear_stiffness, joint.friction
    slip = np.maximum(k_s * (u - limit), 0.0) / (k_s + k_n * mu * dilation)
    np.testing.assert_allclose(np.abs(ds["contact_slip"].values[:, 1]), slip, rtol=1e-3, atol=1e-9)
    stress = -pressure - k_n * dilation * slip
    np.testing.assert_allclose(ds["contact_normal_stress"].values[:, 1], stress, rtol=1e-3)
    pushed = k_s * (u - slip) * width * T
    np.testing.assert_allclose(ds["block_support_force_x"].values[:, box], pushed, rtol=1e-3, atol=5.0)
    np.testing.assert_allclose(ds["block_support_force_y"].values[:, box], (stress + pressure) * width * T, atol=50.0)


def two_columns(solver: Solver, level: bool) -> np.ndarray:
    """Return rotation and forces of a beam, loaded off-centre, on two columns of different stiffness."""
    strong = Joint(normal_stiffness=50e9, tensile_strength=5e6, cohesion=5e6)
    wall = Assembly(thickness=T, gravity=(0.0, 0.0), joint=strong)
    wall.support(wall.add_block(rectangle(0.0, -0.2, 1.0, 0.0)))
    for left, k in ((0.0, 20e9), (0.8, 60e9)):
        column = wall.add_block(rectangle(left, 0.0, left + 0.2, 0.5))
        wall.set_joint(0, column, replace(strong, normal_stiffness=k))
    beam = wall.add_block(rectangle(0.0, 0.5, 1.0, 0.6), BlockMaterial(density=0.0))
    if level:
        wall.support(beam, x=False, y=False)
    wall.load(beam, y=-20e3, at=(0.3, 0.55))
    ds = damagepred.solve(wall, solver=solver, increments=1).isel(increment=-1)
    return ds.sel(block=beam) if "block" in ds.coords else ds.isel(block=beam)


def test_a_level_beam_stays_level_and_shares_its_load_by_stiffness(solver: Solver) -> None:
    """Columns with 1/k = 1/20 + 1/50 and 1/60 + 1/50: they settle equally, and the support carries the moment."""
    beam = two_columns(solver, level=True)
    k = np.array([1 / (1 / 20e9 + 1 / 50e9), 1 / (1 / 60e9 + 1 / 50e9)]) * 0.2 * T
    assert float(beam["block_rotation"]) == 0.0
    assert float(beam["block_displacement_y"]) == pytest.approx(-20e3 / k.sum(), rel=1e-4)
    # about the middle: columns act at -0.4 and +0.4, the load at -0.2
    up = 20e3 * k / k.sum()
    moment = -(-20e3 * -0.2) - (up * np.array([-0.4, 0.4])).sum()
    assert float(beam["block_support_moment"]) == pytest.approx(moment, rel=1e-3)
    assert abs(float(two_columns(solver, level=False)["block_rotation"])) > 1e-7


def test_supports_of_single_gridpoints_balance_force_and_moment(solver: Solver) -> None:
    """A cantilever of zones under its weight, a vertical traction at its end and a horizontal one along its top."""
    length, height, end, top = 0.8, 0.3, 40e3, 25e3
    wall = Assembly(thickness=T)
    block = wall.add_block(rectangle(2.0, 1.0, 2.0 + length, 1.0 + height), zone_size=0.1)
    wall.hold_points(block, lambda x, y: x < 2.0 + 1e-9, x=0.0, y=0.0)
    wall.traction(block, lambda x, y: x > 2.0 + length - 1e-9, y=end)
    wall.traction(block, lambda x, y: y > 1.0 + height - 1e-9, x=top)
    ds = damagepred.solve(wall, solver=solver, increments=1).isel(increment=-1, block=block)
    up, along = end * height * T, top * length * T
    weight = 2000.0 * length * height * T * 9.81
    assert float(ds["block_support_force_x"]) == pytest.approx(-along, rel=1e-4)
    assert float(ds["block_support_force_y"]) == pytest.approx(weight - up, rel=1e-4)
    moment = up * length / 2 - along * height / 2  # of the tractions, about the middle
    assert float(ds["block_support_moment"]) == pytest.approx(-moment, rel=1e-4)
    assert float(ds["base_reaction"]) == pytest.approx(weight - up, rel=1e-4)
