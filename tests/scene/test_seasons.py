"""Seasons: the movements against closed forms, stages that follow, seeds, and studies that replay."""

from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from damagepred import InputError, Scene, Study, open_study
from damagepred.campaign.replay import replay
from damagepred.campaign.settings import StudySettings
from damagepred.enumerations import SampleStatus
from damagepred.results.tables import path_columns, year_columns, year_frame
from damagepred.scene import Seasons, SeasonStep
from damagepred.uq.estimate import probability

SMALL = {"wall": {"length": 1.44, "height": 0.6}, "dpc": {"course": 2}}


def many(years: int = 40, count: int = 600, **keys: object) -> np.ndarray:
    """Return the movements of many seeds (seeds, years, 2)."""
    return np.array([Seasons(years=years, seed=k, **keys).movements() for k in range(count)]).reshape(count, years, 2)


def test_a_leak_comes_stays_and_goes() -> None:
    leak = SeasonStep(year=1, movement="6 mm", rise=1, end=3)
    found = Seasons(years=4, swing=0, trend=0, step=(leak,)).movements()
    np.testing.assert_allclose(1e3 * found, [0, 0, 3, 6, 6, 0, 0, 0], atol=1e-12)


def test_a_step_comes_in_its_share_of_the_samples() -> None:
    rare = SeasonStep(year=1, movement="6 mm", rise=0, probability=0.25)
    found = many(years=2, count=2000, swing="1 mm", swing_cov=0, step=(rare,))
    assert (found[:, 1, 0] > 5e-3).mean() == pytest.approx(0.25, abs=0.03)


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


def test_jacks_do_not_pull() -> None:
    with pytest.raises(InputError, match="jacks push one way"):
        Scene.from_dict({"movement": {"shape": "jacks", "seasons": {"years": 2}}})


@pytest.mark.thorough
def test_a_sampled_wall_keeps_the_swing_of_the_file() -> None:
    """Without a soil log no other number determines the swing."""
    seasons = {"years": 30, "swing": "48 mm", "trend": "24 mm"}
    scene = Scene.from_dict({"mound": {"shape": "walsh"}, "movement": {"shape": "mound", "seasons": seasons}})
    sampled = scene.with_values({"joint.friction": 0.7})
    assert sampled.movement == scene.movement
    assert sampled.mound.surface_movement == scene.mound.surface_movement > 40e-3
    assert scene.with_values({"movement.seasons.swing": 0.06}).movement.seasons.swing == 0.06


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


def test_categories_by_year_so_far_and_now() -> None:
    """Of four walls one has closed again by year 2, so that one in two has been damaged, and one in four is."""
    ds = of_years([[0, 1, 0], [0, 0, 2], [0, 0, 0], [0, 0, 0]])
    rows = {c.name: [cell.split()[0] for cell in c.cells] for c in year_columns(ds)}
    assert rows["category 1 or worse so far"] == ["0.25", "0.50"]
    assert rows["category 1 or worse now"] == ["0.25", "0.25"]
    assert rows["category 2 or worse so far"] == ["0.00", "0.25"]
    frame = year_frame(ds)
    assert frame.loc[(1, 2.0)]["so_far"] == 0.5
    assert frame.loc[(2, 2.0)]["now"] == 0.25
    assert frame["so_far"].between(frame["so_far_lower"], frame["so_far_upper"]).all()
    band = probability(np.array([1.0, 1.0, 0.0, 0.0]))
    cell = next(c for c in year_columns(ds) if c.name == "category 1 or worse so far").cells[1]
    assert cell == f"0.50 ({band.lower:.2f} to {band.upper:.2f})"


def test_a_wall_that_was_not_followed_counts_by_what_it_reached() -> None:
    ds = of_years([[0, 1, -1], [0, 0, 0]])
    rows = {c.name: [cell.split()[0] for cell in c.cells] for c in year_columns(ds)}
    assert rows["category 1 or worse so far"] == ["0.50", "0.50"]
    assert rows["category 1 or worse now"] == ["0.50", "–"]
    assert np.isnan(year_frame(ds).loc[(1, 2.0)]["now"])
    failed = of_years([[0, 4, -1]], SampleStatus.FAILED)
    both = xr.concat([ds, failed], "sample")
    assert [c.cells for c in year_columns(both)] == [c.cells for c in year_columns(ds)]


def test_defaults_of_seasons_are_named_with_their_units_and_those_given_are_not():
    from damagepred.scene.assumed import assumed_seasons

    given = {"movement": {"seasons": {"years": 3}}}
    default = Scene.from_dict(given).movement.seasons
    said = assumed_seasons(Scene.from_dict(given))
    assert f"a mean swing of {1e3 * default.swing:g} mm" in said
    assert default.swing < 1.0  # m
    given["movement"]["seasons"]["swing"] = "7 mm"
    assert not any("mean swing" in line for line in assumed_seasons(Scene.from_dict(given)))
    assert not any("swing of" in one for one in assumed_seasons(Scene.from_dict(given), ["movement.seasons.swing_cov"]))
