"""Blocks count as detached beyond a limit that allows for elastic displacements."""

import numpy as np
import pytest

from damagepred.assembly import Assembly
from damagepred.assembly.assembly import rectangle
from damagepred.scene import Joint, Solver
from damagepred.solvers.system.collapse_criterion import detached_blocks, largest_elastic_displacement

LENGTH, HEIGHT, WEIGHT = 0.24, 0.075, 2000.0 * 9.81 * 0.075


def tall(count: int, normal_stiffness: float) -> Assembly:
    """Return a bonded stack of rigid bricks."""
    bond = Joint(normal_stiffness=normal_stiffness, tensile_strength=1e12, cohesion=1e12)
    stack = Assembly(joint=bond)
    for i in range(count):
        stack.add_block(rectangle(0.0, HEIGHT * i, LENGTH, HEIGHT * (i + 1)))
    stack.rest_on_ground([0])
    return stack


def test_blocks_beyond_the_limit_are_detached() -> None:
    model = tall(40, 1e7).build(Solver(lump_block_elasticity=False))
    moved = np.zeros(model.size)
    far = largest_elastic_displacement(model, 0.0)
    assert far == pytest.approx(40 * 41 * WEIGHT / 2e7, rel=1e-6)
    # a suddenly applied load doubles the elastic displacement; half a brick is allowed besides,
    # and twice the settlement of the bed joint on the ground
    limit = 2.0 * far + 0.5 * np.sqrt(LENGTH * HEIGHT) + 2.0 * 40 * WEIGHT / 1e7
    for share, loose in ((0.999, []), (1.001, [20])):
        moved[3 * 20] = share * limit
        assert np.flatnonzero(detached_blocks(model, moved, 0.0)).tolist() == loose


def test_the_limit_of_an_unsupported_stack_has_no_elastic_part() -> None:
    wall = tall(2, 1e7)
    wall.add_block(rectangle(1.0, 0.0, 1.24, HEIGHT))  # in the air
    model = wall.build(Solver(lump_block_elasticity=False))
    assert largest_elastic_displacement(model, 1.0) == 0.0
