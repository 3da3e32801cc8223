"""Runs with a stopping rule."""

from __future__ import annotations

import json
from concurrent.futures import Executor
from pathlib import Path
from typing import Any, NamedTuple

from damagepred.archive.files import write_text
from damagepred.archive.folder import open_study
from damagepred.campaign.campaign import Campaign, RunSummary
from damagepred.errors import InputError
from damagepred.uq.estimate import ENOUGH_REPLICATES, Estimate
from damagepred.uq.stopping import interim_confidence, interim_sizes


class InterimAnalysis(NamedTuple):
    """Interim analysis of a sequential stopping rule: the estimate at a number of samples."""

    samples: int  # walls run
    estimate: Estimate  # with an interval that holds at all looks together
    enough: bool  # whether the interval was narrow enough


class Ending(NamedTuple):
    """End of a run."""

    summary: RunSummary  # of its last piece
    looks: list[InterimAnalysis]
    reason: str  # {"enough", "samples", "interrupted"}


def run_until(
    study: Campaign,
    out: str | Path,
    samples: int | None = None,
    workers: int = 1,
    executor: Executor | None = None,
    **options: Any,
) -> Ending:
    """Run a study until its ``stop_when`` is met, or all samples are run; ``options`` as of ``Campaign.run``."""
    how = study.settings.study
    most, rule = samples or how.samples, how.stop_when
    if rule is None:
        summary = study.run(out, most, workers, executor, **options)
        return Ending(summary, [], "interrupted" if summary.interrupted else "samples")
    if how.sampler == "lhs":
        raise InputError("[study.stop_when]: a Latin hypercube cannot be extended from look to look; take 'sobol'.")
    sizes = interim_sizes(rule.first, most)
    confidence = interim_confidence(sizes, rule.confidence, how.replicates >= ENOUGH_REPLICATES)
    seen: list[InterimAnalysis] = []
    for count in sizes:
        summary = study.run(out, count, workers, executor, **options)
        if summary.interrupted:
            return Ending(summary, seen, "interrupted")
        estimate = rule.estimate(open_study(out).isel(sample=slice(count)), confidence)  # also if more are done
        seen.append(InterimAnalysis(summary.done, estimate, rule.met(estimate)))
        if seen[-1].enough:
            break
    reason = "enough" if seen[-1].enough else "samples"
    looks = [{"samples": n, "enough": enough, **estimate._asdict()} for n, estimate, enough in seen]
    content = {"quantity": rule.name(), "reason": reason, "looks": looks}
    write_text(Path(out) / "stopping.json", json.dumps(content, indent=2) + "\n")
    return Ending(summary, seen, reason)
