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


def exact_series() -> float:
    """The safe region is star-shaped: integrate its radius over all directions."""
    angle = (np.arange(4000) + 0.5) * 2 * np.pi / 4000
    low, high = np.zeros_like(angle), np.full_like(angle, 20.0)
    for _ in range(60):
        middle = (low + high) / 2
        safe = series(np.column_stack((middle * np.cos(angle), middle * np.sin(angle))), angle) > 0
        low, high = np.where(safe, middle, low), np.where(safe, high, middle)
    return float(np.exp(-(low**2) / 2).mean())


EXACT_CURVED, _ = integrate.quad(lambda y: stats.norm.pdf(y) * special.ndtr(-(3.0 - 0.15 * y**2)), -10, 10)
PROBLEMS = {
    "linear, beta 3, 2 dimensions": (linear(3.0), 2, special.ndtr(-3.0)),
    "linear, beta 4, 300 dimensions": (linear(4.0), 300, special.ndtr(-4.0)),
    "curved": (curved, 2, EXACT_CURVED),
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


@pytest.mark.quick_cases
@pytest.mark.parametrize("name", PROBLEMS)
def test_unbiased_with_the_stated_coverage(name: str) -> None:
    check(name, 40, 500)


@pytest.mark.quick_cases
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


def test_followed_again_from_kept_evaluations_it_is_the_same() -> None:
    kept: dict[int, float] = {}

    def keep(z: Array, numbers: Array) -> Array:
        g = series(z, numbers)
        kept.update(zip(numbers.tolist(), g.tolist()))
        return g

    first = subset_simulation(keep, 2, samples=200, seed=3)
    again = subset_simulation(lambda z, numbers: np.array([kept[int(i)] for i in numbers]), 2, samples=200, seed=3)
    np.testing.assert_array_equal(again.samples, first.samples)
    np.testing.assert_equal(again.levels, first.levels)  # also where the acceptance is NaN
    assert again.probability == first.probability
    assert sorted(kept) == list(range(first.evaluations))
    assert subset_simulation(series, 2, samples=200, seed=4).probability != first.probability


@pytest.mark.parametrize(("samples", "share"), [(500, 0.3), (505, 0.1), (20, 0.1), (100, 0.0), (100, 1.0)])
def test_sizes_that_do_not_fit(samples: int, share: float) -> None:
    with pytest.raises(InputError, match="level_share"):
        subset_simulation(series, 2, samples=samples, level_share=share)
