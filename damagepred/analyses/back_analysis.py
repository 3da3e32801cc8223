"""Back-analysis: movement and cause of observed cracks, and damage by further movement.

Every increment of every stored sample is a state, with the sample's weight and the prior probability of the movements
nearest to the increment, weighted by the likelihood (self-normalised importance sampling: Robert and Casella 2004, ch.
3). Causes are studies, with Bayes factors from their mean likelihoods; another cause has the likelihood of a vague
model. Local cracks and levels come from replays of some samples, drawn with probabilities proportional to the weights
and weighted by the inverse (Horvitz and Thompson 1952). The likelihood of all observations together is integrated over
the distribution of the model's discrepancy, whose medians decide whether a state resembles the observations.
"""

from __future__ import annotations

import hashlib
import tomllib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from scipy import special

from damagepred.analyses.posterior_tables import LARGEST_ODDS, UNCERTAIN
from damagepred.analyses.stored_walls import StoredWalls
from damagepred.archive.folder import StudyFolder
from damagepred.arrays import FloatArray, IntArray
from damagepred.campaign.campaign import Campaign, Progress
from damagepred.campaign.settings import read_frozen
from damagepred.errors import InputError, nearest
from damagepred.formatting import duration
from damagepred.inputs.arguments import checked
from damagepred.runtime.one_thread import one_blas_thread
from damagepred.uq.capacity import highest_category
from damagepred.uq.estimate import effective_samples
from damagepred.uq.importance import Proposal, cross_entropy_shift
from damagepred.uq.movement_distribution import MovementDistribution, movement_distribution
from damagepred.uq.observations import ANOTHER, Discrepancy, Observations


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


DEFAULT = InferenceOptions()

_MOVED_BY = {
    "central_deflection": ("movement", "central_deflection"),
    "surface_movement": ("mound", "surface_movement"),
    "settlement": ("movement", "settlement"),
}
"""Table and key of a scene with the largest value of a measure."""


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

    Raises
    ------
    InputError
        If the observations cannot be made on these walls, or no state has a positive likelihood.

    Examples
    --------
    >>> import damagepred
    >>> from damagepred.uq.observations import Discrepancy, Observations, CrackObservation
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
    survey = hashlib.sha256(repr(seen).encode()).hexdigest()[:8]
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
    studies: Sequence[str | Path], observations: str | Path, options: InferenceOptions, workers: int
) -> list[str]:
    """Sentences on the largest cost of replays and rounds of new walls."""
    seen, sentences = Observations.from_toml(observations), []
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
    return bool(seen.level) or any(crack.x is not None for crack in seen.crack)


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
    logs, misfits, replayed = [], [], []
    for walls in studies:
        log, misfit, count = _state_weights(walls, seen, movement, workers, options, on_replay)
        logs.append(log)
        misfits.append(misfit)
        replayed.append(count)
    evidence = np.array([special.logsumexp(log) if np.isfinite(log).any() else -np.inf for log in logs])
    if not np.isfinite(evidence).any():
        raise InputError("observations: no state of any stored wall has a positive likelihood.")
    prior = np.array([seen.prior_odds.get(name, 1.0) for name in (*names, ANOTHER)], dtype=np.float64)
    prior /= prior.sum()
    evidence = np.append(evidence, seen.vague_log_likelihood())
    cause = special.softmax(np.log(prior) + evidence)
    weights = [np.exp(log - e) if np.isfinite(e) else np.zeros(log.shape) for log, e in zip(logs, evidence)]
    return _dataset(studies, seen, options, weights, cause, prior, evidence, misfits, replayed)


def _state_weights(
    walls: StoredWalls,
    seen: Observations,
    movement: MovementDistribution | None,
    workers: int,
    options: InferenceOptions,
    on_replay: Callable[[int, int], None] | None,
) -> tuple[FloatArray, float, int]:
    """Log weights of the states (not normalised), the least misfit, and the number of replayed samples."""
    shares, models = zip(*seen.discrepancy.nodes(options.discrepancy_points))

    def integrated(fit_with: Callable[[Discrepancy], FloatArray]) -> FloatArray:
        """Log likelihood of all observations together, over the distribution of the discrepancy."""
        log_likelihood = special.logsumexp([np.log(w) + fit_with(m) for w, m in zip(shares, models)], axis=0)
        return np.where(np.isfinite(log_likelihood), log_likelihood, -np.inf)

    prior, archive = walls.log_prior(movement), {m: walls.fit_of_archive(seen, m).log_likelihood for m in models}
    log = prior + integrated(archive.__getitem__)
    misfit, count = walls.fit_of_archive(seen, seen.discrepancy).misfit, 0
    if _needs_replays(seen):
        if not np.isfinite(log).any():
            return log, np.inf, 0
        samples, chance = chosen_samples(np.exp(log - log.max()).sum(axis=1), options.replays)
        walls.replay(samples, workers, on_replay)
        all_logs, all_misfits = np.full(log.shape, -np.inf), np.full(log.shape, np.inf)
        together = integrated(lambda m: archive[m][samples] + walls.fit_of_replays(seen, m, samples).log_likelihood)
        all_logs[samples] = prior[samples] + together - np.log(chance)[:, None]
        all_misfits[samples] = misfit[samples] + walls.fit_of_replays(seen, seen.discrepancy, samples).misfit
        log, misfit, count = all_logs, all_misfits, len(samples)
    possible = misfit[np.isfinite(log)]
    return log, float(possible.min()) if possible.size else np.inf, count


