"""Archives judged again under other rules: what comes out is what solving again under these rules would give."""

import dataclasses
import tomllib
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import damagepred
from damagepred.archive.files import write_dataset
from damagepred.archive.schema import category_attributes
from damagepred.campaign.settings import StudySettings
from damagepred.damage import load_table
from damagepred.errors import InputError
from damagepred.results.rejudge import footing_gap_note
from damagepred.scene import Damage, Dpc, Joint, Movement, Opening, Scene, Wall
from damagepred.study import Study, open_study
from tests.conftest import SMALL_STUDY

MM = 1e-3
OLD = Path(__file__).parents[1] / "archive" / "version_1"


def study(width: list, group: list | None = None, status: list | None = None, category: list | None = None):
    """A synthetic study: widths (mm) on (sample, increment); of all groups the same width."""
    wide = np.array(width, dtype=np.float64) * MM
    table = load_table("as2870")
    known = np.where(np.isfinite(wide), table.by_width(np.nan_to_num(wide)), -1)
    known = known if category is None else np.array(category)
    both = ("sample", "increment")
    ds = xr.Dataset(
        {
            "crack_width_max": (both, wide),
            "damage_category": (both, known.astype(np.int8), category_attributes(table.category_names, "")),
            "status": ("sample", np.array(status or [0] * len(wide), dtype=np.int8)),
            "group_count": ("group_count", [2, 3, 4, 5]),
        },
        attrs={"damage_table": table.name, "highest_category": 4},
    )
    if group is not None:
        widths = np.repeat(np.array(group, dtype=np.float64)[..., None] * MM, 4, axis=-1)
        ds["crack_group_width"] = ((*both, "group_count"), widths)
    return ds


def again(ds: xr.Dataset, **rules) -> list:
    return damagepred.judge_again(ds, **rules)["damage_category"].values.tolist()


@pytest.mark.parametrize(("plasterboard", "limit"), [(False, 3.0), (True, 4.5)])
def test_groups_at_their_edge(plasterboard: bool, limit: float):
    group = [[limit * (1 - 1e-6), limit, limit * (1 - 1e-15), limit + 1e-6]]
    ds = study([[4.6] * 4], group)
    assert again(ds, plasterboard=plasterboard) == [[2, 3, 3, 3]]
    assert again(ds, plasterboard=plasterboard, count_rule=False) == [[2] * 4]


def test_the_worst_category_so_far_follows_the_new_limits():
    ds = study([[0.2, 4.0, 0.05], [0.2, 0.05, np.nan]], [[0.0] * 3] * 2)
    ds["damage_category_worst"] = ds["damage_category"].copy(data=np.array([[1, 2, 2], [1, 1, 1]], dtype=np.int8))
    finer = dataclasses.replace(load_table("as2870"), limits=(0.04e-3, 0.1e-3, 3e-3, 5e-3))
    judged = damagepred.judge_again(ds, table=finer)
    assert judged["damage_category"].values.tolist() == [[2, 3, 1], [2, 1, -1]]
    assert judged["damage_category_worst"].values.tolist() == [[2, 3, 3], [2, 2, -1]]
    at_end = ds.drop_vars("damage_category_worst").assign(damage_category_worst=("sample", np.int8([2, 1])))
    left = damagepred.judge_again(at_end, table=finer)
    assert "damage_category_worst" not in left
    assert "damage_category_worst is left out" in left.attrs["judgement"]


def test_a_table_of_one_s_own(tmp_path: Path):
    text = (Path(damagepred.__file__).parent.parent / "data" / "damage" / "as2870.toml").read_text()
    own = tmp_path / "mine.toml"
    own.write_text(text.replace("from = 5.0e-3", "from = 4.0e-3").replace("AS 2870-2011 Table C1", "mine"))
    judged = damagepred.judge_again(study([[4.0]], [[0.0]]), table=own)
    assert judged["damage_category"].values.tolist() == [[3]]
    assert judged.attrs["damage_table"] == "mine"
    own.write_text(text.replace("number = 2", "number = 7"))
    with pytest.raises(InputError, match=r"mine\.toml: is no damage table \(categories must be numbered"):
        again(study([[4.0]]), table=own)
    own.write_text(text.replace("from = 5.0e-3", "from = 0.5e-3"))
    with pytest.raises(InputError, match="the limits must grow"):
        again(study([[4.0]]), table=own)
    own.write_text("name = 1")
    with pytest.raises(InputError, match="lacks 'category'"):
        again(study([[4.0]]), table=own)


