"""The footing of a model: segments, sections, supports, jacks, and the measure of its deflection."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from damagepred.assembly import wall_geometry, wall_model
from damagepred.assembly.bond import lay_bricks
from damagepred.assembly.model import Model
from damagepred.assembly.wall import footing_alone
from damagepred.enumerations import ContactKind
from damagepred.errors import InputError
from damagepred.scene import Footing, Joint, Movement, Opening, Rig, Scene, Soil, Solver, Wall

JACKS = Movement(kind="doming", shape="jacks", central_deflection=1e-3)
GROUND = Movement(kind="doming", shape="mound")
DOOR = Opening(kind="door", x=0.96, width=0.96, height=2.1)
WALL = Wall(length=4.8, height=2.4)


def segments(model: Model) -> np.ndarray:
    """Return left, right, bottom and top of the footing's blocks (m)."""
    assert model.footing is not None
    corners = model.blocks.vertices[model.blocks.first_vertex[model.footing][:, None] + np.arange(4)]
    low, high = corners.min(axis=1), corners.max(axis=1)
    return np.column_stack((low[:, 0], high[:, 0], low[:, 1], high[:, 1]))


# -- segments ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("movement", [JACKS, GROUND], ids=["jacks", "mound"])
def test_a_segment_lies_under_each_brick_of_the_first_course(movement: Movement):
    scene = Scene(wall=WALL, movement=movement)
    model = wall_model(scene)
    first = [b for b in lay_bricks(scene) if b.course == 0]
    pieces = segments(model)
    np.testing.assert_allclose(pieces[:, 0], [b.left for b in first], atol=1e-9)
    np.testing.assert_allclose(pieces[:, 1], [b.right for b in first], atol=1e-9)
    np.testing.assert_allclose(pieces[:, 2:], [[-0.3, 0.0]] * len(first), atol=1e-12)
    assert (model.footing == model.n_blocks - len(first) + np.arange(len(first))).all()


@pytest.mark.parametrize(("longest", "each"), [(0.24, 1), (0.2399, 2), (0.12, 2), (0.1, 3), (1.0, 1)])
def test_segments_are_no_longer_than_they_may_be(longest: float, each: int):
    scene = Scene(wall=replace(WALL, bond="stack"), footing=Footing(segment_length=longest), movement=GROUND)
    pieces = segments(wall_model(scene))
    assert len(pieces) == 20 * each
    np.testing.assert_allclose(pieces[:, 1] - pieces[:, 0], 0.24 / each, atol=1e-9)


@pytest.mark.parametrize(
    "opening", [(), (Opening(kind="door", x=1.92, width=0.96, height=2.1),)], ids=["solid", "door"]
)
@pytest.mark.parametrize("movement", [JACKS, GROUND], ids=["jacks", "mound"])
@pytest.mark.parametrize("length", [4.8, 4.56, 5.0])
def test_a_symmetric_wall_has_a_symmetric_footing(length: float, movement: Movement, opening: tuple[Opening, ...]):
    hole = tuple(replace(o, x=(length - o.width) / 2) for o in opening)
    model = wall_model(Scene(wall=replace(WALL, length=length), movement=movement, opening=hole))
    pieces = segments(model)
    np.testing.assert_allclose(pieces[::-1, :2], length - pieces[:, 1::-1], atol=2e-9)
    face = model.interfaces
    below = np.isin(face.kind, (ContactKind.SOIL, ContactKind.SUPPORT))
    x = (face.x[below, None] + face.normal_y[below, None] * face.contact_offset[below]).ravel()
    area = face.contact_area[below].ravel()
    there, back = np.lexsort((area, np.round(x, 6))), np.lexsort((area, np.round(length - x, 6)))
    np.testing.assert_allclose(x[there], length - x[back], atol=2e-9)
    np.testing.assert_allclose(area[there], area[back], rtol=1e-6)
    if model.jacks is not None:
        push = model.jacks.push[1::3][model.footing]
        np.testing.assert_allclose(push, push[::-1], atol=1e-9)
        turn = model.jacks.push[2::3][model.footing]
        np.testing.assert_allclose(turn, -turn[::-1], atol=1e-9)