def movement_cdf(walls: StoredWalls, weight: FloatArray, points: FloatArray) -> FloatArray:
    """Posterior distribution function of the movement at some points, uniform between the edges of each increment."""
    used = weight > 1e-12 * max(weight.max(), 1e-300)
    low, high, heavy = walls.edges[:, :-1][used], walls.edges[:, 1:][used], weight[used]
    width = np.maximum(high - low, 1e-300)
    return np.array([heavy @ np.clip((x - low) / width, 0.0, 1.0) for x in points]) / max(heavy.sum(), 1e-300)


def _future(walls: StoredWalls, weight: FloatArray, options: InferenceOptions, highest: int) -> xr.Dataset:
    """Probability of each category or worse after further movement, on (further, category)."""
    category = walls.ds["damage_category"].values
    among, lower, upper = np.full((3, len(options.further), highest), np.nan)
    followed = np.zeros(len(options.further))
    rows, columns = np.nonzero(weight > 0)
    heavy = weight[rows, columns] / max(weight.sum(), 1e-300)
    worst = np.maximum(category.max(axis=1), 0)[rows]
    moved = walls.movement[rows]
    for k, share in enumerate(options.further if len(rows) else ()):
        target = walls.movement[rows, columns] + share * walls.largest
        increment = np.nanargmin(np.abs(moved - target[:, None]), axis=1)
        # the nearest increment, unless the path ends before the movement
        has_result = (target <= walls.edges[rows, -1] * (1 + 1e-9)) & (category[rows, increment] >= 0)
        reached = np.where(has_result, category[rows, increment], worst)[:, None] >= np.arange(1, highest + 1)
        followed[k] = heavy[has_result].sum()
        lower[k], upper[k] = heavy @ reached, heavy @ (reached | ~has_result[:, None])
        if has_result.any():
            among[k] = heavy[has_result] @ reached[has_result] / heavy[has_result].sum()
    named = {"": among, "_lower": lower, "_upper": upper}
    values = {f"future_probability{end}": (("further", "category"), v, {"units": "1"}) for end, v in named.items()}
    return xr.Dataset({**values, "future_known": ("further", followed, {"units": "1"})})


def _path_end(
    walls: StoredWalls, weight: FloatArray, quantiles: FloatArray, future: xr.Dataset, options: InferenceOptions
) -> tuple[float, str]:
    """Share of the posterior at the end of the paths, and advice on longer paths ("" if not needed)."""
    end = np.fmax.reduce(walls.edges, axis=1)
    at_end = (walls.edges[:, 1:] >= end[:, None] * (1 - 1e-9)) & (weight > 0)
    cut = float(weight[at_end].sum())
    doubt = float((future["future_probability_upper"] - future["future_probability_lower"]).max())
    if not max(doubt, cut) > UNCERTAIN or not weight.any():
        return cut, ""
    shown = walls.shown
    longest = end >= walls.largest * (1 - 1e-9)
    if weight[~longest].sum() > 0.5 * weight.sum():
        return cut, (
            f'follow walls further, with stop_at_category = "none" under [study]: most of them end before '
            f"{shown.factor * walls.largest:.3g} {shown.unit} (damage category reached, own movement, or failure)"
        )
    target = float(f"{quantiles[-1] + max(options.further) * walls.largest:.2g}")
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
    misfits: Sequence[float],
    replayed: Sequence[int],
) -> xr.Dataset:
    steps, among = max(weight.shape[1] for weight in weights), special.softmax(np.log(prior[:-1]) + evidence[:-1])
    highest = min(highest_category(walls.ds) for walls in studies)
    units = {walls.units for walls in studies}
    unit = {"units": units.pop()} if len(units) == 1 else {"comment": "in movement_units of each study"}
    values: dict[str, Any] = {"posterior": [], "movement": []}
    quantiles, futures = [], []
    for walls, weight, share in zip(studies, weights, among):
        pad = ((0, 0), (0, steps - weight.shape[1]))
        values["posterior"].append(np.pad(share * weight, pad))
        values["movement"].append(np.pad(walls.movement, pad, constant_values=np.nan))
        grid = np.linspace(0.0, walls.largest, 1001)
        cdf = movement_cdf(walls, weight, grid)
        quantiles.append(
            np.interp(options.quantiles, cdf, grid) if cdf[-1] > 0 else np.full(len(options.quantiles), np.nan)
        )
        futures.append(_future(walls, weight, options, highest))
    effective = np.array([effective_samples(weight.sum(axis=1)) for weight in weights])
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
    local = [crack for crack in seen.crack if crack.x is not None]
    places = [(c.x, c.y, c.width or c.wider_than or c.narrower_than or 0.0) for c in local]
    if places:
        names = ("observed_x", "observed_y", "observed_width")
        ds = ds.assign({name: ("observed", np.array(v), {"units": "m"}) for name, v in zip(names, zip(*places))})
        ways = [">" if crack.wider_than else "<" if crack.narrower_than else "" for crack in local]
        ds = ds.assign(observed_limit=("observed", ways))
    if seen.level:
        ends = np.array([(each.x, each.y, each.to_x, each.to_y, each.difference) for each in seen.level]).T
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
