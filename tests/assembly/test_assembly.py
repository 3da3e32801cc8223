"""The public Assembly: any convex blocks, supports, loads and gravity."""

from operator import attrgetter

import numpy as np
import pytest

from damagepred import Assembly
from damagepred.assembly import GRAVITY, wall_model
from damagepred.assembly.bond import lay_bricks
from damagepred.enumerations import ContactKind
from damagepred.errors import InputError
from damagepred.scene import BlockMaterial, Joint, Movement, Scene, Solver, Wall
from damagepred.solvers import solve_path

UNIT = [(0, 0), (1, 0), (1, 1), (0, 1)]


def stack(n: int = 2, **options) -> Assembly:
    wall = Assembly(**options)
    for i in range(n):
        wall.add_block([(x, y + i) for x, y in UNIT])
    return wall


def test_an_assembly_of_the_wall_s_bricks_is_the_wall():
    """The template adds nothing of its own: put together by hand the same bricks make the same model."""
    scene = Scene(wall=Wall(length=2.4, height=0.6), movement=Movement(shape="parabola"))
    wall = Assembly()
    for brick in lay_bricks(scene):
        corners = [
            (brick.left, brick.bottom),
            (brick.left, brick.top),
            (brick.right, brick.top),
            (brick.right, brick.bottom),
        ]
        wall.add_block(corners, course=brick.course)  # clockwise: either way round will do
    wall.rest_on_ground(range(10), lambda x: scene.movement.profile(x, 2.4))
    mine, template = wall.build(), wall_model(scene)
    for part in ("interfaces", "properties", "ground.full", "joints"):
        found, expected = (attrgetter(part)(model) for model in (mine, template))
        for name, value in expected._asdict().items():
            if value is None:
                assert getattr(found, name) is None
                continue
            np.testing.assert_allclose(getattr(found, name), value, rtol=1e-12, atol=1e-15, err_msg=name)
    np.testing.assert_allclose(mine.supports.load, template.supports.load, rtol=1e-12, atol=1e-12)
    assert mine.span == pytest.approx(2.4)
    assert mine.central_deflection == pytest.approx(8e-3)


def test_loads_make_the_same_resultant_wherever_they_act():
    """A force may be slid along its own line."""
    ends = []
    for at in ((0.2, 0.0), (0.2, 0.5), (0.2, 7.0)):
        wall = stack(gravity=(0, 0))
        wall.load(0, y=-1.0, at=at)
        ends.append(wall.build().supports.load)
    np.testing.assert_allclose(ends[0], ends[1])
    np.testing.assert_allclose(ends[0], ends[2])


def test_supports_and_moves():
    wall = stack(3)
    wall.support(0)
    wall.support(1, x=True, y=False, rotation=False)
    wall.move(2, x=0.001, y=-0.002, rotation=0.0)
    supports = wall.build().supports
    assert supports.prescribed.tolist() == [0, 1, 2, 3, 6, 7, 8]
    assert supports.prescribed_displacement.tolist() == [0, 0, 0, 0, 0.001, -0.002, 0]
    assert wall.build().central_deflection == 0.002


def test_kinds_come_from_direction():
    wall = stack()
    wall.add_block([(1, 0), (2, 0), (2, 1), (1, 1)])
    wall.rest_on_ground([0, 2])
    face = wall.build().interfaces
    assert sorted(face.kind.tolist()) == [
        ContactKind.BED_JOINT,
        ContactKind.HEAD_JOINT,
        ContactKind.FOOTING_INTERFACE,
        ContactKind.FOOTING_INTERFACE,
    ]


def test_set_joint_where_a_vertex_divides_the_common_edge():
    wall = Assembly()
    wall.add_block([(0, 0), (1, 0), (1, 1), (0.3, 1), (0, 1)])
    wall.add_block([(0, 1), (1, 1), (1, 2), (0, 2)])
    wall.set_joint(0, 1, Joint(cohesion=7.0, tensile_strength=0.0), ContactKind.DPC)
    model = wall.build()
    assert sorted(model.interfaces.length) == pytest.approx([0.3, 0.7])
    assert (model.properties.cohesion == 7.0).all()
    assert (model.interfaces.kind == ContactKind.DPC).all()


def test_ground_under_a_hexagon_and_under_nothing():
    wall = Assembly()
    wall.add_block([(1, 0), (2, 0), (3, 1), (2, 2), (1, 2), (0, 1)])
    wall.rest_on_ground([0, 0], lambda x: -0.01 * x)  # twice the same block is once
    model = wall.build(Solver(lump_block_elasticity=False))
    face = model.interfaces
    assert (face.x.tolist(), face.length.tolist()) == ([1.5], [1.0])
    assert (face.block_a[0], face.block_b[0]) == (1, 0)  # the ground is block n
    np.testing.assert_allclose(model.ground.full.normal, [[-0.01, -0.015, -0.02]])
    assert model.central_deflection == pytest.approx(0.015)

    pointed = Assembly()
    pointed.add_block([(0, 1), (1, 0), (2, 1)])
    pointed.rest_on_ground([0])
    with pytest.raises(InputError, match="block 0: cannot rest on the ground"):
        pointed.build()


def test_fields_by_material():
    wall = stack(4)
    wall.set_joint(0, 1, Joint(cohesion=1e6))
    values = np.array([1e5, 2e5, 3e5])
    law = wall.build(fields={0: {"cohesion": values}}).properties
    model = wall.build()
    assert law.cohesion[model.interfaces.block_a == 0].tolist() == [1e6]
    others = model.interfaces.block_a != 0
    np.testing.assert_array_equal(law.cohesion[others], values[model.interfaces.joint[others]])


