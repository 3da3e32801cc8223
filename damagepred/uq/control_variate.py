"""Two levels: results of a coarse model as a control variate, whose mean comes from many cheap walls.

With fine results f and coarse results c of the same samples, and coarse results alone of further samples, the estimate
is ``mean(f - a c) + a mean(further c)``. It is unbiased for any a that the averaged samples did not choose. So a is
chosen for each fifth of the samples by the other four (cross-fitting), for each scramble of Sobol points by the others.

Nor may the averaged samples decide on their own number: that is for a pilot run, which is not averaged. (The allocation
depends on the pilot's hits. With the pilot averaged, estimates of a probability of 0.05 were 13 % too high.)

Efficiency: with correlation r and cost ratio k = coarse over fine, the best allocation needs
``(sqrt(1 - r^2) + sqrt(k r^2))^2`` of the cost of plain sampling for the same error (Peherstorfer, Willcox and
Gunzburger 2016, for two models).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from damagepred.arrays import FloatArray
from damagepred.errors import InputError
from damagepred.uq.estimate import ENOUGH_REPLICATES, Estimate, student_factor


@dataclass(frozen=True)
class ControlVariateOptions:
    """Decision for a control variate, and the cross-fitting of its coefficient.

    Attributes
    ----------
    worthwhile_cost : float
        Largest cost, relative to plain sampling, at which it is used (1); at the less favourable end of the interval of
        the correlation the cost may not exceed that of plain sampling.
    folds : int
        Parts of the samples; the coefficient of each is estimated from the others.
    """

    worthwhile_cost: float = 0.8
    folds: int = 5

    @property
    def fewest(self) -> int:
        """Fine results needed: two for each part."""
        return 2 * self.folds


DEFAULT = ControlVariateOptions()


class PilotReport(NamedTuple):
    """Efficiency of a control variate, as estimated from a pilot run.

    Attributes
    ----------
    samples : int
        Of the pilot.
    correlation, correlation_lower, correlation_upper : float
        Of fine and coarse results, with a 90 % interval (Fisher).
    cost_ratio : float
        Cost of a coarse result over that of a fine one.
    relative_cost, relative_cost_worst : float
        Cost over that of plain sampling for the same error, at the correlation found and at the end of its interval
        that is nearer to 0.
    coarse_per_fine : float
        Coarse results for each fine one in the best allocation, those of the same samples counted.
    pays : bool
        Whether it is worth it.
    """

    samples: int
    correlation: float
    correlation_lower: float
    correlation_upper: float
    cost_ratio: float
    relative_cost: float
    relative_cost_worst: float
    coarse_per_fine: float
    pays: bool

    def allocation(self, budget: float, options: ControlVariateOptions = DEFAULT) -> tuple[int, int]:
        """Return the numbers of fine and coarse results that a budget allows.

        Parameters
        ----------
        budget : float
            In units of a fine result's cost; it is kept but for rounding by a few walls.
        options : ControlVariateOptions
            Its ``fewest`` fine results.

        Returns
        -------
        fine, coarse : int
            Coarse results include those of the fine ones' samples; 0 if the control variate does not pay, or not with
            so small a budget.
        """
        if not self.pays:
            return max(int(budget), 1), 0
        fine = max(int(budget / (1 + self.coarse_per_fine * self.cost_ratio)), options.fewest)
        coarse = min(round(fine * self.coarse_per_fine), int((budget - fine) / self.cost_ratio))
        return (fine, coarse) if coarse >= fine + 2 else (max(int(budget), 1), 0)

    def line(self) -> str:
        """Return it in a sentence."""
        return (
            f"correlation {self.correlation:.2f} ({self.correlation_lower:.2f} to {self.correlation_upper:.2f}, 90 %), "
            f"a coarse wall costs {self.cost_ratio:.2f} of a fine one: the same error for {self.relative_cost:.2f} of "
            f"the cost ({self.relative_cost_worst:.2f} at worst) with {self.coarse_per_fine:.1f} coarse walls a fine "
            "one: " + ("it pays" if self.pays else "it does not pay")
        )


def relative_cost(correlation: float, cost_ratio: float, most: float = 1.0 - 1e-6) -> tuple[float, float]:
    """Return the cost over that of plain sampling for the same error, and the coarse results a fine one it takes.

    Parameters
    ----------
    correlation : float
        Of fine and coarse results.
    cost_ratio : float
        Coarse over fine.
    most : float
        Share of the variance that is taken to be common to both at most.
    """
    shared = min(correlation**2, most)
    each = max(np.sqrt(shared / ((1 - shared) * cost_ratio)), 1.0)
    return float((1 - shared + shared / each) * (1 + each * cost_ratio)), float(each)


def read_pilot(
    fine: FloatArray,
    coarse: FloatArray,
    fine_cost: float,
    coarse_cost: float,
    options: ControlVariateOptions = DEFAULT,
) -> PilotReport:
    """Estimate the efficiency of a control variate from results of the same samples.

    Parameters
    ----------
    fine, coarse : array (samples,)
        Results.
    fine_cost, coarse_cost : float
        Of one result each, in the same unit.
    options : ControlVariateOptions
        Its ``worthwhile_cost``.
    """
    count, ratio = len(fine), coarse_cost / fine_cost
    spread = float(np.std(fine)) * float(np.std(coarse))
    if count < 5 or spread == 0:
        return PilotReport(count, 0.0, -1.0, 1.0, ratio, 1 + ratio, 1 + ratio, 1.0, False)
    found = float(np.clip(np.corrcoef(fine, coarse)[0, 1], -1, 1))
    centre = np.arctanh(np.clip(found, -1 + 1e-9, 1 - 1e-9))
    low, high = (float(np.tanh(centre + sign * 1.645 / np.sqrt(count - 3))) for sign in (-1, 1))
    near = 0.0 if low * high < 0 else min(abs(low), abs(high))
    # results that all agree may differ in the next sample
    most = 1.0 - 1.0 / count
    cost, each = relative_cost(found, ratio, most)
    worst = relative_cost(near, ratio, most)[0]
    pays = bool(cost <= options.worthwhile_cost and worst <= 1.0)
    return PilotReport(count, found, low, high, ratio, cost, worst, each, pays)


def two_level(
    fine: FloatArray,
    coarse: FloatArray,
    further: FloatArray,
    *,
    replicates: int = 1,
    confidence: float = 0.9,
    options: ControlVariateOptions = DEFAULT,
) -> Estimate:
    """Estimate the mean of the fine results, with the coarse ones as control variate.

    Parameters
    ----------
    fine, coarse : array (n,)
        Results of the same samples, hits or shares from 0 to 1.
    further : array (m,)
        Coarse results of the samples after those.
    replicates : int
        Independent scrambles of Sobol points that take turns as samples, 4 or more; 1: samples are random.
    confidence : float
        Of the interval.
    options : ControlVariateOptions
        Its ``folds``.

    Returns
    -------
    Estimate
        ``effective_samples`` are fine results of plain sampling with the same standard error.

    Raises
    ------
    InputError
        If there are too few scrambles, or scrambles without a sample.
    """
    fine, coarse, further = (np.asarray(v, dtype=np.float64) for v in (fine, coarse, further))
    n = len(fine)
    if replicates > 1:
        value, error, freedom = _of_scrambles(fine, coarse, further, replicates)
        wide = error
    else:
        value, error, wide = _of_random(fine, coarse, further, options.folds)
        freedom = n - 1.0
    # of whole samples no error is smaller than what half of one makes
    error, wide = max(error, 0.5 / n), max(wide, 0.5 / n)
    factor = student_factor(confidence, freedom)
    like = float(fine.var(ddof=1)) / error**2
    lower, upper = max(value - factor * wide, 0.0), min(value + factor * wide, 1.0)
    return Estimate(value, error, min(lower, value), max(upper, value), confidence, n, like)


def _of_random(fine: FloatArray, coarse: FloatArray, further: FloatArray, folds: int) -> tuple[float, float, float]:
    """Return the mean of random samples, its standard error, and the error that the interval is made with."""
    n, m = len(fine), len(further)
    fold = np.arange(n) % folds
    coefficient = np.array([_coefficient(fine[fold != k], coarse[fold != k]) for k in range(folds)])[fold] * m / (n + m)
    rest, common = fine - coefficient * coarse, float(coefficient.mean())
    value = float(rest.mean() + common * further.mean())
    # the coefficients of the folds differ: the coarse mean is added back, so that this is no variance of the samples
    centred = rest + coefficient * float(np.concatenate((coarse, further)).mean())
    # two more samples, with fine above and below coarse, widen the interval of few samples (Agresti and Coull)
    rest_error, common_error = centred.var(ddof=1) / n, common**2 * further.var(ddof=1) / m
    wide = (centred.var() * n + 2.0) / (n + 2.0) ** 2
    return value, float(np.sqrt(rest_error + common_error)), float(np.sqrt(wide + common_error))


def _of_scrambles(
    fine: FloatArray, coarse: FloatArray, further: FloatArray, replicates: int
) -> tuple[float, float, float]:
    """Return the mean, its standard error and degrees of freedom: each scramble is an independent estimate."""
    if replicates < ENOUGH_REPLICATES or len(fine) < replicates or len(further) < replicates:
        raise InputError(f"replicates = {replicates}: must be {ENOUGH_REPLICATES} or more, with samples of each.")
    which, beyond = np.arange(len(fine)) % replicates, (len(fine) + np.arange(len(further))) % replicates
    found = np.empty(replicates)
    for k in range(replicates):
        here, others = which == k, which != k
        all_coarse = np.append(coarse[here], further[beyond == k])
        slope = _coefficient(fine[others], coarse[others])
        found[k] = fine[here].mean() - slope * (coarse[here].mean() - all_coarse.mean())
    return float(found.mean()), float(found.std(ddof=1) / np.sqrt(replicates)), replicates - 1.0


def _coefficient(fine: FloatArray, coarse: FloatArray) -> float:
    spread = float(coarse.var())
    return float(((fine - fine.mean()) * (coarse - coarse.mean())).mean()) / spread if spread > 0 else 0.0
