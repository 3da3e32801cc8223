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


def test_roof_load_stands_on_what_is_left_beside_an_opening_to_the_top():
    scene = Scene(opening=(Opening(x=2.55, y=0.9, width=0.9, height=1.5),), loads=Loads(roof=5100.0))
    bare = vertical(scene.with_values({"loads.roof": 0.0}))
    roof = bare[:, 1] - vertical(scene)[:, 1]
    blocks = wall_geometry(scene).blocks
    on_top = blocks.course == blocks.course.max()
    assert (roof[~on_top] == 0).all()
    assert roof[on_top] == pytest.approx(1000.0 * blocks.area[on_top] / 0.075, rel=1e-9)  # 5.1 m carry 5.1 kN
    left = on_top & (blocks.x < 3)
    assert roof[left].sum() == pytest.approx(2550.0)


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


def test_footing_interface_is_under_the_bottom_course_alone_and_not_under_doors(house: Scene):
    geometry = wall_geometry(house)
    face, n = geometry.interfaces, len(geometry.blocks.x)
    ground = face.kind == ContactKind.FOOTING_INTERFACE
    assert (face.block_a[ground] == n).all()  # the ground
    assert (face.block_a[~ground] < n).all()
    assert (geometry.blocks.course[face.block_b[ground]] == 0).all()
    assert set(face.block_b[ground]) == set(np.flatnonzero(geometry.blocks.course == 0))
    np.testing.assert_array_equal(face.y[ground], 0.0)
    np.testing.assert_array_equal(face.normal_y[ground], 1.0)
    assert face.length[ground].sum() == pytest.approx(6.0 - 0.84)
    inside = (face.x > 0.6 + 1e-9) & (face.x < 1.44 - 1e-9)
    assert not (ground & inside).any()
    assert ground[-ground.sum() :].all()  # the last ones


def test_contacts_stand_for_the_whole_area_of_their_interface(house: Scene):
    for solver in (Solver(), Solver(contacts_per_interface=5), Solver(quadrature="midpoint", contacts_per_interface=1)):
        face = wall_model(Scene(opening=house.opening, solver=solver)).interfaces
        np.testing.assert_allclose(face.contact_area.sum(axis=1), 0.11 * face.length, rtol=1e-12)
        assert (np.abs(face.contact_offset) <= face.length[:, None] / 2 * (1 + 1e-12)).all()


def test_arms_are_those_of_a_rigid_rotation(house: Scene):
    """Turn each block by a small angle about its centroid and see how the middle of each interface moves."""
    geometry = wall_geometry(house)
    face, blocks = geometry.interfaces, geometry.blocks
    theta = 1e-7
    for block, arm_n, arm_s in (
        (face.block_a, face.arm_normal_a, face.arm_shear_a),
        (face.block_b, face.arm_normal_b, face.arm_shear_b),
    ):
        real = block < len(blocks.x)
        rx, ry = face.x[real] - blocks.x[block[real]], face.y[real] - blocks.y[block[real]]
        ux = (np.cos(theta) * rx - np.sin(theta) * ry - rx) / theta
        uy = (np.sin(theta) * rx + np.cos(theta) * ry - ry) / theta
        nx, ny = face.normal_x[real], face.normal_y[real]
        np.testing.assert_allclose(ux * nx + uy * ny, arm_n[real], atol=1e-7)
        np.testing.assert_allclose(ux * ny - uy * nx, arm_s[real], atol=1e-7)


# -- joints and their strengths ----------------------------------------------------------------------------------------


def test_paper_s_strengths_everywhere(bryant: Scene):
    model = wall_model(bryant)
    dpc = model.interfaces.kind == ContactKind.DPC
    law = model.properties
    for name, mortar, membrane in (
        ("tensile_strength", 0.453e6, 0.0),
        ("cohesion", 0.375e6, 0.0),
        ("friction", 0.75, 0.5),
        ("residual_cohesion", 0.0, 0.0),
        ("residual_friction", 0.75, 0.5),
    ):
        values = getattr(law, name)
        np.testing.assert_allclose(values[~dpc], mortar)
        np.testing.assert_allclose(values[dpc], membrane)
    assert not law.brittle_shear.any()
    assert model.apex_limited == 0


def test_dpc_with_its_own_stiffness():
    scene = Scene(dpc=Dpc(normal_stiffness=1e9), solver=Solver(lump_block_elasticity=False))
    model = wall_model(scene)
    dpc = model.interfaces.kind == ContactKind.DPC
    assert (model.properties.normal_stiffness[dpc] == 1e9).all()
    assert (model.properties.normal_stiffness[~dpc] == 82e9).all()
    assert (model.properties.shear_stiffness == 36e9).all()


def test_block_elasticity_in_series_with_bed_and_perpend():
    """1/k = 1/k_n + h/E on a bed between two courses, and the length of a brick on a perpend; with G in shear."""
    model = wall_model(Scene(wall=Wall(length=2.4, height=0.45)))
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


