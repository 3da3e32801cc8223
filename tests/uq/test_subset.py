"""Subset simulation on problems with known answers: unbiased, with the stated coverage, and repeatable."""

from collections.abc import Callable

import numpy as np
import pytest
from scipy import integrate, special, stats

from damagepred.errors import InputError
from damagepred.uq.subset import SubsetEstimate, subset_simulation

Array = np.ndarray


def linear(beta: float) -> Callable[[Array, Array], Array]:
    return lambda z, _: beta - z.sum(axis=1) / np.sqrt(z.shape[1])


def curved(z: Array, _: Array) -> Array:
    """Failure surface curved towards the origin."""
    return 3.0 - z[:, 0] - 0.15 * z[:, 1] ** 2


def series(z: Array, _: Array) -> Array:
    """A series system of four limit states, two of them curved (Waarts 2000)."""
    x, y = z[:, 0], z[:, 1]
    bent, both = 0.1 * (x - y) ** 2, (x + y) / np.sqrt(2)
    return np.min([3 + bent - both, 3 + bent + both, x - y + 7 / np.sqrt(2), y - x + 7 / np.sqrt(2)], axis=0)


def exact_curved() -> float:
    return integrate.quad(lambda y: stats.norm.pdf(y) * special.ndtr(-(3.0 - 0.15 * y**2)), -10, 10)[0]


def exact_series() -> float:
    """The safe region is star-shaped: integrate its radius over all directions."""
    angle = (np.arange(4000) + 0.5) * 2 * np.pi / 4000
    low, high = np.zeros_like(angle), np.full_like(angle, 20.0)
    for _ in range(60):
        middle = (low + high) / 2
        safe = series(np.column_stack((middle * np.cos(angle), middle * np.sin(angle))), angle) > 0
        low, high = np.where(safe, middle, low), np.where(safe, high, middle)
    return float(np.exp(-(low**2) / 2).mean())


PROBLEMS = {
    "linear, beta 3, 2 dimensions": (linear(3.0), 2, special.ndtr(-3.0)),
    "linear, beta 4, 300 dimensions": (linear(4.0), 300, special.ndtr(-4.0)),
    "curved": (curved, 2, exact_curved()),
    "series system": (series, 2, exact_series()),
}


def repeat(name: str, times: int, samples: int, confidence: float = 0.9) -> list[SubsetEstimate]:
    g, dimensions, _ = PROBLEMS[name]
    return [subset_simulation(g, dimensions, samples=samples, seed=s, confidence=confidence) for s in range(times)]


def test_the_series_system_has_the_probability_of_the_books() -> None:
    assert exact_series() == pytest.approx(2.2e-3, rel=0.05)


def check(name: str, times: int, samples: int) -> None:
    exact = PROBLEMS[name][2]
    found = repeat(name, times, samples)
    values = np.array([f.probability for f in found])
    error = values.std(ddof=1) / np.sqrt(times)
    # the method has a bias of the order of the squared coefficient of variation
    assert abs(values.mean() - exact) < 3.5 * error + 0.3 * values.var() / exact
    stated = np.sqrt(np.mean([f.variation**2 for f in found]))
    assert 0.6 * stated < values.std(ddof=1) / exact < 1.5 * stated
    hits = sum(f.lower <= exact <= f.upper for f in found)
    assert stats.binom.cdf(hits, times, 0.8) > 1e-3  # of intervals that state 0.9
    assert all(0.25 < level.acceptance < 0.65 for f in found for level in f.levels[1:])
    assert max(f.evaluations for f in found) < 8 * samples


@pytest.mark.parametrize("name", PROBLEMS)
def test_unbiased_with_the_stated_coverage(name: str) -> None:
    check(name, 40, 500)


@pytest.mark.parametrize(
    ("unknown_from", "lower", "upper"),
    [
        # nothing is known of a third of what is reached; of few that are far more often than it; of what is next to it
        (lambda z: z[:, 1] > 0.43, special.ndtr(-3.0) * special.ndtr(0.43), None),
        (lambda z: z[:, 1] > 2.0, special.ndtr(-3.0) * special.ndtr(2.0), None),
        (lambda z: (z[:, 0] > 2.8) & (z[:, 0] < 3.2), special.ndtr(-3.2), special.ndtr(-2.8)),
    ],
)
def test_unknown_samples_give_bounds(unknown_from: Callable[[Array], Array], lower: float, upper: float | None) -> None:
    """Failures injected into a problem with a known answer: one run each way is unbiased for its bound."""

    if upper is None:
        edge = 0.43 if lower < 0.001 else 2.0
        upper = lower + special.ndtr(-edge)
    for instead, exact in ((np.inf, lower), (0.0, upper)):

        def g(z: Array, _: Array, instead: float = instead) -> Array:
            return np.where(unknown_from(z), instead, 3.0 - z[:, 0])

        found = [subset_simulation(g, 2, samples=400, seed=s) for s in range(24)]
        values = np.array([f.probability for f in found])
        assert abs(values.mean() - exact) < 3.5 * values.std(ddof=1) / np.sqrt(24) + 0.3 * values.var() / exact
        assert stats.binom.cdf(sum(f.lower <= exact <= f.upper for f in found), 24, 0.8) > 1e-3


