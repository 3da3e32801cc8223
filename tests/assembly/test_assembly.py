"""The public Assembly: any convex blocks, supports, loads and gravity."""

import numpy as np
import pytest

from damagepred import Assembly
from damagepred.errors import InputError
from damagepred.scene import Joint, Solver

UNIT = [(0, 0), (1, 0), (1, 1), (0, 1)]


def stack(n: int = 2, **options) -> Assembly:
    wall = Assembly(**options)
    for i in range(n):
        wall.add_block([(x, y + i) for x, y in UNIT])
    return wall


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


# -- what is refused --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("other", [UNIT, [(0.5, 0), (1.5, 0), (1.5, 1), (0.5, 1)], [(0.5, 0.5), (2, 0.6), (2, 2)]])
def test_overlapping_blocks(other: list):
    wall = Assembly()
    wall.add_block(UNIT)
    wall.add_block(other)
    with pytest.raises(InputError, match=r"blocks 0 and 1 overlap by .* m"):
        wall.build()


def test_no_joint_between_blocks_that_do_not_meet():
    wall = stack(3)
    wall.set_joint(0, 2, Joint())
    with pytest.raises(InputError, match="blocks 0 and 2 share no edge"):
        wall.build()
