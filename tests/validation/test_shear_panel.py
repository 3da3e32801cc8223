"""The shear panel J4D of Raijmakers and Vermeltfoort, about 50 kN, and its stepped crack; nothing is fitted."""

from dataclasses import replace

import numpy as np
import pytest
import xarray as xr

import damagepred
from damagepred.scene import Joint, Solver
from tests.validation.shear_panel import BRITTLE, HEIGHT, LENGTH, SOFT, SOFT_IN_SHEAR, panel

CAP, WIDE = 10.5e6, 0.5e-3


def push(
    joint: Joint, to: float, increments: int, *, bricks_crack: bool = True, method: str = "quasi_static"
) -> tuple[xr.Dataset, np.ndarray]:
    """Return the path and the horizontal force (kN) of each increment."""
    pushed = panel(joint, push=to, bricks_crack=bricks_crack)
    solver = Solver(method=method, blocks="rigid", tolerance=1e-3 if method == "explicit" else None)
    ds = damagepred.solve(pushed.assembly, solver=solver, increments=increments)
    assert ds.attrs["status"] == "complete"
    height = ds["block_displacement_y"].values[:, pushed.beam]
    np.testing.assert_allclose(height, height[0], rtol=1e-9)  # its height is fixed once the preload is on
    assert height[0] < -1e-6
    assert (ds["block_rotation"].values[:, pushed.beam] == 0.0).all()
    return ds, ds["block_support_force_x"].values[:, pushed.beam] / 1e3


def check_diagonal(ds: xr.Dataset) -> None:
    """Check that what is open follows the diagonal from the top's near to the bottom's far corner, in steps."""
    last = ds.isel(increment=-1)
    head = (last["contact_kind"].values == 1) & (last["contact_opening"].values > WIDE)
    x, y = last["contact_x"].values[head], last["contact_y"].values[head]
    height, length = HEIGHT, LENGTH
    assert np.ptp(y) > 0.75 * height, "from top to bottom"
    assert np.corrcoef(x, y)[0, 1] < -0.9
    slope, at_middle = np.polyfit(y - height / 2, x - length / 2, 1)
    assert -1.0 < slope < -0.4, "the diagonal, or somewhat steeper"
    assert abs(at_middle) < 0.2 * length
    assert len(np.unique(x.round(3))) >= 4, "in steps"


def test_brittle_joints_crack_at_about_what_the_test_carried() -> None:
    ds, force = push(BRITTLE, 1.3e-3, 13)
    first = int(np.argmax(np.diff(force) < 0))
    assert force[0] == pytest.approx(0.0, abs=1e-3)
    assert 40.0 < force[first] < 60.0
    assert 0.7e-3 < 1e-4 * first < 1.3e-3
    # head joints and bricks that crack then lie between the two ends of the diagonal
    last = ds.isel(increment=-1)
    cracked = (last["contact_kind"].values == 1) & (last["contact_state"].values == 1)
    assert cracked.sum() > 10
    assert np.corrcoef(last["contact_x"].values[cracked], last["contact_y"].values[cracked])[0, 1] < -0.5


@pytest.mark.slow
def test_the_crack_is_stepped_and_diagonal() -> None:
    ds, force = push(replace(BRITTLE, compressive_strength=CAP), 4e-3, 40)
    check_diagonal(ds)
    assert 45.0 < force.max() < 65.0
    # balance: what comes in at the top goes somewhere
    names = ("elastic_energy", "friction_work", "fracture_work", "crushing_work", "released_energy")
    went = sum(ds[name].values[-1] for name in names)
    work = float(ds["external_work"].values[-1])
    assert abs(work - went) < 0.02 * work
    assert float(ds["energy_error"].values[-1]) < 0.02 * work
    assert float(ds["joint_law_violation"].max()) < 1e-3 * CAP


@pytest.mark.slow
def test_whole_bricks_lock_and_softening_joints_carry_more() -> None:
    brittle, soft = (push(joint, 4e-3, 40, bricks_crack=False)[1] for joint in (BRITTLE, SOFT))
    first = int(np.argmax(np.diff(brittle) < 0))
    assert 45.0 < brittle[first] < 65.0
    assert brittle[-1] > 1.5 * brittle[first], "without a cap, at fixed height, what is whole jams"
    assert (soft > 0.98 * brittle).all()


@pytest.mark.slow
def test_both_solvers_agree_while_the_order_of_breaking_is_not_chance() -> None:
    for soft in (SOFT, SOFT_IN_SHEAR):
        joint = replace(soft, compressive_strength=CAP)
        exact, found = (push(joint, 2e-3, 80, method=method)[1] for method in ("quasi_static", "explicit"))
        np.testing.assert_allclose(found, exact, atol=1.5)
        assert exact.max() < 65.0


@pytest.mark.slow
def test_the_crack_of_joints_that_soften_in_shear_is_diagonal_too() -> None:
    ds, force = push(replace(SOFT_IN_SHEAR, compressive_strength=CAP), 4e-3, 80)
    check_diagonal(ds)
    assert 45.0 < force.max() < 65.0
    assert force[-1] < 0.85 * force.max(), "slip has worn off cohesion"
