"""Limits of AS 2870 and BRE 251 exactly at their edges, groups, plasterboard, and joints that do not count."""

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from damagepred.assembly import wall_model
from damagepred.damage import Cracks, group_widths, load_table
from damagepred.damage.cracks import find_cracks
from damagepred.damage.table import read_table
from damagepred.errors import InputError
from damagepred.one_wall.judged_path import joint_map
from damagepred.scene import Damage, Dpc, Scene, Solver, Wall
from tests.damage.pattern import COURSE, Pattern, rules_of

MM = 1e-3


def single(width: float) -> Cracks:
    return some([(width, 1.0, 1.0)])


def some(cracks: list[tuple[float, float, float]]) -> Cracks:
    width, x, y = (np.array(v) for v in zip(*sorted(cracks, reverse=True)))
    return Cracks(width, x, y, np.ones(len(width), dtype=np.int64), width, np.ones(len(width)))


def category(cracks: Cracks, **settings) -> int:
    rules = rules_of(Damage(**settings))
    group = group_widths(cracks, rules.group_distance, (rules.group_count,))[0] if rules.count_rule else 0.0
    return int(rules.table.by_width_and_group(cracks.width.max(initial=0.0), group))


# width, category below, category at the limit and above
AS2870 = [(0.1, 0, 1), (1.0, 1, 2), (5.0, 2, 3), (15.0, 3, 4), (25.0, 4, 4)]
BRE251 = [(0.1, 0, 1), (1.0, 1, 2), (5.0, 2, 3), (15.0, 3, 4), (25.0, 4, 5)]


@pytest.mark.parametrize(
    ("table", "limit", "below", "above"),
    [("as2870", *row) for row in AS2870] + [("bre251", *row) for row in BRE251],
)
def test_limits(table: str, limit: float, below: int, above: int):
    assert category(single(limit * MM * (1 - 1e-6)), table=table) == below
    assert category(single(limit * MM), table=table) == above
    assert category(single(limit / 1000), table=table) == above  # however the number was computed
    assert category(single(limit * MM * (1 - 1e-15)), table=table) == above
    assert category(single(limit * MM * (1 + 1e-6)), table=table) == above


@pytest.mark.parametrize(("limit", "below", "above"), AS2870[:4])
def test_plasterboard_raises_the_limits_by_half(limit: float, below: int, above: int):
    assert category(single(1.5 * limit * MM * (1 - 1e-6)), plasterboard=True) == below
    assert category(single(1.5 * limit * MM), plasterboard=True) == above
    assert category(single(limit * MM), plasterboard=True) == below


def test_plasterboard_with_bre_is_refused():
    with pytest.raises(InputError, match=r"damage: plasterboard = true: table 'bre251' has no such allowance.*as2870"):
        Scene.from_dict({"damage": {"table": "bre251", "plasterboard": True}})
    with pytest.raises(InputError, match="BRE Digest 251 has no such allowance"):
        load_table("bre251").with_plasterboard()


def test_unknown_table_names_those_there_are():
    with pytest.raises(InputError, match=r"'as2780': take as2870 or bre251.*mean 'as2870'"):
        load_table("as2780")
    with pytest.raises(InputError, match=r"'as2870' or 'bre251'"):
        Scene.from_dict({"damage": {"table": "as2780"}})


@pytest.mark.parametrize("name", ["as2870", "bre251"])
def test_tables_say_where_they_come_from(name: str):
    table = load_table(name)
    assert table.source
    assert table.category_names[:5] == ("negligible", "very slight", "slight", "moderate", "severe")
    assert table.highest == len(table.category_names) - 1
    assert (np.diff(table.limits) > 0).all()


# -- the group rule --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("cracks", "settings", "expected"),
    [
        ([(3, 0, 0)], {}, 2),  # a single one
        ([(3, 0, 0), (3, 0.8, 0.6)], {}, 3),  # 1.0 m apart
        ([(3, 0, 0), (3, 0.9, 0)], {}, 3),
        ([(3, 0, 0), (3, 1.2, 0)], {}, 2),
        ([(3, 0, 0), (3, 0, 1.2)], {}, 2),
        ([(3, 0, 0), (3, 1.0 + 1e-6, 0)], {}, 2),
        ([(3, 0, 0), (3, 0.5, 0)], {"count_rule": False}, 2),
        ([(3, 0, 0), (2.999, 0.5, 0)], {}, 2),  # not wide enough
        ([(4.9, 0, 0), (3, 0.5, 0)], {}, 3),
        ([(3, 0, 0), (3, 1.2, 0)], {"group_distance": 1.5}, 3),
        ([(3, 0, 0), (3, 0.9, 0)], {"group_count": 3}, 2),
        ([(3, 0, 0), (3, 0.9, 0), (3, -0.9, 0)], {"group_count": 3}, 3),  # around the middle one
        ([(3, 0, 0), (3, 0.9, 0), (3, 2.7, 0)], {"group_count": 3}, 2),
        ([(16, 0, 0), (3, 0.5, 0)], {}, 4),  # never makes it less
        ([(3, 0, 0), (3, 0.5, 0)], {"table": "bre251"}, 3),
        ([(3, 0, 0), (3, 0.5, 0)], {"plasterboard": True}, 2),  # the group starts at 4.5 mm
        ([(4.5, 0, 0), (4.5, 0.5, 0)], {"plasterboard": True}, 3),
        ([(0.9, 0, 0), (0.9, 0.1, 0), (0.9, 0.2, 0)], {}, 1),  # many fine cracks are fine cracks
    ],
)
def test_groups(cracks: list, settings: dict, expected: int):
    assert category(some([(w * MM, x, y) for w, x, y in cracks]), **settings) == expected


