"""The empirical curve: by hand, published data, the closed forms of special cases, and a bound on what is left."""

import numpy as np
import pytest
from scipy import special

from damagepred.uq.fragility import fit_fragility, turnbull
from tests.uq.test_fragility import known, lognormal, study
from tests.uq.test_fragility_single import study as single_study

INF = np.inf

RADIOTHERAPY = """
45,- 6,10 0,7 46,- 46,- 7,16 17,- 7,14 37,44 0,8 4,11 15,- 11,15 22,- 46,- 46,- 25,37 46,- 26,40 46,- 27,34 36,44 46,-
36,48 37,- 40,- 17,25 46,- 11,18 38,- 5,12 37,- 0,5 18,- 24,- 36,- 5,11 19,35 17,25 24,- 32,- 33,- 19,26 37,- 34,- 36,-
"""
"""Months to cosmetic deterioration after radiotherapy (Finkelstein and Wolfe 1985, Biometrics 41)."""


def test_three_walls_by_hand() -> None:
    """(0, 2], (1, 3], (2, 4]: mass can lie in (1, 2] and (2, 3] alone. L = p (p + q) q, so p = q = 1/2."""
    found = turnbull(np.array([0.0, 1, 2]), np.array([2.0, 3, 4]))
    assert found.left.tolist() == [1.0, 2.0]
    assert found.right.tolist() == [2.0, 3.0]
    np.testing.assert_allclose(found.mass, [0.5, 0.5], atol=1e-6)
    np.testing.assert_allclose(found.probability(np.array([0.0, 1.9, 2.0, 2.5, 3.0, 9.0])), [0, 0, 0.5, 0.5, 1, 1])


def test_published_data() -> None:
    """The estimate that the literature gives for the 46 patients of the radiotherapy group."""
    pairs = [pair.split(",") for pair in RADIOTHERAPY.split()]
    lower = np.array([float(a) for a, _ in pairs])
    upper = np.array([INF if b == "-" else float(b) for _, b in pairs])
    found = turnbull(lower, upper)
    there = found.mass > 1e-4
    assert found.left[there].tolist() == [4, 6, 7, 11, 24, 33, 38, 46]
    assert found.right[there].tolist() == [5, 7, 8, 12, 25, 34, 40, 48]
    published = [0.0463, 0.0334, 0.0887, 0.0708, 0.0926, 0.0818, 0.1209, 0.4656]
    np.testing.assert_allclose(found.mass[there], published, atol=1e-4)


def test_as_a_model_it_has_bands_and_no_dispersion() -> None:
    ds = study(known(np.random.default_rng(1), 150), end=60.0)
    curves = fit_fragility(ds, model="empirical", categories=[2, 3], bootstrap=60)
    np.testing.assert_array_equal(curves["probability"], curves["empirical"])
    assert np.isnan(curves["dispersion"]).all()
    assert curves["fit_status"].values.tolist() == ["empirical"] * 2
    assert (curves["probability_lower"] <= curves["probability"] + 1e-9).all()
    assert (curves["probability_upper"] >= curves["probability"] - 1e-9).all()
    assert (curves["median_lower"] <= curves["median"]).all()
    fitted = fit_fragility(ds, categories=[2, 3], bootstrap=0)
    np.testing.assert_allclose(curves["median"], fitted["median"], rtol=0.2)
    assert curves.attrs["curves_cross"] == 0


def test_where_half_the_walls_have_not_reached_it_there_is_no_empirical_median() -> None:
    ds = study(lognormal(np.random.default_rng(1), 8.0, 0.4, 80), end=6.0, increments=12)
    curve = fit_fragility(ds, model="empirical", categories=[1], bootstrap=20).isel(category=0)
    assert np.isnan(curve["median"])
    movement = np.random.default_rng(2).uniform(1, 20, 200)
    single = single_study(movement, movement > lognormal(np.random.default_rng(3), 8.0, 0.4, 200))
    curve = fit_fragility(single, model="empirical", categories=[1], bootstrap=20).isel(category=0)
    assert float(curve["median"]) == pytest.approx(8.0, rel=0.25)


def test_what_few_walls_reached_each_in_its_own_increments() -> None:
    """No step may take all probability from where a wall was seen: nothing would bring it back."""
    random = np.random.default_rng(6)
    capacity, end = lognormal(random, 30.0, 0.6, 4000), random.uniform(10.0, 16.0, 4000)
    step = end / 20
    reached = capacity <= end
    lower = np.where(reached, np.floor(capacity / step) * step, end)
    upper = np.where(reached, lower + step, INF)
    found = turnbull(lower, upper)
    assert 0.05 < reached.mean() < 0.15
    inside = found.probability(np.where(reached, upper, 0.0)) - found.probability(lower)
    assert inside[reached].min() > 0
    truth = np.array([special.ndtr(np.log(at / 30.0) / 0.6) for at in (8.0, 11.0, 14.0)])
    np.testing.assert_allclose(found.probability(np.array([8.0, 11.0, 14.0])), truth, atol=0.015)
