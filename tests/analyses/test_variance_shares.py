"""Crossed studies: the same walls and fields in every combination, and their shares of variance."""

import tomllib
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import damagepred
from damagepred.analyses.variance_shares import _output_of, crossed_study, study_sensitivity
from damagepred.campaign.sample import joint_places
from damagepred.campaign.settings import StudySettings
from damagepred.errors import InputError
from damagepred.study import Study
from tests.conftest import SMALL_STUDY
from tests.uq.test_fragility import FAILED, fail
from tests.uq.test_fragility import study as made_up


def settings(text: str = SMALL_STUDY, **changes: object) -> StudySettings:
    tables = tomllib.loads(text)
    tables["study"].update(changes)
    return StudySettings.from_dict(tables)


@pytest.mark.parametrize("sampler", ["sobol", "random", "lhs"])
def test_samples_come_in_fours(sampler: str) -> None:
    crossed = crossed_study(settings(sampler=sampler))
    design, places = crossed.design(), joint_places(crossed.scene)
    friction = design.wall_values(12)["joint.friction"].reshape(-1, 2, 2)
    np.testing.assert_array_equal(friction[:, :, 0], friction[:, :, 1])
    assert len(np.unique(friction)) == 6
    strength = np.array([design.joint_values(i, places)["joint.cohesion"] for i in range(12)]).reshape(3, 2, 2, -1)
    np.testing.assert_array_equal(strength[:, 0], strength[:, 1])
    assert len(np.unique(strength[:, 0, :, 0])) == 6


def test_both_walls_of_a_table_are_independent() -> None:
    """Points of Sobol's sequence that follow each other are not."""
    friction = crossed_study(settings()).design().wall_values(4 * 512)["joint.friction"].reshape(-1, 2, 2)[:, :, 0]
    assert abs(np.corrcoef(friction.T)[0, 1]) < 0.1
    # more samples keep the first ones
    more = crossed_study(settings()).design().wall_values(4 * 600)["joint.friction"]
    np.testing.assert_array_equal(more[: 4 * 512].reshape(-1, 2, 2)[:, :, 0], friction)


def test_a_crossed_study_runs_as_any_other_and_gives_its_shares(tmp_path: Path) -> None:
    crossed = crossed_study(settings(movement="path"))
    with ThreadPoolExecutor(1) as executor:
        Study(crossed).run(tmp_path / "small.dp", samples=24, executor=executor)
    ds = damagepred.open_study(tmp_path / "small.dp")
    found = study_sensitivity(ds, category=1, resamples=50)
    assert found.attrs["tables"] == 6
    assert found["group"].values.tolist() == ["wall", "joints"]
    assert float(found["group_first_order"].sum() + found["interaction"]) == pytest.approx(1.0)
    assert set(found["variable"].values) == {"joint.friction", "movement.central_deflection"}
    for name in ("spearman_lower", "partial", "first_order_error", "group_total_error"):
        assert np.isfinite(found[name]).all(), name
    assert np.isnan(found["group_total_upper"]).all()  # six tables are too few for an interval


def crossed_walls(tables: int, wall: float, joints: float, seed: int = 1, end: float = 20.0) -> xr.Dataset:
    """Capacities that depend on an input and on the joints, in a crossed design."""
    random = np.random.default_rng(seed)
    w, f = random.standard_normal((2, tables, 2))
    log = wall * w[:, :, None] + joints * f[:, None, :]
    ds = made_up(8.0 * np.exp(log.reshape(-1)), end=end, increments=400)
    x = np.repeat(w.reshape(-1), 2)
    return ds.assign({"joint.friction": ("sample", x, {"role": "input"})}).assign_attrs(crossed=1)


def test_shares_of_known_walls() -> None:
    """Ranks of a sum of normals: shares nearly those of the sum itself."""
    found = study_sensitivity(crossed_walls(800, 0.4, 0.2, end=60.0), category=1, resamples=100)
    np.testing.assert_allclose(found["group_first_order"], [0.8, 0.2], atol=0.05)
    assert abs(float(found["interaction"])) < 0.05
    # the one input holds for a wall: it has that share, too, found another way
    assert float(found["first_order"][0]) == pytest.approx(0.8, abs=0.05)
    assert float(found["spearman"][0]) == pytest.approx(6 / np.pi * np.arcsin(np.sqrt(0.8) / 2), abs=0.03)


