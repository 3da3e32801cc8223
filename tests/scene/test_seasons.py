"""Seasons: the movements against closed forms, stages that follow, seeds, and studies that replay."""

from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from damagepred import Scene, Study, open_study
from damagepred.campaign.replay import replay
from damagepred.campaign.settings import StudySettings
from damagepred.enumerations import SampleStatus
from damagepred.errors import InputError
from damagepred.results.tables import path_columns, year_columns, year_frame
from damagepred.scene import Seasons, SeasonStep

SMALL = {"wall": {"length": 1.44, "height": 0.6}, "dpc": {"course": 2}}


def test_a_leak_comes_stays_and_goes() -> None:
    leak = SeasonStep(year=1, movement="6 mm", rise=1, end=3)
    found = Seasons(years=4, swing=0, trend=0, step=(leak,)).movements()
    np.testing.assert_allclose(1e3 * found, [0, 0, 3, 6, 6, 0, 0, 0], atol=1e-12)


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({"swing": 0}, "nothing moves"),
        ({"years": 0}, "years"),
        ({"correlation": 1.0}, "correlation"),
        ({"step": [{"year": 1}]}, "movement"),
    ],
)
def test_wrong_seasons_are_named(keys: dict, words: str) -> None:
    with pytest.raises(InputError, match=words):
        Scene.from_dict({"movement": {"seasons": keys}})


@pytest.mark.thorough
def test_each_sample_of_a_study_has_seasons_of_its_own_and_replays(tmp_path: Path) -> None:
    tables = {
        "scene": {**SMALL, "movement": {"seasons": {"years": 2, "swing": "4 mm", "increments": 2}}},
        "study": {"samples": 3, "seed": 5},
        "variables": {"joint.friction": {"distribution": "uniform", "lower": 0.6, "upper": 0.8}},
    }
    settings = StudySettings.from_dict(tables, source="study")
    Study(settings).run(tmp_path / "a.dp", samples=2)
    Study(settings).run(tmp_path / "a.dp", samples=3)
    Study(settings).run(tmp_path / "b.dp", samples=3)
    first, again = open_study(tmp_path / "a.dp"), open_study(tmp_path / "b.dp")
    np.testing.assert_array_equal(first["central_deflection"], again["central_deflection"])
    assert len(np.unique(first["central_deflection"].values[:, 2])) == 3  # the ends of the first half year
    worst = first["damage_category_worst"].values
    assert worst.dtype == np.int8
    assert (worst == np.maximum.accumulate(first["damage_category"].values, axis=1)).all()
    ds, comparison = replay(tmp_path / "a.dp", 1)
    assert comparison.startswith("bit for bit")
    np.testing.assert_array_equal(ds["central_deflection"], first["central_deflection"].values[1])
    rows = {c.name: list(c.cells) for c in year_columns(first)}
    assert rows["year"] == ["1", "2"]
    wall = {c.name: c for c in path_columns(ds)}
    assert wall["time"].cells[-1] == "2.00"
    assert int(wall["worst category so far"].cells[-1]) == ds["damage_category"].values.max()


def of_years(category: list[list[int]], status: SampleStatus = SampleStatus.COMPLETE) -> xr.Dataset:
    """Return a study of walls whose category is known after 0, 1, 2 ... years; the width is lost where it is -1."""
    found = np.array(category, dtype=np.int8)
    both = ("sample", "increment")
    return xr.Dataset(
        {
            "damage_category": (both, found),
            "crack_width_max": (both, np.where(found < 0, np.nan, 1e-3 * found)),
            "time": (both, np.tile(np.arange(found.shape[1], dtype=float), (len(found), 1))),
            "status": ("sample", np.full(len(found), status, dtype=np.int8)),
        }
    )


def test_a_wall_that_was_not_followed_counts_by_what_it_reached() -> None:
    ds = of_years([[0, 1, -1], [0, 0, 0]])
    rows = {c.name: [cell.split()[0] for cell in c.cells] for c in year_columns(ds)}
    assert rows["category 1 or worse so far"] == ["0.50", "0.50"]
    assert rows["category 1 or worse now"] == ["0.50", "–"]
    assert np.isnan(year_frame(ds).loc[(1, 2.0)]["now"])
    failed = of_years([[0, 4, -1]], SampleStatus.FAILED)
    both = xr.concat([ds, failed], "sample")
    assert [c.cells for c in year_columns(both)] == [c.cells for c in year_columns(ds)]
