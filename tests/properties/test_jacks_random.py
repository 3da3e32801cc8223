"""Random small walls on jacks of prescribed deflection: the load is found, also where the wall fails."""

import numpy as np
import pytest

from damagepred import Scene, solve

pytestmark = pytest.mark.quick_cases()

SEEDS = [0, 12, 27, 32, 46, 67, 95]
"""Some of the 21 walls of 100 for which relaxation under a constant load found no equilibrium."""


def wall_on_jacks(seed: int) -> Scene:
    draw = np.random.default_rng(seed)
    cohesion, softens = float(draw.uniform(0.02, 0.4)) * 1e6, draw.random() < 0.3
    draw.random()
    stiffness = float(10 ** draw.uniform(9.5, 11.3))
    joint = {
        "normal_stiffness": stiffness,
        "tensile_strength": float(draw.choice([0.0, 1.0, 1e3, 5e4, 3e5])),
        "cohesion": cohesion,
        "friction": float(draw.uniform(0.3, 0.9)),
        "residual_cohesion": float(draw.choice([0.0, 0.3, 1.0])) * cohesion,
        "shear_stiffness": stiffness * float(draw.uniform(0.3, 0.6)),
    }
    if softens:
        joint["fracture_energy"] = float(draw.uniform(5.0, 20.0))
    movement = {
        "kind": str(draw.choice(["doming", "dishing"])),
        "central_deflection": float(10 ** draw.uniform(-3.6, -2.4)),
        "increments": 5,
        "shape": "jacks",
    }
    wall = {"length": float(draw.uniform(1.0, 2.0)), "height": float(draw.uniform(0.4, 0.9)), "block_length": 0.2} | {
        "block_height": 0.15,
        "thickness": 0.11,
        "bond": str(draw.choice(["running", "stack"])),
    }
    scene: dict[str, object] = (
        {"wall": wall, "block": {"elastic_modulus": float(10 ** draw.uniform(9.0, 10.0)), "density": 2000.0}}
        | {"joint": joint, "footing": {"width": 0.3, "depth": float(draw.choice([0.1, 0.2, 0.3]))}}
        | {"movement": movement, "loads": {"roof": float(draw.choice([0.0, 2000.0]))}}
        | {"rig": {"stop_at_zero": bool(draw.random() < 0.5)}}
    )
    if draw.random() < 0.5:
        scene["dpc"] = {"course": 1, "friction": float(draw.uniform(0.3, 0.8))}
    return Scene.from_dict(scene)


@pytest.mark.parametrize("seed", SEEDS)
def test_the_load_of_jacks_is_found(seed: int) -> None:
    """The deflection is the prescribed one, in balance, and the joints obey their law."""
    scene = wall_on_jacks(seed)
    ds = solve(scene)
    assert ds.attrs["status"] == "complete"
    asked = scene.movement.central_deflection * ds["progress"].values
    np.testing.assert_allclose(np.abs(ds["central_deflection"]), asked, atol=1e-6)
    assert ds["unbalanced_force_ratio"].values.max() < 1e-3
    assert ds["joint_law_violation"].values.max() < 0.05  # Pa


@pytest.mark.parametrize(("length", "courses", "depth"), [(0.68, 5, 0.48), (0.88, 3, 0.18), (2.2, 4, 0.15)])
def test_a_stiff_wall_lifts_off_where_bilateral_supports_would_pull(length: float, courses: int, depth: float) -> None:
    """Its jacks then carry all of its weight: no equilibrium exists at a larger deflection."""
    tables: dict[str, object] = {
        "wall": (
            {"length": length, "height": courses * 0.14, "block_length": length / 2.0, "block_height": 0.14}
            | {"thickness": 0.13}
        ),
        "block": {"elastic_modulus": 6e9, "density": 2000.0},
        "joint": {"normal_stiffness": 4e10, "shear_stiffness": 1e10, "tensile_strength": 5e6, "cohesion": 9e6},
        "footing": {"width": 0.4, "depth": depth, "elastic_modulus": 8e9, "density": 2200.0},
        "movement": {"kind": "doming", "shape": "jacks", "central_deflection": 0.4e-3, "increments": 20},
    }
    rig = {"support_stiffness": 1e10, "stop_at_zero": False}
    held, free = (
        solve(Scene.from_dict(tables | {"rig": rig | {"support": way}}), on_failure="return")
        for way in ("held", "lift_off")
    )
    load = held["support_load"].sum("support").values
    pulls = np.interp(0.0, -load, held["progress"].values)
    assert 0.0 < pulls < 1.0
    assert free.attrs["status"] == "collapsed"
    assert free.attrs["collapse_progress"] == pytest.approx(
        pulls, rel=0.02, abs=free.attrs["collapse_progress_uncertainty"]
    )
