"""Widths of crack bands, of openings by hand; widest openings are those at the ends of joints."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from damagepred.assembly import wall_model
from damagepred.damage.joints import JointMap
from damagepred.damage.judge import judge
from damagepred.damage.tracing import BELOW_DPC, DPC_OPENING, WALL, Growth
from damagepred.enumerations import ContactKind
from damagepred.one_wall.judged_path import gauges, joint_map
from damagepred.scene import ControlJoint, Damage, Dpc, Joint, Opening, Scene, Solver, Wall
from tests.damage.pattern import Pattern, rules_of

MM = 1e-3
BRICK, COURSE = 0.24, 0.075


def band(wall: Pattern, **rules) -> float:
    """Width (mm) of the widest band of a wall drawn by hand."""
    return wall.judge(Damage(**rules)).crack_band_width_max / MM


def of_model(scene: Scene, opened: dict[tuple[int, float, float], float], **rules) -> float:
    """Width (mm) of the widest band of a scene's wall of which the joints nearest to some places open evenly (mm)."""
    joints = gauges(wall_model(scene)).joints
    opening, cracked = np.zeros(joints.contact_x.shape), np.zeros(joints.contact_x.shape, dtype=bool)
    middle = (joints.start + joints.end) / 2
    for (kind, x, y), width in opened.items():
        own = np.flatnonzero(joints.kind == kind)
        nearest = own[np.argmin(np.hypot(*(middle[own] - (x, y)).T))]
        opening[nearest], cracked[nearest] = width * MM, True
    return judge(joints, opening, np.zeros_like(opening), cracked, rules_of(Damage(**rules))).crack_band_width_max / MM


def test_head_joints_of_one_course_are_summed_along_the_gauge():
    """1, 2, 4, 8 mm a brick apart: gauges of 0, 1, 2 and 3 bricks read 8, 12, 14 and 15."""
    wall = Pattern()
    for i, width in zip((4, 6, 8, 10), (1, 2, 4, 8)):
        wall.open("head", i, 4, width * MM)
    lengths = (0.1, BRICK - 0.01, BRICK, 2 * BRICK, 3 * BRICK, 3.0)
    assert [band(wall, band_gauge=g) for g in lengths] == pytest.approx([8, 8, 12, 14, 15, 15])
    assert band(wall) == pytest.approx(15)  # the default spans three bricks


def test_other_courses_are_other_bands():
    wall = Pattern()
    wall.open("head", 4, 4, 1 * MM)
    wall.open("head", 5, 5, 2 * MM)
    assert band(wall) == pytest.approx(2)


def test_of_a_stepped_crack_the_larger_component_counts():
    wall = Pattern()
    for step in range(4):
        wall.open("head", 4 + step, 3 + step + (1 if (7 + 2 * step) % 2 else 0), 1 * MM)
        wall.open("bed", 4 + step, 4 + step, 2 * MM)
    assert band(wall) == pytest.approx(2)


PLAIN = Scene(wall=Wall(length=2.88, height=0.9))
ROW, COLUMN = (0.96, 1.2, 1.44, 1.68), (0.225, 0.3, 0.375, 0.45)


def heads(*x: float, y: float = 0.3375) -> dict:
    return {(ContactKind.HEAD_JOINT, place, y): 1.0 for place in x}


def beds(*y: float, x: float = 1.26) -> dict:
    return {(ContactKind.BED_JOINT, x, place): 1.0 for place in y}


@pytest.mark.parametrize(
    ("parts", "opened", "width"),
    [
        ({}, heads(*ROW), 4),
        ({}, beds(*COLUMN), 4),
        ({"opening": (Opening(x=1.2, y=0.3, width=0.24, height=0.15),)}, heads(0.96, 1.68), 1),
        ({"opening": (Opening(x=1.2, y=0.3, width=0.24, height=0.15),)}, beds(0.225, 0.525), 1),
        ({"control_joint": (ControlJoint(x=1.2),)}, heads(0.96, 1.44, 1.68), 2),
        ({"control_joint": (ControlJoint(x=1.2),)}, beds(*COLUMN), 4),
        ({"dpc": Dpc(course=4)}, heads(*ROW, y=0.1875), 0),
        ({"dpc": Dpc(course=4)}, beds(0.15, 0.225, 0.375, 0.45), 2),
    ],
)
def test_a_gauge_ends_where_the_masonry_does(parts: dict, opened: dict, width: int):
    """Joints that open by 1 mm each, side by side, beside an opening, a control joint, and on either side of a dpc."""
    assert of_model(replace(PLAIN, **parts), opened) == pytest.approx(width)


TURN = 5e-3
DRY = Joint(tensile_strength=0.0, cohesion=0.0)

RULES = [
    *({"quadrature": "lobatto", "contacts_per_interface": count} for count in (2, 3, 4, 9)),
    *({"quadrature": "midpoint", "contacts_per_interface": count} for count in (2, 3, 4, 9)),
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