def test_a_group_may_make_the_highest_category_and_none_beyond(data_folder: Path, tmp_path: Path):
    """Two cracks of 3 mm are category 4 of 4 by a table that says so; category 5 there is none."""
    text = (data_folder / "damage" / "as2870.toml").read_text(encoding="utf-8")
    file = tmp_path / "strict.toml"
    file.write_text(text.replace("[group]\ncategory = 3", "[group]\ncategory = 4"), encoding="utf-8")
    table = read_table(file)
    assert [int(table.by_width_and_group(3 * MM, group * MM)) for group in (2.9, 3.0)] == [2, 4]
    file.write_text(text.replace("[group]\ncategory = 3", "[group]\ncategory = 5"), encoding="utf-8")
    with pytest.raises(InputError, match=r"group\.category"):
        read_table(file)


@pytest.mark.parametrize(("apart", "expected"), [(8, 3), (10, 2)])
def test_group_rule_on_a_wall(apart: int, expected: int):
    """8 half bricks are 0.96 m, 10 are 1.2 m."""
    wall = Pattern()
    wall.open("head", 4, 4, 3 * MM)
    wall.open("head", 4 + apart, 4, 3 * MM)
    verdict = wall.judge()
    assert verdict.damage_category == expected
    assert verdict.crack_count == 2
    assert wall.judge(Damage(count_rule=False)).damage_category == 2


# -- what is wall, what is base, what is dpc -------------------------------------------------------------------------


@pytest.fixture
def on_dpc() -> Pattern:
    return Pattern(columns=50, rows=12, dpc=2)


def test_the_dpc_is_no_crack(on_dpc: Pattern):
    for i in range(50):
        on_dpc.open("bed", i, 2, 20 * MM)
    verdict = on_dpc.judge()
    assert verdict.damage_category == 0
    assert verdict.crack_width_max == 0.0
    assert verdict.dpc_opening_max == pytest.approx(20 * MM)
    assert verdict.dpc_separation_length == pytest.approx(6.0)


def test_a_dpc_that_never_held_counts_as_open_without_having_cracked(on_dpc: Pattern):
    on_dpc.open("bed", 20, 2, 4 * MM)
    on_dpc.cracked[:] = False
    assert on_dpc.judge().dpc_opening_max == pytest.approx(4 * MM)


def test_a_dpc_under_pressure_is_closed(on_dpc: Pattern):
    on_dpc.opening[on_dpc.map.is_dpc] = -0.1 * MM
    assert on_dpc.judge().dpc_opening_max == 0.0


@pytest.mark.parametrize("way", [1, -1])
def test_slip_of_the_dpc_counts_either_way_and_that_of_other_joints_not(on_dpc: Pattern, way: int):
    on_dpc.slide("bed", 20, 2, 3 * way * MM)
    on_dpc.slide("bed", 21, 2, -2 * way * MM)
    on_dpc.slide("bed", 20, 3, 8 * way * MM)
    on_dpc.slide("bed", 20, 1, -9 * way * MM)
    assert on_dpc.judge().dpc_slip_max == pytest.approx(3 * MM)


def test_a_crack_above_and_one_below_are_not_joined(on_dpc: Pattern):
    on_dpc.open("head", 21, 1, 6 * MM)
    on_dpc.open("bed", 21, 2, 6 * MM)
    on_dpc.open("head", 22, 2, 2 * MM)
    verdict = on_dpc.judge()
    assert verdict.crack_width_max == pytest.approx(2 * MM)
    assert verdict.damage_category == 2
    assert verdict.base_crack_width_max == pytest.approx(6 * MM)


@pytest.mark.parametrize("dpc", [None, 2])
def test_a_gap_over_the_footing_is_no_crack(dpc: int | None):
    wall = Pattern(columns=50, dpc=dpc)
    for i in range(50):
        wall.open("bed", i, 0, 30 * MM)
    verdict = wall.judge()
    assert (verdict.damage_category, verdict.crack_width_max, verdict.base_crack_width_max) == (0, 0.0, 0.0)


