"""Properties of the verdict for any pattern of cracks."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from damagepred.damage import HAIRLINE
from damagepred.damage.cracks import find_cracks
from damagepred.damage.judge import judge
from damagepred.damage.tracing import WALL, Growth
from damagepred.scene import Damage
from tests.damage.pattern import Pattern, rules_of

WIDTHS = st.floats(0.0, 30e-3)


@st.composite
def cracked_walls(draw: st.DrawFn) -> Pattern:
    wall = Pattern(columns=12, rows=8, dpc=draw(st.sampled_from([None, 2])))
    names = sorted(wall.lines)
    for name in draw(st.lists(st.sampled_from(names), max_size=25, unique=True)):
        wall.open(*name, draw(st.tuples(WIDTHS, WIDTHS, WIDTHS)))
    for name in draw(st.lists(st.sampled_from(names), max_size=5, unique=True)):
        wall.slide(*name, draw(st.floats(-5e-3, 5e-3)))
    return wall


SETTINGS = settings(max_examples=60, deadline=None, derandomize=True)


@SETTINGS
@given(cracked_walls())
def test_verdict_and_cracks_agree(wall: Pattern):
    verdict = wall.judge()
    found = find_cracks(wall.map, wall.opening, wall.slip, wall.cracked)
    assert (np.diff(found.width) <= 0).all()
    if verdict.crack_width_max > 0.05e-3:
        assert found.width[0] == verdict.crack_width_max
    # groups can only add, and only up to moderate
    plain = wall.judge(Damage(count_rule=False)).damage_category
    assert verdict.damage_category in (plain, max(plain, 3))
    assert plain == sum(verdict.crack_width_max >= limit for limit in (0.1e-3, 1e-3, 5e-3, 15e-3))


@SETTINGS
@given(cracked_walls(), st.randoms(use_true_random=False))
def test_the_order_of_joints_does_not_matter(wall: Pattern, random):
    order = list(range(len(wall.map.kind)))
    random.shuffle(order)
    joints = dataclasses.replace(
        wall.map, **{f.name: getattr(wall.map, f.name)[order] for f in dataclasses.fields(wall.map)}
    )
    again = judge(joints, wall.opening[order], wall.slip[order], wall.cracked[order], rules_of(Damage()))
    expected = wall.judge()
    for name, value in expected._asdict().items():
        assert getattr(again, name) == pytest.approx(value, rel=1e-12, abs=1e-9 if name.endswith("length") else 0), name


@SETTINGS
@given(cracked_walls())
def test_every_piece_beyond_the_hairline_is_of_one_crack(wall: Pattern):
    found = Growth(wall.map).step(0, wall.opening, wall.slip, wall.cracked)
    own = [one.crack for one in found if one.part == WALL]
    pieces = np.concatenate([c.pieces for c in own] or [np.empty(0, dtype=int)])
    beyond = (wall.cracked & (wall.opening > HAIRLINE)) | (np.abs(wall.slip) > HAIRLINE)
    assert sorted(pieces) == np.flatnonzero((beyond & wall.map.is_wall[:, None]).ravel()).tolist()
    assert [one.number for one in found] == list(range(1, len(found) + 1))
    for crack in own:
        assert (np.abs(crack.width) <= crack.displacement * (1 + 1e-9)).all()
        assert (crack.displacement >= crack.opening).all()
        steps = np.hypot(*np.diff(crack.path, axis=0).T)
        assert steps.sum() <= crack.length * (1 + 1e-9)
        assert -90 < crack.inclination <= 90
    if own and max(c.opening.max() for c in own) > 0:
        assert own[0].opening.max() == wall.judge().crack_width_max
