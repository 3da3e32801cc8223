"""Widest openings are those at the ends of joints, wherever the contacts lie."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from damagepred.assembly import wall_model
from damagepred.damage import Growth, JointMap, judge
from damagepred.damage.tracing import BELOW_DPC, DPC_OPENING, WALL
from damagepred.one_wall.judged_path import joint_map
from damagepred.scene import Damage, Dpc, Joint, Scene, Solver, Wall
from tests.damage.pattern import rules_of

TURN = 5e-3
DRY = Joint(tensile_strength=0.0, cohesion=0.0)

RULES = [
    *({"quadrature": "lobatto", "contacts_per_interface": count} for count in range(2, 10)),
    *({"quadrature": "midpoint", "contacts_per_interface": count} for count in range(2, 10)),
    *({"quadrature": "midpoint", "contacts_per_interface": 1, "no_tension_subdivisions": parts} for parts in (2, 4, 7)),
    {"quadrature": "midpoint", "contacts_per_interface": 2, "no_tension_subdivisions": 3},
    {"quadrature": "lobatto", "no_tension_subdivisions": 1},
    {"blocks": "deformable", "quadrature": "midpoint", "contacts_per_interface": 2},
    {"blocks": "deformable", "quadrature": "midpoint", "contacts_per_interface": 1, "zone_size": 0.03},
    {"blocks": "deformable"},
]


def turned_brick(course: int, dpc: int | None, rule: dict[str, Any]) -> tuple[JointMap, Any, float, float]:
    """Joints and openings of a wall of which one brick turns about its lower left corner; its length and height."""
    solver = Solver(**rule)
    scene = Scene(
        wall=Wall(length=1.2, height=0.45), dpc=None if dpc is None else Dpc(course=dpc), joint=DRY, solver=solver
    )
    model = wall_model(scene)
    joints, blocks, face = joint_map(model), model.blocks, model.interfaces
    in_course = np.flatnonzero(blocks.course == course)
    brick = in_course[np.argsort(blocks.x[in_course])[len(in_course) // 2]]
    corners = blocks.vertices[blocks.first_vertex[brick] : blocks.first_vertex[brick + 1]]
    pivot, size = corners.min(axis=0), np.ptp(corners, axis=0)
    # at (x, y) the brick moves by turn (-(y - y_0), x - x_0); the joint opens as side b goes off side a
    side = (face.block_b == brick).astype(float) - (face.block_a == brick)
    move_x, move_y = -TURN * (joints.contact_y - pivot[1]), TURN * (joints.contact_x - pivot[0])
    opening = side[:, None] * (face.normal_x[:, None] * move_x + face.normal_y[:, None] * move_y)
    return joints, opening, float(size[0]), float(size[1])


@pytest.mark.quick_cases
@pytest.mark.parametrize("rule", RULES, ids=lambda rule: " ".join(map(str, rule.values())))
@pytest.mark.parametrize(("course", "dpc"), [(3, None), (0, None), (2, 2), (1, 3)])
def test_a_brick_that_turns_opens_its_bed_by_its_length(rule: dict[str, Any], course: int, dpc: int | None):
    """Turned by theta about its lower left corner, a bed opens by theta l at the other end, a side by theta h."""
    joints, opening, length, height = turned_brick(course, dpc, rule)
    cracked = np.ones(opening.shape, dtype=bool)
    found = judge(joints, opening, np.zeros_like(opening), cracked, rules_of(Damage(band_gauge=0.01)))
    bed, side = pytest.approx(TURN * length, rel=1e-9), pytest.approx(TURN * height, rel=1e-9)
    wall, base, on_dpc, footing = {
        (3, None): (bed, 0.0, 0.0, 0.0),
        (0, None): (side, 0.0, 0.0, bed),
        (2, 2): (side, 0.0, bed, 0.0),
        (1, 3): (0.0, bed, 0.0, 0.0),
    }[course, dpc]
    assert found.crack_width_max == found.crack_band_width_max == wall
    assert (found.base_crack_width_max, found.dpc_opening_max, found.footing_opening_max) == (base, on_dpc, footing)
    cracks = Growth(joints).step(0, opening, np.zeros_like(opening), cracked)
    for part, width in ((WALL, wall), (BELOW_DPC, base), (DPC_OPENING, on_dpc)):
        assert max((one.crack.opening.max() for one in cracks if one.part == part), default=0.0) == width
