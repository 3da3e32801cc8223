"""Sensitivity of a study: ranks and shares of variance, censored walls, and walls in fours of archives of 0.1."""

import tomllib
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from damagepred.analyses.epistemic import _changed, alternatives
from damagepred.analyses.mean_wall import beyond_mean_wall
from damagepred.analyses.variance_shares import _output_of, study_sensitivity
from damagepred.archive.folder import open_study
from damagepred.campaign.settings import StudySettings
from damagepred.cli.sentences import estimate_lines
from damagepred.errors import InputError
from damagepred.study import Study
from tests.conftest import SMALL_STUDY
from tests.synthetic_studies import synthetic_study
from tests.uq.test_fragility import FAILED, fail
from tests.uq.test_fragility import study as made_up


def crossed_walls(tables: int, wall: float, joints: float, seed: int = 1, end: float = 20.0) -> xr.Dataset:
    """Capacities that depend on an input and on the joints; walls in fours, as in archives of 0.1."""
    random = np.random.default_rng(seed)
    w, f = random.standard_normal((2, tables, 2))
    log = wall * w[:, :, None] + joints * f[:, None, :]
    ds = made_up(8.0 * np.exp(log.reshape(-1)), end=end, increments=400)
    x = np.repeat(w.reshape(-1), 2)
    return ds.assign({"joint.friction": ("sample", x, {"role": "input"})}).assign_attrs(crossed=1)


def test_shares_of_known_walls() -> None:
    """Ranks of a sum of normals: shares nearly those of the sum itself."""
    found = study_sensitivity(crossed_walls(800, 0.4, 0.2, end=60.0), category=1, resamples=100)
    assert float(found["first_order"][0]) == pytest.approx(0.8, abs=0.05)
    assert float(found["spearman"][0]) == pytest.approx(6 / np.pi * np.arcsin(np.sqrt(0.8) / 2), abs=0.03)


def test_censored_and_failed_walls_are_reported_and_included() -> None:
    ds = crossed_walls(300, 0.4, 0.2, end=8.0)
    for wall in range(0, 1200, 12):
        fail(ds, wall, 150)
    found = study_sensitivity(ds, category=1, resamples=20)
    assert found.attrs["walls"] == 600  # those that share nothing
    assert found.attrs["samples_failed"] == 100
    assert 0.45 < found.attrs["share_censored"] < 0.6


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


@pytest.mark.parametrize(
    ("ask", "words"),
    [
        ({}, "give one of them"),
        ({"category": 1, "output": "crack"}, "give one of them"),
        ({"category": 3}, "0 of 40 samples reached it, and a ranking of inputs needs 10 or more"),
        ({"output": "crack"}, "no such result"),
        ({"output": "damage_category"}, "1 of 40 samples have no value at the end"),
    ],
)
def test_invalid_requests_are_refused(ask: dict, words: str) -> None:
    ds = crossed_walls(10, 0.4, 0.2)
    ds["status"].values[3] = FAILED
    ds["damage_category"].values[3, 5:] = -1
    with pytest.raises(InputError, match=words):
        study_sensitivity(ds, **ask)


def test_a_result_at_the_end_of_the_movement() -> None:
    ds = crossed_walls(10, 0.4, 0.2)
    found = _output_of(ds, output="damage_category")
    np.testing.assert_array_equal(found.value, ds["damage_category"].values[:, -1])


def mean_wall(category: int, at: float) -> xr.Dataset:
    """Path of a wall that ends in a category at a movement (m)."""
    path = {"damage_category": [0, category], "central_deflection": [0.0, at]}
    ds = xr.Dataset({name: ("increment", np.array(values)) for name, values in path.items()})
    ds["central_deflection"].attrs["units"] = "m"
    return ds


def test_walls_with_movements_of_their_own_count_at_their_ends(tmp_path: Path) -> None:
    ds = open_study(synthetic_study(tmp_path / "house.dp", 80))
    settings = StudySettings.from_dict(tomllib.loads(SMALL_STUDY))
    said = beyond_mean_wall(mean_wall(1, 6e-3), settings, tmp_path / "house.toml")
    share = (ds["damage_category"].values.max(axis=1) >= 2).mean()
    assert said.startswith(
        "the mean wall is no worse than category 1 very slight; of 80 sampled walls in house.dp, a share"
    )
    assert f"a share of {share:.2f} (90 % interval" in said.replace("90%", "90 %")
    assert said.endswith("reaches category 2 slight or worse by the end of its own movement")
    # another study, or none, tells nothing
    other = StudySettings.from_dict(tomllib.loads(SMALL_STUDY.replace("seed = 7", "seed = 8")))
    unknown = "one wall without scatter; sampled walls may be worse: run `damagepred study house.toml`"
    assert beyond_mean_wall(mean_wall(1, 6e-3), other, tmp_path / "house.toml") == unknown


TINY = SMALL_STUDY.replace("length = 1.44", "length = 0.96").replace("increments = 6", "increments = 3")


def test_alternatives_are_estimated_beside_the_study(tmp_path: Path) -> None:
    tables = tomllib.loads(TINY)
    tables["study"] |= {"samples": 16, "epistemic": {"rougher": {"joint.friction": {"mean": 0.8}}, "same": {}}}
    with ThreadPoolExecutor(2) as executor:
        Study(StudySettings.from_dict(tables)).run(tmp_path / "s.dp", executor=executor)
    own, rougher, same = alternatives(tmp_path / "s.dp", 1, 6e-3)
    assert (own.name, rougher.name, same.name) == ("", "rougher", "same")
    assert same.found.estimate.value == pytest.approx(own.found.estimate.value)
    assert same.effective_samples == pytest.approx(16)
    assert 4 < rougher.effective_samples < 16
    said = "\n".join(estimate_lines([own, rougher, same], 1, 6e-3))
    assert "Monte Carlo error" in said
    assert "epistemic range of the inputs" in said


def test_what_is_no_alternative() -> None:
    settings = StudySettings.from_dict(tomllib.loads(TINY))
    with pytest.raises(InputError, match="are separate studies"):
        _changed(settings, "a", {"joint.cohesion": {"cov": 0.1}})
    with pytest.raises(InputError, match="covv"):
        _changed(settings, "a", {"joint.friction": {"covv": 0.1}})
