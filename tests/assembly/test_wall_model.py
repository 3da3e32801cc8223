"""From a scene to its model: weights, kinds, strengths, joints, jambs."""

from pathlib import Path

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


# -- loads ------------------------------------------------------------------------------------------------------------


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


# -- kinds ------------------------------------------------------------------------------------------------------------


def test_dpc_lies_between_its_courses_and_nowhere_else(bryant: Scene):
    geometry = wall_geometry(bryant)
    face = geometry.interfaces
    dpc = face.kind == ContactKind.DPC
    np.testing.assert_allclose(face.y[dpc], 0.15, atol=1e-12)  # on top of two courses
    assert face.length[dpc].sum() == pytest.approx(6.0)
    at_level = np.isclose(face.y, 0.15) & (face.normal_y > 0.5)
    assert (dpc == at_level).all()
    course = geometry.blocks.course
    assert (course[face.block_a[dpc]] == 1).all()
    assert (course[face.block_b[dpc]] == 2).all()
    assert (geometry.joint_material[dpc] == 1).all()
    assert (geometry.joint_material[~dpc] == 0).all()


@pytest.mark.parametrize("course", [1, 5, 31])
def test_dpc_on_another_course(course: int):
    face = wall_geometry(Scene(dpc=Dpc(course=course))).interfaces
    np.testing.assert_allclose(face.y[face.kind == ContactKind.DPC], 0.075 * course, rtol=1e-12)


def test_contacts_stand_for_the_whole_area_of_their_interface(house: Scene):
    for solver in (Solver(), Solver(contacts_per_interface=5), Solver(quadrature="midpoint", contacts_per_interface=1)):
        face = wall_model(Scene(opening=house.opening, solver=solver)).interfaces
        np.testing.assert_allclose(face.contact_area.sum(axis=1), 0.11 * face.length, rtol=1e-12)
        assert (np.abs(face.contact_offset) <= face.length[:, None] / 2 * (1 + 1e-12)).all()


# -- joints and their strengths ----------------------------------------------------------------------------------------


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


# -- fields -----------------------------------------------------------------------------------------------------------


def test_a_field_gives_each_joint_its_own_value_and_leaves_the_other_material_alone(house: Scene):
    geometry = wall_geometry(house)
    count = len(geometry.joints.kind)
    tension, friction = 1e3 + np.arange(count), 0.2 + 1e-4 * np.arange(count)
    model = wall_model(house, {"joint.tensile_strength": tension, "dpc.friction": friction})
    face, dpc = model.interfaces, model.interfaces.kind == ContactKind.DPC
    np.testing.assert_array_equal(model.properties.tensile_strength[~dpc], tension[face.joint[~dpc]])
    assert (model.properties.tensile_strength[dpc] == 0).all()
    np.testing.assert_array_equal(model.properties.friction[dpc], friction[face.joint[dpc]])
    assert (model.properties.friction[~dpc] == 0.75).all()
    # a residual friction that is not given follows
    np.testing.assert_array_equal(model.properties.residual_friction[dpc], friction[face.joint[dpc]])
    assert (model.properties.cohesion[~dpc] == 0.375e6).all()


@pytest.mark.parametrize("field", [{"wall.length": 3}, {"joint.colour": 3}, {"dpc.course": 3}, {"cohesion": 3}])
def test_what_cannot_vary_from_joint_to_joint(field: dict):
    with pytest.raises(InputError, match="only properties of joint, head_joint and dpc"):
        wall_model(Scene(), {k: np.ones(v) for k, v in field.items()})


# -- movement and jambs ------------------------------------------------------------------------------------------------


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
