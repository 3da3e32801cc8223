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
    estimate: Estimate | None  # with an interval that holds at all looks together
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
    how, most = study.settings.study, samples or study.settings.study.samples
    rule = how.stop_when
    if rule is not None and how.sampler == "lhs":
        raise InputError("[study.stop_when]: a Latin hypercube cannot be extended from look to look; take 'sobol'.")
    sizes = interim_sizes(rule.first, most) if rule is not None else [most]
    replicated = how.replicates >= ENOUGH_REPLICATES
    confidence = 0.9 if rule is None else interim_confidence(sizes, rule.confidence, replicated)
    seen: list[InterimAnalysis] = []
    while True:
        count = sizes[len(seen)]
        summary = study.run(out, count, workers, executor, **options)
        if summary.interrupted:
            return Ending(summary, seen, "interrupted")
        look = InterimAnalysis(summary.done, None, False)
        if rule is not None:
            estimate = rule.estimate(open_study(out).isel(sample=slice(count)), confidence)  # also if more are done
            look = InterimAnalysis(summary.done, estimate, rule.met(estimate))
        seen.append(look)
        reason = "enough" if seen[-1].enough else "samples" if count == sizes[-1] else ""
        if reason:
            looks = [{"samples": n, "enough": e, **(found._asdict() if found else {})} for n, found, e in seen]
            content = {"quantity": rule.name() if rule is not None else "", "reason": reason, "looks": looks}
            write_text(Path(out) / "stopping.json", json.dumps(content, indent=2) + "\n")
            return Ending(summary, seen, reason)
