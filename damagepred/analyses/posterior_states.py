"""Weights of the states of stored walls, over the distributions of discrepancy and history."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from scipy import special

from damagepred.analyses.inference_options import InferenceOptions
from damagepred.analyses.stored_walls import StoredWalls, is_local
from damagepred.arrays import FloatArray, IntArray
from damagepred.uq.discrepancy import stacked
from damagepred.uq.estimate import effective_samples
from damagepred.uq.history import PARAMETERS, PRESENT, Histories, drawn_histories, years_from
from damagepred.uq.movement_distribution import MovementDistribution
from damagepred.uq.observations import Observations
from damagepred.uq.samplers import unit_points
from damagepred.uq.survey_likelihood import Fit

CELLS = 400_000  # states times histories whose likelihood is computed at a time: some arrays of 3 MB
ROUNDS, WALLS, DEFENSIVE, KERNEL, MORE = 8, 60, 0.2, 0.5, 4
"""Population Monte Carlo: most rounds, walls that guide them, share drawn from the prior, kernel over the scatter; and
factor on the draws of the last three rounds."""

LIKELY = 64  # histories, the likeliest, among which the least misfit is looked for
DRAWN = 4000  # histories drawn from the posterior: shares are known to 0.8 %


def chosen_samples(weight: FloatArray, count: int) -> tuple[IntArray, FloatArray]:
    """Sample without replacement, with inclusion probabilities min(1, c w) (systematic; Tille 2006)."""
    used = np.flatnonzero(weight > 0)
    if len(used) <= count:
        return used, np.ones(len(used))
    chance = np.zeros(len(weight))
    sure = np.zeros(len(weight), dtype=bool)
    while True:
        free = ~sure & (weight > 0)
        chance = np.where(sure, 1.0, np.where(free, weight * (count - sure.sum()) / max(weight[free].sum(), 1e-300), 0))
        if not (more := (chance >= 1) & free).any():
            break
        sure |= more
    steps = np.floor(np.cumsum(chance) + 0.5 + 1e-9)
    drawn = np.flatnonzero(np.diff(steps, prepend=0.0) > 0)
    return drawn, chance[drawn]


def needs_replays(seen: Observations) -> bool:
    """Whether archives lack the observed results: local cracks, and levels."""
    return any(is_local(series[0]) for _, series in seen.series)


class _Draws(NamedTuple):
    """Histories and discrepancies on one axis, with the logarithm of their weights."""

    past: Histories
    terms: Any
    log_weight: FloatArray


class States(NamedTuple):
    """States of a study's walls."""

    log: FloatArray  # (samples, increments): logarithm of the weight, not normalised
    misfit: FloatArray  # (quantities,): of each quantity of the survey, in the state with the least sum
    replayed: int
    past: Histories = PRESENT
    # drawn from the posterior: sample, increment and number of the history
    drawn: tuple[IntArray, IntArray, IntArray] | None = None
    effective: float = np.inf  # number of the histories
    visits: tuple[FloatArray | None, ...] = ()  # log weights if a visit were alone, None without readings


def states_of(
    walls: StoredWalls,
    seen: Observations,
    movement: MovementDistribution | None,
    workers: int,
    options: InferenceOptions,
    on_replay: Callable[[int, int], None] | None,
) -> States:
    """Weights of the states, over the distributions of discrepancy and history."""
    shares, models = zip(*seen.discrepancy.nodes(options.discrepancy_points))
    now = _Draws(PRESENT, stacked(models), np.log(shares))
    prior, rows, chance = walls.log_prior(movement), np.arange(len(walls.movement)), np.ones(len(walls.movement))
    local = needs_replays(seen)

    def all_samples(log: FloatArray) -> FloatArray:
        """Log weights of all samples from the log likelihood of the used ones."""
        full = np.full(prior.shape, -np.inf)
        full[rows] = prior[rows] + special.logsumexp(log, axis=2) - np.log(chance)[:, None]
        return full

    if local:
        several = len(seen.dates) > 1
        first = _near_posterior(walls, seen, prior, rows, options, local=False) if several else now
        log = all_samples(_log_likelihood(walls, seen, first, rows, local=False))
        if not np.isfinite(log).any():
            return States(log, np.full(len(seen.series), np.inf), 0)
        rows, chance = chosen_samples(np.exp(log - log.max()).sum(axis=1), options.replays)
        walls.replay(rows, workers, on_replay)
    draws = _near_posterior(walls, seen, prior, rows, options, local=True) if len(seen.dates) > 1 else now
    each = _log_likelihood(walls, seen, draws, rows, local=True)
    log = all_samples(each)
    each += (prior[rows] - np.log(chance)[:, None])[..., None]
    likely = np.argsort(special.logsumexp(each, axis=(0, 1)))[-LIKELY:]
    past = PRESENT if draws is now else Histories(*(values[likely] for values in draws.past))
    fit = walls.fit(seen, past, seen.discrepancy, rows, local)
    states = States(log, _least_misfit(walls, seen, past, rows, local, fit, log), len(rows) if local else 0)
    if not seen.dates or not np.isfinite(states.misfit).all():
        return states
    each = np.exp(each - log.max())
    alone = [seen.alone(day) for day in seen.dates]
    visits = [None if v is None else all_samples(_log_likelihood(walls, v, now, rows, local)) for v in alone]
    # systematic resampling, which draws a state as often as its share says
    points = (np.arange(DRAWN) + 0.5) / DRAWN * each.sum()
    row, increment, draw = np.unravel_index(np.searchsorted(np.cumsum(each.ravel()), points), each.shape)
    effective = effective_samples(each.sum(axis=(0, 1)))
    if draws is now:  # of one visit: the prior's histories
        kinds, equal = range(len(seen.prior.kind)), np.zeros(options.histories)
        draws = _joined([_drawn(seen, k, _normals(seen, k, options, k), equal) for k in kinds])
        effective = np.inf
        draw = np.random.default_rng(0).integers(len(draws.log_weight), size=DRAWN)
    drawn = rows[row], increment, draw
    return states._replace(past=draws.past, drawn=drawn, effective=effective, visits=tuple(visits))


