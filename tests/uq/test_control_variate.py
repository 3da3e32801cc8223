"""Two levels: unbiased, with the stated coverage, and used only where they pay."""

import numpy as np
import pytest
from scipy import special, stats

from damagepred.errors import InputError
from damagepred.uq.control_variate import read_pilot, relative_cost, two_level
from damagepred.uq.samplers import unit_points


def pair(correlation: float, n: int, random: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Hits of two walls whose capacities are correlated; the coarse one is biased."""
    x = random.standard_normal(n)
    y = correlation * x + np.sqrt(1 - correlation**2) * random.standard_normal(n)
    return (x > 1.0) * 1.0, (y > 0.7) * 1.0


@pytest.mark.parametrize("correlation", [0.0, 0.9, 0.99])
def test_unbiased_with_the_stated_coverage(correlation: float) -> None:
    exact = special.ndtr(-1.0)
    found = []
    for seed in range(400):
        random = np.random.default_rng(seed)
        fine, coarse = pair(correlation, 60, random)
        found.append(two_level(fine, coarse, pair(correlation, 600, random)[1]))
    values = np.array([f.value for f in found])
    assert abs(values.mean() - exact) < 4 * values.std(ddof=1) / np.sqrt(len(values))
    assert np.sqrt(np.mean([f.error**2 for f in found])) == pytest.approx(values.std(ddof=1), rel=0.15)
    hits = sum(f.lower <= exact <= f.upper for f in found)
    assert stats.binom.cdf(hits, 400, 0.87) > 1e-3  # of intervals that state 0.9, of few hits
    assert hits < 390


@pytest.mark.parametrize("slope", [1.0, 0.5])
def test_perfectly_correlated_coarse_results_all_count(slope: float) -> None:
    """Fine results in proportion to coarse ones: the estimate is that of all coarse results, and so is its error."""
    coarse, further = np.arange(40) % 2 * 1.0, (np.arange(120) % 4 < 1) * 1.0
    found = two_level(slope * coarse, coarse, further)
    assert found.value == pytest.approx(slope * (20 + 30) / 160)
    # n s^2 + m t^2 over (n + m)^2, with the variances of the two
    error = slope * np.sqrt(40 * coarse.var(ddof=1) + 120 * further.var(ddof=1)) / 160
    assert found.error == pytest.approx(error)


def test_scrambles_with_perfectly_correlated_coarse_results() -> None:
    """Each scramble's estimate is the mean of its coarse results: 0.3, 0.4, 0.5 and 0.6 of ten each."""
    label = np.arange(40) % 4
    hits = (np.arange(40) // 4 < np.array([3, 4, 5, 6])[label]) * 1.0
    coarse, further = hits[8:28], np.append(hits[28:], hits[:8])
    found = two_level(coarse, coarse, further, replicates=4)
    assert found.value == pytest.approx(0.45)
    assert found.error == pytest.approx(np.sqrt(0.05 / 3) / 2)
    half = stats.t.ppf(0.95, 3) * found.error
    assert (found.lower, found.upper) == pytest.approx((0.45 - half, 0.45 + half))
    assert found.effective_samples == pytest.approx(coarse.var(ddof=1) / found.error**2)


def test_each_fifth_has_its_coefficient_from_the_other_four() -> None:
    """Value and error, fold by fold, by least squares of the other folds."""
    random = np.random.default_rng(5)
    fine, coarse, further = random.random(23), random.random(23), random.random(31)
    fine += 0.6 * coarse
    slope = np.empty(23)
    for k in range(5):
        others = np.arange(23) % 5 != k
        slope[k::5] = np.polyfit(coarse[others], fine[others], 1)[0] * 31 / 54
    both = np.append(coarse, further).mean()
    rest, common = fine - slope * (coarse - both), slope.mean() ** 2 * np.var(further, ddof=1) / 31
    wide = np.sqrt((np.sum((rest - rest.mean()) ** 2) + 2.0) / 25.0**2 + common)  # one more sample to either side
    found = two_level(fine, coarse, further, confidence=0.8)
    assert found.value == pytest.approx(np.mean(fine - slope * coarse) + slope.mean() * further.mean())
    assert found.error == pytest.approx(np.sqrt(np.var(rest, ddof=1) / 23 + common))
    assert found.lower == pytest.approx(found.value - stats.t.ppf(0.9, 22) * wide)
    assert (found.samples, found.confidence) == (23, 0.8)


def test_a_pilot_by_hand() -> None:
    """Hits of 4 walls of 12 each, 2 of them of both: correlation 1/4, and its interval by Fisher's transformation."""
    fine, coarse = (np.arange(12) < 4) * 1.0, ((np.arange(12) > 1) & (np.arange(12) < 6)) * 1.0
    report = read_pilot(fine, coarse, 8.0, 2.0)
    assert (report.samples, report.cost_ratio, report.correlation) == (12, 0.25, pytest.approx(0.25))
    ends = [np.tanh(np.arctanh(0.25) + sign * 1.645 / 3) for sign in (-1, 1)]
    assert [report.correlation_lower, report.correlation_upper] == pytest.approx(ends)
    assert report.relative_cost == pytest.approx(relative_cost(0.25, 0.25)[0])
    assert report.relative_cost_worst == relative_cost(0.0, 0.25)[0] == pytest.approx(1.25)
    assert report.line() == (
        f"correlation 0.25 ({ends[0]:.2f} to {ends[1]:.2f}, 90 %), a coarse wall costs 0.25 of a fine one: the same "
        "error for 1.25 of the cost (1.25 at worst) with 1.0 coarse walls a fine one: it does not pay"
    )
    # with a budget of 20: 12 fine and 13 coarse ones are too few to count on, 12 and 16 are enough
    some = report._replace(pays=True, cost_ratio=0.5, coarse_per_fine=1.1)
    assert some.allocation(20.0) == (20, 0)
    assert some._replace(coarse_per_fine=1.3).allocation(20.0) == (12, 16)
    assert some._replace(coarse_per_fine=4.0).allocation(14.0) == (14, 0)
    assert some._replace(coarse_per_fine=4.0).allocation(16.0) == (10, 12)


def whole_procedure(seed: int, counted: bool) -> float:
    """A pilot of 32, then what it says with a budget of 128; the pilot's samples counted or not. Exact: 0.05."""

    def draw(n: int) -> tuple[np.ndarray, np.ndarray]:
        x, own = random.standard_normal((2, n))
        y = 0.97 * x + np.sqrt(1.0 - 0.97**2) * own
        return (x > 1.6448536) * 1.0, (y > 1.5) * 1.0

    random = np.random.default_rng([seed, counted])
    fine, coarse = draw(32)
    n, m = read_pilot(fine, coarse, 1.0, 0.05).allocation(128.0)
    if counted:
        more = draw(max(n - 32, 0))
        fine, coarse = np.append(fine, more[0]), np.append(coarse, more[1])
    else:
        fine, coarse = draw(n)
    return two_level(fine, coarse, draw(max(m - n, 2))[1]).value if m else float(fine.mean())


def test_a_pilot_that_counts_would_bias_the_estimate_and_does_not_count() -> None:
    bias = {}
    for counted in (False, True):
        found = np.array([whole_procedure(seed, counted) for seed in range(2500)])
        bias[counted] = (found.mean() - 0.05) / (found.std(ddof=1) / np.sqrt(len(found)))
    assert abs(bias[False]) < 3.5
    assert bias[True] > 5  # standard errors: the sensitivity of this test


def test_scrambles_of_sobol_points_estimate_their_error_and_need_fewer_walls() -> None:
    """Shares that are smooth in two numbers; the coarse one is biased."""
    exact, found, plain = 0.25, [], []
    for seed in range(200):
        u = unit_points("sobol", 2, 8 * 32, seed, 8)
        fine, coarse = u[:, 0] * u[:, 1], u[:, 0] ** 1.2 * u[:, 1]
        found.append(two_level(fine[: 8 * 4], coarse[: 8 * 4], coarse[8 * 4 :], replicates=8))
        v = np.random.default_rng(seed).random((8 * 32, 2))
        fine, coarse = v[:, 0] * v[:, 1], v[:, 0] ** 1.2 * v[:, 1]
        plain.append(two_level(fine[: 8 * 4], coarse[: 8 * 4], coarse[8 * 4 :]).value)
    values = np.array([f.value for f in found])
    assert abs(values.mean() - exact) < 4 * values.std(ddof=1) / np.sqrt(200)
    assert values.std() < 0.5 * np.std(plain)
    assert sum(f.lower <= exact <= f.upper for f in found) > 170
    with pytest.raises(InputError, match="replicates = 3"):
        two_level(fine[:32], coarse[:32], coarse[32:], replicates=3)


def test_identical_results_do_not_require_ever_more_coarse_ones() -> None:
    """A pilot in which both agree, and a budget that is not exceeded."""
    hits = np.arange(12) % 2 * 1.0
    report = read_pilot(hits, hits, 1.0, 0.5)
    assert report.coarse_per_fine < 6
    for budget in (20, 100, 1000):
        n, m = report.allocation(budget)
        assert n + 0.5 * m <= budget + 1


def test_the_cost_is_that_of_the_allocation() -> None:
    """The formula against the variance of the estimator, minimised by hand."""
    for correlation, ratio in ((0.95, 0.1), (0.8, 0.02), (0.5, 0.3)):
        each = np.linspace(1, 60, 20000)
        by_hand = (1 - correlation**2 * (1 - 1 / each)) * (1 + each * ratio)
        cost, best = relative_cost(correlation, ratio)
        assert cost == pytest.approx(by_hand.min(), rel=1e-4)
        assert best == pytest.approx(each[by_hand.argmin()], abs=0.02)
    # with many coarse walls the two formulas agree
    assert relative_cost(0.95, 0.01)[0] == pytest.approx((np.sqrt(1 - 0.95**2) + 0.95 * 0.1) ** 2)


def test_the_gain_predicted_by_the_pilot_is_reached() -> None:
    random = np.random.default_rng(1)
    fine, coarse = pair(0.995, 400, random)
    report = read_pilot(fine, coarse, 1.0, 0.02)
    assert report.pays
    assert "it pays" in report.line()
    n, m = report.allocation(200.0)
    assert n + m * 0.02 == pytest.approx(200, rel=0.02)
    errors = []
    for seed in range(200):
        random = np.random.default_rng([2, seed])
        fine, coarse = pair(0.995, n, random)
        errors.append(two_level(fine, coarse, pair(0.995, m - n, random)[1]).value)
    share = special.ndtr(-1.0)
    assert np.var(errors) / (share * (1 - share) / 200) == pytest.approx(report.relative_cost, rel=0.4)


def test_coarse_walls_that_do_not_pay_are_not_used() -> None:
    random = np.random.default_rng(1)
    for correlation, ratio in ((0.3, 0.01), (0.9, 0.9)):
        report = read_pilot(*pair(correlation, 200, random), 1.0, ratio)
        assert not report.pays
        assert report.allocation(50) == (50, 0)
    # a few samples do not prove much, and results that are all alike prove nothing
    assert read_pilot(*pair(0.9, 8, random), 1.0, 0.3).pays is False
    assert read_pilot(np.zeros(30), np.zeros(30), 1.0, 0.01).pays is False


@pytest.mark.parametrize("share", [0.05, 0.2])
@pytest.mark.parametrize("correlation", [0.9, 0.98])
def test_intervals_of_twenty_fine_walls_have_the_stated_coverage(share: float, correlation: float) -> None:
    """Agreement of few walls does not prove agreement of all: coverage 0.6 instead of 0.9 before."""
    limit, held = special.ndtri(1 - share), 0
    for seed in range(200):
        random = np.random.default_rng([3, seed])
        x = random.standard_normal(220)
        y = correlation * x + np.sqrt(1 - correlation**2) * random.standard_normal(220)
        hit, coarse = (x > limit) * 1.0, (y > limit - 0.3) * 1.0
        found = two_level(hit[:20], coarse[:20], coarse[20:])
        held += found.lower <= share <= found.upper
    assert stats.binom.cdf(held, 200, 0.9) > 1e-3
