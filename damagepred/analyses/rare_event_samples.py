"""Walls of a rare event: solved by workers, and logged one by one."""

from __future__ import annotations

import contextlib
import dataclasses
import hashlib
import json
import os
import time
import warnings
from concurrent.futures import Executor, Future
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from damagepred.analyses.limit_state import NOTHING_KNOWN, Margin, Question, margin
from damagepred.archive.digest import read_signed_json
from damagepred.archive.files import write_whole
from damagepred.archive.folder import StudyFolder
from damagepred.arrays import FloatArray, IntArray
from damagepred.campaign.sample import SampledWall, joint_places
from damagepred.campaign.settings import StudySettings, read_frozen
from damagepred.campaign.warm_up import warm_up
from damagepred.campaign.workers import LocalPool, WorkerDied
from damagepred.errors import ArchiveWarning, InputError, StudyError
from damagepred.uq.design import Design


class Solved(NamedTuple):
    """Evaluated wall: number of the evaluation, margin, and time (s)."""

    number: int
    margin: Margin
    seconds: float


def normals_to_wall(settings: StudySettings, design: Design, normals: FloatArray) -> SampledWall:
    """Scene and values of the joints for standard normals."""
    count = len(design.wall)
    values = design.wall_values_from(normals[None, :count])
    scene = settings.scene.with_values({key: float(v[0]) for key, v in values.items()})
    if not design.joint:
        return scene, {}
    return scene, design.joint_values_from(normals[count:].reshape(len(design.joint), -1), joint_places(scene))


def _solve(folder: str, number: int, normals: FloatArray) -> Solved:
    """Margin of a wall given by its number and standard normals: the task of a worker."""
    settings, design, question = _read_question(folder)
    began = time.perf_counter()
    try:
        result = margin(*normals_to_wall(settings, design, normals), question)
    except (InputError, ArithmeticError, np.linalg.LinAlgError) as error:
        result = NOTHING_KNOWN._replace(why=f"{type(error).__name__}: {error}")
    return Solved(number, result, time.perf_counter() - began)


@lru_cache(maxsize=2)
def _read_question(folder: str) -> tuple[StudySettings, Design, Question]:
    study = StudyFolder(folder)
    settings = read_frozen(study.study_text())
    content = read_signed_json(question_file(study), study.study_hash)
    return settings, settings.design(), Question(**{f.name: content[f.name] for f in dataclasses.fields(Question)})


class Walls:
    """Walls of one run of subset simulation, from its log and newly solved."""

    def __init__(
        self, folder: StudyFolder, pool: Executor, log: str, failed_reached: bool = False, like: Walls | None = None
    ) -> None:
        content = read_signed_json(question_file(folder), folder.study_hash)
        question = {k: v for k, v in content.items() if k not in ("program", "programs", "schema_version")}
        self.question = folder.study_hash + json.dumps(question, sort_keys=True)  # part of the digests of walls
        self.where, self.pool, self.log, self.like = str(folder.path.resolve()), pool, folder.path / log, like
        self.bound = 0 if failed_reached else 1
        self.known = _read_log(self.log, self.question)
        self.logged = len(self.known)
        self.shared: dict[int, Margin] = {}
        self.digest: dict[int, bytes] = {}

    def margins(self, z: FloatArray, numbers: IntArray) -> FloatArray:
        """Margins of walls (n,); unknown walls are solved."""
        for number, row in zip(numbers.tolist(), z):
            self.digest[number] = hashlib.blake2b(np.ascontiguousarray(row).tobytes(), digest_size=16).digest()
            if self.like is not None and self.like.digest.get(number) == self.digest[number]:
                self.shared[number] = self.like.of(number)
        wanted = [(n, row) for n, row in zip(numbers.tolist(), z) if n not in self.known and n not in self.shared]
        if wanted and isinstance(self.pool, LocalPool) and not self.solved_now:  # its workers load the kernels
            warm_up(_read_question(self.where)[0].scene)
        waiting = [(number, self.pool.submit(_solve, self.where, number, row)) for number, row in wanted]
        with self.log.open("a", encoding="utf-8") as log:
            for number, future in waiting:
                self._keep(log, _outcome(number, future))
        return np.array([self.of(number)[self.bound] for number in numbers.tolist()])

    def of(self, number: int) -> Margin:
        """Margin of a wall."""
        return self.known[number] if number in self.known else self.shared[number]

    @property
    def failed(self) -> int:
        """Failed walls of this run, without the walls of the other run."""
        return sum(margin.most == np.inf for margin in self.known.values())

    @property
    def solved_now(self) -> int:
        """Walls solved since the log was read."""
        return len(self.known) - self.logged

    def _keep(self, log: Any, solved: Solved) -> None:
        least, most, why = solved.margin
        entry = [solved.number, None if np.isinf(most) else most, round(solved.seconds, 4), why, least]
        try:
            log.write(json.dumps([*entry, _digest(entry, self.question)]) + "\n")
            log.flush()
            os.fsync(log.fileno())
        except OSError as error:
            raise StudyError(f"{self.log.parent}: cannot be written: {error.strerror}.") from error
        self.known[solved.number] = solved.margin


def _outcome(number: int, future: Future[Solved]) -> Solved:
    try:
        return future.result()
    except (WorkerDied, TimeoutError) as error:
        return Solved(number, NOTHING_KNOWN._replace(why=f"{type(error).__name__}: {error}"), 0.0)


def question_file(folder: StudyFolder) -> Path:
    """File of the question in a folder."""
    return folder.path / "question.json"


def _digest(entry: list[Any], question: str) -> str:
    return hashlib.sha256((question + json.dumps(entry)).encode()).hexdigest()[:16]


def _read_log(file: Path, question: str) -> dict[int, Margin]:
    """Walls in a log, without damaged lines, lines of another question and an unfinished last line."""
    if not file.is_file():
        return {}
    content = file.read_bytes()
    whole = content[: content.rfind(b"\n") + 1]
    if len(whole) < len(content):
        with file.open("rb+") as stream:
            stream.truncate(len(whole))
    margins: dict[int, Margin] = {}
    lines, sound = whole.splitlines(keepends=True), []
    for line in lines:
        with contextlib.suppress(ValueError, TypeError, RecursionError):
            entry = json.loads(line)
            if len(entry) < 6 or entry.pop() == _digest(entry, question):  # older versions wrote no digest
                margins.update([_logged(*entry)])
                sound.append(line)
    if lost := len(lines) - len(sound):
        write_whole(file, lambda p: p.write_bytes(b"".join(sound)))
        message = f"{file}: {lost} lines were damaged or of another question; their samples are solved again."
        warnings.warn(message, ArchiveWarning, stacklevel=2)
    return margins


def _logged(number: int, most: float | None, _: float, why: str, least: float | None = None) -> tuple[int, Margin]:
    """Number and margin of a line; older lines lack the path of a failed wall."""
    if most is None:
        return number, Margin(NOTHING_KNOWN.least if least is None else least, np.inf, why)
    return number, Margin(most, most, why)
