"""Head joints of their own (``[head_joint]``)."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from damagepred import InputError, Joint, Scene, Wall
from damagepred.assembly.wall import wall_model
from damagepred.enumerations import ContactKind


def scene(**tables: Any) -> Scene:
    wall = {"length": 1.2, "height": 0.45}
    return Scene.from_dict({"wall": wall, "movement": {"central_deflection": 1e-3}, **tables})


def test_keys_and_factors_hold_for_heads_alone() -> None:
    joint = {"tensile_strength": 0.4e6, "cohesion": 0.5e6, "fracture_energy": 20.0}
    head = {"cohesion": 0.3e6, "factor": {"tensile_strength": 0.56, "fracture_energy": 0.66}}
    model = wall_model(scene(joint=joint, head_joint=head))
    law, heads = model.properties, model.interfaces.kind == ContactKind.HEAD_JOINT
    np.testing.assert_allclose(law.tensile_strength[heads], 0.56 * 0.4e6)
    np.testing.assert_allclose(law.cohesion[heads], 0.3e6)
    np.testing.assert_allclose(law.critical_opening[heads], 2 * 0.66 * 20.0 / (0.56 * 0.4e6))
    beds = model.interfaces.kind == ContactKind.BED_JOINT
    np.testing.assert_allclose(law.tensile_strength[beds], 0.4e6)
    np.testing.assert_allclose(law.cohesion[beds], 0.5e6)


@pytest.mark.parametrize("given", [None, {"tensile_strength": 0.1e6}, {"factor": {"tensile_strength": 0.5}}])
def test_values_that_vary_from_joint_to_joint(given: dict[str, Any] | None) -> None:
    described = scene() if given is None else scene(head_joint=given)
    joints = wall_model(described).joints
    drawn = np.linspace(0.2e6, 0.4e6, len(joints.kind))
    model = wall_model(described, {"joint.tensile_strength": drawn})
    heads = model.interfaces.kind == ContactKind.HEAD_JOINT
    expected = drawn[model.interfaces.joint[heads]]
    if given is not None:
        expected = 0.5 * expected if "factor" in given else np.full_like(expected, 0.1e6)
    np.testing.assert_allclose(model.properties.tensile_strength[heads], expected)
    own = wall_model(described, {"joint.tensile_strength": drawn, "head_joint.tensile_strength": 0.3 * drawn})
    np.testing.assert_allclose(own.properties.tensile_strength[heads], 0.3 * drawn[model.interfaces.joint[heads]])


def test_what_makes_no_joint_is_refused() -> None:
    with pytest.raises(InputError, match="dilation"):
        scene(head_joint={"friction": 0.1, "dilation": 0.2})


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


def test_a_factor_of_nothing_is_refused() -> None:
    with pytest.raises(InputError, match="strength_factor"):
        Scene.from_dict({"joint": {"strength_factor": 0.0}})
