"""Back-analysis: movement and cause of observed cracks, and damage by further movement.

Every increment of every stored sample is a state, with the sample's weight and the prior probability of the movements
nearest to the increment, weighted by the likelihood (self-normalised importance sampling: Robert and Casella 2004, ch.
3). Causes are studies, with Bayes factors from their mean likelihoods; another cause has the likelihood of a vague
model. Local cracks and levels come from replays of some samples, drawn with probabilities proportional to the weights
and weighted by the inverse (Horvitz and Thompson 1952). The likelihood of all observations together is integrated over
the distribution of the model's discrepancy, whose medians decide whether a state resembles the observations.

Of observations with dates a state is the largest movement up to the last visit. Histories that end there, and the
discrepancy, are drawn near their posterior (population Monte Carlo: Cappe et al. 2004) and weighted.
"""

from __future__ import annotations

import hashlib
import tomllib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from scipy import special

from damagepred.analyses.posterior_tables import LARGEST_ODDS, UNCERTAIN
from damagepred.analyses.stored_walls import StoredWalls, is_local
from damagepred.archive.folder import StudyFolder
from damagepred.arrays import FloatArray, IntArray
from damagepred.campaign.campaign import Campaign, Progress
from damagepred.campaign.settings import read_frozen
from damagepred.errors import InputError, nearest
from damagepred.formatting import duration
from damagepred.inputs.arguments import checked
from damagepred.runtime.one_thread import one_blas_thread
from damagepred.uq.capacity import highest_category
from damagepred.uq.discrepancy import stacked
from damagepred.uq.estimate import effective_samples
from damagepred.uq.history import PARAMETERS, PRESENT, Histories, drawn_histories, together, years_from
from damagepred.uq.importance import Proposal, cross_entropy_shift
from damagepred.uq.movement_distribution import MovementDistribution, movement_distribution
from damagepred.uq.observations import ANOTHER, Observations
from damagepred.uq.samplers import unit_points
from damagepred.uq.survey_likelihood import vague_log_likelihood


@dataclass(frozen=True)
class InferenceOptions:
    """Options of a back-analysis.

    Attributes
    ----------
    replays : int
        Largest number of replayed samples per study, for local cracks and levels.
    fewest_effective : float
        Effective number of samples below which the result has a caution, and new walls are run.
    new_walls : int
        Walls per round of adaptive importance sampling; 0: no new walls.
    rounds : int
        Largest number of rounds.
    nominal_share : float
        Share of the new walls drawn from the study's own distributions (defensive mixture).
    smallest_cause : float
        Least posterior probability of a cause, among the studies, for new walls.
    resemblance : float
        Probability of a larger misfit below which the best state does not resemble the observations.
    further : tuple of float
        Further movements, as shares of the study's largest.
    map_cell, map_width : float
        Side of the cells of the crack map (m), and the smallest width of its cracks (m).
    negligible : float
        Share of the posterior up to which a sample is left out of the map.
    quantiles : tuple of float
        Quantiles of the movement.
    discrepancy_points : int
        Points of the quadrature over each fitted term of the model's discrepancy; 1: without uncertainty of the fit.
    histories : int
        Histories of each kind, of observations with dates.
    """

    replays: int = 200
    fewest_effective: float = 50.0
    new_walls: int = 0
    rounds: int = 3
    nominal_share: float = 0.2
    smallest_cause: float = 0.01
    resemblance: float = 0.01
    further: tuple[float, ...] = (0.0, 0.1, 0.25, 0.5)
    map_cell: float = 0.15
    map_width: float = 5e-4
    negligible: float = 1e-4
    quantiles: tuple[float, ...] = (0.05, 0.25, 0.5, 0.75, 0.95)
    discrepancy_points: int = 7
    histories: int = 256


DEFAULT = InferenceOptions()

