"""Rotation of a block on a joint without tension: the error of the contact rules over the closed form."""

from dataclasses import replace

import pytest

from damagepred import Assembly, solve
from damagepred.assembly.assembly import rectangle
from damagepred.scene import Joint, Solver

DRY = Joint(tensile_strength=0.0, cohesion=0.0)


def rotation_error(solver: Solver, share: float, length: float = 0.24, thickness: float = 0.11) -> float:
    """Error over theta = 2 N / (k_n t a^2), contact length a = 3 (b / 2 - e); ``share`` is e / b."""
    wall = Assembly(thickness=thickness, gravity=(0.0, 0.0), joint=DRY)
    block = wall.add_block(rectangle(-length / 2, 0.0, length / 2, 0.075))
    wall.support(wall.add_block(rectangle(-length / 2, -0.1, length / 2, 0.0)))
    force = 1e5 * length * thickness
    wall.load(block, y=-force, at=(share * length, 0.075))
    ds = solve(wall, solver=replace(solver, blocks="rigid", lump_block_elasticity=False), increments=1)
    pressed = 3 * (0.5 - share) * length
    turned = -float(ds["block_rotation"].values[-1, block])
    return turned * DRY.normal_stiffness * thickness * pressed**2 / (2 * force) - 1.0


def test_three_contacts_at_two_fifths_by_hand() -> None:
    """The right one (1/6) carries 4.8 N/k, the middle (4/6) 0.3 N/k over b/2: 9 N/(k b) in place of 2 N/(k b 0.3²)."""
    assert rotation_error(Solver(no_tension_subdivisions=1), 0.4) == pytest.approx(9 / (2 / 0.09) - 1, abs=1e-3)


@pytest.mark.parametrize("share", [0.2, 0.25, 0.3, 0.34, 0.38, 0.4])
def test_four_parts_of_three_contacts_stay_within_a_tenth(share: float) -> None:
    assert abs(rotation_error(Solver(), share)) < 0.1
