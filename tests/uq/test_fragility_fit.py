"""Fragility curves: goodness of fit, measures of movement, bands with their coverage, the empirical curve."""

import math

import numpy as np
import pytest
import xarray as xr
from scipy import special, stats

from damagepred.errors import InputError
from damagepred.uq.fragility import bands, fit_fragility, fit_lognormal, likelihood, turnbull
from damagepred.uq.fragility.estimators import estimators
from damagepred.uq.fragility.fit import group_intervals
from damagepred.uq.fragility.goodness import akaike_criterion, distance
from damagepred.uq.fragility.turnbull import _icm_step
from damagepred.uq.intensity import intensity_values
from tests.uq.test_fragility import SCATTER, TRUTH, fail, known, lognormal, study
from tests.uq.test_fragility_single import study as single_study


def test_distance_is_kolmogorov_s_of_exactly_known_capacities() -> None:
    values = lognormal(np.random.default_rng(1), 8.0, 0.5, 60)
    fit = fit_lognormal(values, values)
    expected = stats.kstest(values, stats.lognorm(s=fit.dispersion, scale=fit.median).cdf).statistic
    found = distance(fit, turnbull(values, values))
    assert found == pytest.approx(expected, abs=2e-3)  # masses are known to the bound on the likelihood


@pytest.mark.parametrize("kind", ["shared increments", "own increments", "one movement a wall"])
def test_lognormal_walls_are_not_refused_and_others_are(kind: str) -> None:
    chances = []
    for shape in ("lognormal", "two kinds"):
        random = np.random.default_rng(5)
        capacity = lognormal(random, 8.0, 0.3, 150)
        if shape == "two kinds":  # weak and strong, nothing between
            capacity = np.where(random.random(150) < 0.5, 3.0, 15.0) * np.exp(0.1 * random.standard_normal(150))
        if kind == "one movement a wall":
            movement = random.uniform(1, 25, 150)
            ds = single_study(movement, movement >= capacity)
        else:
            end = 25.0 if kind == "shared increments" else random.uniform(20, 30, 150)
            ds = study(capacity, end=end, increments=25)
        curve = fit_fragility(ds, categories=[1], bootstrap=0, goodness=19).isel(category=0)
        chances.append(float(curve["p_value"]))
    assert chances[0] > 0.1
    assert chances[1] == pytest.approx(1 / 20)


def test_the_criterion_counts_parameters_where_the_likelihood_is_right() -> None:
    """One category, many walls: minus twice the log-likelihood and nearly 2 x 2."""
    values = lognormal(np.random.default_rng(2), 8.0, 0.5, 4000)
    cells = group_intervals(values[None], values[None], np.ones(4000))
    x = np.log(values)
    least = -2 * stats.norm.logpdf(x, x.mean(), x.std()).sum()
    assert akaike_criterion(cells, False) == pytest.approx(least + 4, abs=0.5)
    assert akaike_criterion(cells, True) == pytest.approx(akaike_criterion(cells, False), rel=1e-9)


def arched(length: np.ndarray) -> xr.Dataset:
    """Walls of other lengths, all damaged at a curvature of the footing of 1/1000 m, more or less."""
    random = np.random.default_rng(3)
    critical = 1e-3 * np.exp(0.2 * random.standard_normal(len(length)))
    deflection = np.linspace(0.0, 0.02, 41) * np.ones((len(length), 1))
    curvature = 8 * deflection / length[:, None] ** 2
    both = ("sample", "increment")
    return xr.Dataset(
        {
            "damage_category": (both, (curvature >= critical[:, None]).astype(np.int8)),
            "status": ("sample", np.zeros(len(length), dtype=np.int8)),
            "central_deflection": (both, deflection, {"units": "m"}),
            "deflection_ratio": (both, deflection / length[:, None], {"units": "1"}),
        },
        attrs={"highest_category": 1},
    )


def test_curvature_is_that_of_the_arc() -> None:
    length = np.random.default_rng(1).uniform(4.0, 9.0, 200)
    ds = arched(length)
    np.testing.assert_allclose(
        intensity_values(ds, "curvature"), 8 * ds["central_deflection"].values / length[:, None] ** 2, rtol=1e-12
    )
    assert (intensity_values(ds, "curvature")[:, 0] == 0).all()
    curves = fit_fragility(ds, intensity="curvature", bootstrap=0)
    assert curves["intensity"].attrs["units"] == "m-1"
    assert float(curves["median"][0]) == pytest.approx(1e-3, rel=0.05)
    assert float(curves["dispersion"][0]) == pytest.approx(0.2, rel=0.15)
    # against the deflection the walls' lengths scatter, too
    assert float(fit_fragility(ds, bootstrap=0)["dispersion"][0]) > 0.35


