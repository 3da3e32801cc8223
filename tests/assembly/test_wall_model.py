"""From a scene to its model: weights, kinds, strengths, joints, head joints, jambs."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from damagepred.assembly import wall_geometry, wall_model
from damagepred.enumerations import ContactKind
from damagepred.errors import InputError
from damagepred.scene import Dpc, Joint, Loads, Movement, Opening, Scene, Solver, Wall

DOOR = Opening(kind="door", x=0.6, width=0.84, height=2.1)
WINDOW = Opening(x=2.4, y=0.9, width=1.2, height=0.9)


@pytest.fixture(scope="module")
def bryant(data_folder: Path) -> Scene:
    return Scene.from_toml(data_folder / "bryant_dishing.toml")


@pytest.fixture(scope="module")
def house() -> Scene:
    return Scene(dpc=Dpc(), opening=(DOOR, WINDOW), loads=Loads(roof=6000.0))


def vertical(scene: Scene) -> np.ndarray:
    return wall_model(scene).supports.load.reshape(-1, 3)


def test_total_load_is_weight_and_roof(bryant: Scene, house: Scene):
    for scene in (bryant, house):
        area = scene.wall.length * scene.wall.height - sum(o.width * o.height for o in scene.opening)
        weight = 2000.0 * 9.81 * area * 0.11
        load = vertical(scene)
        assert load[:, 1].sum() == pytest.approx(-(weight + 6000.0), rel=1e-12)
        assert (load[:, [0, 2]] == 0).all()


def test_roof_load_lies_evenly_on_the_top_course_alone(bryant: Scene):
    with_roof, without = vertical(bryant), vertical(bryant.with_values({"loads.roof": 0.0}))
    roof = without[:, 1] - with_roof[:, 1]
    course = wall_geometry(bryant).blocks.course
    assert (roof[course < 31] == 0).all()
    assert roof[course == 31][[0, 1, 12, -1]] == pytest.approx([500 * 0.24 / 0.5 / 2, 240, 240, 120])  # 1 kN/m
    assert roof.sum() == pytest.approx(6000.0)


def test_block_elasticity_in_series_with_bed_and_perpend():
    """1/k = 1/k_n + h/E on a bed between two courses, and the length of a brick on a perpend; with G in shear."""
    model = wall_model(Scene(wall=Wall(length=2.4, height=0.45), solver=Solver(blocks="rigid")))
    face, k_n, k_s = model.interfaces, model.properties.normal_stiffness, model.properties.shear_stiffness
    g = 9e9 / (2 * 1.19)
    bed = face.kind == ContactKind.BED_JOINT
    np.testing.assert_allclose(k_n[bed], 1 / (1 / 82e9 + 0.075 / 9e9), rtol=1e-12)
    np.testing.assert_allclose(k_s[bed], 1 / (1 / 36e9 + 0.075 / g), rtol=1e-12)
    head = face.kind == ContactKind.HEAD_JOINT
    whole = head & (np.abs(face.x - 1.2) < 0.9)
    np.testing.assert_allclose(k_n[whole], 1 / (1 / 82e9 + 0.24 / 9e9), rtol=1e-12)
    np.testing.assert_allclose(k_s[whole], 1 / (1 / 36e9 + 0.24 / g), rtol=1e-12)
    beside_a_half = head & (np.abs(face.x - 0.12) < 1e-9)
    assert beside_a_half.any()
    np.testing.assert_allclose(k_n[beside_a_half], 1 / (1 / 82e9 + 0.18 / 9e9), rtol=1e-12)
    ground = face.kind == ContactKind.FOOTING_INTERFACE  # the ground adds nothing
    np.testing.assert_allclose(k_n[ground], 1 / (1 / 82e9 + 0.0375 / 9e9), rtol=1e-12)


def test_tension_stops_at_the_apex_of_the_cone():
    joint = Joint(tensile_strength=0.8e6, cohesion=0.3e6, friction=0.75)
    model = wall_model(Scene(joint=joint, dpc=Dpc()))
    mortar = model.interfaces.kind != ContactKind.DPC
    np.testing.assert_allclose(model.properties.tensile_strength[mortar], 0.4e6)
    assert model.apex_limited == (wall_geometry(Scene(dpc=Dpc())).joints.kind != ContactKind.DPC).sum()


def test_residual_tension_obeys_the_apex_too():
    joint = Joint(residual_tensile_strength=0.4e6, residual_cohesion=0.1e6, residual_friction=0.5)
    model = wall_model(Scene(joint=joint))
    np.testing.assert_allclose(model.properties.residual_tensile_strength, 0.2e6)
    assert model.apex_limited == 0  # counts intact joints


@pytest.mark.parametrize("field", [{"wall.length": 3}, {"joint.colour": 3}, {"dpc.course": 3}, {"cohesion": 3}])
def test_what_cannot_vary_from_joint_to_joint(field: dict):
    with pytest.raises(InputError, match="only properties of joint, head_joint and dpc"):
        wall_model(Scene(), {k: np.ones(v) for k, v in field.items()})


@pytest.mark.parametrize("kind", ["dishing", "doming"])
def test_the_ground_moves_as_the_profile_tells(kind: str):
    scene = Scene(movement=Movement(kind=kind, shape="parabola", central_deflection=0.01))
    model = wall_model(scene)
    face = model.interfaces
    ground = face.kind == ContactKind.FOOTING_INTERFACE
    x = face.x[ground][:, None] + face.contact_offset[ground]
    sign = 1 if kind == "doming" else -1
    np.testing.assert_allclose(model.ground.full.normal, sign * 0.04 * (x / 6) * (1 - x / 6), atol=1e-15)
    np.testing.assert_allclose(model.ground.full.shear, 0.0, atol=1e-18)
    assert (model.span, model.central_deflection) == (6.0, 0.01)


def test_dpc_above_the_wall_that_openings_make():
    """Sill and head of this window divide the height into 1, 1 and 29 courses, not 32."""
    scene = Scene(dpc=Dpc(course=31), opening=(Opening(x=2.4, y=0.11, width=0.96, height=0.11),))
    with pytest.raises(InputError, match=r"dpc.course = 31: the wall has 31 courses; take 1 to 30"):
        wall_model(scene)


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


STRENGTHS = ("tensile_strength", "cohesion", "residual_tensile_strength", "residual_cohesion")
MORTAR = Joint(tensile_strength=0.2e6, cohesion=0.3e6, residual_tensile_strength=0.05e6, residual_cohesion=0.1e6)
SMALL = Scene(wall=Wall(length=1.2, height=0.45, block_length=0.4, block_height=0.15), joint=MORTAR)


def test_all_strengths_of_beds_and_heads_are_multiplied_and_nothing_else() -> None:
    times = {name: 1.5 * getattr(MORTAR, name) for name in STRENGTHS}
    found = wall_model(replace(SMALL, joint=replace(MORTAR, strength_factor=1.5))).properties
    expected = wall_model(replace(SMALL, joint=replace(MORTAR, **times))).properties
    for name, value in found._asdict().items():
        assert value == pytest.approx(getattr(expected, name), rel=1e-15), name


def test_what_makes_no_joint_is_refused() -> None:
    with pytest.raises(InputError, match="dilation"):
        scene(head_joint={"friction": 0.1, "dilation": 0.2})
    with pytest.raises(InputError, match="strength_factor"):
        scene(joint={"strength_factor": 0.0})
