"""Subset simulation: small probabilities as products of larger ones (Au and Beck 2001).

The samples with the smallest margins are the seeds of Markov chains that draw the next level, by conditional sampling
in standard normals (Papaioannou, Betz, Zwirglmaier and Straub 2015) with the step adapted to the acceptance rate. The
innovation of evaluation e depends on (seed, e) alone: a run whose evaluations were stored can be repeated without them.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from damagepred.arrays import BoolArray, FloatArray, IntArray
from damagepred.errors import InputError, require_count, require_number
from damagepred.inputs.arguments import checked
from damagepred.runtime.one_thread import one_blas_thread
from damagepred.uq.estimate import normal_factor, student_factor, wilson
from damagepred.uq.random_streams import RandomStream, generator

LimitState = Callable[[FloatArray, IntArray], FloatArray]


TARGET_ACCEPTANCE, INITIAL_STEP, SMALLEST_STEP = 0.44, 0.6, 0.05
"""Acceptance rate to which the step s of the conditional sampler is adapted; its first and its smallest value (1)."""
MAX_NORMALS = 10**9  # standard normals of a level beyond which it is refused


class Level(NamedTuple):
    """One level."""

    limit: float  # largest margin that counts as reached; 0 at the last level
    share: float  # of the level's samples that reached it
    variation: float  # coefficient of variation of that share, dependence along the chains counted
    acceptance: float  # share of the chains' proposals that were accepted; NaN at the first level, which has no chains


class SubsetEstimate(NamedTuple):
    """Result of subset simulation."""

    probability: float  # of a margin of 0 or less
    # its coefficient of variation, the levels taken as independent (Au and Beck 2001): low where they are not
    variation: float
    # confidence interval, lognormal, and its level
    lower: float
    upper: float
    confidence: float
    levels: tuple[Level, ...]  # from the first to the last
    evaluations: int  # of the limit state
    reached: bool  # whether the last level got to failure; if not, ``probability`` is an upper estimate
    samples: FloatArray  # (samples, dimensions): of the last level, standard normals
    margins: FloatArray  # (samples,): theirs
    # probabilities that the independent runs found; ``levels``, ``samples`` and ``margins`` are of the last run
    runs: tuple[float, ...] = ()


@checked
@one_blas_thread()
def subset_simulation(
    limit_state: LimitState,
    dimensions: int,
    *,
    samples: int = 500,
    level_share: float = 0.1,
    seed: int = 0,
    max_levels: int = 10,
    confidence: float = 0.9,
    runs: int = 1,
    on_level: Callable[[Level], None] | None = None,
) -> SubsetEstimate:
    """Estimate a small probability.

    Parameters
    ----------
    limit_state : callable
        Given independent standard normals, array (n, dimensions), and the numbers of these evaluations, array of int
        (n,), returns margins, array (n,): 0 or less is reached, and the smaller the nearer to it. Where it is
        unknown, run once with 0 and once with infinity: the probability lies between both.
    dimensions : int
        Number of standard normals.
    samples : int
        A level.
    level_share : float
        Share of a level's samples that the next starts from.
    seed : int
        Seed of all random numbers.
    max_levels : int
        Levels after which it gives up.
    confidence : float
        Confidence level of the interval.
    runs : int
        Independent runs whose mean is taken. Levels of one run are correlated, and a run without initial samples in
        one of several failure regions may never find it: the interval of a single run covers the truth less often than
        its confidence (studies/coverage). That of several is Student's, with the larger of their standard error and
        the one that follows from the runs' own coefficients of variation.
    on_level : callable, optional
        Called with each ``Level`` as it is known.

    Raises
    ------
    InputError
        If ``samples * level_share`` or ``1 / level_share`` is no whole number, or either is too small; if a margin is
        NaN; if there are no runs.

    Examples
    --------
    >>> import numpy as np
    >>> found = subset_simulation(lambda z, numbers: 3.0 - z.sum(axis=1) / np.sqrt(5), 5, samples=1000)
    >>> 0.0005 < found.probability < 0.003   # exact: 0.00135
    True
    """
    chains, length = check_sizes(samples, level_share)
    for name, value in (("runs", runs), ("dimensions", dimensions), ("max_levels", max_levels)):
        require_count(name, value)
    require_count("seed", seed, 0)
    require_number("samples x dimensions", samples * dimensions, 1, MAX_NORMALS)
    require_number("confidence", confidence, 0.0, 0.9999, open_low=True)
    margin = _NumberedLimitState(limit_state)

    def one_run(run: int) -> SubsetEstimate:
        """Carry out one run of subset simulation."""
        z = _normals(seed, margin.count, samples, dimensions)
        g = margin(z)
        levels: list[Level] = []
        step, acceptance = INITIAL_STEP, np.nan
        while True:
            ordered = np.sort(g)
            limit = float(0.5 * (ordered[chains - 1] + ordered[chains])) if ordered[chains - 1] > 0 else 0.0
            reached = g <= limit
            share = float(reached.mean())
            levels.append(Level(limit, share, _variation(reached, share, chains if levels else samples), acceptance))
            if on_level is not None:
                on_level(levels[-1])
            # no further level follows where most samples share one margin
            if limit == 0.0 or len(levels) == max_levels or not np.isfinite(limit) or share > 0.5:
                return _estimate(levels, g, z, margin, confidence)
            # of equal margins more samples than chains may have reached the limit: the seeds are drawn from all of them
            random = generator(seed, RandomStream.SUBSET_START, run * max_levels + len(levels))
            start = random.permutation(np.flatnonzero(reached))[:chains]
            z, g, acceptance, step = _sample_level(margin, z[start], g[start], limit, length, step, seed)

    estimates = [one_run(run) for run in range(runs)]
    return estimates[0] if runs == 1 else _mean_of_runs(estimates)


def _normals(seed: int, first: int, evaluations: int, dimensions: int) -> FloatArray:
    """Standard normals of evaluations from a number on, array (evaluations, dimensions)."""
    streams = (generator(seed, RandomStream.SUBSET, first + i) for i in range(evaluations))
    return np.array([stream.standard_normal(dimensions) for stream in streams])


def _mean_of_runs(estimates: list[SubsetEstimate]) -> SubsetEstimate:
    """Mean of independent runs, with a lognormal interval."""
    each, last = np.array([estimate.probability for estimate in estimates]), estimates[-1]
    mean, count = float(each.mean()), len(estimates)
    stated = np.array([estimate.variation for estimate in estimates]) * each
    error = max(float(each.std(ddof=1)) / np.sqrt(count), float(np.sqrt((stated**2).sum())) / count)
    variation = error / mean
    reached = all(estimate.reached for estimate in estimates)
    spread = student_factor(last.confidence, count - 1) * np.sqrt(np.log1p(variation**2))
    return last._replace(
        probability=mean,
        variation=variation,
        reached=reached,
        runs=tuple(each.tolist()),
        lower=mean * float(np.exp(-spread)) if reached else 0.0,
        upper=min(mean * float(np.exp(spread)), 1.0) if reached else max(estimate.upper for estimate in estimates),
    )


def check_sizes(samples: int, level_share: float) -> tuple[int, int]:
    """Return the number of chains of a level and their length."""
    possible = 0 < level_share < 1
    chains, length = (round(samples * level_share), round(1 / level_share)) if possible else (0, 0)
    if chains * length != samples or chains < 5 or length < 2:
        raise InputError(
            f"samples = {samples}, level_share = {level_share:g}: the share must be one over a whole number, 2 or "
            "more, and give a whole number of samples, 5 or more; 500 and 0.1 do."
        )
    return chains, length


class _NumberedLimitState:
    """A limit state whose evaluations are numbered."""

    def __init__(self, limit_state: LimitState) -> None:
        self.limit_state, self.count = limit_state, 0

    def __call__(self, z: FloatArray) -> FloatArray:
        try:
            g = np.asarray(self.limit_state(z, np.arange(self.count, self.count + len(z))), dtype=np.float64)
        except (TypeError, ValueError) as error:
            raise InputError(f"limit_state: gives no numbers ({error}).") from error
        if g.shape != (len(z),):
            raise InputError(f"limit_state: must give one number per sample, shape {(len(z),)}; it gives {g.shape}.")
        if unknown := int(np.isnan(g).sum()):
            raise InputError(
                f"limit_state: is NaN for {unknown} of {len(z)} samples; give 0 (reached) or infinity (not reached)."
            )
        self.count += len(z)
        return g


def _sample_level(
    margin: _NumberedLimitState, z: FloatArray, g: FloatArray, limit: float, length: int, step: float, seed: int
) -> tuple[FloatArray, FloatArray, float, float]:
    """Next level's samples and margins, the acceptance rate and the last step, all chains side by side."""
    chains = len(z)
    all_z, all_g = [z], [g]
    accepted = 0
    for k in range(1, length):
        xi = _normals(seed, margin.count, chains, z.shape[1])
        proposed = np.sqrt(1.0 - step**2) * z + step * xi
        margins = margin(proposed)
        take = margins <= limit
        z, g = np.where(take[:, None], proposed, z), np.where(take, margins, g)
        all_z.append(z)
        all_g.append(g)
        accepted += int(take.sum())
        adapted = step * np.exp((take.mean() - TARGET_ACCEPTANCE) / np.sqrt(k))
        step = float(np.clip(adapted, SMALLEST_STEP, 1.0))
    return np.concatenate(all_z), np.concatenate(all_g), accepted / (chains * (length - 1)), step


