"""The factor on the strengths of a wall's joints: the batch, on top of what varies from joint to joint."""

from dataclasses import replace

import numpy as np
import pytest

from damagepred import Joint, Scene, Wall
from damagepred.assembly import wall_model
from damagepred.errors import InputError
from damagepred.scene import HeadJoint

STRENGTHS = ("tensile_strength", "cohesion", "residual_tensile_strength", "residual_cohesion")
MORTAR = Joint(tensile_strength=0.2e6, cohesion=0.3e6, residual_tensile_strength=0.05e6, residual_cohesion=0.1e6)
SMALL = Scene(wall=Wall(length=1.2, height=0.45, block_length=0.4, block_height=0.15), joint=MORTAR)


def factored(scene: Scene, factor: float) -> Scene:
    return replace(scene, joint=replace(scene.joint, strength_factor=factor))


def test_all_strengths_of_beds_and_heads_are_multiplied_and_nothing_else() -> None:
    times = {name: 1.5 * getattr(MORTAR, name) for name in STRENGTHS}
    found = wall_model(factored(SMALL, 1.5)).properties
    expected = wall_model(replace(SMALL, joint=replace(MORTAR, **times))).properties
    for name, value in found._asdict().items():
        assert value == pytest.approx(getattr(expected, name), rel=1e-15), name


@pytest.mark.parametrize(
    ("joint", "place", "values", "column", "expected"),
    [
        (
            Joint(cohesion=0.4e6, fracture_energy=20.0, shear_fracture_energy=60.0),
            "shear_fracture_energy",
            (40.0, 80.0),
            "critical_slip",
            (2 * 40 / 0.4e6, 2 * 80 / 0.4e6),
        ),
        (MORTAR, "residual_cohesion", (0.1e6, 0.2e6), "residual_cohesion", (0.1e6, 0.2e6)),
        (MORTAR, "residual_tensile_strength", (0.01e6, 0.1e6), "residual_tensile_strength", (0.01e6, 0.1e6)),
    ],
)
def test_values_that_lean_on_others_vary_from_joint_to_joint(
    joint: Joint, place: str, values: tuple[float, ...], column: str, expected: tuple[float, ...]
) -> None:
    scene = replace(SMALL, joint=joint)
    joints = int(wall_model(scene).interfaces.joint.max()) + 1
    varied = {f"joint.{place}": np.resize(values, joints)}
    found = getattr(wall_model(scene, fields=varied).properties, column)
    assert (found.min(), found.max()) == pytest.approx(expected)
    with pytest.raises(InputError, match=place):
        wall_model(scene, fields={f"joint.{place}": np.full(joints, -1.0)})


def test_head_joints_may_have_their_own() -> None:
    own = wall_model(replace(factored(SMALL, 1.5), head_joint=HeadJoint(strength_factor=0.5))).properties
    strength = np.unique(own.tensile_strength.round(6))
    assert {0.5 * 0.2e6, 1.5 * 0.2e6} <= set(strength.tolist())


def test_a_factor_of_nothing_is_refused() -> None:
    with pytest.raises(InputError, match="strength_factor"):
        Scene.from_dict({"joint": {"strength_factor": 0.0}})
