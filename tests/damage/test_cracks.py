"""Which joints make one crack, how wide it is, and where."""

import numpy as np
import pytest
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from damagepred.assembly import wall_geometry
from damagepred.damage import Cracks, JointMap, find_cracks
from damagepred.scene import Opening, Scene, Wall
from tests.damage.pattern import COURSE, HALF, Pattern

MM = 1e-3


def cracks(wall: Pattern) -> Cracks:
    return find_cracks(wall.map, wall.opening, wall.slip, wall.cracked)


def test_a_stepped_crack_is_one_crack():
    wall = Pattern()
    steps = [
        ("head", 4, 2),
        ("bed", 4, 3),
        ("head", 5, 3),
        ("bed", 5, 4),
        ("head", 6, 4),
        ("bed", 6, 5),
        ("head", 7, 5),
    ]
    for step in steps:
        wall.open(*step, 1 * MM)
    found = cracks(wall)
    assert found.width.tolist() == [1 * MM]
    assert found.joints.tolist() == [7]


@pytest.mark.parametrize("missing", range(1, 6))
def test_a_step_that_is_sound_parts_it(missing: int):
    wall = Pattern()
    steps = [
        ("head", 4, 2),
        ("bed", 4, 3),
        ("head", 5, 3),
        ("bed", 5, 4),
        ("head", 6, 4),
        ("bed", 6, 5),
        ("head", 7, 5),
    ]
    for number, step in enumerate(steps):
        if number != missing:
            wall.open(*step, (1 + number / 10) * MM)
    found = cracks(wall)
    assert sorted(found.joints.tolist()) == sorted([missing, 6 - missing])


@pytest.mark.parametrize(("slip", "count"), [(0.2 * MM, 1), (-0.2 * MM, 1), (0.06 * MM, 1), (0.04 * MM, 2), (0.0, 2)])
def test_sliding_joins_what_opened_if_an_eye_can_see_it(slip: float, count: int):
    wall = Pattern()
    wall.open("head", 4, 2, 2 * MM)
    wall.open("head", 7, 3, 1 * MM)
    for i in (4, 5, 6):
        wall.slide("bed", i, 3, slip)
    assert len(cracks(wall).width) == count


def test_sliding_alone_is_no_open_crack():
    wall = Pattern()
    for i in (4, 5, 6):
        wall.slide("bed", i, 3, 5 * MM)
    assert len(cracks(wall).width) == 0
    verdict = wall.judge()
    assert (verdict.damage_category, verdict.crack_width_max, verdict.crack_count) == (0, 0.0, 0)


def test_psi_of_one_crack_of_a_tenth_of_a_millimetre_is_one():
    wall = Pattern()
    assert wall.judge().psi == 0.0
    wall.open("head", 4, 2, 0.1 * MM)
    assert wall.judge().psi == pytest.approx(2 * 0.1**0.3)
    assert wall.judge().psi == pytest.approx(1.0, abs=0.003)


def test_psi_weighs_cracks_by_displacement_and_length_and_counts_those_that_slid():
    wall = Pattern()
    wall.vertical(4, 2 * MM)  # six head joints and the five beds between, of half a brick
    wall.slide("bed", 10, 3, 3 * MM)
    long, short = found = cracks(wall).length
    assert found.tolist() == [max(found), min(found)]
    mean = (2.0**2 * long + 3.0**2 * short) / (2.0 * long + 3.0 * short)
    assert wall.judge().psi == pytest.approx(2 * 2**0.15 * mean**0.3)
    wall.slide("head", 4, 2, 1.5 * MM)
    assert cracks(wall).displacement[0] == pytest.approx(np.hypot(2, 1.5) * MM)


def test_a_closed_crack_is_none():
    wall = Pattern()
    wall.open("head", 4, 2, -1 * MM)
    assert len(cracks(wall).width) == 0


def test_neighbours_along_a_bed_are_one_and_beds_a_course_apart_are_two():
    wall = Pattern()
    for i in range(3, 9):
        wall.open("bed", i, 4, 0.5 * MM)
        wall.open("bed", i, 5, 0.7 * MM)
    assert cracks(wall).joints.tolist() == [6, 6]
    wall.open("head", 4, 4, 0.1 * MM)  # joins them
    assert cracks(wall).joints.tolist() == [13]


def test_width_is_the_largest_opening_and_its_place_is_the_crack_s():
    wall = Pattern(origin=(3.0, 1.0))
    wall.open("head", 4, 2, (1 * MM, 2 * MM, 3 * MM))  # tangent of a perpend points down: widest at its foot
    wall.open("bed", 4, 3, (0.3 * MM, 0.2 * MM, 0.1 * MM))
    found = cracks(wall)
    assert found.width.tolist() == [3 * MM]
    assert found.x[0] == pytest.approx(3.0 + 4 * HALF)
    assert found.y[0] == pytest.approx(1.0 + 2 * COURSE)


def test_partly_cracked_joint_counts_where_it_is_cracked():
    wall = Pattern()
    wall.open("bed", 4, 3, (2 * MM, 1 * MM, 0.5 * MM))
    wall.cracked[wall.place("bed", 4, 3), 0] = False
    assert cracks(wall).width.tolist() == [1 * MM]


# -- real walls: every corner must be found, wherever rounding puts it -----------------------------------------------


def joint_map(scene: Scene) -> JointMap:
    face = wall_geometry(scene).interfaces
    x = face.x[:, None] + face.normal_y[:, None] * face.contact_offset
    y = face.y[:, None] - face.normal_x[:, None] * face.contact_offset
    normal = np.column_stack((face.normal_x, face.normal_y))
    return JointMap.from_contacts(x, y, face.contact_area / scene.wall.thickness, normal, face.kind)


@pytest.mark.parametrize(
    "scene",
    [
        Scene(),
        Scene(wall=Wall(length=6.4)),  # 75 mm are a half-integer multiple of 1e-7 of 6.4 m
        Scene(wall=Wall(length=12.8, height=2.7)),
        Scene(wall=Wall(length=5.37, height=2.31)),
        Scene(wall=Wall(length=10.24, block_height=0.08, height=2.56)),
        Scene(wall=Wall(length=3.3), opening=(Opening(x=1.13, y=0.91, width=0.87, height=0.83),)),
    ],
    ids=lambda s: f"{s.wall.length}x{s.wall.height}",
)
def test_joints_that_meet_share_a_corner(scene: Scene):
    joints = joint_map(scene)
    points = np.concatenate((joints.start, joints.end))
    pairs = cKDTree(points).query_pairs(1e-6, output_type="ndarray")
    graph = coo_array((np.ones(len(pairs)), pairs.T), shape=(len(points),) * 2)
    expected, _ = connected_components(graph, directed=False)
    assert joints.corners.shape[1] == expected
    # all joints cracked are one crack
    shape = joints.contact_x.shape
    found = find_cracks(joints, np.full(shape, 1 * MM), np.zeros(shape), np.ones(shape, dtype=bool))
    assert len(found.width) == 1
    assert found.joints[0] == joints.is_wall.sum()
