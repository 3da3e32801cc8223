"""Subset simulation on problems with known answers: unbiased, with the stated coverage, and repeatable."""

from collections.abc import Callable

import numpy as np
import pytest
from scipy import special, stats

from damagepred.uq.subset import subset_simulation

Array = np.ndarray


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


def test_the_series_system_has_the_probability_of_the_books() -> None:
    assert exact_series() == pytest.approx(2.2e-3, rel=0.05)


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
