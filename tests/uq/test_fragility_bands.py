"""Bands of fragility curves: their coverage, and their definitions."""

import math

import numpy as np
import pytest
import xarray as xr
from scipy import special, stats

from damagepred.uq.exceedance import exceedance, median_movement
from damagepred.uq.fragility import FragilityOptions, bands, capacities, fit_fragility, fit_lognormal
from damagepred.uq.fragility.bands import ParameterDraws, confidence_band, expanded_percentiles, resample
from damagepred.uq.fragility.estimators import CompositeLikelihood
from damagepred.uq.fragility.fit import group_intervals
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


def test_bca_shifts_the_band_by_bias_and_skewness() -> None:
    """Of exactly known capacities: the dispersion's resamples are too small, and more so than BCa leaves them."""
    values = lognormal(np.random.default_rng(3), 8.0, 0.5, 40)
    ds = study(values, end=60.0, increments=3000)
    known = capacities(ds, 1)
    estimator = CompositeLikelihood([0], group_intervals(known.lower[None], known.upper[None], np.ones(40)))
    again = resample(estimator, 2000, np.random.default_rng(4))
    draws, row = ParameterDraws(again.replicates, again, 1.0), np.ones(1)
    low, high = confidence_band(draws, row, np.ones(1), 0.9, 40.0).dispersion
    scatter = float(np.log(values).std())
    # exact: n s^2 / sigma^2 is chi-squared of 39
    exact = [scatter * math.sqrt(40 / stats.chi2.ppf(q, 39)) for q in (0.95, 0.05)]
    percentiles = np.quantile(
        1.0 / again.replicates[:, 0], special.ndtr(expanded_percentiles(np.array([0.05, 0.95]), 40))
    )
    plain = abs(percentiles[0] - exact[0]) + abs(percentiles[1] - exact[1])
    assert abs(low - exact[0]) + abs(high - exact[1]) < 0.75 * plain


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


def test_a_band_of_three_walls_is_that_of_the_posterior() -> None:
    """Three of 40 walls reached it: many resamples have fewer."""
    ds = study(np.append([3.5, 5.5, 7.5], np.full(37, 99.0)), end=10.0, increments=10)
    curve = fit_fragility(ds, categories=[1], bootstrap=200).isel(category=0)
    note = str(curve["fit_note"].values)
    assert "rests on 3 walls" in note
    assert "lies beyond the study's movement" in note
    low, high = stats.beta(3, 38).ppf([0.05, 0.95])  # of a share, with a prior dp / p
    assert float(curve["probability_lower"][-1]) == pytest.approx(low, rel=0.1)
    assert float(curve["probability_upper"][-1]) == pytest.approx(high, rel=0.1)


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


@pytest.mark.thorough
def test_the_band_covers_the_true_value_where_few_walls_reach_the_category() -> None:
    """A tenth of 32 walls; resamples that have fewer than three of them would leave the band with nearly no width."""
    end, fitted, held = 7.0, 0, 0
    median = end * math.exp(1.28155 * SCATTER)
    for seed in range(80):
        capacity = lognormal(np.random.default_rng([78, seed]), median, SCATTER, 32)
        curve = fit_fragility(study(capacity, end=end, increments=30), categories=[1], bootstrap=100, points=4)
        if (last := curve.isel(category=0, intensity=-1))["fit_status"] == "extrapolated":
            fitted += 1
            held += bool(last["probability_lower"] <= 0.1 <= last["probability_upper"])
    assert fitted > 40
    assert 0.8 <= held / fitted < 1.0


def test_the_known_part_of_a_failed_wall_counts() -> None:
    """A wall that failed late and undamaged has more information than one that failed at once."""
    ds = study(np.linspace(2.2, 9.2, 30), end=12.0, increments=12)
    medians = []
    for increment in (1, 9):
        other = ds.copy(deep=True)
        for wall in (27, 28, 29):
            fail(other, wall, increment)
        medians.append(float(fit_fragility(other, categories=[1], bootstrap=0)["median"][0]))
    c = capacities(ds, 1)
    lost = fit_lognormal(c.lower[:27], c.upper[:27]).median
    assert medians[0] == pytest.approx(lost, rel=1e-6)  # followed to 0: no information
    assert medians[1] > 1.05 * lost


@pytest.mark.parametrize(("situation", "value"), [("10 % failed", "median"), ("both", "median_lower_bound")])
def test_the_median_that_a_study_stops_at_is_that_of_the_curve(situation: str, value: str) -> None:
    ds = made_up(situation, 5, 200)
    curve = fit_fragility(ds, categories=[1], bootstrap=400).isel(category=0)
    found = median_movement(ds, 1)
    assert found.value == pytest.approx(float(curve[value]), rel=1e-9)
    assert found.lower == pytest.approx(float(curve["median_lower"]), rel=0.05)
    assert found.upper == pytest.approx(float(curve["median_upper"]), rel=0.05)


def test_a_wall_that_failed_beyond_a_movement_is_known_at_it() -> None:
    """Ten walls: four damaged at 3.5 mm, two failed at 2 mm, four failed at 8 mm, all unharmed until then."""
    ds = study(np.append(np.full(4, 3.5), np.full(6, 99.0)), end=12.0, increments=12)
    for wall, increment in ((4, 2), (5, 2), (6, 8), (7, 8), (8, 8), (9, 8)):
        fail(ds, wall, increment)
    found = exceedance(ds, 1, 6.0)
    assert found.failed == 2
    assert found.estimate.value == pytest.approx(4 / 8)
    assert (found.failed_undamaged, found.failed_damaged) == pytest.approx((4 / 10, 6 / 10))
    # no wall without damage was followed beyond 8 mm
    beyond = exceedance(ds, 1, 10.0)
    assert beyond.failed == 6
    assert np.isnan(beyond.estimate.value)
    assert (beyond.failed_undamaged, beyond.failed_damaged) == pytest.approx((4 / 10, 1.0))
    assert (beyond.estimate.lower, beyond.estimate.upper) == (exceedance(ds, 1, 7.0).estimate.lower, 1.0)
