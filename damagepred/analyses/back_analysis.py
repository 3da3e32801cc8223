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
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import xarray as xr
from scipy import special

from damagepred.analyses.inference_options import DEFAULT, InferenceOptions
from damagepred.analyses.posterior_dataset import posterior_dataset
from damagepred.analyses.posterior_states import needs_replays, states_of
from damagepred.analyses.stored_walls import StoredWalls
from damagepred.arrays import FloatArray
from damagepred.campaign.campaign import Campaign, Progress
from damagepred.errors import InputError, nearest
from damagepred.formatting import duration
from damagepred.inputs.arguments import checked
from damagepred.runtime.one_thread import one_blas_thread
from damagepred.uq.importance import Proposal, cross_entropy_shift
from damagepred.uq.movement_distribution import movement_distribution
from damagepred.uq.observations import ANOTHER, Observations
from damagepred.uq.survey_likelihood import vague_log_likelihood


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
        samples, and the least misfit of a state; ``misfit_of_observation`` on (study, observation) are its parts.
        ``movement_quantile`` on (study, quantile), in ``movement_units`` of the ``movement_measure`` of each study;
        ``movement_cut`` is the share of the posterior at the end of the paths, where they cut the movement. On (study,
        further, category): ``future_probability`` of each category or worse among the walls with a result there, and
        its bounds ``_lower`` and ``_upper`` among all; ``further`` is a share of ``movement_largest``.
        ``advice`` names the movement to which walls should be run.

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
            stored[k] = _with_new_walls(stored[k], weight, seen, number, workers, options, on_replay, on_walls)
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
        raise InputError(f"{walls.path}: new samples cannot be drawn, as the samples come from a table.")
    shifts = {}
    if study.design.wall:
        count = int(walls.first[1])
        use = weight[:count] if weight[:count].any() else np.ones(count)
        mean = cross_entropy_shift(study.design.draw(count).normal, use)
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
    if needs_replays(seen):
        counts = [max(0, min(options.replays, walls.known.sum()) - walls.stores[0].count()) for walls in opened]
        if any(counts):
            took = duration(float(np.dot(counts, seconds)))
            sentences.append(f"replays for cracks with a place and for levels: {sum(counts)} samples, about {took}")
    if not options.new_walls:
        return sentences
    took = duration(options.rounds * options.new_walls * sum(seconds))
    sentences.append(
        f"new samples where fewer than {options.fewest_effective:g} samples are effective: at most {options.rounds} "
        f"rounds of {options.new_walls} samples per study, {took} in all, and replays"
    )
    return sentences


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
        raise InputError("observations: no state of any stored sample has a positive likelihood.")
    prior = np.array([seen.prior_odds.get(name, 1.0) for name in (*names, ANOTHER)], dtype=np.float64)
    prior /= prior.sum()
    evidence = np.append(evidence, vague_log_likelihood(seen))
    cause = special.softmax(np.log(prior) + evidence)
    weights = [np.exp(log - e) if np.isfinite(e) else np.zeros(log.shape) for log, e in zip(logs, evidence)]
    return posterior_dataset(studies, seen, options, weights, cause, prior, evidence, states)
