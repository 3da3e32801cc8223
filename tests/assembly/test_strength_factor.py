"""The factor on the strengths of a wall's joints: the batch, on top of what varies from joint to joint."""

from dataclasses import replace

import pytest

from damagepred import InputError, Joint, Scene, Wall
from damagepred.assembly import wall_model

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