@pytest.mark.parametrize("shift", [(1e4, 0.0), (1e4, -1e4)])
def test_ten_kilometres_away_the_wall_is_the_same(shift: tuple[float, float]):
    scene = Scene(wall=Wall(length=2.4, height=0.6))
    near, far = Assembly(), Assembly()
    for b in lay_bricks(scene):
        corners = np.array([(b.left, b.bottom), (b.right, b.bottom), (b.right, b.top), (b.left, b.top)])
        near.add_block(corners, course=b.course)
        far.add_block(corners + np.array(shift), course=b.course)
    first, second = near.build(), far.build()
    for part, tolerance in (("interfaces", 1e-9), ("joints", 1e-9)):
        for name, value in getattr(first, part)._asdict().items():
            if value is None:
                continue
            moved = {"x": shift[0], "y": shift[1]}.get(name, 0.0)
            np.testing.assert_allclose(
                getattr(getattr(second, part), name), value + moved, atol=tolerance, err_msg=name
            )
    np.testing.assert_allclose(second.properties.normal_stiffness, first.properties.normal_stiffness, rtol=1e-9)
    np.testing.assert_allclose(second.supports.load, first.supports.load, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(second.blocks.polar, first.blocks.polar, rtol=1e-6)


# -- what is refused --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "vertices",
    [
        [(0, 0), (2, 0), (1, 0.5), (1, 2)],
        [(0, 0), (1, 0), (2, 0)],
        [(0, 0), (1, np.nan), (0, 1)],
        [(0, 0), (1, 0)],
        "square",
    ],
)
def test_a_bad_block_is_named_and_not_added(vertices: object):
    wall = stack(2)
    with pytest.raises(InputError, match="block 2: "):
        wall.add_block(vertices)
    assert wall.n_blocks == 2
    wall.build()


@pytest.mark.parametrize("other", [UNIT, [(0.5, 0), (1.5, 0), (1.5, 1), (0.5, 1)], [(0.5, 0.5), (2, 0.6), (2, 2)]])
def test_overlapping_blocks(other: list):
    wall = Assembly()
    wall.add_block(UNIT)
    wall.add_block(other)
    with pytest.raises(InputError, match=r"blocks 0 and 1 overlap by .* m"):
        wall.build()


@pytest.mark.parametrize("block", [-1, 2, 99])
@pytest.mark.parametrize(
    "use",
    [
        lambda w, b: w.support(b),
        lambda w, b: w.move(b, x=0.1),
        lambda w, b: w.load(b, x=1.0),
        lambda w, b: w.set_joint(0, b, Joint()),
        lambda w, b: w.set_joint(b, 0, Joint()),
        lambda w, b: w.rest_on_ground([0, b]),
    ],
    ids=["support", "move", "load", "set_joint", "set_joint first", "rest_on_ground"],
)
def test_unknown_blocks(use, block: int):
    with pytest.raises(InputError, match=f"block {block}: there is no such block; they are numbered 0 to 1"):
        use(stack(2), block)


def test_no_joint_between_blocks_that_do_not_meet():
    wall = stack(3)
    wall.set_joint(0, 2, Joint())
    with pytest.raises(InputError, match="blocks 0 and 2 share no edge"):
        wall.build()


@pytest.mark.parametrize("thick_first", [True, False])
@pytest.mark.parametrize("thick_below", [True, False])
@pytest.mark.parametrize("method", ["quasi_static", "explicit"])
def test_blocks_of_two_thicknesses_meet_in_the_thinner(thick_first: bool, thick_below: bool, method: str):
    """Areas, weights and stresses of one block on another, and of one beside it, by hand, added in either order."""
    thick, thin, density = 0.3, 0.1, 2000.0
    below, above = (thick, thin) if thick_below else (thin, thick)
    places = [(below, 0.0, 0.0), (above, 0.0, 1.0), (above, 1.0, 0.0)]
    wall = Assembly(thickness=0.7, block=BlockMaterial(density=density), joint=Joint(normal_stiffness=1e9))
    order = [0, 1, 2] if (below == thick) == thick_first else [1, 2, 0]
    number = {
        place: wall.add_block([(x + left, y + bottom) for x, y in UNIT], thickness=depth)
        for place, (depth, left, bottom) in ((p, places[p]) for p in order)
    }
    wall.support(number[0])
    wall.support(number[2])
    model = wall.build(Solver(lump_block_elasticity=False))
    face = model.interfaces
    pairs = [{int(a), int(b)} for a, b in zip(face.block_a, face.block_b)]
    area = dict(zip(map(frozenset, pairs), face.contact_area.sum(axis=1)))
    assert area[frozenset((number[0], number[1]))] == pytest.approx(thin)
    assert area[frozenset((number[0], number[2]))] == pytest.approx(thin)
    weight = [density * GRAVITY * depth for depth, _, _ in places]
    load = model.supports.load.reshape(-1, 3)
    for place in range(3):
        assert load[number[place]] == pytest.approx([0.0, -weight[place], 0.0])
        assert model.block_law.thickness[number[place]] == places[place][0]
    increment = list(solve_path(model, Solver(method=method, lump_block_elasticity=False, tolerance=1e-6), 1))[-1]
    bed = pairs.index({number[0], number[1]})
    np.testing.assert_allclose(increment.normal_stress[bed], -weight[1] / thin, rtol=1e-4)
    np.testing.assert_allclose(increment.opening[bed], -weight[1] / (1e9 * thin), rtol=1e-4)