# -- softening -------------------------------------------------------------------------------------------------------


def test_tension_falls_to_nothing_where_the_area_below_it_is_the_fracture_energy():
    model = wall_model(Scene(joint=Joint(fracture_energy=20.0), dpc=Dpc()))
    law, dpc = model.properties, model.interfaces.kind == ContactKind.DPC
    np.testing.assert_allclose(law.critical_opening[~dpc], 2 * 20.0 / 0.453e6, rtol=1e-14)
    assert (law.critical_opening[dpc] == 0.0).all()  # nothing to soften
    assert (law.tensile_strength[dpc] == 0.0).all()


def test_where_the_elastic_joint_holds_more_the_bond_breaks_at_once():
    """f_t^2 / (2 k_n) is 1.25 N/m of the joint alone, and up to 4 N/m with its blocks: so perpends are too soft."""
    joint, strength = Joint(fracture_energy=2.5), 0.453e6
    model = wall_model(Scene(joint=joint))
    law = model.properties
    held = strength**2 / (2 * law.normal_stiffness)
    expected = np.where(held < 2.5, 2 * 2.5 / strength, 0.0)
    np.testing.assert_allclose(law.critical_opening, expected, rtol=1e-14)
    whole = (model.interfaces.kind == ContactKind.HEAD_JOINT) & (np.abs(model.interfaces.x - 3.0) < 2.0)
    assert (law.critical_opening[whole] == 0.0).all()
    assert (law.critical_opening[model.interfaces.kind == ContactKind.BED_JOINT] > 0.0).all()
    alone = wall_model(Scene(joint=joint, solver=Solver(lump_block_elasticity=False))).properties
    assert (alone.critical_opening > 0.0).all()
    tough = wall_model(Scene(joint=Joint(fracture_energy=10.0))).properties
    assert (tough.critical_opening > 0.0).all()


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


def test_a_residual_friction_that_is_given_stays():
    scene = Scene(joint=Joint(residual_friction=0.6))
    count = len(wall_geometry(scene).joints.kind)
    law = wall_model(scene, {"joint.friction": np.full(count, 0.9)}).properties
    assert (law.friction == 0.9).all()
    assert (law.residual_friction == 0.6).all()


def test_the_apex_rule_counts_joints_not_contacts():
    scene = Scene()
    geometry = wall_geometry(scene)
    count = len(geometry.joints.kind)
    cohesion = np.full(count, 0.375e6)
    weak = [3, 40, 41, count - 1]
    cohesion[weak] = 0.1e6
    model = wall_model(scene, {"joint.cohesion": cohesion})
    assert model.apex_limited == len(weak)
    touched = np.isin(model.interfaces.joint, weak)
    assert touched.sum() > len(weak)  # a bed has two interfaces
    np.testing.assert_allclose(model.properties.tensile_strength[touched], 0.1e6 / 0.75)
    np.testing.assert_allclose(model.properties.tensile_strength[~touched], 0.453e6)


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


def test_jambs_end_at_the_corners_of_the_opening_in_blocks_beside_it(house: Scene):
    model = wall_model(house)
    vertices, first = model.blocks.vertices, model.blocks.first_vertex
    for number, hole in enumerate(house.opening):
        places = [(hole.x, hole.y), (hole.right, hole.y), (hole.right, hole.top), (hole.x, hole.top)]
        for end, (block, place) in enumerate(zip(model.jambs.block[number], places)):
            corners = vertices[first[block] : first[block + 1]]
            assert np.abs(corners - place).max(axis=1).min() < 1e-9  # the corner is its own
            centroid = np.array((model.blocks.x[block], model.blocks.y[block]))
            np.testing.assert_allclose(centroid + model.jambs.arm[number, end], place)
            assert hole.y < centroid[1] < hole.top  # beside the opening, not above or below it
            assert (centroid[0] < hole.x) == (end in (0, 3))
            assert (centroid[0] > hole.right) == (end in (1, 2))


def test_geometry_is_shared_between_samples_and_not_between_walls():
    scene = Scene(dpc=Dpc())
    assert wall_geometry(scene) is wall_geometry(scene.with_values({"joint.cohesion": 1e5, "dpc.friction": 0.4}))
    assert wall_geometry(scene) is not wall_geometry(scene.with_values({"wall.length": 6.5}))
    assert wall_geometry(scene) is not wall_geometry(Scene())
    assert wall_geometry(scene) is not wall_geometry(Scene(dpc=Dpc(course=3)))


def test_dpc_above_the_wall_that_openings_make():
    """Sill and head of this window divide the height into 1, 1 and 29 courses, not 32."""
    scene = Scene(dpc=Dpc(course=31), opening=(Opening(x=2.4, y=0.11, width=0.96, height=0.11),))
    with pytest.raises(InputError, match=r"dpc.course = 31: the wall has 31 courses; take 1 to 30"):
        wall_model(scene)
