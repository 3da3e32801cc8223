"""Curves of a common dispersion: statsmodels' ordinal model, known truth, and curves that never cross."""

import itertools

import numpy as np
import pytest
import xarray as xr
from hypothesis import given, settings
from hypothesis import strategies as st
from statsmodels.genmod.families import Binomial
from statsmodels.genmod.families.links import Probit
from statsmodels.genmod.generalized_linear_model import GLM
from statsmodels.miscmodels.ordinal_model import OrderedModel

from damagepred.errors import InputError
from damagepred.uq.fragility import fit_fragility, fit_lognormal
from tests.uq.test_fragility import BETA, RATE, WIDTHS, fail, known, study
from tests.uq.test_fragility_single import study as single_study


def ordinal(seed: int, walls: int = 300) -> tuple[np.ndarray, np.ndarray]:
    """Movements, and the category of walls of which each has one capacity factor for all categories."""
    random = np.random.default_rng(seed)
    movement = random.uniform(1.0, 25.0, walls)
    worse = np.exp(0.45 * random.standard_normal(walls))[:, None] * np.array([4.0, 9.0, 15.0])
    return movement, (movement[:, None] >= worse).sum(axis=1)


@pytest.mark.parametrize("seed", range(2))
def test_the_ordinal_fit_is_that_of_statsmodels(seed: int) -> None:
    movement, category = ordinal(seed, 120)
    model = OrderedModel(category, np.log(movement)[:, None], distr="probit")
    theirs = model.fit(method="bfgs", disp=False, gtol=1e-7)
    slope, thresholds = theirs.params[0], model.transform_threshold_params(theirs.params)[1:-1]
    curves = fit_fragility(single_study(movement, category), model="common", categories=[1, 2, 3], bootstrap=0)
    np.testing.assert_allclose(curves["dispersion"], 1 / slope, rtol=1e-6)
    np.testing.assert_allclose(curves["median"], np.exp(thresholds / slope), rtol=1e-6)


@settings(max_examples=60, deadline=None, derandomize=True)
@given(
    st.lists(st.lists(st.integers(1, 13), min_size=3, max_size=3), min_size=3, max_size=25),
    st.booleans(),
    st.integers(0, 10**6),
)
def test_medians_stand_in_the_categories_order(capacity: list[list[int]], fails: bool, seed: int) -> None:
    """For any walls: each category is reached at increment 1 to 12, or never (13)."""
    ds = study(np.sort(np.array(capacity, dtype=float), axis=1) - 0.5, end=12.0, increments=12)
    if fails:
        for wall in np.random.default_rng(seed).choice(len(capacity), len(capacity) // 3, replace=False):
            fail(ds, int(wall), 6)
    curves = fit_fragility(ds, model="common", categories=[1, 2, 3], bootstrap=0, points=21)
    fitted = curves["probability"].values[(curves["fit_status"] == "fitted").values]
    for lesser, worse in itertools.pairwise(fitted):
        assert (worse <= lesser + 1e-6).all()


@pytest.mark.thorough
@pytest.mark.parametrize(("model", "single"), [("common", False), ("common", True)])
def test_bands_cover_the_true_value_about_nine_times_in_ten(model: str, single: bool) -> None:
    hits, repetitions = np.zeros(2), 30
    for seed in range(repetitions):
        random = np.random.default_rng([5, seed])
        capacity = known(random, 120)[:, 1:]
        if single:
            movement = random.choice(np.arange(4.0, 90.0, 4.0), 120)
            ds = single_study(movement, (movement[:, None] >= capacity).sum(axis=1))
        else:
            ds = study(capacity, end=80.0, increments=40)
        curve = fit_fragility(ds, model=model, categories=[1, 2, 3], bootstrap=60, seed=seed, points=3)
        curve = curve.isel(category=1)
        for k, (name, truth) in enumerate((("median", WIDTHS[2] / RATE), ("dispersion", BETA))):
            hits[k] += bool(curve[f"{name}_lower"] <= truth <= curve[f"{name}_upper"])
    # 27 expected; 22 or fewer come in 1 % of binomial draws
    assert (hits >= 22).all(), hits


def test_counts_at_fixed_movements_are_a_binomial_probit_model() -> None:
    movement = np.array([4.0, 8.0, 12.0, 20.0])
    hits, walls = np.array([2, 17, 31, 38]), np.array([40, 40, 39, 40])
    theirs = GLM(
        np.column_stack((hits, walls - hits)), np.column_stack((np.ones(4), np.log(movement))), Binomial(Probit())
    ).fit(tol=1e-14)
    a, b = theirs.params
    counts = np.column_stack((walls - hits, hits))
    ds = xr.Dataset(
        {
            "damage_category": ("sample", np.repeat(np.tile(np.arange(2, dtype=np.int8), 4), counts.ravel())),
            "status": ("sample", np.zeros(walls.sum(), dtype=np.int8)),
            "central_deflection": ("sample", np.repeat(movement, walls), {"units": "mm"}),
        },
        attrs={"highest_category": 1},
    )
    curve = fit_fragility(ds, bootstrap=50).isel(category=0)
    assert float(curve["median"]) == pytest.approx(np.exp(-a / b), rel=1e-7)
    assert float(curve["dispersion"]) == pytest.approx(1 / b, rel=1e-7)
    assert curve["median_lower"] < curve["median"] < curve["median_upper"]
    fit = fit_lognormal(
        np.concatenate((np.zeros(4), movement)),
        np.concatenate((movement, np.full(4, np.inf))),
        np.concatenate((hits, walls - hits)),
    )
    assert float(curve["median"]) == pytest.approx(fit.median, rel=1e-9)
    np.testing.assert_allclose(curve["empirical"].sel(intensity=movement, method="nearest"), hits / walls, atol=1e-9)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"model": "ordinal"}, "model = 'ordinal': must be one of separate, common, empirical"),
        ({"categories": [2, 1]}, "must ascend"),
    ],
)
def test_invalid_requests_are_refused(options: dict, words: str) -> None:
    with pytest.raises(InputError, match=words):
        fit_fragility(study(known(np.random.default_rng(1), 30)), **options)
