"""A coarse wall beside each sampled one, where a pilot run shows that it pays.

All are ordinary studies: ``pilot_fine.dp`` and ``pilot_coarse.dp``, of random samples that decide and do not count,
then ``fine.dp`` and ``coarse.dp``. Two walls of one sample have the same values for the whole wall, and joints of the
coarse one have the strength of the nearest joints of the fine one. Where the study's sampler is Sobol's, the latter two
are of points from several scrambles, which tell the error.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from damagepred.analyses.limit_state import Question
from damagepred.archive.files import check_output, write_whole
from damagepred.archive.folder import open_study
from damagepred.arrays import FloatArray
from damagepred.assembly import Limits
from damagepred.campaign.campaign import Campaign
from damagepred.campaign.settings import StudySettings
from damagepred.errors import InputError, StudyError
from damagepred.inputs.arguments import checked
from damagepred.uq.control_variate import DEFAULT, PilotReport, read_pilot, two_level
from damagepred.uq.estimate import ENOUGH_REPLICATES, Estimate, probability
from damagepred.uq.exceedance import category_capacities, known_hits, pseudo_values
from damagepred.uq.movement_distribution import as_distribution
from damagepred.uq.random_streams import Stream, generator


class TwoLevel(NamedTuple):
    """What two levels say of a probability.

    Attributes
    ----------
    pilot : PilotReport
        Whether it pays.
    estimate : Estimate
        With the control variate if it pays, otherwise from the fine walls alone; see ``damagepred.uq.exceedance``.
    failed_undamaged, failed_damaged : Estimate
        Bounds: fine walls that failed, or ended, count as not having reached the category, and as having reached it.
    fine, coarse : int
        Walls run, without the pilot's.
    failed : int
        Fine walls that failed, or ended, before they reached the category and the movement.
    """

    pilot: PilotReport
    estimate: Estimate
    failed_undamaged: Estimate
    failed_damaged: Estimate
    fine: int
    coarse: int
    failed: int


def levels(settings: StudySettings, scrambles: int = 8) -> tuple[StudySettings, StudySettings]:
    """Return a study's fine and coarse form, of the same samples.

    Parameters
    ----------
    settings : StudySettings
        With ``[study.coarse]``.
    scrambles : int
        Independent scrambles of the Sobol points, if the study does not have enough for an error estimate.

    Raises
    ------
    InputError
        If the study says nothing of a coarse wall, or the scene cannot take it.
    """
    if not settings.study.coarse:
        raise InputError(
            "[study.coarse]: say in which the coarse wall differs, such as [study.coarse.wall] block_length = '480 mm'."
        )
    if settings.study.sampler == "table" or settings.study.importance:
        raise InputError("[study.coarse]: goes with samples drawn as stated; no table and no importance.")
    scene = settings.coarse_scene()
    sobol = settings.study.sampler == "sobol"
    given = settings.study.replicates
    how = replace(
        settings.study,
        sampler="sobol" if sobol else "random",
        stop_when=None,
        time_budget=None,
        coarse={},
        replicates=(given if given >= ENOUGH_REPLICATES else scrambles) if sobol else 1,
        movement="path",
    )
    return replace(settings, study=how), replace(
        settings, scene=scene, study=replace(how, fields_from=settings.scene, store_fields=False)
    )


def _pilot_of(level: StudySettings) -> StudySettings:
    """Return a level with random samples of its own seed, the same for both levels."""
    seed = int(generator(level.study.seed, Stream.PILOT, 0).integers(2**31))
    return replace(level, study=replace(level.study, sampler="random", replicates=1, seed=seed))


@checked
def run_two_level(
    settings: StudySettings,
    category: int,
    at: float,
    out: str | Path,
    *,
    pilot: int = 32,
    budget: float | None = None,
    workers: int = 1,
    executor: Executor | None = None,
    mix_versions: bool = False,
    confidence: float = 0.9,
    on_pilot: Callable[[PilotReport], None] | None = None,
    limits: Limits = Limits(),  # noqa: B008 - frozen
) -> TwoLevel:
    """Estimate the probability of a category at a movement with a coarse wall as control variate, if it pays.

    Parameters
    ----------
    settings : StudySettings
        With ``[study.coarse]``.
    category, at : int, float
        The category, or a worse one, and the movement (m).
    out : str or Path
        Folder for both studies; the same call goes on with what is there.
    pilot : int
        Samples of the pilot run. They decide how the rest is run, and do not count in the end.
    budget : float, optional
        Work after the pilot, in fine walls; by default the study's number of samples.
    workers, executor, mix_versions
        See ``Study.run``.
    confidence : float
        Of the interval.
    on_pilot : callable, optional
        Called with the pilot's report before the rest is run.
    limits : Limits
        See ``Study``.

    Raises
    ------
    InputError
        If there is no coarse wall, or the numbers make no sense.
    KeyboardInterrupt
        If it was interrupted; the same call goes on.
    """
    fine, coarse = levels(settings)
    Question(category, at).check(settings)
    fewest = DEFAULT.fewest
    budget = max(settings.study.samples, fewest) if budget is None else budget
    if pilot < fewest or not budget >= fewest:
        raise InputError(f"pilot = {pilot}, budget = {budget:g}: must be {fewest} walls or more.")
    folder = Path(out)
    check_output(folder)
    if (folder / "study.toml").is_file():
        raise StudyError(f"{folder}: is no folder of two-level runs; nothing was changed. Choose another with -o.")

    def run(level: StudySettings, name: str, samples: int) -> xr.Dataset:
        if (
            Campaign(level, limits)
            .run(folder / name, samples, workers, executor, mix_versions=mix_versions)
            .interrupted
        ):
            raise KeyboardInterrupt
        return open_study(folder / name)

    first = [run(_pilot_of(level), f"pilot_{name}.dp", pilot) for level, name in ((fine, "fine"), (coarse, "coarse"))]
    tried = [_hits(ds, category, at, pilot, 0.0) for ds in first]
    cost = [float(np.nanmedian(ds["run_time"].values[:pilot])) for ds in first]
    report = read_pilot(tried[0], tried[1], cost[0], cost[1])
    if on_pilot is not None:
        on_pilot(report)
    turns = fine.study.replicates
    count, beside = (_whole(n, turns) for n in report.allocation(budget))
    fine_walls = run(fine, "fine.dp", count)
    undamaged, damaged = (_hits(fine_walls, category, at, count, unknown) for unknown in (0.0, 1.0))
    if beside:
        beside = max(beside, count + turns, count + 2)
        x = _hits(run(coarse, "coarse.dp", beside), category, at, beside)

    def estimate(hits: FloatArray) -> Estimate:
        if beside:
            return two_level(hits, x[:count], x[count:], replicates=turns, confidence=confidence)
        return probability(hits, replicate=np.arange(count) % turns if turns > 1 else None, confidence=confidence)

    ends, failed = (estimate(undamaged), estimate(damaged)), int((damaged != undamaged).sum())
    found = TwoLevel(report, estimate(_hits(fine_walls, category, at, count)), *ends, count, beside, failed)
    content: dict[str, Any] = {"category": category, "at": at, "fine": found.fine, "coarse": found.coarse}
    content |= {"failed": found.failed, "pilot": report._asdict(), "estimate": found.estimate._asdict()}
    content |= {name: getattr(found, name)._asdict() for name in ("failed_undamaged", "failed_damaged")}
    text = json.dumps(content, indent=2) + "\n"
    write_whole(folder / "two_level.json", lambda p: p.write_text(text, encoding="utf-8"))
    return found


def _whole(samples: int, turns: int) -> int:
    """Round a number of samples up to a multiple of the number of scrambles."""
    return -(-samples // turns) * turns


def _hits(ds: xr.Dataset, category: int, at: float, count: int, unknown: float | None = None) -> FloatArray:
    """Pseudo-values of the first walls (see ``damagepred.uq.exceedance``); with ``unknown``, hits of a bound."""
    known, wanted = category_capacities(ds, category).part(slice(count)), as_distribution(at)
    found = pseudo_values(known, wanted).hit if unknown is None else known_hits(known, wanted, unknown)
    if np.isnan(found).any():
        raise InputError(f"at = {at:g}: no wall was followed as far; let the study's movement be larger.")
    return found
