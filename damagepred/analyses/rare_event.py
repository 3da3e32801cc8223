"""Probability of a rare category of damage by subset simulation with the walls of a study.

A folder holds the question, the frozen study and a line for each wall that was solved. The walls follow from the seed
and from each other, so that a run that was interrupted is followed again to where it stopped without solving them
again, and more workers change nothing.
"""

from __future__ import annotations

import dataclasses
import warnings
from collections.abc import Callable
from concurrent.futures import Executor
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from damagepred.analyses.limit_state import Question, study_for_limit_state
from damagepred.analyses.rare_event_samples import Walls, WorkerPool, question_file
from damagepred.archive.digest import read_signed_json, signed_json
from damagepred.archive.files import check_output, write_whole
from damagepred.archive.folder import StudyFolder
from damagepred.archive.provenance import program, provenance
from damagepred.archive.schema import SCHEMA_VERSION
from damagepred.assembly import Limits
from damagepred.campaign.cost_estimate import require_affordable
from damagepred.campaign.dispatch import sample_timeout
from damagepred.campaign.sample import joint_places
from damagepred.campaign.settings import StudySettings, read_frozen
from damagepred.errors import ArchiveWarning, DamagedError, InputError, StudyError, require_count
from damagepred.inputs.arguments import checked
from damagepred.uq.subset import Level, SubsetEstimate, check_sizes, subset_simulation

WALLS, WALLS_FAILED_REACHED = "walls.jsonl", "walls_failed_reached.jsonl"
"""Logs of the two runs."""


class RareEvent(NamedTuple):
    """What was found.

    Attributes
    ----------
    estimate : SubsetEstimate
        Probability with its confidence interval, level by level; failed walls count as not having reached the category.
    failed_damaged : SubsetEstimate
        The same where failed walls count as having reached it: a run of its own, if there are any.
    failed : int
        Walls that could not be followed to the movement asked for, in both runs.
    solved_now : int
        Walls solved in this call; the rest were there already.
    programs : tuple of str
        Versions of the program that solved them.
    """

    estimate: SubsetEstimate
    failed_damaged: SubsetEstimate
    failed: int
    solved_now: int
    programs: tuple[str, ...] = ()

    @property
    def interval(self) -> tuple[float, float]:
        """What holds the probability whatever became of the failed walls.

        From the lower end of the interval where none of them reached the category to the upper end where all did.
        """
        return self.estimate.lower, self.failed_damaged.upper

    def lines(self, question: Question) -> list[str]:
        """Say what was found.

        Parameters
        ----------
        question : Question
            What was asked.
        """
        e, all_damaged = self.estimate, self.failed_damaged
        said = [f"run {k}: {p:.3g}" for k, p in enumerate(e.runs, start=1)]
        if not e.runs:
            said.append(
                "the interval is that of one run alone, which holds the truth less often than it says: take --runs 4 "
                "or more"
            )
        said += [
            f"level {k}: margin {level.limit:.4g} or less for {level.share:.3g} of the walls"
            + ("" if np.isnan(level.acceptance) else f", {level.acceptance:.0%} of proposals accepted")
            for k, level in enumerate(e.levels, start=1)
        ]
        said.append(f"P(category >= {question.category} at {1e3 * question.at:g} mm) {_found(e)}")
        if self.failed:
            low, high = self.interval
            said += [
                f"{self.failed} walls failed before {1e3 * question.at:g} mm. Above, they count as not having reached "
                "the category",
                f"if all of them had reached it: {_found(all_damaged)}",
                f"so it is between {low:.3g} and {high:.3g} ({e.confidence:.0%}), whatever became of them",
            ]
        if len(self.programs) > 1:
            said.append(f"caution: walls were solved by several programs, which may differ: {'; '.join(self.programs)}")
        return said


