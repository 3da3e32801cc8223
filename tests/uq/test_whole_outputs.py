"""Whole outputs of small studies against independent values: every column, count, unit and word of it."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from scipy import special, stats
from statsmodels.stats.proportion import proportion_confint

from damagepred.results.tables import DOUBTFUL
from damagepred.uq.capacity import read_capacities
from damagepred.uq.comparison import compare
from damagepred.uq.fragility import fit_fragility, fit_lognormal, fit_surface
from damagepred.uq.fragility.goodness import _grouped_by_increments, sequential_p_value
from tests.recorded import check_parts
from tests.uq.test_fragility import MISSING, fail, scipy_fit, study
from tests.uq.test_fragility_single import study as single_study

CAPACITY = np.array([0.0, 2.5, 3.5, 3.6, 4.5, 5.5, 6.5, 6.6, 7.5, 8.5, 9.5, 99.0, 99.0])


def small() -> xr.Dataset:
    """Thirteen walls to 12 mm: one damaged at the start, one failed behind 3 mm, one missing, two never damaged."""
    ds = study(np.column_stack((CAPACITY, CAPACITY + 8.0)), end=12.0, increments=12, seed=4, span=6.0)
    fail(ds, 11, 4)
    ds["status"].values[10], ds["damage_category"].values[10] = MISSING, -1
    return ds


def wilson(share: float, count: float, confidence: float = 0.9) -> tuple[float, float]:
    return proportion_confint(share * count, count, 1 - confidence, "wilson")


def test_every_column_of_curves() -> None:
    curves = fit_fragility(small(), categories=[1, 2], bootstrap=0, points=13)
    both = read_capacities(small(), [1, 2], "central_deflection").capacities
    one, two = (curves.isel(category=k) for k in (0, 1))
    counts = [[int(c[name]) for name in ("reached", "not_reached", "failed")] for c in (one, two)]
    assert counts == [[10, 1, 1], [4, 7, 1]]
    lower, upper, failed = both.lower[0, 1:], both.upper[0, 1:], both.failed[0, 1:]
    assert np.flatnonzero(failed).tolist() == [9]
    median, dispersion = scipy_fit(lower, upper)
    assert float(one["median"]) == pytest.approx(median, rel=1e-6)
    assert float(one["dispersion"]) == pytest.approx(dispersion, rel=1e-5)
    start = 1 / 12
    ends = wilson(start, 12)
    assert [float(one[f"share_at_start{end}"]) for end in ("", "_lower", "_upper")] == pytest.approx([start, *ends])
    assert [float(two[f"share_at_start{end}"]) for end in ("", "_lower", "_upper")] == [0, 0, 0]
    with np.errstate(divide="ignore"):
        rising = special.ndtr(np.log(np.arange(13) / median) / dispersion)
    np.testing.assert_allclose(one["probability"], start + (1 - start) * rising, atol=1e-6)
    for end, bounds in (
        ("undamaged", (np.where(failed, 12.0, lower), upper)),
        ("damaged", (lower, np.where(failed, 4.0, upper))),
    ):
        fit = fit_lognormal(*bounds)
        assert float(one[f"median_failed_{end}"]) == pytest.approx(fit.median, rel=1e-6)
        rising = fit.probability(np.arange(13.0))
        np.testing.assert_allclose(one[f"probability_failed_{end}"], start + (1 - start) * rising, atol=1e-6)
    # Kaplan and Meier of the eleven others: one is lost behind 3 mm
    survival = np.cumprod([1, 1, 1, 10 / 11, 7 / 9, 6 / 7, 5 / 6, 3 / 5, 2 / 3, 1 / 2, 1, 1, 1])
    np.testing.assert_allclose(one["empirical"], 1 - 11 / 12 * survival, atol=1e-5)
    gaps = [np.abs(special.ndtr(np.log(m / median) / dispersion) - (1 - survival[m])) for m in range(1, 13)]
    assert float(one["distance"]) == pytest.approx(max(gaps), abs=1e-4)
    for name in ("median_lower", "median_upper", "median_lower_bound", "median_extrapolated", "p_value"):
        assert np.isnan(float(one[name])), name
    assert curves["fit_status"].values.tolist() == ["fitted", "extrapolated"]
    assert curves["fit_note"].values.tolist() == [
        "1 wall reached it before any movement; median and dispersion are of the others; rests on 9 walls that "
        "reached it",
        "rests on 4 walls that reached it; its median lies beyond the study's movement",
    ]
    assert np.isnan(two["median"])
    assert float(two["median_lower_bound"]) == 12.0
    assert float(two["median_extrapolated"]) == pytest.approx(
        fit_lognormal(both.lower[1], both.upper[1]).median, rel=1e-6
    )
    assert (float(two["median_failed_undamaged"]), float(two["median_failed_damaged"])) == (np.inf, np.inf)


def test_names_units_and_attributes_of_curves() -> None:
    curves = fit_fragility(small(), categories=[1, 2], bootstrap=0, points=13)
    np.testing.assert_array_equal(curves.attrs.pop("movements"), np.arange(13.0))
    parts = {f"curves.{key}": str(value) for key, value in curves.attrs.items()}
    for name, values in curves.variables.items():
        parts |= {f"{name}.{key}": str(values.attrs[key]) for key in ("long_name", "units") if key in values.attrs}
    check_parts(Path(__file__).with_name("curves.txt"), parts)


def test_bands_of_an_empirical_curve_are_wilson_s_for_the_variance_of_resamples() -> None:
    """On shared increments without censored walls the curve is a share of walls, with a binomial variance."""
    capacity = np.linspace(1.2, 11.7, 50)
    ds = study(capacity, end=12.0, increments=12)
    at = one = fit_fragility(ds, categories=[1], model="empirical", bootstrap=800, points=13).isel(category=0)
    share = (capacity <= np.arange(13)[:, None]).mean(axis=1)
    np.testing.assert_allclose(at["probability"], share, atol=1e-9)
    limits = np.array([wilson(p, 50) for p in share[1:]])
    np.testing.assert_allclose(at["probability_lower"][1:], limits[:, 0], atol=0.012)
    np.testing.assert_allclose(at["probability_upper"][1:], limits[:, 1], atol=0.012)
    assert (float(at["probability_lower"][0]), float(at["probability_upper"][0])) == (0.0, 0.0)
    assert float(one["median"]) == 7.0
    # the order statistics at 18.5 and 31.5 of 50 walls, at the ends of their increments
    assert (float(one["median_lower"]), float(one["median_upper"])) == (6.0, 8.0)
    assert (float(one["resamples_fitted"]), str(one["fit_status"].values)) == (1.0, "empirical")
    assert [int(one[n]) for n in ("reached", "not_reached", "failed")] == [50, 0, 0]
    assert "dispersion" in one
    assert np.isnan(one["dispersion"])


def test_bounds_of_failed_walls_of_an_empirical_curve() -> None:
    """Failed behind 3 mm: damaged there, or undamaged to the end, with the median of nine others between."""
    capacity = np.array([2.5, 3.5, 4.5, 5.5, 6.5, 7.5, 8.5, 9.5, 10.5, 99.0, 99.0])
    ds = study(capacity, end=12.0, increments=12)
    for wall in (9, 10):
        fail(ds, wall, 4)
    one = fit_fragility(ds, categories=[1], model="empirical", bootstrap=0).isel(category=0)
    assert [float(one[f"median{end}"]) for end in ("", "_failed_undamaged", "_failed_damaged")] == [7.0, 8.0, 6.0]
    every = fit_fragility(ds.isel(increment=slice(0, 6)), categories=[1], model="empirical", bootstrap=0)
    assert np.isnan(every["median"][0])
    assert float(every["median_lower_bound"][0]) == 5.0


@pytest.mark.parametrize("kind", ["shared increments", "own movements", "one movement each"])
def test_simulated_walls_of_a_fitted_curve_are_read_as_the_study_reads_walls(kind: str) -> None:
    """Also on the edge of increments, for failed walls and for walls that ended before."""
    edge = 0.1 * (kind == "own movements")
    capacity = np.array([0.5, 2.0 + edge, 2.5, 4.1, 7.9, 8.0 + edge, 8.5, 11.9, 30.0])
    if kind == "one movement each":
        movement = np.array([1.0, 1.0, 9.0, 4.0, 8.0, 8.0, 8.0, 12.0, 12.0])
        ds = single_study(movement, movement >= capacity)
    else:
        end = 12.0 if kind == "shared increments" else np.array([12.0, 6.0, 9.0, 12.0, 10.0, 16.0, 8.0, 12.0, 24.0])
        ds = study(capacity, end=end, increments=6)
    walls = read_capacities(ds, [1], "central_deflection")
    lower, upper = walls.capacities.lower[0], walls.capacities.upper[0]
    assert (walls.marks is not None) == (kind == "shared increments")
    found = _grouped_by_increments(capacity, walls.capacities.end, walls, upper)
    np.testing.assert_allclose(found[0], lower, rtol=1e-12)
    np.testing.assert_allclose(found[1], upper, rtol=1e-12)
    # followed to less than their movement: known to be undamaged up to there alone
    if kind != "one movement each":
        followed = np.minimum(walls.capacities.end, 5.0)
        low, high = _grouped_by_increments(capacity, followed, walls, upper)
        np.testing.assert_allclose(high, np.where(upper <= 5.0, upper, np.inf))
        np.testing.assert_allclose(low, np.where(upper <= 5.0, lower, np.minimum(lower, 5.0)))


def test_a_p_value_is_the_rank_of_the_statistic_among_simulated_ones() -> None:
    """Of lognormal walls p-values are even: five studies of 40 walls, 19 simulations each, fewer after the tenth."""
    found = []
    for seed in range(5):
        capacity = 6.0 * np.exp(0.4 * np.random.default_rng([3, seed]).standard_normal(40))
        ds = study(capacity, end=12.0, increments=12)
        found.append(float(fit_fragility(ds, categories=[1], bootstrap=0, goodness=19, seed=seed)["p_value"][0]))
    ranks = np.array([20 * p if p <= 0.5 else 10 / p for p in found])
    np.testing.assert_allclose(ranks, np.round(ranks), atol=1e-9)
    assert 0.25 < np.mean(found) < 0.75
    assert len(set(found)) > 3


def test_a_sequential_p_value_is_conservative_and_finds_as_many_doubtful_curves() -> None:
    """Under the true form, of 20 000 statistics and 100 simulated ones each; 40 of 100 suffice on the average."""
    random = np.random.default_rng(8)
    studies = 20_000
    statistic, simulated = random.random(studies), random.random((studies, 100))
    drawn = np.zeros(studies, dtype=int)

    def counted(k: int) -> Iterator[float]:
        for value in simulated[k].tolist():
            drawn[k] += 1
            yield value

    found = np.array([sequential_p_value(statistic[k], counted(k)) for k in range(studies)])
    full = ((simulated >= statistic[:, None]).sum(axis=1) + 1) / 101
    np.testing.assert_array_equal(found[full < 0.1], full[full < 0.1])
    np.testing.assert_array_equal(found < DOUBTFUL, full < DOUBTFUL)
    for level in (2 / 101, 5 / 101, 0.1, 0.2, 0.5, 10 / 12):  # levels that p-values reach: exact
        assert (found <= level).mean() == pytest.approx(level, abs=4 * np.sqrt(level * (1 - level) / studies))
    for level in (DOUBTFUL, 0.15, 0.8):  # others: at most
        assert (found <= level).mean() < level + 4 * np.sqrt(level * (1 - level) / studies)
    assert drawn.mean() < 40
    # of a form that is refused, all are drawn
    assert sequential_p_value(2.0, iter(simulated[0])) == 1 / 101


def test_every_column_of_a_comparison() -> None:
    """Three categories at the increments of the reference; eight of ten samples in common."""
    first = small().assign({"joint.friction": ("sample", np.arange(13.0))})
    first.attrs |= {"seed": 3, "sampler": "random", "highest_category": 2, "damage_table": "a table"}
    first["damage_category"].attrs["flag_values"] = np.arange(5, dtype=np.int8)
    second = first.copy(deep=True).isel(sample=slice(0, 9))
    second["damage_category"].values[:] = np.roll(first["damage_category"].values[:9], 2, axis=1)
    second["damage_category"].values[:, :2] = 0
    other = second.assign_attrs(seed=8)
    found = compare({"as it is": first, "better": second, "else": other})
    assert found["movement"].values.tolist() == list(range(1, 13))
    assert found["movement_name"].values.tolist() == [f"{m}" for m in range(1, 13)]
    assert found["movement"].attrs == {"units": "mm", "long_name": "movement", "measure": "central_deflection"}
    assert found["category"].values.tolist() == [1, 2]
    assert found["category"].attrs["flag_meanings"].split()[2] == "slight"
    assert found["category"].attrs["flag_values"].tolist() == [0, 1, 2, 3, 4]
    assert found["paired_samples"].values.tolist() == [12, 9, 0]
    assert found.attrs == {"confidence": 0.9, "reference": "as it is", "damage_table": "a table"}
    assert found["probability"].attrs == {"units": "1", "long_name": "probability of the category or worse"}
    assert found["difference_lower"].attrs["long_name"] == "change of that probability against the first study"
    category = second["damage_category"].values[:, 1:]
    for k in (1, 2):
        share = (np.maximum.accumulate(category, axis=1) >= k).mean(axis=0)
        np.testing.assert_allclose(found["probability"][1, k - 1], share, atol=1e-12)
    before = compare({"as it is": first.isel(sample=slice(9)), "better": second})["probability"][0]  # the same samples
    np.testing.assert_allclose(found["difference"][1], found["probability"][1] - before, atol=1e-12)
    np.testing.assert_allclose(found["difference"][2], found["probability"][2] - found["probability"][0], atol=1e-12)
    unknown = found["unknown"].values
    assert unknown[0, 0].tolist() == [0] * 3 + [1] * 9
    assert unknown[1].sum() == 0
    # pairs are nearer to each other than different walls
    width = (found["difference_upper"] - found["difference_lower"]).sel(category=1, movement=[4, 6])
    assert (width.sel(study="better") < width.sel(study="else")).all()
    for s in ("better", "else"):
        part = found.sel(study=s)
        assert (part["probability_lower"] <= part["probability"]).all()
        assert (part["difference_lower"] >= -1).all()
        assert (part["difference_upper"] <= 1).all()
    limits = [wilson(3 / 9, 9), wilson(float(found["probability"][1, 0, 5]), 9)]
    assert float(found["probability_lower"][1, 0, 5]) == pytest.approx(limits[1][0], abs=1e-9)
    assert float(found["probability_upper"][1, 0, 5]) == pytest.approx(limits[1][1], abs=1e-9)


def test_a_difference_of_replicates_is_student_s_of_their_means() -> None:
    """Four scrambles in turn: the mean of each one's differences, with three degrees of freedom."""
    random = np.random.default_rng(5)
    common = {"seed": 1, "sampler": "sobol", "replicates": 4, "highest_category": 1, "damage_table": "a table"}
    studies = {}
    for name, median in (("a", 5.0), ("b", 7.0)):
        capacity = median * np.exp(0.4 * random.standard_normal(40))
        studies[name] = study(capacity, end=12.0, increments=12, **common).assign({"x.y": ("sample", np.arange(40.0))})
    found = compare(studies, at=[6.0]).isel(study=1, category=0, movement=0)
    hit = [(ds["damage_category"].values[:, 6] >= 1).astype(float) for ds in studies.values()]
    each = np.array([(hit[1] - hit[0])[r::4].mean() for r in range(4)])
    half = stats.t.ppf(0.95, 3) * each.std(ddof=1) / 2
    assert float(found["difference"]) == pytest.approx(each.mean())
    assert float(found["difference_lower"]) == pytest.approx(max(each.mean() - half, -1.0))
    assert float(found["difference_upper"]) == pytest.approx(min(each.mean() + half, 1.0))


