"""Limits of damage tables and scales exactly at their edges, groups, plasterboard, joints that do not count."""

from pathlib import Path

import numpy as np
import pytest

from damagepred.damage import deviation_limits, load_strain_table, load_table, read_table, sticking_limits
from damagepred.damage.cracks import Cracks, group_widths
from damagepred.damage.limits import load_scale
from damagepred.errors import InputError
from damagepred.scene import Damage, Scene
from tests.damage.pattern import Pattern, rules_of

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
    ("table", "limit", "below", "above"), [("as2870", *row) for row in AS2870] + [("bre251", *row) for row in BRE251]
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


@pytest.fixture
def on_dpc() -> Pattern:
    return Pattern(columns=50, rows=12, dpc=2)


def test_a_dpc_that_never_held_counts_as_open_without_having_cracked(on_dpc: Pattern):
    on_dpc.open("bed", 20, 2, 4 * MM)
    on_dpc.cracked[:] = False
    assert on_dpc.judge().dpc_opening_max == pytest.approx(4 * MM)


def test_a_dpc_under_pressure_is_closed(on_dpc: Pattern):
    on_dpc.opening[on_dpc.map.is_dpc] = -0.1 * MM
    assert on_dpc.judge().dpc_opening_max == 0.0


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


SCALES = {
    "width": (load_table("as2870").by_width, load_table("as2870").limits),
    "psi": (load_scale("psi").level, load_scale("psi").limits),
    "slope": (deviation_limits().level, deviation_limits().limits),
    "sticking": (lambda angle: sticking_limits().level(angle, 0.0 * angle, 0.0 * angle), sticking_limits().angle),
}


@pytest.mark.parametrize("name", SCALES)
def test_what_is_unknown_has_no_level(name: str):
    level, limits = SCALES[name]
    assert level(np.array([np.nan, 2.0 * limits[-1]])).tolist() == [-1, len(limits)]


def test_a_strain_that_meets_a_limit_has_the_category_below():
    table = load_strain_table()
    strain = np.array(table.limits)
    assert table.by_strain(strain).tolist() == [0, 1, 2, 3]
    assert table.by_strain(strain * (1 + 1e-10)).tolist() == [0, 1, 2, 3]
    assert table.by_strain(strain * (1 + 1e-6)).tolist() == [1, 2, 3, 4]
    assert table.by_strain([np.nan]).tolist() == [-1]
