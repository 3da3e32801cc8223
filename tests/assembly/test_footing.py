"""The footing of a model: segments, sections, supports, jacks, and the measure of its deflection."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from damagepred.assembly import Model, footing_alone, wall_geometry, wall_model
from damagepred.enumerations import ContactKind
from damagepred.errors import InputError
from damagepred.scene import Footing, Movement, Opening, Rig, Scene, Solver, Wall

JACKS = Movement(kind="doming", shape="jacks", central_deflection=1e-3)
GROUND = Movement(kind="doming", shape="mound")
DOOR = Opening(kind="door", x=0.96, width=0.96, height=2.1)
WALL = Wall(length=4.8, height=2.4)


def segments(model: Model) -> np.ndarray:
    """Return left, right, bottom and top of the footing's blocks (m)."""
    corners = model.blocks.vertices[model.blocks.first_vertex[model.footing][:, None] + np.arange(4)]
    low, high = corners.min(axis=1), corners.max(axis=1)
    return np.column_stack((low[:, 0], high[:, 0], low[:, 1], high[:, 1]))


@pytest.mark.parametrize(("longest", "each"), [(0.24, 1), (0.2399, 2), (0.12, 2), (0.1, 3), (1.0, 1)])
def test_segments_are_no_longer_than_they_may_be(longest: float, each: int):
    scene = Scene(wall=replace(WALL, bond="stack"), footing=Footing(segment_length=longest), movement=GROUND)
    pieces = segments(wall_model(scene))
    assert len(pieces) == 20 * each
    np.testing.assert_allclose(pieces[:, 1] - pieces[:, 0], 0.24 / each, atol=1e-9)


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
    np.testing.assert_allclose(1 / (law.shear_stiffness[section] * 0.2), h / shear + h**3 / (20e9 * 0.4 * 0.5**3))


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


@pytest.mark.parametrize("movement", [JACKS, GROUND], ids=["jacks", "mound"])
def test_a_footing_of_zones_is_one_block_and_measured_at_its_gridpoints(movement: Movement):
    solver = Solver(footing="deformable", zone_size_footing=0.15)
    scene = Scene(wall=WALL, movement=movement, solver=solver)
    model = wall_model(scene)
    mesh = model.mesh
    assert len(model.footing) == 1
    assert not (wall_geometry(scene).interfaces.kind == ContactKind.FOOTING_SECTION).any()
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