def test_the_variation_is_that_of_the_formula_by_hand() -> None:
    """Two levels of 20 samples with margins as written here; Au and Beck (2001), equations 27 to 30.

    Level 1: 5 of 20 independent samples reach it: 1/4, variation^2 = (1 - 1/4) / (1/4 x 20) = 3/20.
    Level 2: 5 chains of 4 samples reach it at 7 of 20: 7/20. Correlations within chains over 1, 2 and 3 steps are
    31/91, -9/91 and -49/91 of the variance 91/400: gamma = 2 (3/4 x 31 - 2/4 x 9 - 1/4 x 49) / 91 = 1/7, and
    variation^2 = (1 - 7/20) / (7/20 x 20) x (1 + 1/7) = 26/245.
    """
    chains = np.array([[0, 1, 1, 1], [0, 0, 1, 1], [0, 0, 0, 1], [0, 0, 1, 0], [0, 0, 0, 0]])
    first = np.where(np.arange(20) % 4 == 0, 1.0, 10.0)
    margins = np.concatenate((first, np.where(chains[:, 1:].T.ravel(), -1.0, 1.0)))
    found = subset_simulation(lambda z, numbers: margins[numbers], 2, samples=20, level_share=0.25)
    assert found.evaluations == len(margins)
    assert [level.share for level in found.levels] == pytest.approx([1 / 4, 7 / 20], rel=1e-14)
    assert [level.variation**2 for level in found.levels] == pytest.approx([3 / 20, 26 / 245], rel=1e-13)
    assert found.probability == pytest.approx(7 / 80, rel=1e-14)
    assert found.variation**2 == pytest.approx(3 / 20 + 26 / 245, rel=1e-13)
    spread = 1.6448536269514722 * np.sqrt(np.log(1 + 3 / 20 + 26 / 245))  # of a lognormal, 90 %
    assert (found.lower, found.upper) == pytest.approx((7 / 80 * np.exp(-spread), 7 / 80 * np.exp(spread)), rel=1e-12)


def test_a_likely_event_needs_one_level() -> None:
    found = subset_simulation(linear(0.5), 3, samples=500)
    assert len(found.levels) == 1
    assert found.evaluations == 500
    assert found.lower < special.ndtr(-0.5) < found.upper


def test_followed_again_from_kept_evaluations_it_is_the_same() -> None:
    kept: dict[int, float] = {}

    def keep(z: Array, numbers: Array) -> Array:
        g = series(z, numbers)
        kept.update(zip(numbers.tolist(), g.tolist()))
        return g

    first = subset_simulation(keep, 2, samples=200, seed=3)
    again = subset_simulation(lambda z, numbers: np.array([kept[int(i)] for i in numbers]), 2, samples=200, seed=3)
    np.testing.assert_array_equal(again.samples, first.samples)
    assert again.levels == first.levels or np.isnan(first.levels[0].acceptance)
    assert again.probability == first.probability
    assert sorted(kept) == list(range(first.evaluations))
    assert subset_simulation(series, 2, samples=200, seed=4).probability != first.probability


def test_steps_and_ties_do_not_mislead() -> None:
    """Margins known in steps only: levels are as likely as they are, not as they were to be."""
    g = linear(3.0)
    found = [
        subset_simulation(lambda z, n: np.ceil(4 * g(z, n)) / 4, 2, samples=500, seed=s).probability for s in range(24)
    ]
    # below the upper bound no sample exceeds 0
    error = np.std(found, ddof=1) / np.sqrt(len(found))
    assert abs(np.mean(found) - special.ndtr(-3.0)) < 4 * error


def test_a_plateau_is_reported() -> None:
    found = subset_simulation(lambda z, n: np.where(z[:, 0] > 6, -1.0, 1.0), 2, samples=100)
    assert not found.reached
    assert found.lower == 0
    nothing = subset_simulation(lambda z, n: np.full(len(z), np.inf), 2, samples=100)
    assert not nothing.reached
    with pytest.raises(InputError, match="is NaN for 100 of 100 samples; give 0"):
        subset_simulation(lambda z, n: np.full(len(z), np.nan), 2, samples=100)


@pytest.mark.parametrize(("samples", "share"), [(500, 0.3), (505, 0.1), (20, 0.1), (100, 0.0), (100, 1.0)])
def test_sizes_that_do_not_fit(samples: int, share: float) -> None:
    with pytest.raises(InputError, match="level_share"):
        subset_simulation(series, 2, samples=samples, level_share=share)


def late(z: Array, _: Array) -> Array:
    """Two regions of the same probability, one of which appears only at late levels."""
    return np.minimum(3.0 - z[:, 0], 5.0 * (3.0 - z[:, 1]))


def test_independent_runs_reveal_the_error_of_a_single_run() -> None:
    exact, times = 1 - special.ndtr(3.0) ** 2, 24
    held = {1: 0, 5: 0}
    for seed in range(times):
        for runs in held:
            found = subset_simulation(late, 2, samples=100, seed=seed, runs=runs)
            held[runs] += found.lower <= exact <= found.upper
    assert stats.binom.cdf(held[5], times, 0.9) > 1e-3
    assert held[1] < held[5]


def test_runs_are_independent_and_the_first_is_that_of_one_alone() -> None:
    one, three = (subset_simulation(series, 2, samples=200, seed=3, runs=runs) for runs in (1, 3))
    assert one.runs == ()
    assert three.runs[0] == one.probability
    assert len(set(three.runs)) == 3
    assert three.probability == pytest.approx(np.mean(three.runs))
    assert three.variation >= np.std(three.runs, ddof=1) / np.sqrt(3) / three.probability
    spread = stats.t.ppf(0.95, 2) * np.sqrt(np.log1p(three.variation**2))
    assert three.upper == pytest.approx(three.probability * np.exp(spread))
    with pytest.raises(InputError, match="runs = 0"):
        subset_simulation(series, 2, samples=200, runs=0)
