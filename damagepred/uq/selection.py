"""Selection of an alternative by successive elimination: the cheapest safe one, or the one of least expected cost.

In each round every alternative that may still be the answer gets more samples. For the cheapest safe one, Hoeffding's
bounds of each probability (1963, theorem 1) decide, with an equal part of the probability of error for each alternative
and round (Bonferroni). For the least expected cost, the others are compared with the one of the least estimate in pairs
of the same samples; the bounds follow the spread of the differences (``betting_lower_bound``) and hold in all rounds.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
import scipy
from scipy import special

from damagepred.arrays import BoolArray, FloatArray, IntArray
from damagepred.errors import InputError

STAKES = np.geomspace(1e-3, 1.0, 16)  # stakes of the bounds by betting, as shares of the capital


class Selection(NamedTuple):
    """Outcome of a search."""

    chosen: int | None  # the cheapest alternative that meets the target, or None
    sure: bool  # whether no cheaper alternative is undecided
    # (alternatives,): decisions; neither where undecided or eliminated
    meets: BoolArray
    fails: BoolArray
    # (alternatives,): estimate and one-sided bounds
    mean: FloatArray
    lower: FloatArray
    upper: FloatArray
    samples: IntArray  # (alternatives,): samples
    # upper bound of the expected cost by which the chosen alternative exceeds the best one; NaN where costs were not
    # compared
    regret: float = np.nan


Values = Callable[[int, int], FloatArray]  # alternative, number of samples -> values of its samples
OnRound = Callable[[int, int], None]  # called with the samples per alternative, and the number of alternatives


def hoeffding_bounds(mean: float, count: int, error: float) -> tuple[float, float]:
    """Bounds of the mean of values from 0 to 1, each wrong with at most a given probability."""
    limit = np.log(1.0 / error) / count

    def excess(p: float) -> float:
        return float(special.rel_entr(mean, p) + special.rel_entr(1.0 - mean, 1.0 - p)) - limit

    tiny = 1e-12
    lower = 0.0 if mean <= tiny or excess(tiny) < 0 else scipy.optimize.brentq(excess, tiny, mean)
    over = mean >= 1 - tiny or excess(1 - tiny) < 0
    upper = 1.0 if over else scipy.optimize.brentq(excess, max(mean, tiny), 1 - tiny)
    return float(lower), float(upper)


def select_cheapest(
    costs: FloatArray,
    hits: Values,
    limit: float,
    rounds: Sequence[int],
    confidence: float = 0.95,
    on_round: OnRound | None = None,
) -> Selection:
    """Select the cheapest alternative whose probability of damage is at most a limit, by the samples of each round."""
    if not (len(costs) and 0 < limit < 1 and 0 < confidence < 1):
        raise InputError("design: needs an alternative, and a probability and confidence between 0 and 1.")
    total = len(costs)
    error = (1.0 - confidence) / (total * len(rounds))
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


def betting_lower_bound(values: FloatArray, error: float) -> float:
    """Lower bound of the mean of independent values from 0 to 1, by the capital of bets against each mean.

    If the mean is m, the product of 1 + c (x / m - 1) over the values x is a martingale for every stake c. So the mean
    of these products over the stakes exceeds 1 / error with at most that probability (Ville's inequality; Waudby-Smith
    and Ramdas 2024). The bound adapts to the spread of the values, which need not be known.
    """

    def excess(m: float) -> float:
        with np.errstate(divide="ignore"):
            capital = np.log1p(STAKES[:, None] * (values / m - 1.0)).sum(axis=1)
        return float(special.logsumexp(capital) - np.log(len(STAKES)) + np.log(error))

    tiny, mean = 1e-12, float(np.mean(values))
    return 0.0 if mean <= tiny or excess(tiny) < 0 else float(scipy.optimize.brentq(excess, tiny, mean))


def select_least_expected(
    costs: FloatArray,
    losses: Values,
    largest: float,
    rounds: Sequence[int],
    confidence: float = 0.95,
    tolerance: float = 0.0,
    on_round: OnRound | None = None,
) -> Selection:
    """Select the alternative of the least expected cost: its own and its mean loss."""
    if not (len(costs) and largest > 0 and 0 < confidence < 1):
        raise InputError("design: needs an alternative, a positive repair cost, and a confidence between 0 and 1.")
    total = len(costs)
    error = (1.0 - confidence) / (total * (total + 1))  # ordered pairs, and two bounds of each
    mean, lower, upper = np.full(total, np.nan), costs + 0.0, costs + largest
    count, dearer = np.zeros(total, dtype=np.int64), np.zeros(total, dtype=bool)
    active, best, regret = np.arange(total), 0, np.inf
    for size in rounds:
        if on_round is not None:
            on_round(size, len(active))
        values = {int(k): losses(int(k), size) for k in active}
        for k, loss in values.items():
            mean[k], count[k] = costs[k] + loss.mean(), len(loss)
            share = loss / largest
            lower[k] = costs[k] + largest * betting_lower_bound(share, error)
            upper[k] = costs[k] + largest * (1.0 - betting_lower_bound(1.0 - share, error))
        best = int(active[np.argmin(mean[active])])
        others = [k for k in values if k != best]
        # the difference of two losses lies between -largest and largest
        shares = {k: 0.5 + 0.5 * (values[k] - values[best]) / largest for k in others}
        bounds = {k: 2.0 * largest * (betting_lower_bound(share, error) - 0.5) for k, share in shares.items()}
        excess = {k: costs[k] - costs[best] + bounds[k] for k in others}
        dearer[[k for k in others if excess[k] > 0]] = True
        regret = max([0.0, *(-bound for bound in excess.values())])
        active = np.flatnonzero(~dearer)
        if regret <= tolerance:
            break
    sure = regret <= tolerance
    meets = (np.arange(total) == best) & sure
    return Selection(best, sure, meets, dearer, mean, lower, upper, count, regret)
