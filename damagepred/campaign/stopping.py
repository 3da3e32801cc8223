"""Runs with a stopping rule or a time budget."""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

from damagepred.archive.files import write_text
from damagepred.archive.folder import StudyFolder, open_study
from damagepred.campaign.campaign import Campaign, Progress, RunSummary
from damagepred.errors import InputError
from damagepred.uq.estimate import ENOUGH_REPLICATES, Estimate
from damagepred.uq.stopping import StopWhen, interim_confidence, interim_sizes


class InterimAnalysis(NamedTuple):
    """Interim analysis of a sequential stopping rule: the estimate at a number of samples."""

    samples: int  # walls run
    estimate: Estimate | None  # with an interval that holds at all looks together
    enough: bool  # whether the interval was narrow enough


class Ending(NamedTuple):
    """End of a run."""

    summary: RunSummary  # of its last piece
    looks: list[InterimAnalysis]
    reason: str  # {"enough", "samples", "time", "interrupted"}


def run_until(
    study: Campaign,
    out: str | Path,
    samples: int | None = None,
    workers: int = 1,
    executor: Executor | None = None,
    *,
    on_progress: Callable[[Progress], None] | None = None,
    **options: Any,
) -> Ending:
    """Run a study until its ``stop_when`` is met, its ``time_budget`` is used up, or all samples are run."""
    how, most = study.settings.study, samples or study.settings.study.samples
    rule, budget = how.stop_when, how.time_budget
    if rule is not None and how.sampler == "lhs":
        raise InputError("[study.stop_when]: a Latin hypercube cannot be extended from look to look; take 'sobol'.")
    sizes = interim_sizes(rule.first, most) if rule is not None else [most]
    confidence = _confidence(rule, sizes, how.replicates, budget is not None)
    began = time.monotonic()
    seen: list[InterimAnalysis] = []
    while True:
        count = sizes[len(seen)]
        remaining = None if budget is None else budget - (time.monotonic() - began)
        with _stop_after(remaining, out):
            summary = study.run(out, count, workers, executor, on_progress=on_progress, **options)
        over = budget is not None and time.monotonic() - began >= budget
        if summary.interrupted and not over:
            return Ending(summary, seen, "interrupted")
        look = InterimAnalysis(summary.done, None, False)
        if rule is not None:
            estimate = rule.estimate(open_study(out).isel(sample=slice(count)), confidence)  # also if more are done
            look = InterimAnalysis(summary.done, estimate, rule.met(estimate))
        seen.append(look)
        reason = "enough" if seen[-1].enough else "time" if over else "samples" if count == sizes[-1] else ""
        if reason:
            looks = [{"samples": n, "enough": e, **(found._asdict() if found else {})} for n, found, e in seen]
            content = {"quantity": rule.name() if rule is not None else "", "reason": reason, "looks": looks}
            write_text(Path(out) / "stopping.json", json.dumps(content, indent=2) + "\n")
            return Ending(summary, seen, reason)


def _confidence(rule: StopWhen | None, sizes: list[int], replicates: int, timed: bool) -> float:
    if rule is None:
        return 0.9
    # the end of the time is one more look: counted like a look between the last two
    every = sorted({*sizes, (sizes[-1] + sizes[-2]) // 2}) if timed and len(sizes) > 1 else sizes
    return interim_confidence(every, rule.confidence, replicates >= ENOUGH_REPLICATES)


@contextmanager
def _stop_after(seconds: float | None, out: str | Path) -> Iterator[None]:
    """Request to stop a run after a time (s), if any; samples that have begun are finished."""
    timer = threading.Timer(max(seconds or 0.0, 0.0), StudyFolder(out).ask_to_stop)
    timer.daemon = True
    if seconds is not None:
        timer.start()
    try:
        yield
    finally:
        timer.cancel()
