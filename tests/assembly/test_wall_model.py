"""From a scene to its model: weights, kinds, strengths, joints, jambs."""

import numpy as np
import pytest

from damagepred.assembly import wall_geometry, wall_model
from damagepred.enumerations import ContactKind
from damagepred.errors import InputError
from damagepred.scene import Dpc, Joint, Loads, Opening, Scene, Solver

DOOR = Opening(kind="door", x=0.6, width=0.84, height=2.1)
WINDOW = Opening(x=2.4, y=0.9, width=1.2, height=0.9)


@pytest.fixture(scope="module")
def house() -> Scene:
    return Scene(dpc=Dpc(), opening=(DOOR, WINDOW), loads=Loads(roof=6000.0))


# -- loads ------------------------------------------------------------------------------------------------------------


# -- kinds ------------------------------------------------------------------------------------------------------------


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


def test_residual_tension_obeys_the_apex_too():
    joint = Joint(residual_tensile_strength=0.4e6, residual_cohesion=0.1e6, residual_friction=0.5)
    model = wall_model(Scene(joint=joint))
    np.testing.assert_allclose(model.properties.residual_tensile_strength, 0.2e6)
    assert model.apex_limited == 0  # counts intact joints


# -- softening -------------------------------------------------------------------------------------------------------


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


def test_dpc_above_the_wall_that_openings_make():
    """Sill and head of this window divide the height into 1, 1 and 29 courses, not 32."""
    scene = Scene(dpc=Dpc(course=31), opening=(Opening(x=2.4, y=0.11, width=0.96, height=0.11),))
    with pytest.raises(InputError, match=r"dpc.course = 31: the wall has 31 courses; take 1 to 30"):
        wall_model(scene)
