"""How rare is a category of damage: subset simulation with the walls of a study.

A folder holds the question, the frozen study and a line for each wall that was solved. The walls follow from the seed
and from each other, so that a run that was interrupted is followed again to where it stopped without solving them
again, and more workers change nothing.
"""

from __future__ import annotations

import dataclasses
import json
import os
import time
from collections.abc import Callable, Sequence
from concurrent.futures import Executor, Future
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from damagepred.archive.files import write_whole
from damagepred.archive.folder import StudyFolder
from damagepred.archive.provenance import provenance
from damagepred.errors import InputError, SolverError, StudyError
from damagepred.scene import Scene
from damagepred.study.capacity import Question, asked_of, margin
from damagepred.study.sample import joint_places
from damagepred.study.settings import StudySettings, read_frozen
from damagepred.study.warm_up import warm_up
from damagepred.study.workers import LocalPool, WorkerDied
from damagepred.uq.design import Design
from damagepred.uq.subset import Level, SubsetEstimate, subset_simulation

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
Solved = tuple[int, float, float, str]
"""A wall's number, its margin (NaN if it failed), the time it took (s), and why it failed."""


class RareEvent(NamedTuple):
    """What was found.

    Attributes
    ----------
    estimate : SubsetEstimate
        Probability with its confidence interval, level by level.
    failed : int
        Walls that could not be solved; they count as not having reached the category.
    solved_now : int
        Walls solved in this run; the rest were there already.
    """

    estimate: SubsetEstimate
    failed: int
    solved_now: int

    def lines(self, question: Question) -> list[str]:
        """Say what was found.

        Parameters
        ----------
        question : Question
            What was asked.
        """
        e = self.estimate
        said = [
            f"level {k}: margin {level.limit:.4g} or less for {level.share:.3g} of the walls"
            + ("" if np.isnan(level.acceptance) else f", {level.acceptance:.0%} of proposals accepted")
            for k, level in enumerate(e.levels, start=1)
        ]
        where = f"P(category >= {question.category} at {1e3 * question.at:g} mm)"
        if e.reached:
            said.append(
                f"{where} = {e.probability:.3g}, {e.lower:.3g} to {e.upper:.3g} ({e.confidence:.0%}), coefficient of "
                f"variation {e.variation:.2f}, {e.evaluations} walls"
            )
        else:
            said.append(f"{where} is below {e.probability:.3g}: after {e.evaluations} walls no level reached it")
        if self.failed:
            said.append(f"{self.failed} walls failed; they count as not having reached the category")
        return said


