"""Settlement profiles against closed forms: tilt, superposition, Gaussian trough and step."""

import math
from typing import Any

import numpy as np
import pytest

import damagepred
from damagepred import Scene

WALL = {"length": "2.4 m", "height": "0.9 m", "block_length": "0.48 m", "block_height": "0.15 m"}
UNBROKEN = {"tensile_strength": "100 MPa", "cohesion": "100 MPa"}


def solved(wall: dict[str, Any] = WALL, joint: dict[str, Any] | None = None, **tables: Any) -> Any:
    movement = {"increments": 2, **tables.pop("movement")}
    return damagepred.solve(Scene.from_dict({"wall": wall, "joint": joint or {}, "movement": movement, **tables}))


@pytest.mark.parametrize("footing", ["none", "deformable"])
@pytest.mark.parametrize("end", ["left", "right"])
def test_tilt_does_no_damage(footing: str, end: str):
    ds = solved(movement={"shape": "tilt", "settlement": "60 mm", "end": end}, solver={"footing": footing})
    assert ds["crack_width_max"].values.max() < 1e-9
    stress = ds["contact_normal_stress"].values
    np.testing.assert_allclose(stress[-1], stress[0], atol=1e-6 * np.abs(stress).max())
    assert ds["ground_tilt"].values[-1] == pytest.approx(0.06 / 2.4)
    assert ds["angular_distortion"].values[-1] == ds["deflection_ratio"].values[-1] == 0.0
    walls = slice(0, len(ds["block"]) if footing == "none" else -5)
    rotation = ds["block_rotation"].values[-1, walls] - ds["block_rotation"].values[0, walls]
    np.testing.assert_allclose(rotation, (0.06 if end == "left" else -0.06) / 2.4, rtol=1e-6)


def test_tilt_does_no_damage_in_the_explicit_solver():
    ds = solved(movement={"shape": "tilt", "settlement": "6 mm"}, solver={"method": "explicit", "blocks": "rigid"})
    assert ds["crack_width_max"].values.max() < 1e-6
    assert ds["settlement"].values[-1] == 6e-3


def test_profiles_add_up_on_an_uncracked_wall():
    """Displacements by a sum of two profiles are the sum of the displacements by each."""
    x = np.linspace(0.0, 1.0, 21)
    profiles = {"a": np.exp(-8 * x), "b": np.where(x > 0.5, np.sin(np.pi * (x - 0.5)), 0.0) ** 2}
    profiles["sum"] = profiles["a"] + profiles["b"]
    moved = {}
    for name, values in profiles.items():
        table = np.column_stack((x, values)).tolist()
        size = 1e-3 * float(np.abs(values).max())
        ds = solved(joint=UNBROKEN, movement={"shape": "table", "table": table, "settlement": size})
        assert ds["crack_width_max"].values.max() == 0.0
        moved[name] = ds["block_displacement_y"].values[-1] - ds["block_displacement_y"].values[0]
    # the monotone cubic between the points does not add up exactly
    np.testing.assert_allclose(moved["sum"], moved["a"] + moved["b"], atol=2e-5)
    assert np.abs(moved["sum"]).max() > 5e-4


def test_presets_add_up_to_rounding():
    """Settlement of both ends at once is the settlement of one end and of the other."""
    ends = {}
    for end in ("left", "right"):
        movement = {"shape": "tilt", "settlement": "1 mm", "end": end}
        ends[end] = solved(joint=UNBROKEN, movement=movement)["block_displacement_y"].values
    together = solved(joint=UNBROKEN, movement={"shape": "table", "table": [[0, 1], [1, 1]], "settlement": "1 mm"})[
        "block_displacement_y"
    ].values
    by_ends = sum(moved[-1] - moved[0] for moved in ends.values())
    np.testing.assert_allclose(together[-1] - together[0], by_ends, atol=1e-12)
    np.testing.assert_allclose(by_ends, -1e-3, rtol=1e-9)


def test_trough_sags_within_i_and_hogs_beyond():
    """Stress along the top of a low wall follows the curvature -S (1 - (x/i)^2) exp(-x^2 / 2 i^2) / i^2.

    It is 0 at x = i, and at its hogging extreme, x = sqrt(3) i, 2 exp(-1.5) of its value over the axis.
    """
    i = 1.92
    ds = solved(
        {"length": "15.36 m", "height": "0.15 m", "block_length": "0.24 m", "block_height": "0.075 m", "bond": "stack"},
        UNBROKEN,
        movement={"shape": "trough", "trough_width": i, "tunnel_depth": "500 m", "settlement": "2 mm"},
        loads={"roof": 0.0},
    )
    heads = ds["contact_kind"].values == 1
    top = heads & (ds["contact_y"].values > 0.149)
    x = ds["contact_x"].values[top] - 7.68
    stress = (ds["contact_normal_stress"].values[-1] - ds["contact_normal_stress"].values[0])[top]
    middle = stress[np.abs(x).argmin()]
    assert middle < 0  # compression over the axis: sagging
    expected = middle * (1 - (x / i) ** 2) * np.exp(-0.5 * (x / i) ** 2)
    np.testing.assert_allclose(stress, expected, atol=0.03 * abs(middle))
    right = x > 0
    zero = np.interp(0.0, stress[right & (x < 1.7 * i)], x[right & (x < 1.7 * i)])
    assert zero == pytest.approx(i, rel=0.02)
    assert stress.max() == pytest.approx(-2 * math.exp(-1.5) * middle, rel=0.04)


def test_step_stands_at_the_crack():
    """Two halves without bond between them: the slip of the line of heads is the step."""
    ds = solved(
        {**WALL, "bond": "stack", "length": "1.92 m"},
        movement={"shape": "step", "settlement": "20 mm"},
        head_joint={"tensile_strength": 0.0, "cohesion": 0.0, "friction": 0.0},
        solver={"blocks": "rigid"},
    )
    line = (ds["contact_kind"].values == 1) & np.isclose(ds["contact_x"].values, 0.96)
    slip = np.abs(ds["contact_slip"].values[-1, line] - ds["contact_slip"].values[0, line])
    np.testing.assert_allclose(slip, 0.02, rtol=1e-6)
    others = (ds["contact_kind"].values == 1) & ~line
    assert np.abs(ds["contact_slip"].values[-1, others]).max() < 1e-9