@pytest.mark.parametrize(
    ("rules", "words"),
    [
        ({"table": "as2780"}, "as2870 or bre251"),
        ({"table": "bre251", "plasterboard": True}, "no such allowance"),
        ({"group_distance": 0.5}, "group_distance = 0.5: this archive was judged with 1 m"),
        ({"dpc_threshold": 2e-3}, "dpc_threshold = 0.002"),
        ({"group_count": 1}, "group_count = 1: must be at least 2"),
    ],
)
def test_what_cannot_be_is_said(rules: dict, words: str):
    with pytest.raises(InputError, match=words):
        again(study([[4.0]], [[0.0]]), **rules)
    with pytest.raises(InputError, match="no variable 'crack_width_max'"):
        again(study([[4.0]]).drop_vars("crack_width_max"))


def test_no_values_beyond_the_end_of_a_path():
    nan = np.nan
    ds = study(
        [[0.0, 16.0, nan], [0.0, 30.0, nan], [0.0, 2.0, 3.0], [0.0, 1.5, nan], [0.0, 6.0, nan]],
        np.zeros((5, 3)),
        status=[0, 0, 0, 1, 0],  # the fourth fell down in increment 1
        category=[[0, 4, 4], [0, 4, 4], [0, 2, 2], [0, 4, 4], [0, 3, -1]],  # the fifth's jacks were unloaded
    )
    judged = damagepred.judge_again(ds, table="bre251")
    assert judged["damage_category"].values.tolist() == [[0, 4, -1], [0, 5, 5], [0, 2, 2], [0, 5, 5], [0, 3, -1]]
    assert judged.attrs["highest_category"] == 4  # none is known to 5 but by chance
    assert "of 1 of 5 walls the category is not known beyond the end of their paths" in judged.attrs["judgement"]
    assert "all are known up to category 4" in judged.attrs["judgement"]
    assert again(ds) == ds["damage_category"].values.tolist()  # by its own rules as it was
    # limits that are stricter are all known: 16 and 30 mm are beyond the highest
    strict = damagepred.judge_again(ds, plasterboard=True)
    assert strict["damage_category"].values.tolist() == [[0, 3, -1], [0, 4, 4], [0, 2, 2], [0, 4, 4], [0, 2, -1]]
    assert strict.attrs["highest_category"] == 3


def test_what_an_older_archive_does_not_hold_is_said():
    ds = open_study(OLD)
    judged = damagepred.judge_again(ds, table="bre251")
    assert "2 of 3 walls are judged by their widest crack alone" in judged.attrs["judgement"]
    assert "no deviation from level and plumb" in judged.attrs["judgement"]
    by_width = load_table("bre251").by_width(np.nan_to_num(ds["crack_width_max"].values))
    known = np.isfinite(ds["crack_width_max"].values)
    np.testing.assert_array_equal(judged["damage_category"].values[known], by_width[known])
    assert "widest crack alone" not in damagepred.judge_again(ds, count_rule=False).attrs["judgement"]
    assert "no crack bands: the archive does not hold their widths" in judged.attrs["judgement"]
    assert "no gap along the footing bed" in judged.attrs["judgement"]
    assert "damage_category_band" not in judged
    for rules, name in (
        ({"measure": "band"}, "crack_band_width_max"),
        ({"count_footing_gap": True}, "footing_opening_max"),
    ):
        with pytest.raises(InputError, match=f"of an older version, does not hold {name}"):
            damagepred.judge_again(ds, **rules)


def run(folder: Path, rules: str, movement: str = "path") -> xr.Dataset:
    text = SMALL_STUDY.replace("stop_at_category = 4", f'stop_at_category = "none"\nmovement = "{movement}"')
    settings = tomllib.loads(text)
    settings["scene"]["damage"] = tomllib.loads(rules)
    with ThreadPoolExecutor(1) as executor:
        Study(StudySettings.from_dict(settings)).run(folder, samples=4, executor=executor)
    return open_study(folder)