# -- interfaces -------------------------------------------------------------------------------------------------------


def test_segments_are_joined_to_each_other_and_to_the_bricks_on_them():
    scene = Scene(wall=WALL, footing=Footing(segment_length=0.12), movement=GROUND, opening=(DOOR,))
    model = wall_model(scene)
    face, footing = model.interfaces, model.footing
    assert footing is not None
    section = face.kind == ContactKind.FOOTING_SECTION
    assert section.sum() == len(footing) - 1
    assert (np.sort(face.block_a[section]) == footing[:-1]).all()
    assert (face.block_b[section] == face.block_a[section] + 1).all()
    np.testing.assert_allclose(face.normal_x[section], 1.0)
    np.testing.assert_allclose(face.length[section], scene.footing.depth)
    np.testing.assert_allclose(face.contact_area[section].sum(axis=1), 0.3 * 0.3)
    bed = face.kind == ContactKind.FOOTING_INTERFACE
    assert face.length[bed].sum() == pytest.approx(WALL.length - DOOR.width)
    np.testing.assert_allclose(face.contact_area[bed].sum(axis=1), face.length[bed] * WALL.thickness)
    np.testing.assert_array_equal(face.y[bed], 0.0)
    assert np.isin(face.block_a[bed], footing).all() ^ np.isin(face.block_b[bed], footing).all()
    assert not ((face.x[bed] > DOOR.x) & (face.x[bed] < DOOR.right)).any()
    soil = face.kind == ContactKind.SOIL
    assert face.length[soil].sum() == pytest.approx(WALL.length)
    np.testing.assert_allclose(face.contact_area[soil].sum(axis=1), face.length[soil] * 0.3)
    assert (face.block_a[soil] == model.n_blocks).all()
    assert not (face.kind == ContactKind.SUPPORT).any()


def test_sections_have_the_stiffness_of_the_beam():
    footing = Footing(width=0.4, depth=0.5, elastic_modulus=20e9, poisson_ratio=0.25)
    model = footing_alone(Scene(wall=WALL, footing=footing, movement=GROUND, opening=(DOOR,)))
    face, law = model.interfaces, model.properties
    section = face.kind == ContactKind.FOOTING_SECTION
    h = model.blocks.x[face.block_b[section]] - model.blocks.x[face.block_a[section]]
    np.testing.assert_allclose(law.normal_stiffness[section], 20e9 / h)
    bending = (law.normal_stiffness[:, None] * face.contact_area * face.contact_offset**2).sum(axis=1)[section]
    np.testing.assert_allclose(bending, 20e9 * 0.4 * 0.5**3 / 12 / h)
    shear = 5 / 6 * 8e9 * 0.2
    np.testing.assert_allclose(
        1 / (law.shear_stiffness[section] * 0.2), h / shear + h**3 / (12 * 20e9 * 0.4 * 0.5**3 / 12)
    )


def test_the_bed_on_the_footing_is_mortar_or_its_own():
    own = Joint(normal_stiffness=5e9, shear_stiffness=2e9, tensile_strength=0.1e6, cohesion=0.2e6)
    for joint in (None, own):
        solver = Solver(lump_block_elasticity=False)
        scene = Scene(wall=WALL, footing=Footing(joint=joint), movement=GROUND, solver=solver)
        model = wall_model(scene)
        bed = model.interfaces.kind == ContactKind.FOOTING_INTERFACE
        used = joint or scene.joint
        assert (model.properties.normal_stiffness[bed] == used.normal_stiffness).all()
        assert (model.properties.cohesion[bed] == used.cohesion).all()
        others = model.interfaces.kind == ContactKind.BED_JOINT
        assert (model.properties.normal_stiffness[others] == scene.joint.normal_stiffness).all()