def test_censored_and_failed_walls_are_reported_and_included() -> None:
    ds = crossed_walls(300, 0.4, 0.2, end=8.0)
    for wall in range(0, 1200, 12):
        fail(ds, wall, 150)
    found = study_sensitivity(ds, category=1, resamples=20)
    assert found.attrs["walls"] == 600  # those that share nothing
    assert found.attrs["tables"] == 300
    assert found.attrs["samples_failed"] == 100
    assert 0.45 < found.attrs["share_censored"] < 0.6
    assert float(found["group_first_order"][0]) > 3 * float(found["group_first_order"][1])


def test_curves_say_that_their_walls_are_crossed() -> None:
    ds = crossed_walls(30, 0.4, 0.2)
    assert damagepred.fit_fragility(ds, categories=[1], bootstrap=0).attrs["crossed"] == 1
    assert "crossed" not in damagepred.fit_fragility(ds.drop_attrs(), categories=[1], bootstrap=0).attrs


def test_incomplete_tables_are_left_out() -> None:
    ds = crossed_walls(30, 0.4, 0.2)
    ds["status"].values[[5, 118, 119]] = 3
    assert study_sensitivity(ds, category=1, resamples=5).attrs["tables"] == 28


def test_ranks_and_shares_are_of_independent_walls() -> None:
    """An input without effect: in pairs of walls, their correlation would be taken for an effect."""
    held = []
    for seed in range(30):
        ds = crossed_walls(12, 0.4, 0.2, seed=seed, end=60.0)
        idle = np.repeat(np.random.default_rng([8, seed]).standard_normal(24), 2)
        ds["joint.cohesion"] = ("sample", idle, {"role": "input"})
        found = study_sensitivity(ds, category=1, resamples=50).sel(variable="joint.cohesion")
        held.append(float(found["spearman_lower"]) <= 0 <= float(found["spearman_upper"]))
    assert 23 <= np.sum(held) <= 30  # 27 expected; with pairs taken as independent, 21


def test_an_ordinary_study_has_ranks_and_no_groups() -> None:
    ds = crossed_walls(50, 0.4, 0.2)
    del ds.attrs["crossed"]
    found = study_sensitivity(ds, category=1, resamples=5)
    assert "group" not in found.dims
    assert float(found["spearman"][0]) > 0.6


@pytest.mark.parametrize(
    ("ask", "words"),
    [
        ({}, "give one of them"),
        ({"category": 1, "output": "crack"}, "give one of them"),
        ({"category": 3}, "no wall has reached it"),
        ({"output": "crack"}, "no such result"),
        ({"output": "damage_category"}, "1 of 40 walls have no value at the end"),
    ],
)
def test_invalid_requests_are_refused(ask: dict, words: str) -> None:
    ds = crossed_walls(10, 0.4, 0.2)
    ds["status"].values[3] = FAILED
    ds["damage_category"].values[3, 5:] = -1
    with pytest.raises(InputError, match=words):
        _output_of(ds, **ask)


def test_a_result_at_the_end_of_the_movement() -> None:
    ds = crossed_walls(10, 0.4, 0.2)
    found = _output_of(ds, output="damage_category")
    np.testing.assert_array_equal(found.value, ds["damage_category"].values[:, -1])


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda t: [t["variables"].pop(p) for p in ("joint.friction", "movement.central_deflection")], "of both kinds"),
        (lambda t: t["study"].update(importance={"joint.friction": {"shift": -1.0}}), "drawn as stated"),
        (
            lambda t: t["variables"].update({"wall.height": {"distribution": "uniform", "lower": 0.45, "upper": 0.6}}),
            "changes the number of joints",
        ),
    ],
)
def test_studies_that_cannot_be_crossed(change, words: str) -> None:
    tables = tomllib.loads(SMALL_STUDY)
    change(tables)
    with pytest.raises(InputError, match=words):
        crossed_study(StudySettings.from_dict(tables))