def _found(e: SubsetEstimate) -> str:
    if not e.reached:
        return f"is below {e.probability:.3g}: after {e.evaluations} walls no level reached it"
    return (
        f"= {e.probability:.3g}, {e.lower:.3g} to {e.upper:.3g} ({e.confidence:.0%}), coefficient of variation "
        f"{e.variation:.2f}, {e.evaluations} walls"
    )


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
    """Estimate the probability that a category is reached by a movement, however small.

    A field adds a standard normal for each joint.

    Parameters
    ----------
    settings : StudySettings
        The study: its variables but for the movement's, its seed.
    question : Question
        Category and movement.
    out : str or Path
        Folder; the same call goes on with one that is there.
    samples, level_share, runs : int, float, int
        See ``damagepred.uq.subset.subset_simulation``.
    workers, executor, timeout, limits, mix_versions
        See ``Study`` and ``Study.run``.
    confidence : float
        Of the interval.
    on_level : callable, optional
        Called with each ``Level``.

    Raises
    ------
    InputError
        If the question cannot be asked of the study.
    StudyError
        If the folder holds another question or is in use.
    """
    question.check(settings)
    require_count("runs", runs, 1)
    check_sizes(samples, level_share)  # before the folder is made: nothing else could be asked in it then
    require_count("workers", workers)
    timeout = sample_timeout(timeout, limits, executor)
    asked = study_for_limit_state(settings, question)
    require_affordable(asked, limits)
    if asked.shape_varies and asked.design().joint:
        raise InputError("rare: walls of varying shape have varying numbers of joints; leave out their fields.")
    folder = StudyFolder(out)
    check_output(folder.path)
    lock = folder.lock()
    try:
        folder.tidy()
        how = {"samples": samples, "level_share": level_share, "runs": runs}
        programs = _prepare(folder, asked, question, how, mix_versions)
        design = asked.design()
        joints = len(joint_places(asked.scene).x) if design.joint else 0
        size = len(design.wall) + len(design.joint) * joints

        def simulate(walls: Walls) -> SubsetEstimate:
            return subset_simulation(
                walls.margins,
                size,
                samples=samples,
                level_share=level_share,
                seed=asked.study.seed,
                confidence=confidence,
                runs=runs,
                on_level=on_level,
            )

        with WorkerPool(folder, asked.scene, workers, executor, timeout) as pool:
            walls = Walls(pool, folder.path / WALLS)
            found = all_damaged = simulate(walls)
            failed, solved = walls.failed, walls.solved_now
            if failed:
                again = Walls(pool, folder.path / WALLS_FAILED_REACHED, failed_reached=True, like=walls)
                all_damaged = simulate(again)
                failed, solved = failed + again.failed, solved + again.solved_now
        event = RareEvent(found, all_damaged, failed, solved, programs)
        _write_result(folder, event)
    finally:
        lock.release()
    return event


def kept_sizes(out: str | Path) -> dict[str, Any]:
    """Return samples and runs of the question that a folder holds, empty if it holds none."""
    file = question_file(StudyFolder(out))
    if not file.is_file():
        return {}
    try:
        kept = {"runs": 1} | read_signed_json(file)
    except DamagedError:  # said and set aside when the event is asked for
        return {}
    return {key: kept[key] for key in ("samples", "runs") if key in kept}


def _prepare(
    folder: StudyFolder, asked: StudySettings, question: Question, how: dict[str, Any], mix_versions: bool
) -> tuple[str, ...]:
    """Write down study and question, or check that they are those that are there; return the programs at work."""
    text = asked.with_samples(1, None).to_toml()
    content = dataclasses.asdict(question) | how
    now = program(provenance())
    study = folder.study_hash if folder.exists else None
    try:
        before = read_signed_json(question_file(folder), study) if question_file(folder).exists() else {}
    except DamagedError as error:  # walls in the logs carry digests with the question
        warnings.warn(
            f"{error} It is set aside as {folder.set_aside(question_file(folder))}.", ArchiveWarning, stacklevel=3
        )
        before = {}
    if not before:
        others = any(p.name != "study.toml" and not p.name.startswith(".") for p in folder.path.iterdir())
        if others and not (folder.exists and folder.study_text() == text):
            raise StudyError(f"{folder.path}: holds something else; nothing was changed. Choose another with -o.")
        folder.write_study(text)
        _write_question(folder, content | {"program": provenance(), "programs": [now]})
        return (now,)
    before = {"runs": 1} | before  # older versions knew one run alone
    differing = [f"{k} (was {before.get(k)}, is {value})" for k, value in content.items() if before.get(k) != value]
    if read_frozen(folder.study_text()).to_dict() != read_frozen(text).to_dict():
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
            f"{folder.path}: its walls were solved by {'; '.join(solved)}, and this is {now}; go on with that program, "
            "or mix versions with --mix-versions (mix_versions=True), and the result will say so."
        )
    _write_question(folder, before | {"programs": [*solved, now]})
    return (*solved, now)


def _write_question(folder: StudyFolder, content: dict[str, Any]) -> None:
    text = signed_json(content | {"schema_version": SCHEMA_VERSION}, folder.study_hash)
    write_whole(question_file(folder), lambda p: p.write_text(text, encoding="utf-8"))


def _write_result(folder: StudyFolder, event: RareEvent) -> None:
    low, high = event.interval
    content = _content(event.estimate) | {"failed": event.failed}
    if event.failed:
        content |= {"failed_damaged": _content(event.failed_damaged)}
    content |= {"lower_whatever_failed": low, "upper_whatever_failed": high}
    text = signed_json(content, folder.study_hash)
    write_whole(folder.path / "result.json", lambda p: p.write_text(text, encoding="utf-8"))


def _content(found: SubsetEstimate) -> dict[str, Any]:
    content = {k: v for k, v in found._asdict().items() if k not in ("samples", "margins", "levels", "failed")}
    return content | {"levels": [level._asdict() for level in found.levels]}