@pytest.mark.parametrize(("kind", "stiffness"), [("dishing", 2e6), ("doming", 6e6)])
def test_the_soil_swells_in_dishing_and_shrinks_in_doming(kind: str, stiffness: float):
    movement = Movement(kind=kind, shape="mound")  # type: ignore[arg-type]
    soil = Soil(swelling_stiffness=2e6, shrinking_stiffness=6e6, friction=0.4)
    model = footing_alone(Scene(wall=WALL, movement=movement, soil=soil))
    below = model.interfaces.kind == ContactKind.SOIL
    assert (model.properties.normal_stiffness[below] == stiffness).all()
    assert (model.properties.shear_stiffness[below] == stiffness).all()
    assert (model.properties.friction[below] == 0.4).all()
    assert not model.properties.tensile_strength[below].any()
    assert not model.properties.cohesion[below].any()


# -- supports, jacks, deflection --------------------------------------------------------------------------------------


def test_supports_stand_where_the_rig_says():
    rig = Rig(supports=(0.3, 2.4, 4.5), jacks=(1.2, 3.6), support_stiffness=4e9)
    scene = Scene(wall=WALL, movement=JACKS, rig=rig)
    model = wall_model(scene)
    face = model.interfaces
    bearing = face.kind == ContactKind.SUPPORT
    x = np.round(face.x[bearing], 3)
    assert set(np.round(x, 2)) == {0.3, 2.4, 4.5}
    stiffness = (model.properties.normal_stiffness[:, None] * face.contact_area).sum(axis=1)[bearing]
    for place in (0.3, 2.4, 4.5):
        assert stiffness[np.abs(face.x[bearing] - place) < 1e-3].sum() == pytest.approx(4e9, rel=1e-6)
    assert model.span == pytest.approx(4.2)


def test_jacks_push_upwards_with_equal_loads_where_they_stand():
    jacks = (0.6, 1.2, 3.0)  # under the middle, at the end, and under the quarter of a brick
    model = wall_model(Scene(wall=WALL, movement=JACKS, rig=Rig(jacks=jacks)))
    assert model.jacks is not None
    push = model.jacks.push[: 3 * model.n_blocks].reshape(-1, 3)
    assert push[:, 1].sum() == pytest.approx(3.0)
    about_zero = (push[:, 1] * model.blocks.x + push[:, 2]).sum()
    assert about_zero == pytest.approx(sum(jacks))
    assert not push[:, 0].any()
    assert not np.delete(push, model.footing, axis=0).any()


