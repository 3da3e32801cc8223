"""The factor on the strengths of a wall's joints: the batch, on top of what varies from joint to joint."""

from dataclasses import replace

import numpy as np
import pytest

from damagepred import Joint, Scene, Wall, solve
from damagepred.assembly import wall_model
from damagepred.errors import InputError
from damagepred.scene import HeadJoint, Movement

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


def test_it_multiplies_what_varies_from_joint_to_joint() -> None:
    model = wall_model(SMALL)
    joints = int(model.interfaces.joint.max()) + 1
    varied = {"joint.tensile_strength": np.linspace(0.1e6, 0.2e6, joints)}
    once, twice = (wall_model(factored(SMALL, f), fields=varied).properties for f in (1.0, 1.3))
    assert np.ptp(once.tensile_strength) > 0.0
    assert twice.tensile_strength == pytest.approx(1.3 * once.tensile_strength, rel=1e-14)


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


def test_a_brittle_wall_of_twice_the_strength_cracks_at_twice_the_movement() -> None:
    """Without weight a wall is elastic until its first bond breaks: the movement scales with the strength."""
    movement = Movement(kind="dishing", shape="parabola", central_deflection="0.4 mm", increments=40)
    block = replace(SMALL.block, density=0.0)
    weightless = replace(SMALL, movement=movement, block=block, footing=replace(SMALL.footing, density=0.0))
    first = [
        int(np.argmax((solve(factored(weightless, factor))["contact_state"].values == 1).any(axis=1)))
        for factor in (1.0, 2.0)
    ]
    assert first[0] > 0
    assert abs(first[1] - 2 * first[0]) <= 1


def test_a_factor_of_nothing_is_refused() -> None:
    with pytest.raises(InputError, match="strength_factor"):
        Scene.from_dict({"joint": {"strength_factor": 0.0}})