def test_every_joint_is_one_of_wall_base_dpc_or_footing(on_dpc: Pattern):
    joints = on_dpc.map
    kinds = np.stack((joints.is_wall, joints.is_base, joints.is_dpc, joints.kind == 3))
    assert (kinds.sum(axis=0) == 1).all()
    assert joints.middle_y[joints.is_wall].min() > 2 * COURSE
    assert joints.middle_y[joints.is_base].max() < 2 * COURSE


# -- separation length -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("threshold", [0.1, 0.5, 1.0, 1.5])
def test_separation_length_of_a_triangular_gap(on_dpc: Pattern, threshold: float):
    """Gap 8 mm in the middle, straight down to nothing at the ends: open by more than w over L (1 - w/8)."""
    joints = on_dpc.map
    gap = 8 * MM * (1 - np.abs(joints.contact_x - 3.0) / 3.0)
    on_dpc.opening[joints.is_dpc] = gap[joints.is_dpc]
    verdict = on_dpc.judge(Damage(dpc_threshold=threshold * MM))
    assert verdict.dpc_separation_length == pytest.approx(6.0 * (1 - threshold / 8), rel=1e-12)
    assert verdict.dpc_opening_max == pytest.approx(8 * MM)


def test_exactly_the_threshold_is_not_more_than_it(on_dpc: Pattern):
    on_dpc.opening[on_dpc.map.is_dpc] = 1 * MM
    assert on_dpc.judge(Damage(dpc_threshold=1 * MM)).dpc_separation_length == 0.0


def test_of_joints_as_wide_as_each_other_the_place_decides_where_a_crack_is():
    wall = Pattern()
    for column in (4, 5, 6):
        wall.open("bed", column, 3, (2 * MM,) * 3)
    joints, order = wall.map, np.arange(len(wall.map.kind))[::-1]
    turned = dataclasses.replace(joints, **{f.name: getattr(joints, f.name)[order] for f in dataclasses.fields(joints)})
    one = find_cracks(joints, wall.opening, wall.slip, wall.cracked)
    other = find_cracks(turned, wall.opening[order], wall.slip[order], wall.cracked[order])
    assert (one.x[0], one.y[0], one.width[0]) == (other.x[0], other.y[0], 2 * MM)


@pytest.mark.parametrize("rule", [("midpoint", 2), ("midpoint", 3), ("midpoint", 7), ("lobatto", 2), ("lobatto", 3)])
@pytest.mark.parametrize("where", [0.02, 0.3, 0.5, 0.9, 0.99])
@pytest.mark.parametrize("kind", ["dpc", "footing"])
def test_the_opening_is_carried_to_the_ends_of_joints(rule: tuple[Any, int], where: float, kind: str):
    """A wall tilts as one block: its joint opens by theta (x - x_0), beyond w from x_0 + w/theta on, all the way."""
    scene = Scene(
        wall=Wall(length=1.2, height=0.3),
        dpc=Dpc(course=1) if kind == "dpc" else None,
        solver=Solver(quadrature=rule[0], contacts_per_interface=rule[1]),
    )
    model = wall_model(scene)
    joints, tilt = joint_map(model), 2e-3
    number = getattr(joints, kind)
    piece = number[np.argsort(joints.start[number, 0])[2]]
    ends = np.sort([joints.start[piece, 0], joints.end[piece, 0]])
    open_from = ends[0] + where * (ends[1] - ends[0])
    for threshold in (0.1 * MM, 1 * MM):
        opening = np.zeros_like(joints.contact_x)
        opening[number] = threshold + tilt * (joints.contact_x[number] - open_from)
        found = joints.profile(number).open_length(opening, threshold)
        assert found == pytest.approx(1.2 - open_from, rel=1e-9)
        mirrored = 2 * threshold - opening
        assert joints.profile(number).open_length(mirrored, threshold) == pytest.approx(open_from, rel=1e-9)


@pytest.mark.parametrize("count", [3, 5, 7])
def test_each_end_goes_on_as_the_contacts_beside_it(count: int):
    """A joint that gapes at both ends, theta |x - m| about its middle, is open by more than w but for 2 w / theta."""
    scene = Scene(
        wall=Wall(length=1.2, height=0.3),
        dpc=Dpc(course=1),
        solver=Solver(quadrature="midpoint", contacts_per_interface=count),
    )
    joints = joint_map(wall_model(scene))
    piece = joints.dpc[2]
    length = float(np.linalg.norm(joints.end[piece] - joints.start[piece]))
    middle = joints.contact_x[piece].mean()
    opening = np.full_like(joints.contact_x, -1.0)
    threshold, closed = 1 * MM, (1 - 0.5 / count) * length  # beyond the outermost contacts
    opening[piece] = 2 * threshold / closed * np.abs(joints.contact_x[piece] - middle)
    assert joints.dpc_profile.open_length(opening, threshold) == pytest.approx(length - closed, rel=1e-9)