@pytest.mark.parametrize("supports", [(), (0.3, 4.1)])
@pytest.mark.parametrize("longest", [None, 0.1])
def test_deflection_is_that_of_the_middle_between_the_outer_supports(supports, longest):
    scene = Scene(
        wall=WALL, movement=JACKS, rig=Rig(supports=supports, jacks=(1.0, 2.0)), footing=Footing(segment_length=longest)
    )
    model = wall_model(scene)
    assert model.deflection is not None
    left, right = supports or (0.0, 4.8)

    def deflection(y, slope) -> float:
        moved = np.zeros((model.size // 3, 3))
        moved[: model.n_blocks, 0] = 7.0
        moved[: model.n_blocks, 1], moved[: model.n_blocks, 2] = y(model.blocks.x), slope(model.blocks.x)
        return float(model.deflection @ moved.ravel())

    assert deflection(lambda x: 0 * x + 3.0, lambda x: 0 * x) == pytest.approx(0.0, abs=1e-12)
    assert deflection(lambda x: 2 * x + 3.0, lambda x: 0 * x + 2.0) == pytest.approx(0.0, abs=1e-12)
    parabola = deflection(lambda x: (x - left) * (right - x), lambda x: left + right - 2 * x)
    h = longest or 0.24
    assert parabola == pytest.approx((right - left) ** 2 / 4, abs=2 * (h / 2) ** 2)
    moved = np.zeros(model.size)
    moved[1 : 3 * model.n_blocks : 3][: model.n_blocks - len(segments(model))] = 1.0  # bricks do not count
    assert model.deflection @ moved == 0.0


@pytest.mark.parametrize("control", [{}, {"control": "load", "jack_load": 1e3}])
def test_one_segment_between_the_supports_is_refused_as_no_jack_bends_it(control: dict[str, Any]):
    scene = Scene(
        wall=Wall(length=0.5, height=0.2, block_length=0.5, block_height=0.1),
        movement=Movement(shape="jacks", central_deflection=1e-4),
        rig=Rig(supports=(0.05, 0.45), jacks=(0.2,), **control),
    )
    with pytest.raises(InputError, match=r"rig\.supports: between 0\.05 and 0\.45 m .* one rigid segment"):
        wall_model(scene)
    wall_model(replace(scene, footing=Footing(segment_length=0.25)))


def test_weight_of_the_footing_goes_with_its_width_and_any_line_load_is_on_it():
    footing = Footing(width=0.4, depth=0.5, density=2400.0)
    scene = Scene(wall=WALL, footing=footing, movement=GROUND)
    model = footing_alone(scene, line_load=5e3)
    load = model.supports.load.reshape(-1, 3)
    weight = 2400 * 9.81 * 0.4 * 0.5 + 5e3
    length = np.diff(segments(model)[:, :2]).ravel()
    np.testing.assert_allclose(load[:, 1], -weight * length)
    assert not load[:, [0, 2]].any()
    whole, bare = (wall_model(s).supports.load[1::3].sum() for s in (scene, Scene(wall=WALL)))
    assert whole - bare == pytest.approx(-2400 * 9.81 * 0.4 * 0.5 * 4.8)


def test_a_footing_alone_is_on_the_rig_of_the_whole_wall():
    scene = Scene(wall=WALL, movement=JACKS, opening=(DOOR,), footing=Footing(segment_length=0.1))
    alone, whole = footing_alone(scene), wall_model(scene)
    np.testing.assert_allclose(segments(alone), segments(whole))
    assert alone.jacks is not None
    assert whole.jacks is not None
    assert whole.footing is not None
    there = 3 * whole.footing[:, None] + np.arange(3)
    np.testing.assert_allclose(alone.jacks.push[: there.size], whole.jacks.push[there].ravel())
    assert alone.deflection is not None
    assert whole.deflection is not None
    np.testing.assert_allclose(alone.deflection[: there.size], whole.deflection[there].ravel())


# -- a footing of zones -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("movement", [JACKS, GROUND], ids=["jacks", "mound"])
def test_a_footing_of_zones_is_one_block_and_measured_at_its_gridpoints(movement: Movement):
    solver = Solver(footing="deformable", zone_size_footing=0.15)
    scene = Scene(wall=WALL, movement=movement, solver=solver)
    model = wall_model(scene)
    mesh = model.mesh
    assert mesh is not None
    assert model.footing is not None
    assert len(model.footing) == 1
    assert not (wall_geometry(scene).interfaces.kind == ContactKind.FOOTING_SECTION).any()
    assert model.deflection is not None
    moved = np.zeros(model.size)
    own = np.flatnonzero(mesh.gridpoint_block == model.footing[0])
    for give, exact in ((lambda x: 3 - 2 * x, 0.0), (lambda x: x * (4.8 - x), 4.8**2 / 4)):
        moved[:] = 0.0
        moved[mesh.dof_y[own]] = give(mesh.x[own])
        assert model.deflection @ moved == pytest.approx(exact, abs=0.15**2 / 4)
    if model.jacks is not None:
        push = model.jacks.push
        assert push[mesh.dof_y[own]].sum() == pytest.approx(3.0)
        assert (push[mesh.dof_y[own]] * mesh.x[own]).sum() == pytest.approx(3 * 2.4)
        low = mesh.y[own][push[mesh.dof_y[own]] > 0]
        np.testing.assert_allclose(low, -0.3)
