"""Selection of the cheapest alternative whose probability of damage is low enough, by successive elimination.

In each round every alternative that may still be the answer gets more samples. One whose upper bound lies below the
limit meets the target; then all dearer ones are eliminated. One whose lower bound lies above it does not meet it.

The bounds are those of Hoeffding (1963, theorem 1), n KL(mean, p) <= ln(1/alpha), which hold for the mean of
independent values from 0 to 1. Each alternative and round has an equal part of the probability of error (Bonferroni).
So all decisions are right with the stated probability, whether or not the alternatives share random numbers.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy import optimize, special

from damagepred.arrays import BoolArray, FloatArray, IntArray
from damagepred.errors import InputError


@dataclass(frozen=True)
class SelectionOptions:
    """Options of the search.

    Attributes
    ----------
    confidence : float
        Probability that all decisions are right.
    first, most : int
        Samples of an alternative in the first round, and at most.
    growth : float
        Factor on the samples from round to round.
    """

    confidence: float = 0.95
    first: int = 32
    most: int = 1024
    growth: float = 2.0

    def rounds(self) -> list[int]:
        """Return the number of samples of an alternative in each round."""
        counts = [self.first]
        while counts[-1] < self.most:
            counts.append(min(int(np.ceil(counts[-1] * self.growth)), self.most))
        return counts


class Selection(NamedTuple):
    """Outcome of a search.

    Attributes
    ----------
    chosen : int or None
        The cheapest alternative that meets the target; None if none is known to.
    sure : bool
        Whether no cheaper alternative is undecided.
    meets, fails : array of bool (alternatives,)
        Decisions; neither where undecided or eliminated.
    mean, lower, upper : array (alternatives,)
        Estimate and one-sided bounds.
    samples : array of int (alternatives,)
        Samples.
    """

    chosen: int | None
    sure: bool
    meets: BoolArray
    fails: BoolArray
    mean: FloatArray
    lower: FloatArray
    upper: FloatArray
    samples: IntArray


def hoeffding_bounds(mean: float, count: int, error: float) -> tuple[float, float]:
    """Return bounds of the mean of values from 0 to 1, each wrong with at most a given probability.

    Parameters
    ----------
    mean : float
        Of the values.
    count : int
        Number of values.
    error : float
        Probability.
    """
    limit = np.log(1.0 / error) / count

    def excess(p: float) -> float:
        return float(special.rel_entr(mean, p) + special.rel_entr(1.0 - mean, 1.0 - p)) - limit

    tiny = 1e-12
    lower = 0.0 if mean <= tiny or excess(tiny) < 0 else optimize.brentq(excess, tiny, mean)
    upper = 1.0 if mean >= 1 - tiny or excess(1 - tiny) < 0 else optimize.brentq(excess, max(mean, tiny), 1 - tiny)
    return float(lower), float(upper)


def select_cheapest(
    costs: FloatArray,
    hits: Callable[[int, int], FloatArray],
    limit: float,
    options: SelectionOptions,
    on_round: Callable[[int, int], None] | None = None,
) -> Selection:
    """Select the cheapest alternative whose probability of damage is at most a limit.

    Parameters
    ----------
    costs : array (alternatives,)
        Their costs.
    hits : callable
        Alternative, number of samples -> whether each is damaged, or its probability; the first samples stay the same.
    limit : float
        Largest probability that is accepted.
    options : SelectionOptions
        Confidence and samples.
    on_round : callable, optional
        Called before each round with the samples of an alternative, and the number of alternatives that get them.
    """
    if not (len(costs) and 0 < limit < 1 and 0 < options.confidence < 1):
        raise InputError("design: needs an alternative, and a probability and confidence between 0 and 1.")
    total, rounds = len(costs), options.rounds()
    error = (1.0 - options.confidence) / (total * len(rounds))
    meets, fails = np.zeros(total, dtype=bool), np.zeros(total, dtype=bool)
    mean, lower, upper = np.full(total, np.nan), np.zeros(total), np.ones(total)
    count = np.zeros(total, dtype=np.int64)
    active = np.arange(total)
    for size in rounds:
        if on_round is not None:
            on_round(size, len(active))
        for k in active:
            values = hits(int(k), size)
            mean[k], count[k] = float(np.mean(values)), len(values)
            lower[k], upper[k] = hoeffding_bounds(mean[k], len(values), error)
        meets |= upper <= limit
        fails |= lower > limit
        cheapest = costs[meets].min() if meets.any() else np.inf
        active = np.flatnonzero(~meets & ~fails & (costs < cheapest))
        if not len(active):
            break
    chosen = int(np.flatnonzero(meets)[np.argmin(costs[meets])]) if meets.any() else None
    return Selection(chosen, not len(active), meets, fails, mean, lower, upper, count)
