"""Widths of crack bands, of openings by hand, and properties for any openings."""

from dataclasses import replace

import numpy as np
import pytest

from damagepred.assembly import wall_model
from damagepred.damage import judge
from damagepred.enumerations import ContactKind
from damagepred.one_wall.judged_path import gauges
from damagepred.scene import ControlJoint, Damage, Dpc, Opening, Scene, Wall
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


# -- by hand ---------------------------------------------------------------------------------------------------------


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


# -- walls of templates ----------------------------------------------------------------------------------------------


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