def _least_misfit(
    walls: StoredWalls, seen: Observations, past: Histories, rows: IntArray, local: bool, fit: Fit, log: FloatArray
) -> FloatArray:
    """Misfit of each quantity in the possible state that has the least sum of them."""
    possible = np.where(np.isfinite(log[rows])[..., None] & np.isfinite(fit.misfit), fit.misfit, np.inf)
    row, increment, draw = np.unravel_index(np.argmin(possible), possible.shape)
    if not np.isfinite(possible[row, increment, draw]):
        return np.full(len(seen.series), np.inf)
    past = past if past is PRESENT else Histories(*(values[[draw]] for values in past))
    alone = (walls.fit(seen, past, seen.discrepancy, rows[[row]], local, [one]) for one in seen.series)
    return np.array([fit.misfit[0, increment, 0] for fit in alone])


def _log_likelihood(walls: StoredWalls, seen: Observations, draws: _Draws, rows: IntArray, local: bool) -> FloatArray:
    """Weighted log likelihood of the states of some walls, on (rows, increments, draws)."""
    log = np.empty((len(rows), walls.movement.shape[1], len(draws.log_weight)))
    step = max(1, CELLS // log[0].size)
    for some in (slice(start, start + step) for start in range(0, len(rows), step)):
        fit = walls.fit(seen, draws.past, draws.terms, rows[some], local)
        log[some] = fit.log_likelihood + draws.log_weight
    return np.where(np.isfinite(log), log, -np.inf)


def _drawn(seen: Observations, kind: int, normal: FloatArray, log_weight: FloatArray) -> _Draws:
    """Histories of a kind and discrepancies at independent standard normals."""
    days = seen.dates
    first = years_from(days[-1], days[:1])[0]
    count = PARAMETERS[seen.prior.kind[kind]]
    past = drawn_histories(seen.prior, kind, special.ndtr(normal[:, :count]), first, days[-1])
    models = [seen.discrepancy.at(z) if z.size else seen.discrepancy for z in normal[:, count:]]
    return _Draws(past, stacked(models), log_weight)


def _normals(seen: Observations, kind: int, options: InferenceOptions, seed: int) -> FloatArray:
    """Standard normals of histories of a kind, and of the terms of the discrepancy if it is integrated."""
    terms = len(seen.discrepancy.uncertain) if options.discrepancy_points > 1 else 0
    return special.ndtri(unit_points("sobol", PARAMETERS[seen.prior.kind[kind]] + terms, options.histories, seed))


def _joined(parts: Sequence[_Draws]) -> _Draws:
    """Draws of several kinds, which are equally likely before the survey."""
    terms = {name: np.concatenate([getattr(part.terms, name) for part in parts]) for name in vars(parts[0].terms)}
    # equally likely kinds, each with its own number of draws
    log_weight = np.concatenate([part.log_weight - np.log(len(parts) * len(part.log_weight)) for part in parts])
    past = Histories(*map(np.concatenate, zip(*(part.past for part in parts))))
    return _Draws(past, type(parts[0].terms)(**terms), log_weight)


def _near_posterior(
    walls: StoredWalls, seen: Observations, prior: FloatArray, rows: IntArray, options: InferenceOptions, local: bool
) -> _Draws:
    """Histories and discrepancies drawn near their posterior, by kind, with weights of the prior over the proposal."""
    guides = rows[np.isfinite(prior[rows]).any(axis=1)]
    guides, parts = guides[:: max(1, len(guides) // WALLS)], []
    for kind in range(len(seen.prior.kind)):
        normal = _normals(seen, kind, options, kind)
        draws = _drawn(seen, kind, normal, np.zeros(len(normal)))
        for number in range(1, ROUNDS + 1):
            log = _log_likelihood(walls, seen, draws, guides, local)
            total = special.logsumexp(log + prior[guides][..., None], axis=(0, 1))
            if not np.isfinite(total).any():
                break
            power, weight = 1.0, np.exp(total - total.max())
            while effective_samples(weight**power) < len(weight) / 16:  # tempered until enough draws count
                power *= 0.8
            share = weight**power / (weight**power).sum()
            gap = normal - share @ normal
            root = np.linalg.cholesky(KERNEL**2 * gap.T @ (share[:, None] * gap) + 1e-9 * np.eye(gap.shape[1]))
            factor = MORE if number > ROUNDS - 3 else 1  # few draws still count
            near = round((1.0 - DEFENSIVE) * factor * options.histories)
            centres = normal[np.searchsorted(np.cumsum(share), (np.arange(near) + 0.5) / near)]
            normal = _normals(seen, kind, replace(options, histories=factor * options.histories), 100 * number + kind)
            normal[:near] = centres + normal[:near] @ root.T
            gap = np.linalg.solve(root, (normal[:, None] - centres).reshape(-1, len(root)).T)
            kernels = special.logsumexp(-0.5 * (gap**2).sum(axis=0).reshape(-1, near), axis=1)
            ratio = kernels - np.log(near * np.prod(np.diag(root))) + 0.5 * (normal**2).sum(axis=1)
            log_weight = -np.logaddexp(np.log(DEFENSIVE), np.log1p(-DEFENSIVE) + ratio)
            draws = _drawn(seen, kind, normal, log_weight)
            if effective_samples(weight) > len(weight) / 4:
                break
        parts.append(draws)
    return _joined(parts)
