"""Random small walls on jacks of prescribed deflection: the load is found, also where the wall fails."""

import numpy as np
import pytest

from damagepred import Scene, solve

pytestmark = pytest.mark.quick_cases()

SEEDS = [0, 12, 27, 32, 46, 67, 95]
"""Some of the 21 walls of 100 for which relaxation under a constant load found no equilibrium."""


def wall_on_jacks(seed: int) -> Scene:
    """Return a wall of random laws and size on jacks."""
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
    wall = {
        "length": float(draw.uniform(1.0, 2.0)),
        "height": float(draw.uniform(0.4, 0.9)),
        "block_length": 0.2,
        "block_height": 0.15,
        "thickness": 0.11,
        "bond": str(draw.choice(["running", "stack"])),
    }
    scene: dict[str, object] = {
        "wall": wall,
        "block": {"elastic_modulus": float(10 ** draw.uniform(9.0, 10.0)), "density": 2000.0},
        "joint": joint,
        "footing": {"width": 0.3, "depth": float(draw.choice([0.1, 0.2, 0.3]))},
        "movement": movement,
        "loads": {"roof": float(draw.choice([0.0, 2000.0]))},
        "rig": {"stop_at_zero": bool(draw.random() < 0.5)},
    }
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


def test_a_footing_that_yields_on_its_jacks_does_not_collapse() -> None:
    """A short footing of one section cracks and its steel yields: the load hardly grows at prescribed deflection.

    Where the wall fails meanwhile, equilibrium is found at that deflection, and the footing does not collapse under a
    load. The explicit solver finds the same load.
    """
    strength = {"tensile_strength": 0.0, "cohesion": 1521.13, "residual_cohesion": 1404.64, "friction": 0.50885}
    joint = {
        **strength,
        "normal_stiffness": 1.8109e11,
        "shear_stiffness": 5.9335e10,
        "residual_friction": 0.21872,
        "brittle_shear": True,
        "compressive_strength": 982191.0,
    }
    tables: dict[str, object] = {
        "wall": {"length": 0.48, "height": 0.34, "thickness": 0.15465, "block_length": 0.24, "block_height": 0.17},
        "block": {"elastic_modulus": 2.8642e9, "density": 1124.87},
        "joint": joint,
        "dpc": {"course": 1, "friction": 0.45936},
        "control_joint": [{"x": 0.239186}],
        "footing": {
            "width": 0.46856,
            "depth": 0.26911,
            "elastic_modulus": 1.1971e10,
            "density": 2184.05,
            "joint": joint | {"friction": 0.67978},
            "concrete": {"grade": "N20", "bottom": "3-L8TM", "top": "none"},
        },
        "movement": {"kind": "dishing", "shape": "jacks", "central_deflection": 1.36e-4, "increments": 1},
        "rig": {"stop_at_zero": False},
    }
    solvers: list[dict[str, object]] = [{"method": "quasi_static"}, {"method": "explicit", "ramp_cycles": 1000}]
    quasi_static, explicit = (solve(Scene.from_dict(tables | {"solver": solver})) for solver in solvers)
    assert quasi_static.attrs["status"] == "complete"
    found, expected = (float(ds["jack_load"][-1]) for ds in (quasi_static, explicit))
    assert found == pytest.approx(expected, rel=0.01)


@pytest.mark.parametrize(("length", "courses", "depth"), [(0.68, 5, 0.48), (0.88, 3, 0.18), (2.2, 4, 0.15)])
def test_a_stiff_wall_lifts_off_where_bilateral_supports_would_pull(length: float, courses: int, depth: float) -> None:
    """Its jacks then carry all of its weight: no equilibrium exists at a larger deflection."""
    tables: dict[str, object] = {
        "wall": {
            "length": length,
            "height": courses * 0.14,
            "block_length": length / 2.0,
            "block_height": 0.14,
            "thickness": 0.13,
        },
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