def _variation(reached: BoolArray, share: float, chains: int) -> float:
    """Coefficient of variation of a share, with the correlation along chains (Au and Beck 2001, eq. 29)."""
    if share == 1.0:
        return 0.0
    hits = reached.reshape(-1, chains).astype(np.float64)
    length = len(hits)
    variance = share * (1 - share)
    dependence = 0.0
    for lag in range(1, length):
        covariance = float((hits[:-lag] * hits[lag:]).mean()) - share**2
        dependence += 2 * (1 - lag / length) * covariance / variance
    return float(np.sqrt((1 - share) / (share * reached.size) * max(1 + dependence, 1e-2)))


def _estimate(
    levels: list[Level], g: FloatArray, z: FloatArray, margin: _NumberedLimitState, confidence: float
) -> SubsetEstimate:
    probability = float(np.prod([level.share for level in levels]))
    reached = levels[-1].limit == 0.0
    variation = float(np.sqrt(sum(level.variation**2 for level in levels)))
    factor = normal_factor(confidence)
    if len(levels) == 1 and reached:
        lower, upper = wilson(probability, len(g), factor)
    elif not reached:
        lower, upper = 0.0, min(probability * (1 + 10 * factor * min(variation, 1.0)), 1.0)
    else:
        spread = factor * np.sqrt(np.log1p(variation**2))
        lower, upper = probability * np.exp(-spread), min(probability * np.exp(spread), 1.0)
    interval = float(lower), float(upper), confidence
    return SubsetEstimate(probability, variation, *interval, tuple(levels), margin.count, reached, z, g)