_MOVED_BY = {
    "central_deflection": ("movement", "central_deflection"),
    "surface_movement": ("mound", "surface_movement"),
    "settlement": ("movement", "settlement"),
}
"""Table and key of a scene with the largest value of a measure."""

CELLS = 400_000
"""States times histories whose likelihood is computed at a time: some arrays of 3 MB."""

ROUNDS, WALLS, DEFENSIVE, KERNEL, MORE = 8, 60, 0.2, 0.5, 4
"""Population Monte Carlo: most rounds, walls that guide them, share drawn from the prior, kernel over the scatter; and
factor on the draws of the last round."""

LIKELY = 64
"""Histories, the likeliest, among which the least misfit is looked for."""

DRAWN = 4000
"""Histories drawn from the posterior: shares are known to 0.8 %."""

DATES = 61
"""Dates of the drawn movement."""


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


@checked
@one_blas_thread()
def infer(
    studies: str | Path | Sequence[str | Path],
    observations: str | Path | Observations,
    *,
    workers: int = 1,
    options: InferenceOptions = DEFAULT,
    on_replay: Callable[[int, int], None] | None = None,
    on_walls: Callable[[Progress], None] | None = None,
) -> xr.Dataset:
    """Posterior of movement, cause and future damage, given observations of a wall.

    Parameters
    ----------
    studies : path or sequence of paths
        Study folders, one per cause.
    observations : path or Observations
        Survey of the wall; see ``damagepred.uq.observations``.
    workers : int
        Processes that replay samples, for local cracks and levels. Replays are stored in ``NAME.dp.replays``.
    options : InferenceOptions
        Replays, limits of the cautions, and quantities of the result.
    on_replay : callable, optional
        Called with the number of finished replays and the number of all replays.
    on_walls : callable, optional
        Called with the progress of new walls.

    Returns
    -------
    xarray.Dataset
        On (sample, increment): ``posterior``, the weights of the states, with the sum 1. On (study,): prior and
        posterior probability of the cause (``another_cause_posterior`` of all others), ``posterior_odds`` between 1/100
        and 100 (NaN below ``fewest_effective`` samples, and where no wall resembles the observations), effective
        samples, and the least misfit of a state. ``movement_quantile`` on (study, quantile), in ``movement_units`` of
        the ``movement_measure`` of each study; ``movement_cut`` is the share of the posterior at the end of the paths,
        where they cut the movement. On (study, further, category): ``future_probability`` of each category or worse
        among the walls with a result there, and its bounds ``_lower`` and ``_upper`` among all; ``further`` is a share
        of ``movement_largest``. ``advice`` names the movement to which walls should be run.

        With dates, too: ``rate_quantile`` (per year) and, on (study, kind), ``history_posterior``; on (study, until,
        ...) ``forecast_quantile`` of the movement and ``forecast_probability`` of each category or worse before a date,
        with bounds; on (study, date, quantile) ``history_quantile``; on (study, visit, quantile) ``visit_quantile``, of
        the movement if each visit were alone.

    Raises
    ------
    InputError
        If the observations cannot be made on these walls, or no state has a positive likelihood.

    Examples
    --------
    >>> import damagepred
    >>> from damagepred.uq.discrepancy import Discrepancy
    >>> from damagepred.uq.observations import Observations, CrackObservation
    >>> survey = Observations(crack=(CrackObservation(width="2 mm"),))
    >>> ds = damagepred.infer("house.dp", survey)
    >>> round(float(ds["posterior"].sum()), 6)
    1.0
    """
    paths = [studies] if isinstance(studies, str | Path) else list(studies)
    seen = observations if isinstance(observations, Observations) else Observations.from_toml(observations)
    stored = [StoredWalls(Path(p)) for p in paths]
    ds = posterior(stored, seen, workers, options, on_replay)
    for number in range(1, options.rounds + 1 if options.new_walls else 1):
        share = np.bincount(ds["study_of_sample"].values, ds["posterior"].values.sum(axis=1), len(stored))
        weak = (ds["effective_samples"].values < options.fewest_effective) & (share >= options.smallest_cause)
        if not weak.any():
            break
        for k in np.flatnonzero(weak):
            weight = ds["posterior"].values[ds["study_of_sample"].values == k].sum(axis=1)
            stored[int(k)] = _with_new_walls(
                stored[int(k)], weight, seen, number, workers, options, on_replay, on_walls
            )
        ds = posterior(stored, seen, workers, options, on_replay)
    return ds


