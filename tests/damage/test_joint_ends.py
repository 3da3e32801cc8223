"""Widest openings are those at the ends of joints, wherever the contacts lie."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import damagepred
from damagepred.assembly import wall_model
from damagepred.damage import Growth, JointMap, judge
from damagepred.damage.growth import BELOW_DPC, DPC_OPENING, WALL
from damagepred.enumerations import ContactKind
from damagepred.one_wall.judged_path import joint_map
from damagepred.plotting.footing import opening_along
from damagepred.plotting.geometry import Faces
from damagepred.scene import Damage, Dpc, Joint, Movement, Scene, Solver, Wall
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
    scene = Scene(
        wall=Wall(length=1.2, height=0.45),
        dpc=None if dpc is None else Dpc(course=dpc),
        joint=DRY,
        solver=Solver(**rule),
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


@pytest.mark.quick_cases
@pytest.mark.parametrize("rule", [("midpoint", 2, None), ("midpoint", 1, 4)])
def test_archives_pictures_and_cracks_read_the_same_widest_opening(rule: tuple[Any, int, int | None]):
    """The archive, the archive judged again, the pictures and the cracks as objects agree on an opened dpc."""
    ds = damagepred.solve(
        Scene(
            wall=Wall(length=1.44, height=0.45),
            dpc=Dpc(course=2),
            joint=DRY,
            movement=Movement(kind="doming", central_deflection=6e-3, increments=4),
            solver=Solver(quadrature=rule[0], contacts_per_interface=rule[1], no_tension_subdivisions=rule[2]),
        )
    )
    widest = ds["dpc_opening_max"].values
    assert (
        widest[1:] > 1.001 * ds["contact_opening"].values[1:, ds["contact_kind"].values == ContactKind.DPC].max(axis=1)
    ).all()
    again = damagepred.judge_again(ds)
    assert again["dpc_opening_max"].values == pytest.approx(widest, rel=1e-9)
    assert again["crack_width_max"].values == pytest.approx(ds["crack_width_max"].values, rel=1e-9)
    place, opening, _ = opening_along(ds)
    assert opening.max(axis=1).clip(0.0) == pytest.approx(widest, rel=1e-9)
    assert (np.diff(place) > -1e-9).all()
    assert (place[0], place[-1]) == pytest.approx((0.0, 1.44))
    faces = Faces.of(ds, -1)
    assert faces.opening[faces.is_dpc].max() == pytest.approx(widest[-1], rel=1e-9)
    cracks = damagepred.cracks(ds).isel(increment=-1)
    of_dpc = cracks["crack_part"].values == DPC_OPENING
    assert np.nanmax(cracks["crack_width"].values[of_dpc]) == pytest.approx(widest[-1], rel=1e-9)