@pytest.mark.quick_cases
@pytest.mark.parametrize("movement", ["path", "sampled", "both"])
def test_a_study_judged_again_is_a_study_run_by_these_rules(tmp_path: Path, movement: str):
    first = run(tmp_path / "first", "count_rule = false", movement)
    second = run(tmp_path / "second", 'table = "bre251"\ngroup_count = 3\n', movement)
    judged = damagepred.judge_again(first, table="bre251", count_rule=True, group_count=3)
    for name in ("damage_category", "end_damage_category", "crack_group_width", "end_crack_group_width"):
        assert (name in second) == (name in judged)
        if name in second:
            np.testing.assert_array_equal(judged[name].values, second[name].values)
    assert str(judged["damage_category"].attrs) == str(second["damage_category"].attrs)
    assert judged.attrs["damage_table"] == second.attrs["damage_table"]
    assert judged.attrs["highest_category"] == second.attrs["highest_category"] == 5
    assert first["damage_category"].attrs["flag_meanings"].endswith("severe")  # what was given is not changed
    assert "very_severe" not in first["damage_category"].attrs["flag_meanings"]
    write_dataset(judged, tmp_path / "judged.nc")
    back = open_study(tmp_path / "judged.nc")
    np.testing.assert_array_equal(back["damage_category"].values, judged["damage_category"].values)
    if movement == "path":
        assert np.isfinite(judged["tilt_max"].values).all()
        assert set(np.unique(judged["deviation_level"].values)) <= {0, 1, 2}


WEAK = Scene(
    wall=Wall(length=2.4, height=0.6),
    opening=(Opening(x=0.96, y=0.15, width=0.48, height=0.3),),
    joint=Joint(tensile_strength=1e3, cohesion=3e3),
    movement=Movement(kind="doming", central_deflection=30 * MM, increments=6),
)


@pytest.fixture(scope="module")
def wall() -> xr.Dataset:
    return damagepred.solve(WEAK)


GAP = "; it counts with [damage] count_footing_gap = true, or judge --footing-gap"


def test_a_gap_that_would_count_is_told_where_it_is_worse_than_the_cracks():
    """Not by its width at the end, where cracks are as bad; nothing where it counts, or where it is not known."""
    scene = {"scene": Scene(wall=Wall(length=2.4, height=0.6)).to_toml()}
    ds = study([[0.0, 0.5, 2.0, 16.0, np.nan], [0.0, 0.5, 0.6, 0.7, 0.8], [0.0, 2.0, 3.0, 4.0, 4.5]])
    ds["damage_category"].values[0, 4] = -1
    gap = [[0.0, 3.0, 6.0, 12.0, np.nan], [0.0, 0.05, 0.5, 0.9, 0.95], [0.0, 0.5, 2.0, 4.0, 6.0]]
    ds["footing_opening_max"] = ("sample", "increment"), np.array(gap) * MM
    ds = ds.assign_attrs(scene)
    of_walls = "in 2 of 3 walls the gap along the bed on the footing is of a higher category than the cracks"
    assert footing_gap_note(ds) == of_walls + GAP
    one = ds.isel(sample=0).assign_attrs(scene)
    assert footing_gap_note(one) == "the bed on the footing opens by 6 mm, which would be category 3" + GAP
    assert footing_gap_note(ds.isel(sample=1)) == ""
    for other in (
        ds.drop_vars("footing_opening_max"),
        ds.assign_attrs(scene=Scene(damage=Damage(count_footing_gap=True)).to_toml(), count_footing_gap=1),
        ds.assign_attrs(scene=Scene(dpc=Dpc(course=1)).to_toml()),
    ):
        assert footing_gap_note(other) == ""


def test_a_wall_without_its_contacts_is_judged_by_its_numbers(wall: xr.Dataset):
    bare = wall.drop_dims(["contact", "block", "vertex"])
    for rules in ({"table": "bre251"}, {"plasterboard": True}, {"count_rule": False}, {"group_count": 4}):
        assert again(bare, **rules) == again(wall, **rules)