def _with_new_walls(
    walls: StoredWalls,
    weight: FloatArray,
    seen: Observations,
    number: int,
    workers: int,
    options: InferenceOptions,
    on_replay: Callable[[int, int], None] | None,
    on_walls: Callable[[Progress], None] | None,
) -> StoredWalls:
    """Study with one more round of walls near the posterior (adaptive importance sampling: Bugallo et al. 2017)."""
    study = Campaign.from_folder(walls.path)
    if study.settings.study.sampler == "table":
        raise InputError(f"{walls.path}: new walls cannot be drawn, as the samples come from a table.")
    shifts = {}
    if study.design.wall:
        count = int(walls.first[1])
        use = weight[:count] if weight[:count].any() else np.ones(count)
        mean = cross_entropy_shift(study.design.draw(count).normal, use).mean
        shifts = {key: Proposal(shift=round(float(m), 2)) for key, m in zip(study.design.wall, mean)}
    how = replace(
        study.settings.study,
        samples=options.new_walls,
        seed=study.settings.study.seed + 1000 * number,
        sampler="random",
        replicates=1,
        stop_when=None,
        importance=shifts,
        nominal_share=options.nominal_share if shifts else 0.0,
    )
    survey = hashlib.sha256(repr(replace(seen, history=None)).encode()).hexdigest()[:8]
    folder = walls.path.with_name(f"{walls.path.name}.near_{survey}") / f"round_{number}.dp"
    folder.parent.mkdir(exist_ok=True)
    campaign = Campaign(replace(study.settings, study=how))
    if campaign.run(folder, options.new_walls, workers, on_progress=on_walls).interrupted:
        raise KeyboardInterrupt
    more = (*walls.more, folder)
    seen = replace(seen, prior_odds={})
    alone = [posterior([StoredWalls(path)], seen, workers, options, on_replay) for path in (walls.path, *more)]
    effective = np.array([float(result["effective_samples"][0]) for result in alone])
    return StoredWalls(walls.path, more, tuple((effective / effective.sum()).tolist()))


def prices(
    studies: Sequence[str | Path], observations: str | Path | Observations, options: InferenceOptions, workers: int
) -> list[str]:
    """Sentences on the largest cost of replays and rounds of new walls."""
    seen = observations if isinstance(observations, Observations) else Observations.from_toml(observations)
    sentences = []
    opened = [StoredWalls(Path(path)) for path in studies]
    for walls in opened:
        walls.require(seen)
    seconds = [float(walls.ds["run_time"].mean()) / workers for walls in opened]
    if _needs_replays(seen):
        counts = [max(0, min(options.replays, walls.known.sum()) - walls.stores[0].count()) for walls in opened]
        if any(counts):
            took = duration(float(np.dot(counts, seconds)))
            sentences.append(f"replays for local cracks and for levels: {sum(counts)} walls, about {took}")
    if not options.new_walls:
        return sentences
    took = duration(options.rounds * options.new_walls * sum(seconds))
    sentences.append(
        f"new walls where fewer than {options.fewest_effective:g} samples are effective: at most {options.rounds} "
        f"rounds of {options.new_walls} walls per study, {took} in all, and replays"
    )
    return sentences


def _needs_replays(seen: Observations) -> bool:
    """Whether archives lack the observed results: local cracks, and levels."""
    return any(is_local(series[0]) for _, series in seen.series)


