"""The search for the cheapest alternative is right as often as it says, on cheap models with known probabilities."""

from __future__ import annotations

import numpy as np
import pytest

from damagepred.errors import InputError
from damagepred.uq.selection import SelectionOptions, select_cheapest

LIMIT = 0.1


def test_the_chosen_alternative_is_that_of_brute_force_in_95_of_100_repetitions() -> None:
    random, right, samples, sure = np.random.default_rng(2), 0, [], 0
    options = SelectionOptions(confidence=0.95, first=64, most=4096)
    for _ in range(100):
        # twelve alternatives, none within a fifth of the limit; a common factor makes them alike
        factor = np.where(random.random(12) < 0.5, random.uniform(0.05, 0.7, 12), random.uniform(1.4, 5.0, 12))
        probability, cost = LIMIT * factor, random.random(12)
        common, own = random.random(4096), random.random((12, 4096))
        pick = random.random((12, 4096)) < 0.7
        uniform = np.where(pick, common, own)

        def hits(k: int, count: int, u: np.ndarray = uniform, p: np.ndarray = probability) -> np.ndarray:
            return (u[k, :count] < p[k]).astype(float)

        found = select_cheapest(cost, hits, LIMIT, options)
        feasible = probability <= LIMIT
        best = int(np.flatnonzero(feasible)[np.argmin(cost[feasible])]) if feasible.any() else None
        right += found.chosen == best
        sure += found.sure
        samples.append(found.samples.sum())
    assert right >= 95
    assert sure >= 90
    assert np.mean(samples) < 0.5 * 12 * 4096  # brute force takes all of them


def test_what_is_not_decided_is_said() -> None:
    even = np.tile([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0], 10)
    found = select_cheapest(np.array([1.0]), lambda k, n: even[:n], LIMIT, SelectionOptions(first=10, most=100))
    assert (found.chosen, found.sure) == (None, False)
    with pytest.raises(InputError, match="between 0 and 1"):
        select_cheapest(np.array([1.0]), lambda k, n: even[:n], 1.5, SelectionOptions())
