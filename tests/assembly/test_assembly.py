"""The public Assembly: any convex blocks, supports, loads and gravity."""

from operator import attrgetter

import numpy as np
import pytest

from damagepred.assembly import Assembly, wall_model
from damagepred.assembly.bond import lay_bricks
from damagepred.errors import InputError
from damagepred.scene import Joint, Movement, Scene, Solver, Wall

UNIT = [(0, 0), (1, 0), (1, 1), (0, 1)]


def stack(n: int = 2, **options) -> Assembly:
    wall = Assembly(**options)
    for i in range(n):
        wall.add_block([(x, y + i) for x, y in UNIT])
    return wall


def test_an_assembly_of_the_wall_s_bricks_is_the_wall():
    """The template adds nothing of its own: put together by hand the same bricks make the same model."""
    rigid = Solver(blocks="rigid")
    scene = Scene(wall=Wall(length=2.4, height=0.6), movement=Movement(shape="parabola"), solver=rigid)
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
    mine, template = wall.build(rigid), wall_model(scene)
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
    model = wall.build(Solver(blocks="rigid"), fields={0: {"cohesion": values}})
    law = model.properties
    assert law.cohesion[model.interfaces.block_a == 0].tolist() == [1e6]
    others = model.interfaces.block_a != 0
    np.testing.assert_array_equal(law.cohesion[others], values[model.interfaces.joint[others]])


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