@pytest.mark.parametrize("scale", ["log", "linear"])
def test_every_column_of_a_surface_of_exact_walls(scale: str) -> None:
    """Fine increments: the slope, dispersion and Akaike's criteria of ordinary least squares."""
    random = np.random.default_rng(2)
    z = random.uniform(1.0, 3.0, 30)
    x = np.log(z) if scale == "log" else z
    y = 1.0 + 0.7 * x + 0.2 * random.standard_normal(30)
    ds = study(np.exp(y), end=40.0, increments=8000, source="made up")
    ds = ds.assign({"joint.strength": ("sample", z, {"units": "MPa", "long_name": "strength", "role": "input"})})
    found = fit_surface(ds, 1, "joint.strength", scale=scale, bootstrap=0, points=(5, 3))
    slope, intercept = np.polyfit(x, y, 1)
    rest = y - intercept - slope * x
    assert float(found["slope"]) == pytest.approx(slope, rel=2e-3)
    assert float(found["dispersion"]) == pytest.approx(rest.std(), rel=2e-3)
    assert float(found["dispersion_alone"]) == pytest.approx(y.std(), rel=2e-3)
    gain = 30 * np.log(y.std() / rest.std())
    assert found.attrs["aic_without"] - found.attrs["aic_with"] == pytest.approx(2 * gain - 2, abs=0.1)
    second = np.geomspace(z.min(), z.max(), 3) if scale == "log" else np.linspace(z.min(), z.max(), 3)
    np.testing.assert_allclose(found["second"], second)
    np.testing.assert_allclose(found["intensity"], np.linspace(0, 40, 5))
    median = np.exp(intercept + slope * (np.log(second) if scale == "log" else second))
    np.testing.assert_allclose(found["median"], median, rtol=5e-3)
    with np.errstate(divide="ignore"):
        rising = special.ndtr(np.log(np.linspace(0, 40, 5) / median[:, None]) / rest.std())
    np.testing.assert_allclose(found["probability"], rising, atol=0.01)
    assert [int(found[n]) for n in ("reached", "not_reached", "failed")] == [30, 0, 0]
    assert found["second"].attrs == {"long_name": "strength", "units": "MPa"}
    assert (found["median"].attrs["units"], found["slope"].attrs["units"]) == ("mm", "1")
    assert found["median_lower"].attrs["long_name"] == "median capacity, lower"
    assert {k: found.attrs[k] for k in found.attrs if not k.startswith(("aic", "fragility"))} == (
        {"Conventions": "CF-1.11", "title": "fragility of made up", "intensity_measure": "central_deflection"}
        | {"second_variable": "joint.strength", "scale": scale, "category": 1, "category_name": "very_slight"}
        | {"confidence": 0.9, "bootstrap_samples": 0, "bootstrap_seed": 0, "samples": 30, "samples_failed": 0}
    )
    for name in ("slope_lower", "dispersion_upper", "median_lower", "probability_upper"):
        assert np.isnan(found[name].values).all()