def test_the_footing_s_largest_curvature_is_read_where_there_are_sections() -> None:
    ds = arched(np.full(20, 6.0))
    section = np.zeros((20, 41, 3))
    section[:, :, 1] = -3.0 * intensity_values(ds, "curvature")
    with pytest.raises(InputError, match="no variable 'footing_curvature' with values; it has central_deflection"):
        fit_fragility(ds, intensity="footing_curvature")
    ds = ds.assign(section_curvature=(("sample", "increment", "section"), section, {"units": "m-1"}))
    curves = [fit_fragility(ds, intensity=m, bootstrap=0) for m in ("footing_curvature", "curvature")]
    assert float(curves[0]["median"][0]) == pytest.approx(3 * float(curves[1]["median"][0]), rel=1e-9)


@pytest.mark.parametrize(
    ("kind", "mound", "share"),
    [
        ("doming", 'shape = "walsh"', 0.7),
        ("dishing", 'shape = "walsh"', 0.5),
        ("doming", "movement_ratio = 0.6", 0.6),
        ("doming", 'shape = "tree"', 1.0),
    ],
)
def test_differential_movement_is_its_share_of_the_surface_movement(kind: str, mound: str, share: float) -> None:
    ds = arched(np.full(20, 6.0)).rename(central_deflection="surface_movement").drop_vars("deflection_ratio")
    ds.attrs["scene"] = f'[movement]\nkind = "{kind}"\n[mound]\n{mound}\n'
    both = [fit_fragility(ds, intensity=m, bootstrap=0) for m in ("differential_movement", "surface_movement")]
    assert float(both[0]["median"][0]) == pytest.approx(share * float(both[1]["median"][0]), rel=1e-9)
    sampled = np.linspace(0.4, 0.8, 20)
    ds["mound.movement_ratio"] = ("sample", sampled)
    found = intensity_values(ds, "differential_movement")
    np.testing.assert_allclose(found[:, -1], sampled * 0.02)


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
    """200 repetitions of 400 walls: 0.9 +- 0.021, so that one in fifty falls outside 0.85 to 0.95 by chance."""
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
    monkeypatch.setattr(bands, "FITTED_SHARE", 1.0)
    curve = fit_fragility(ds, categories=[1], bootstrap=200).isel(category=0)
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


def test_draws_of_a_posterior_have_the_mean_of_its_integral() -> None:
    """One movement per wall, half of them damaged: Jeffreys' prior times the likelihood, summed over a grid."""
    damaged, whole = np.array([2.2, 3, 4, 5, 6, 7, 1, 1.5, 8, 9]), np.full(10, 2.0)
    lower, upper = np.append(0 * damaged, whole), np.append(damaged, np.inf * whole)
    (estimator,) = estimators(group_intervals(lower[None], upper[None], np.ones(20)))
    slope = np.exp(np.linspace(-6, 3.5, 150))  # uniform in its logarithm
    grid = np.stack(np.meshgrid(slope, np.linspace(-15, 30, 200)), axis=-1).reshape(-1, 2)
    cells = estimator.cells
    weight = cells.total * cells.effective() / cells.total.sum()
    terms = likelihood.likelihood(grid, estimator.rows, np.broadcast_to(weight, (len(grid), len(weight))))
    prior = np.sqrt(np.fmax(np.linalg.det(-terms.hessian), 0.0))
    exact = np.average(grid, axis=0, weights=np.exp(terms.value - terms.value.max()) * prior * grid[:, 0])
    draws = [bands.sample_posterior(estimator, np.random.default_rng(seed)) for seed in range(6)]
    np.testing.assert_allclose(np.mean(draws, axis=(0, 1)), exact, rtol=0.015)


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


def test_a_step_between_two_masses_is_newton_s() -> None:
    """L = ln p + 3 ln(1 - p): the step from p = 1/2 ends at the maximum, p = 1/4."""
    step = _icm_step(np.full(2, 0.5), np.array([0, 1]), np.array([1, 2]), np.array([1.0, 3.0]))
    np.testing.assert_allclose(step, [0.25, 0.75])


def test_a_fit_of_many_walls_starts_with_a_fifth_of_the_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    sizes: list[int] = []
    evaluated = likelihood.likelihood
    monkeypatch.setattr(likelihood, "COARSE_START_ROWS", 100)
    monkeypatch.setattr(likelihood, "likelihood", lambda p, r, w: (sizes.append(w.shape[1]), evaluated(p, r, w))[1])
    values = lognormal(np.random.default_rng(1), 8.0, 0.5, 600)
    rows = likelihood.linear_bounds(values, values, np.ones((600, 1)))
    (slope, place) = likelihood.maximise_likelihood(rows, np.ones((1, 600)), np.ones(2))[0]
    assert (slope, place / slope) == pytest.approx((1 / np.log(values).std(), np.log(values).mean()), rel=1e-6)
    assert (sizes[0], sizes[-1]) == (20, 600)


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
