"""Probability of a rare category of damage by subset simulation with the walls of a study.

A folder has the question, the frozen study and one line per solved wall. The walls follow from the seed and from each
other: an interrupted run is repeated from its log without solving walls again, and the number of workers has no effect.
"""

from __future__ import annotations

import dataclasses
import warnings
from collections.abc import Callable
from concurrent.futures import Executor
from contextlib import nullcontext
from pathlib import Path
from typing import Any, NamedTuple

from damagepred.analyses.limit_state import Question, study_for_limit_state
from damagepred.analyses.rare_event_samples import Walls, question_file
from damagepred.archive.digest import read_signed_json, signed_json
from damagepred.archive.files import check_output, write_text
from damagepred.archive.folder import StudyFolder
from damagepred.archive.provenance import program, provenance
from damagepred.archive.schema import SCHEMA_VERSION
from damagepred.assembly import Limits
from damagepred.campaign.campaign import study_differences
from damagepred.campaign.cost_estimate import require_affordable
from damagepred.campaign.dispatch import sample_timeout
from damagepred.campaign.sample import joint_places
from damagepred.campaign.settings import StudySettings, read_frozen, resumed
from damagepred.campaign.workers import LocalPool
from damagepred.errors import ArchiveWarning, DamagedError, InputError, StudyError, require_count
from damagepred.inputs.arguments import checked
from damagepred.uq.subset import Level, SubsetEstimate, check_sizes, subset_simulation

WALLS, WALLS_FAILED_REACHED = "walls.jsonl", "walls_failed_reached.jsonl"
"""Logs of the two runs."""


class RareEvent(NamedTuple):
    """Result of a rare event."""

    estimate: SubsetEstimate  # probability with its interval, level by level; failed walls count as undamaged
    failed_damaged: SubsetEstimate  # of a second run in which failed walls count as damaged, if any failed
    failed: int  # walls that failed before the movement of the question, in both runs
    solved_now: int  # walls solved in this call; the others are from the log
    programs: tuple[str, ...] = ()  # versions of the program that solved them

    @property
    def interval(self) -> tuple[float, float]:
        """Interval of the probability for any outcome of the failed walls: lower end if undamaged, upper if damaged."""
        return self.estimate.lower, self.failed_damaged.upper


@checked
def rare_event(
    settings: StudySettings,
    question: Question,
    out: str | Path,
    *,
    samples: int = 500,
    level_share: float = 0.1,
    runs: int = 1,
    workers: int = 1,
    executor: Executor | None = None,
    timeout: float | None = None,
    limits: Limits = Limits(),  # noqa: B008 - frozen
    mix_versions: bool = False,
    confidence: float = 0.9,
    on_level: Callable[[Level], None] | None = None,
) -> RareEvent:
    """Probability that a category is reached by a movement, also a very small one, by subset simulation."""
    question.check(settings)
    require_count("runs", runs, 1)
    check_sizes(samples, level_share)  # before the folder is made
    require_count("workers", workers)
    timeout = sample_timeout(timeout, limits, executor)
    if (folder := StudyFolder(out)).exists:
        settings = resumed(settings, folder.study_text())
    study = study_for_limit_state(settings, question)
    require_affordable(study, limits)
    if study.shape_varies and study.design().joint:
        raise InputError("rare: samples of varying shape have varying numbers of joints; leave out their fields.")
    check_output(folder.path)
    lock = folder.lock()
    try:
        folder.tidy()
        how: dict[str, Any] = {"samples": samples, "level_share": level_share, "runs": runs}
        programs = _prepare(folder, study, question, how, mix_versions)
        design = study.design()
        joints = len(joint_places(study.scene).x) if design.joint else 0
        size = len(design.wall) + len(design.joint) * joints

        def simulate(walls: Walls) -> SubsetEstimate:
            seed = study.study.seed
            return subset_simulation(walls.margins, size, seed=seed, confidence=confidence, on_level=on_level, **how)

        with LocalPool(workers, timeout) if executor is None else nullcontext(executor) as pool:
            walls = Walls(folder, pool, WALLS)
            undamaged = all_damaged = simulate(walls)
            failed, solved = walls.failed, walls.solved_now
            if failed:
                again = Walls(folder, pool, WALLS_FAILED_REACHED, failed_reached=True, like=walls)
                all_damaged = simulate(again)
                failed, solved = failed + again.failed, solved + again.solved_now
        event = RareEvent(undamaged, all_damaged, failed, solved, programs)
        content = _content(undamaged) | {"failed": failed}
        if failed:
            content |= {"failed_damaged": _content(all_damaged)}
        content |= dict(zip(("lower_whatever_failed", "upper_whatever_failed"), event.interval))
        write_text(folder.path / "result.json", signed_json(content, folder.study_hash))
    finally:
        lock.release()
    return event


def kept_sizes(out: str | Path) -> dict[str, Any]:
    """Samples and runs of the question of a folder, empty without one."""
    file = question_file(StudyFolder(out))
    if not file.is_file():
        return {}
    try:
        kept = {"runs": 1} | read_signed_json(file)
    except DamagedError:  # rare_event reports it and sets it aside
        return {}
    return {key: kept[key] for key in ("samples", "runs") if key in kept}


def _prepare(
    folder: StudyFolder, settings: StudySettings, question: Question, how: dict[str, Any], mix_versions: bool
) -> tuple[str, ...]:
    """Create the folder, or verify that it holds this study and question; return the program versions."""
    text = settings.with_samples(1, None).to_toml()
    content = dataclasses.asdict(question) | how
    now = program(provenance())
    study = folder.study_hash if folder.exists else None
    try:
        before = read_signed_json(question_file(folder), study) if question_file(folder).exists() else {}
    except DamagedError as error:  # digests in the logs include the question
        aside = folder.set_aside(question_file(folder))
        warnings.warn(f"{error} It is set aside as {aside}.", ArchiveWarning, stacklevel=3)
        before = {}
    if not before:
        others = any(p.name != "study.toml" and not p.name.startswith(".") for p in folder.path.iterdir())
        if others and not (folder.exists and folder.study_text() == text):
            raise StudyError(f"{folder.path}: is not a folder of rare; nothing was changed. Choose another with -o.")
        folder.write_study(text)
        _write_question(folder, content | {"program": provenance(), "programs": [now]})
        return (now,)
    before = {"runs": 1} | before  # older versions had a single run
    differing = [f"{k} (was {before.get(k)}, is {value})" for k, value in content.items() if before.get(k) != value]
    if study_differences(read_frozen(folder.study_text()), read_frozen(text)):
        differing.append("the study")
    if differing:
        raise StudyError(
            f"{folder.path}: holds another question; nothing was changed. What differs: {', '.join(differing)}. "
            "Ask it in another folder with -o."
        )
    solved = before.get("programs") or [program(before.get("program") or {})]
    if now in solved:
        return tuple(solved)
    if not mix_versions:
        raise StudyError(
            f"{folder.path}: its samples were solved by {'; '.join(solved)}, and this is {now}; use that program, or "
            "mix versions with --mix-versions (mix_versions=True); the result then lists them."
        )
    _write_question(folder, before | {"programs": [*solved, now]})
    return (*solved, now)


def _write_question(folder: StudyFolder, content: dict[str, Any]) -> None:
    write_text(question_file(folder), signed_json(content | {"schema_version": SCHEMA_VERSION}, folder.study_hash))


def _content(estimate: SubsetEstimate) -> dict[str, Any]:
    content = {k: v for k, v in estimate._asdict().items() if k not in ("samples", "margins", "levels")}
    return content | {"levels": [level._asdict() for level in estimate.levels]}