def posterior(
    studies: Sequence[StoredWalls],
    seen: Observations,
    workers: int = 1,
    options: InferenceOptions = DEFAULT,
    on_replay: Callable[[int, int], None] | None = None,
) -> xr.Dataset:
    """Posterior from opened studies; see ``infer``."""
    for walls in studies:
        walls.require(seen)
    names = [walls.name for walls in studies]
    if len({*names, ANOTHER}) <= len(names):
        raise InputError(f"studies: {', '.join(names)}: each cause needs a study with a different name.")
    if seen.movement is not None and len(measures := sorted({walls.measure for walls in studies})) > 1:
        raise InputError(
            f"movement = {seen.movement}: is the prior of one measure, but the studies have {' and '.join(measures)}; "
            "leave it out, or give studies of one measure."
        )
    if unknown := [name for name in seen.prior_odds if name not in (*names, ANOTHER)]:
        raise InputError(f"prior_odds: '{unknown[0]}': is not a study." + nearest(unknown[0], [*names, ANOTHER]))
    movement = None if seen.movement is None else movement_distribution(seen.movement, studies[0].units, "movement")
    states = [states_of(walls, seen, movement, workers, options, on_replay) for walls in studies]
    logs = [each.log for each in states]
    evidence = np.array([special.logsumexp(log) if np.isfinite(log).any() else -np.inf for log in logs])
    if not np.isfinite(evidence).any():
        raise InputError("observations: no state of any stored wall has a positive likelihood.")
    prior = np.array([seen.prior_odds.get(name, 1.0) for name in (*names, ANOTHER)], dtype=np.float64)
    prior /= prior.sum()
    evidence = np.append(evidence, vague_log_likelihood(seen))
    cause = special.softmax(np.log(prior) + evidence)
    weights = [np.exp(log - e) if np.isfinite(e) else np.zeros(log.shape) for log, e in zip(logs, evidence)]
    return _dataset(studies, seen, options, weights, cause, prior, evidence, states)


class _Draws(NamedTuple):
    """Histories and discrepancies on one axis, with the logarithm of their weights."""

    past: Histories
    terms: Any
    log_weight: FloatArray


class _States(NamedTuple):
    """States of a study's walls."""

    log: FloatArray  # (samples, increments): logarithm of the weight, not normalised
    misfit: float  # least of all states
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
) -> _States:
    """Weights of the states, over the distributions of discrepancy and history."""
    shares, models = zip(*seen.discrepancy.nodes(options.discrepancy_points))
    now = _Draws(PRESENT, stacked(models), np.log(shares))
    prior, rows, chance = walls.log_prior(movement), np.arange(len(walls.movement)), np.ones(len(walls.movement))
    local = _needs_replays(seen)

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
            return _States(log, np.inf, 0)
        rows, chance = chosen_samples(np.exp(log - log.max()).sum(axis=1), options.replays)
        walls.replay(rows, workers, on_replay)
    draws = _near_posterior(walls, seen, prior, rows, options, local=True) if len(seen.dates) > 1 else now
    each = _log_likelihood(walls, seen, draws, rows, local=True)
    log = all_samples(each)
    each += (prior[rows] - np.log(chance)[:, None])[..., None]
    likely = np.argsort(special.logsumexp(each, axis=(0, 1)))[-LIKELY:]
    past = PRESENT if draws is now else Histories(*(values[likely] for values in draws.past))
    (fit,) = walls.fits(seen, past, (seen.discrepancy,), rows, local)
    possible = fit.misfit.min(axis=2)[np.isfinite(log[rows])]
    states = _States(log, float(possible.min()) if possible.size else np.inf, len(rows) if local else 0)
    if not seen.dates or not possible.size:
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
    return states._replace(
        past=draws.past, drawn=(rows[row], increment, draw), effective=effective, visits=tuple(visits)
    )