def rare_event(
    settings: StudySettings,
    question: Question,
    out: str | Path,
    *,
    samples: int = 500,
    level_share: float = 0.1,
    workers: int = 1,
    executor: Executor | None = None,
    timeout: float | None = None,
    confidence: float = 0.9,
    on_level: Callable[[Level], None] | None = None,
) -> RareEvent:
    """Estimate the probability that a category is reached by a movement, however small.

    Fields with a value a joint take part as so many more standard normals.

    Parameters
    ----------
    settings : StudySettings
        The study: its variables but for the movement's, its seed.
    question : Question
        Category and movement.
    out : str or Path
        Folder; the same call goes on with one that is there.
    samples, level_share : int, float
        See ``damagepred.uq.subset.subset_simulation``.
    workers, executor, timeout
        See ``Study.run``.
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
    asked = asked_of(settings, question)
    if any(place.split(".")[0] in ("wall", "opening") for place in asked.variables) and asked.design().joint:
        raise InputError("rare: walls of varying shape have varying numbers of joints; leave out their fields.")
    folder = StudyFolder(out)
    lock = folder.lock()
    try:
        _prepare(folder, asked, question, {"samples": samples, "level_share": level_share})
        known = _read(folder)
        there = len(known)
        design = asked.design()
        joints = len(joint_places(asked.scene).x) if design.joint else 0
        with _Solver(folder, asked.scene, workers, executor, timeout, known) as solver:
            found = subset_simulation(
                solver.margins, len(design.wall) + len(design.joint) * joints, samples=samples,
                level_share=level_share, seed=asked.study.seed, confidence=confidence, on_level=on_level,
            )  # fmt: skip
        failed = sum(1 for g in known.values() if np.isnan(g))
        _write_result(folder, found, failed)
    finally:
        lock.release()
    return RareEvent(found, failed, len(known) - there)


def normals_to_wall(
    settings: StudySettings, design: Design, normals: FloatArray
) -> tuple[Scene, dict[str, FloatArray]]:
    """Return the scene and the joints' values that standard normals stand for.

    Parameters
    ----------
    settings : StudySettings
        The study.
    design : Design
        Its distributions.
    normals : array (dimensions,)
        Of the variables with a value a wall first, then of each field in turn.
    """
    count = len(design.wall)
    values = design.wall_values_from(normals[None, :count])
    scene = settings.scene.with_values({place: float(v[0]) for place, v in values.items()})
    if not design.joint:
        return scene, {}
    return scene, design.joint_values_from(normals[count:].reshape(len(design.joint), -1), joint_places(scene))


# -- what workers do --------------------------------------------------------------------------------------------------


def solve_margins(folder: str, batch: Sequence[tuple[int, FloatArray]]) -> list[Solved]:
    """Solve walls given by their standard normals.

    Parameters
    ----------
    folder : str
        Folder with the frozen study and the question.
    batch : sequence of (int, array)
        Numbers and normals.
    """
    settings, design, question = _asked(folder)
    solved = []
    for number, normals in batch:
        began = time.perf_counter()
        found, message = np.nan, ""
        try:
            found = margin(*normals_to_wall(settings, design, normals), question)
        except (SolverError, InputError, ArithmeticError, np.linalg.LinAlgError) as error:
            message = f"{type(error).__name__}: {error}"
        solved.append((number, float(found), time.perf_counter() - began, message))
    return solved


def _ready(folder: str) -> None:
    warm_up(_asked(folder)[0].scene)


@lru_cache(maxsize=2)
def _asked(folder: str) -> tuple[StudySettings, Design, Question]:
    place = StudyFolder(folder)
    settings = read_frozen(place.study_text())
    content = json.loads(_question_file(place).read_text(encoding="utf-8"))
    return settings, settings.design(), Question(**{f.name: content[f.name] for f in dataclasses.fields(Question)})


class _Solver:
    """Solves what is not known yet, and writes each wall down when it is there."""

    def __init__(
        self,
        folder: StudyFolder,
        scene: Scene,
        workers: int,
        executor: Executor | None,
        timeout: float | None,
        known: dict[int, float],
    ) -> None:
        self.folder, self.scene, self.known = folder, scene, known
        self.workers, self.executor, self.timeout = workers, executor, timeout
        self.where = str(folder.path.resolve())
        self.pool: LocalPool | None = None
        self.log: Any = None

    def __enter__(self) -> _Solver:
        self.log = _log_file(self.folder).open("a", encoding="utf-8")
        return self

    def __exit__(self, kind: object, *rest: object) -> None:
        if self.pool is not None:
            self.pool.close() if kind is None else self.pool.kill()
        self.log.close()

    def margins(self, z: FloatArray, numbers: IntArray) -> FloatArray:
        """Return the margins of walls, of those known from the log, of others from solving them."""
        wanted = [(int(number), row) for number, row in zip(numbers, z) if int(number) not in self.known]
        waiting = [(number, self._submit((number, row))) for number, row in wanted]
        for number, future in waiting:
            self._keep(_outcome(number, future))
        return np.array([self.known[int(number)] for number in numbers])

    def _submit(self, wall: tuple[int, FloatArray]) -> Future[list[Solved]]:
        if self.executor is not None:
            return self.executor.submit(solve_margins, self.where, [wall])
        if self.pool is None:
            warm_up(self.scene)
            self.pool = LocalPool(self.where, self.workers, self.timeout, solve_margins, _ready)  # type: ignore[arg-type]
        return self.pool.submit([wall])  # type: ignore[return-value, list-item]

    def _keep(self, solved: Solved) -> None:
        number, found, seconds, message = solved
        line = json.dumps([number, None if np.isnan(found) else found, round(seconds, 4), message])
        try:
            self.log.write(line + "\n")
            self.log.flush()
            os.fsync(self.log.fileno())
        except OSError as error:
            raise StudyError(f"{self.folder.path}: cannot be written: {error.strerror}.") from error
        self.known[number] = found


def _outcome(number: int, future: Future[list[Solved]]) -> Solved:
    try:
        return future.result()[0]
    except (WorkerDied, TimeoutError) as error:
        return number, np.nan, 0.0, f"{type(error).__name__}: {error}"


# -- the folder -------------------------------------------------------------------------------------------------------


def _question_file(folder: StudyFolder) -> Path:
    return folder.path / "question.json"


def _log_file(folder: StudyFolder) -> Path:
    return folder.path / "walls.jsonl"


def _prepare(folder: StudyFolder, asked: StudySettings, question: Question, how: dict[str, Any]) -> None:
    """Write down study and question, or check that they are those that are there."""
    text = asked.with_samples(1, None).to_toml()
    content = dataclasses.asdict(question) | how
    if not _question_file(folder).is_file():
        if any(p.name != "study.toml" and not p.name.startswith(".") for p in folder.path.iterdir()):
            raise StudyError(f"{folder.path}: holds something else; nothing was changed. Choose another with -o.")
        write_whole(folder.study_file, lambda p: p.write_text(text, encoding="utf-8"))
        kept = json.dumps(content | {"program": provenance()}, indent=2, default=str) + "\n"
        write_whole(_question_file(folder), lambda p: p.write_text(kept, encoding="utf-8"))
        return
    before = json.loads(_question_file(folder).read_text(encoding="utf-8"))
    differing = [f"{key} (was {before.get(key)}, is {value})" for key, value in content.items() if before[key] != value]
    if read_frozen(folder.study_text()).to_dict() != read_frozen(text).to_dict():
        differing.append("the study")
    if differing:
        raise StudyError(
            f"{folder.path}: holds another question; nothing was changed. What differs: {', '.join(differing)}. "
            "Ask it in another folder with -o."
        )


def _read(folder: StudyFolder) -> dict[int, float]:
    """Read the walls that are there; a last line that a killed run left unfinished is cut off."""
    file = _log_file(folder)
    if not file.is_file():
        return {}
    content = file.read_bytes()
    whole = content[: content.rfind(b"\n") + 1]
    if len(whole) < len(content):
        with file.open("rb+") as stream:
            stream.truncate(len(whole))
    rows = [json.loads(line) for line in whole.decode("utf-8").splitlines()]
    return {int(number): np.nan if found is None else float(found) for number, found, *_ in rows}


def _write_result(folder: StudyFolder, found: SubsetEstimate, failed: int) -> None:
    content = {k: v for k, v in found._asdict().items() if k not in ("samples", "margins", "levels")}
    content |= {"failed": failed, "levels": [level._asdict() for level in found.levels]}
    text = json.dumps(content, indent=2) + "\n"
    write_whole(folder.path / "result.json", lambda p: p.write_text(text, encoding="utf-8"))
