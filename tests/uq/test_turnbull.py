"""The empirical curve: by hand, published data, the closed forms of special cases, and a bound on what is left."""

import numpy as np
import pytest

from damagepred.uq.fragility import fit_fragility, turnbull
from tests.uq.test_fragility import lognormal, study
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
    assert list(zip(found.left[there], found.right[there])) == [
        (4, 5),
        (6, 7),
        (7, 8),
        (11, 12),
        (24, 25),
        (33, 34),
        (38, 40),
        (46, 48),
    ]
    published = [0.0463, 0.0334, 0.0887, 0.0708, 0.0926, 0.0818, 0.1209, 0.4656]
    np.testing.assert_allclose(found.mass[there], published, atol=1e-4)


def test_where_half_the_walls_have_not_reached_it_there_is_no_empirical_median() -> None:
    ds = study(lognormal(np.random.default_rng(1), 8.0, 0.4, 80), end=6.0, increments=12)
    curve = fit_fragility(ds, model="empirical", categories=[1], bootstrap=20).isel(category=0)
    assert np.isnan(curve["median"])
    movement = np.random.default_rng(2).uniform(1, 20, 200)
    single = single_study(movement, movement > lognormal(np.random.default_rng(3), 8.0, 0.4, 200))
    curve = fit_fragility(single, model="empirical", categories=[1], bootstrap=20).isel(category=0)
    assert float(curve["median"]) == pytest.approx(8.0, rel=0.25)