def _log_likelihood(walls: StoredWalls, seen: Observations, draws: _Draws, rows: IntArray, local: bool) -> FloatArray:
    """Weighted log likelihood of the states of some walls, on (rows, increments, draws)."""
    log = np.empty((len(rows), walls.movement.shape[1], len(draws.log_weight)))
    step = max(1, CELLS // log[0].size)
    for some in (slice(start, start + step) for start in range(0, len(rows), step)):
        (fit,) = walls.fits(seen, draws.past, (draws.terms,), rows[some], local)
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
    return _Draws(together([part.past for part in parts]), type(parts[0].terms)(**terms), log_weight)


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
            factor = MORE if number == ROUNDS else 1  # few draws still count
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


def movement_cdf(walls: StoredWalls, weight: FloatArray, points: FloatArray) -> FloatArray:
    """Posterior distribution function of the movement at some points, uniform between the edges of each increment."""
    used = weight > 1e-12 * max(weight.max(), 1e-300)
    low, high, heavy = walls.edges[:, :-1][used], walls.edges[:, 1:][used], weight[used]
    width = np.maximum(high - low, 1e-300)
    return np.array([heavy @ np.clip((x - low) / width, 0.0, 1.0) for x in points]) / max(heavy.sum(), 1e-300)


def _reached(
    walls: StoredWalls, rows: IntArray, heavy: FloatArray, target: FloatArray, highest: int
) -> tuple[FloatArray, FloatArray, FloatArray, float]:
    """Probability of each category or worse at movements of weighted walls, its bounds, and the share known there."""
    category = walls.ds["damage_category"].values
    increment = np.nanargmin(np.abs(walls.movement[rows] - target[:, None]), axis=1)
    # the nearest increment, unless the path ends before the movement
    has_result = (target <= walls.edges[rows, -1] * (1 + 1e-9)) & (category[rows, increment] >= 0)
    worst = np.maximum(category.max(axis=1), 0)[rows]
    reached = np.where(has_result, category[rows, increment], worst)[:, None] >= np.arange(1, highest + 1)
    known = float(heavy[has_result].sum())
    among = heavy[has_result] @ reached[has_result] / known if known else np.full(highest, np.nan)
    return among, heavy @ reached, heavy @ (reached | ~has_result[:, None]), known


def _probabilities(name: str, dim: str, chances: Sequence[tuple[Any, ...]]) -> xr.Dataset:
    """Probabilities of categories with their bounds, one row for each value of a dimension."""
    *values, known = zip(*chances)
    ends = dict(zip(("", "_lower", "_upper"), values))
    found = {f"{name}_probability{end}": ((dim, "category"), np.array(v), {"units": "1"}) for end, v in ends.items()}
    return xr.Dataset({**found, f"{name}_known": (dim, np.array(known), {"units": "1"})})


def _unknown(highest: int) -> tuple[Any, ...]:
    return (*np.full((3, highest), np.nan), 0.0)


def _future(walls: StoredWalls, weight: FloatArray, options: InferenceOptions, highest: int) -> xr.Dataset:
    """Probability of each category or worse after further movement, on (further, category)."""
    rows, columns = np.nonzero(weight > 0)
    heavy, now = weight[rows, columns] / max(weight.sum(), 1e-300), walls.movement[rows, columns]
    return _probabilities(
        "future",
        "further",
        [
            _reached(walls, rows, heavy, now + share * walls.largest, highest) if len(rows) else _unknown(highest)
            for share in options.further
        ],
    )


def over_time(
    walls: StoredWalls, seen: Observations, states: _States, options: InferenceOptions, highest: int
) -> xr.Dataset:
    """Rate, kind of history, and movement at dates before and after the last visit, with categories; of one study."""
    last, kinds = seen.dates[-1], seen.prior.kind
    until = seen.prior.forecast_dates(last)
    end, first = years_from(last, [until[-1], seen.dates[0]])
    dates = np.unique([*np.linspace(first - max(0.25 * (end - first), 1.0), end, DATES), *years_from(last, seen.dates)])
    year, units = np.timedelta64(round(365.25 * 86400), "s"), f"{walls.units} year-1"
    days = {"until": until, "visit": seen.dates}
    coordinates: dict[str, Any] = {name: np.array(values, dtype="datetime64[ns]") for name, values in days.items()}
    coordinates["date"] = (np.datetime64(last, "s") + dates * year).astype("datetime64[ns]")
    if states.drawn is None:
        rate, kind, paths = np.full(1, np.nan), np.full(len(kinds), np.nan), np.full((1, len(dates)), np.nan)
        later, chances = np.full((1, len(until)), np.nan), [_unknown(highest)] * len(until)
    else:
        rows, columns, draw = states.drawn
        place = np.random.default_rng(0).random(len(rows))  # anywhere between the edges of the increment
        now = walls.edges[rows, columns] + place * (walls.edges[rows, columns + 1] - walls.edges[rows, columns])
        rate, share = now * states.past.slope[draw], np.full(len(rows), 1.0 / len(rows))
        kind = np.bincount(states.past.kind[draw].astype(np.int64), minlength=len(kinds)) / len(draw)
        paths = now[:, None] * states.past.at(dates)[1][draw]
        reached, moved, _ = states.past.at(years_from(last, until))
        later = now[:, None] * moved[draw]
        chances = [_reached(walls, rows, share, now * each, highest) for each in reached[draw].T]
    alone = np.full((len(seen.dates), len(options.quantiles)), np.nan)
    for row, log in zip(alone, states.visits):
        if log is not None and np.isfinite(log).any():
            row[:] = _quantiles(walls, np.exp(log - special.logsumexp(log)), options)
    of = {"units": walls.units}
    return (
        _probabilities("forecast", "until", chances)
        .assign(
            history_posterior=("kind", kind, {"units": "1"}),
            rate_quantile=("quantile", np.quantile(rate, options.quantiles), {"units": units}),
            forecast_quantile=(("until", "quantile"), np.quantile(later, options.quantiles, axis=0).T, of),
            history_quantile=(("date", "quantile"), np.quantile(paths, options.quantiles, axis=0).T, of),
            visit_quantile=(("visit", "quantile"), alone, of),
        )
        .assign_coords(kind=list(kinds), **coordinates)
    )


def _quantiles(walls: StoredWalls, weight: FloatArray, options: InferenceOptions) -> FloatArray:
    """Quantiles of the movement."""
    grid = np.linspace(0.0, walls.largest, 1001)
    cdf = movement_cdf(walls, weight, grid)
    return np.interp(options.quantiles, cdf, grid) if cdf[-1] > 0 else np.full(len(options.quantiles), np.nan)


def _path_end(
    walls: StoredWalls, weight: FloatArray, quantiles: FloatArray, future: xr.Dataset, options: InferenceOptions
) -> tuple[float, str]:
    """Share of the posterior at the end of the paths, and advice on longer paths ("" if not needed)."""
    end = np.fmax.reduce(walls.edges, axis=1)
    at_end = (walls.edges[:, 1:] >= end[:, None] * (1 - 1e-9)) & (weight > 0)
    cut = float(weight[at_end].sum())
    ahead = [name for name in ("future", "forecast") if f"{name}_known" in future]
    doubt = max(float((future[f"{n}_probability_upper"] - future[f"{n}_probability_lower"]).max()) for n in ahead)
    if not max(doubt, cut) > UNCERTAIN or not weight.any():
        return cut, ""
    shown = walls.shown
    longest = end >= walls.largest * (1 - 1e-9)
    if weight[~longest].sum() > 0.5 * weight.sum():
        return cut, (
            f'follow walls further, with stop_at_category = "none" under [study]: most of them end before '
            f"{shown.factor * walls.largest:.3g} {shown.unit} (damage category reached, own movement, or failure)"
        )
    farthest = quantiles[-1] + max(options.further) * walls.largest
    if "forecast_quantile" in future:
        farthest = max(farthest, float(future["forecast_quantile"].max()))
    target = float(f"{farthest:.2g}")
    advice = f"run walls to {shown.factor * target:.3g} {shown.unit}"
    settings, more = read_frozen(StudyFolder(walls.path).study_text()), f"{walls.name}_farther"
    table, key = _MOVED_BY.get(walls.measure, ("", ""))
    movement = settings.scene.movement
    if not table or movement.stage or settings.scene.soil_layer or f"{table}.{key}" in settings.variables:
        return cut, f"{advice} in a separate study, and infer from it"
    count = round(movement.increment_count * target / walls.largest)
    return cut, (
        f"{advice}: sed -e 's/^{key} = .*/{key} = {target:g}/' -e 's/^increments = .*/increments = {count}/' "
        f"{walls.path.name}/study.toml > {more}.toml && damagepred study {more}.toml, and infer from {more}.dp"
    )


def _dataset(
    studies: Sequence[StoredWalls],
    seen: Observations,
    options: InferenceOptions,
    weights: Sequence[FloatArray],
    cause: FloatArray,
    prior: FloatArray,
    evidence: FloatArray,
    states: Sequence[_States],
) -> xr.Dataset:
    misfits, replayed = [each.misfit for each in states], [each.replayed for each in states]
    steps, among = max(weight.shape[1] for weight in weights), special.softmax(np.log(prior[:-1]) + evidence[:-1])
    highest = min(highest_category(walls.ds) for walls in studies)
    units = {walls.units for walls in studies}
    unit = {"units": units.pop()} if len(units) == 1 else {"comment": "in movement_units of each study"}
    values: dict[str, Any] = {"posterior": [], "movement": []}
    quantiles, futures = [], []
    for walls, weight, share, each in zip(studies, weights, among, states):
        pad = ((0, 0), (0, steps - weight.shape[1]))
        values["posterior"].append(np.pad(share * weight, pad))
        values["movement"].append(np.pad(walls.movement, pad, constant_values=np.nan))
        quantiles.append(_quantiles(walls, weight, options))
        futures.append(_future(walls, weight, options, highest))
        if seen.dates:
            futures[-1] = futures[-1].merge(over_time(walls, seen, each, options, highest))
    effective = np.array([min(effective_samples(w.sum(axis=1)), each.effective) for w, each in zip(weights, states)])
    resemblance = special.chdtrc(seen.count, np.array(misfits))
    usable = (effective >= options.fewest_effective) & (resemblance >= options.resemblance)
    with np.errstate(divide="ignore"):
        odds = np.clip(cause / (1.0 - cause), 1.0 / LARGEST_ODDS, LARGEST_ODDS)
    usable = np.append(usable, usable.any())
    cut, advice = zip(*(_path_end(*args, options) for args in zip(studies, weights, quantiles, futures)))
    state, origins = ("sample", "increment"), seen.discrepancy.origins()
    ds = xr.Dataset(
        {
            "posterior": (state, np.concatenate(values["posterior"]), {"units": "1"}),
            "movement": (state, np.concatenate(values["movement"]), unit),
            **{
                f"{who}_{name}": (dims, value[some], {"units": "1"})
                for name, value in (("prior", prior), ("posterior", cause))
                for who, dims, some in (("cause", "study", slice(-1)), ("another_cause", (), -1))
            },
            "posterior_odds": ("study", np.where(usable, odds, np.nan)[:-1], {"units": "1"}),
            "another_cause_odds": ((), odds[-1] if usable[-1] else np.nan, {"units": "1"}),
            "log_evidence": ("study", evidence[:-1], {"units": "1"}),
            "effective_samples": ("study", effective, {"units": "1"}),
            "replayed": ("study", np.array(replayed), {"units": "1"}),
            "least_misfit": ("study", np.array(misfits), {"units": "1"}),
            "resemblance": ("study", resemblance, {"units": "1", "long_name": "probability of a larger misfit"}),
            "resembles": (
                "study",
                (resemblance >= options.resemblance).astype(np.int8),
                {"flag_values": np.array([0, 1], dtype=np.int8), "flag_meanings": "no yes"},
            ),
            "movement_cut": ("study", np.array(cut), {"units": "1"}),
            "advice": ("study", list(advice)),
            "movement_quantile": (("study", "quantile"), np.array(quantiles), unit),
            "movement_measure": ("study", [walls.measure for walls in studies]),
            "movement_words": ("study", [walls.shown.words for walls in studies]),
            "movement_units": ("study", [walls.units for walls in studies]),
            "study_scene": ("study", [str(walls.ds.attrs["scene"]) for walls in studies]),
            "movement_largest": ("study", [walls.largest for walls in studies], unit),
            "study_of_sample": ("sample", np.repeat(np.arange(len(weights)), [len(w) for w in weights])),
            "sample_in_study": ("sample", np.concatenate([np.arange(len(w)) for w in weights])),
        },
        {
            "study": [walls.name for walls in studies],
            "quantile": list(options.quantiles),
            "further": ("further", list(options.further), {"units": "1"}),
            "category": np.arange(1, highest + 1),
        },
        {
            "title": "back-analysis",
            "observations": seen.count,
            "discrepancy_points": options.discrepancy_points,
            "fewest_effective": options.fewest_effective,
            "least_resemblance": options.resemblance,
            **{f"discrepancy_{name}": getattr(seen.discrepancy, name) for name in origins},
            **{f"discrepancy_interval_{name}": interval for name, (interval, _) in origins.items()},
            **{f"discrepancy_confidence_{name}": confidence for name, (_, confidence) in origins.items()},
        },
    )
    ds = ds.merge(xr.concat(futures, "study"))
    if any(replayed):
        ds = ds.assign(_crack_maps(studies, weights, options))
    last = [(table, series[-1]) for table, series in seen.series if series[-1].since is None]
    local = [crack for table, crack in last if table == "crack" and crack.x is not None]
    places = [(c.x, c.y, c.width or c.wider_than or c.narrower_than or 0.0) for c in local]
    if places:
        names = ("observed_x", "observed_y", "observed_width")
        ds = ds.assign({name: ("observed", np.array(v), {"units": "m"}) for name, v in zip(names, zip(*places))})
        ways = [">" if crack.wider_than else "<" if crack.narrower_than else "" for crack in local]
        ds = ds.assign(observed_limit=("observed", ways))
    if levels := [level for table, level in last if table == "level"]:
        ends = np.array([(each.x, each.y, each.to_x, each.to_y, each.difference) for each in levels]).T
        parts = ("x", "y", "to_x", "to_y", "difference")
        ds = ds.assign({f"level_{part}": ("level", v, {"units": "m"}) for part, v in zip(parts, ends)})
    return ds


def _crack_maps(
    studies: Sequence[StoredWalls], weights: Sequence[FloatArray], options: InferenceOptions
) -> dict[str, tuple[Any, ...]]:
    """Probability that a crack runs through each cell, for each study, and the middles of the cells."""
    walls = [tomllib.loads(str(study.ds.attrs["scene"]))["wall"] for study in studies]
    cell = options.map_cell
    rows, columns = (max(1, int(np.ceil(max(w[key] for w in walls) / cell))) for key in ("height", "length"))
    shape = rows, columns
    maps = [
        w.crack_map(weight, cell, options.map_width, shape, options.negligible) for w, weight in zip(studies, weights)
    ]
    middle = [(np.arange(n) + 0.5) * cell for n in shape]
    return {
        "crack_probability": (("study", "map_y", "map_x"), np.array(maps), {"wider_than": options.map_width}),
        "map_y": ("map_y", middle[0], {"units": "m"}),
        "map_x": ("map_x", middle[1], {"units": "m"}),
    }
