"""Sensitivity of a study: ranks and shares of variance, censored walls, and walls in fours of archives of 0.1."""

import numpy as np
import pytest
import xarray as xr

from damagepred.analyses.variance_shares import _output_of, study_sensitivity
from damagepred.errors import InputError
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
