"""Bands of fragility curves: their coverage, and their definitions."""

import math

import numpy as np
import pytest
import xarray as xr
from scipy import stats

from damagepred.uq.exceedance import median_movement
from damagepred.uq.fragility import FragilityOptions, bands, fit_fragility
from tests.uq.test_fragility import SCATTER, TRUTH, fail, lognormal, study

SITUATIONS = {"all followed": (30.0, 0.0), "60 % censored": (7.0, 0.0), "10 % failed": (20.0, 0.1), "both": (7.0, 0.1)}
"""End of the movement (mm), and the share of walls that fail at a random increment."""


def made_up(situation: str, seed: int, walls: int) -> xr.Dataset:
    end, failing = SITUATIONS[situation]
    random = np.random.default_rng([77, seed])
    ds = study(lognormal(random, TRUTH, SCATTER, walls), end=end, increments=20)
    for wall in np.flatnonzero(random.random(walls) < failing):
        fail(ds, int(wall), int(random.integers(1, 20)))
    return ds


def coverage(situation: str, repetitions: int, walls: int, bootstrap: int) -> dict[str, float]:
    """Coverage of the 90 % band."""
    held = {"median": 0, "dispersion": 0, "probability": 0}
    for seed in range(repetitions):
        ds = made_up(situation, seed, walls)
        curve = fit_fragility(ds, categories=[1], bootstrap=bootstrap, seed=seed, points=6).isel(category=0)
        at = curve["intensity"].values[4]
        truth = {"median": TRUTH, "dispersion": SCATTER, "probability": stats.norm.cdf(math.log(at / TRUTH) / SCATTER)}
        for name, value in truth.items():
            one = curve.isel(intensity=4) if name == "probability" else curve
            held[name] += bool(one[f"{name}_lower"] <= value <= one[f"{name}_upper"])
    return {name: count / repetitions for name, count in held.items()}


@pytest.mark.slow
@pytest.mark.parametrize("situation", SITUATIONS)
def test_the_coverage_of_the_band_of_90_percent_is_85_to_95_percent(situation: str) -> None:
    """200 repetitions of 400 walls: 0.9 +- 0.021, so that one in fifty falls outside 0.85 to 0.95 by chance.

    A median beyond the movement has a lower bound alone, which always holds.
    """
    held = coverage(situation, 200, 400, 250)
    if SITUATIONS[situation][0] < TRUTH:
        assert held.pop("median") == 1.0
    for name, share in held.items():
        assert 0.85 <= share <= 0.95, (name, held)


def test_one_rule_for_bands(monkeypatch: pytest.MonkeyPatch) -> None:
    """The posterior of 99 walls and fewer; BCa of 100, unless too many resamples have no fit."""
    for walls, resampled in ((99, False), (100, True)):
        ds = study(lognormal(np.random.default_rng(3), 8.0, 0.5, walls), end=90.0, increments=30)
        for curve in (
            fit_fragility(ds, categories=[1], bootstrap=50),
            fit_fragility(ds, model="common", categories=[1]),
        ):
            assert np.isfinite(curve["resamples_fitted"].values[0]) == resampled
            assert np.isfinite(curve["median_upper"].values[0])
    monkeypatch.setattr(bands, "SMALLEST_DISPERSION", 0.49)  # resamples below it have no fit
    never = FragilityOptions(fitted_share=1.0)
    curve = fit_fragility(ds, categories=[1], bootstrap=200, options=never).isel(category=0)
    assert 0.0 < float(curve["resamples_fitted"]) < 1.0
    assert "could be fitted: its band comes from the posterior" in str(curve["fit_note"].values)


def test_few_walls_have_student_s_and_chi_squared_s_limits() -> None:
    """Of capacities that are all known nearly exactly, the posterior's quantiles are the textbook's intervals."""
    for walls in (3, 5, 20):
        values = lognormal(np.random.default_rng(walls), 8.0, 0.5, walls)
        curve = fit_fragility(study(values, end=60.0, increments=6000), categories=[1]).isel(category=0)
        logarithm = np.log(values)
        scatter, free = float(logarithm.std(ddof=1)), walls - 1
        half = stats.t.ppf(0.95, free) * scatter / math.sqrt(walls)
        for end, sign, tail in (("lower", -1, 0.95), ("upper", 1, 0.05)):
            exact = float(logarithm.mean()) + sign * half
            assert math.log(float(curve[f"median_{end}"])) == pytest.approx(exact, abs=0.15 * half)
            exact = scatter * math.sqrt(free / stats.chi2.ppf(tail, free))
            assert float(curve[f"dispersion_{end}"]) == pytest.approx(exact, rel=0.06)


@pytest.mark.parametrize(("situation", "value"), [("10 % failed", "median"), ("both", "median_lower_bound")])
def test_the_median_that_a_study_stops_at_is_that_of_the_curve(situation: str, value: str) -> None:
    ds = made_up(situation, 5, 200)
    curve = fit_fragility(ds, categories=[1], bootstrap=400).isel(category=0)
    found = median_movement(ds, 1)
    assert found.value == pytest.approx(float(curve[value]), rel=1e-9)
    assert found.lower == pytest.approx(float(curve["median_lower"]), rel=0.05)
    assert found.upper == pytest.approx(float(curve["median_upper"]), rel=0.05)
