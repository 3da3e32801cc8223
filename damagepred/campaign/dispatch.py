"""Dispatch of samples to workers in batches, and repetition of lost ones.

A batch is lost if its worker died or exceeded the time limit, or its answer never came. Each sample of a lost batch is
run again, alone. Only a sample that is lost alone as well has failed.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, CancelledError, Executor, Future, wait
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np

from damagepred.archive.folder import StudyFolder
from damagepred.assembly import Limits
from damagepred.campaign.sample import NOT_STARTED, Batch, Outcome, already_done, run_batch
from damagepred.campaign.workers import WorkerDied
from damagepred.enumerations import FailureKind
from damagepred.errors import InputError, StudyError, require_number


@dataclass(frozen=True)
class DispatchOptions:
    """Options of the division into batches and of their repetition.

    Attributes
    ----------
    attempts : int
        Times that a sample runs alone; lost at the last one, it has failed.
    most_parts : int
        Files that a study folder is to hold at most, about.
    shortest_batch, longest_batch : float
        Work in a batch (s): long enough that not every wall has a file, short enough that a kill loses little.
    share_of_rest : float
        Samples in a batch, at most, over a worker's share of those that no batch holds yet; one worker takes any.
    timeout_share : float
        Work in a batch, at most, over the time limit of a sample.
    assumed_workers : int
        Workers of an executor that does not tell their number.
    recount_interval : float
        Time (s) after which the workers of an executor are counted again.
    interrupt_check : float
        Interval (s) at which interrupts are noticed while samples run.
    """

    attempts: int = 2
    most_parts: int = 10_000
    shortest_batch: float = 4.0
    longest_batch: float = 30.0
    share_of_rest: float = 0.5
    timeout_share: float = 0.25
    assumed_workers: int = 8
    recount_interval: float = 10.0
    interrupt_check: float = 0.25


class LostSample(NamedTuple):
    """A sample whose worker never answered.

    Attributes
    ----------
    sample : int
        Its number.
    reason : str
        timeout, worker_died or error.
    message : str
        In full.
    """

    sample: int
    reason: str
    message: str


class Engine(Protocol):
    """What runs batches."""

    @property
    def width(self) -> int:
        """Batches that run at a time."""

    def submit(self, batch: Batch) -> Future[list[Outcome]]:
        """Hand over a batch."""

    def close(self) -> None:
        """End it once it is idle."""

    def kill(self) -> None:
        """End it now."""

    def terminate(self) -> None:
        """End what runs, in a signal handler."""


class GivenExecutor:
    """Any ``concurrent.futures`` executor, or a Dask client: what they share is ``submit``.

    Parameters
    ----------
    folder : str
        Study folder, as the executor's workers see it.
    executor : Executor
        The executor; it is left open.
    options : DispatchOptions
        Number of workers if it does not tell it, and how often they are counted.
    """

    def __init__(
        self,
        folder: str,
        executor: Executor | Any,
        options: DispatchOptions = DispatchOptions(),
    ) -> None:
        self._client = getattr(executor, "_client", executor)  # Dask's own executor knows its client
        if hasattr(executor, "get_executor"):
            executor = executor.get_executor(pure=False)
        self.folder, self.executor, self.options = folder, executor, options
        self._width, self._counted = options.assumed_workers, -np.inf

    @property
    def width(self) -> int:
        """Samples that run at a time; a cluster may grow."""
        if time.monotonic() - self._counted > self.options.recount_interval:
            self._counted = time.monotonic()
            known = getattr(self.executor, "_max_workers", None) or getattr(self.executor, "num_workers", None)
            if hasattr(self._client, "nthreads"):
                known = sum(self._client.nthreads().values())
            self._width = known if isinstance(known, int) and known > 0 else self.options.assumed_workers
        return self._width

    def submit(self, batch: Batch) -> Future[list[Outcome]]:
        """Hand a batch to the executor."""
        future = self.executor.submit(run_batch, self.folder, list(batch))
        if not isinstance(future, Future):
            raise InputError(
                f"executor: its submit returns a {type(future).__name__}, not a future of concurrent.futures."
            )
        return future

    def close(self) -> None:
        """Leave the executor as it is: it is the caller's."""

    kill = terminate = close


class Batches:
    """Divides samples into batches, by the time that samples have taken so far.

    Parameters
    ----------
    tasks : iterable of (int, mapping)
        Samples with their values, in ascending order.
    count : int
        How many there are.
    timeout : float or None
        Seconds a sample may take.
    options : DispatchOptions
        Length of batches.
    """

    def __init__(
        self,
        tasks: Iterable[tuple[int, Mapping[str, float]]],
        count: int,
        timeout: float | None = None,
        options: DispatchOptions = DispatchOptions(),
    ) -> None:
        self._tasks = iter(tasks)
        self._next: tuple[int, Mapping[str, float]] | None = next(self._tasks, None)
        self._count, self._timeout, self._options = count, timeout, options
        self._seconds, self._known, self._taken = 0.0, 0, 0

    def note(self, seconds: float) -> None:
        """Learn how long a sample took."""
        self._seconds, self._known = self._seconds + seconds, self._known + 1

    def size(self, width: int = 1) -> int:
        """Return how many samples the next batch takes (factoring: all workers are to end at one time).

        Parameters
        ----------
        width : int
            Batches that run at a time.
        """
        if not self._known:
            return 1
        each = max(self._seconds / self._known, 1e-6)
        options = self._options
        work = min(max(each * self._count / options.most_parts, options.shortest_batch), options.longest_batch)
        if self._timeout is not None:
            work = min(work, self._timeout * options.timeout_share)
        rest = self._count - self._taken
        return max(1, int(min(work / each, rest if width == 1 else options.share_of_rest * rest / width)))

    def next(self, width: int = 1) -> Batch | None:
        """Return the next batch: samples whose numbers follow each other.

        Parameters
        ----------
        width : int
            Batches that run at a time.
        """
        if self._next is None:
            return None
        batch, size = [self._next], self.size(width)
        self._next = None
        for task in self._tasks:
            if len(batch) == size or task[0] != batch[-1][0] + 1:
                self._next = task
                break
            batch.append(task)
        self._taken += len(batch)
        return batch


def run_all(
    engine: Engine,
    folder: str,
    batches: Batches,
    interrupts: Callable[[], int],
    options: DispatchOptions = DispatchOptions(),
) -> Iterator[Outcome | LostSample]:
    """Keep workers busy and yield the outcomes of samples as they arrive.

    Samples that were not started because the study is to stop have none.

    Parameters
    ----------
    engine : Engine
        Where to run.
    folder : str
        Study folder.
    batches : Batches
        What to run.
    interrupts : callable
        How often a stop was asked for. Once: running batches are waited for, and none is started. Twice: return now.
    options : DispatchOptions
        Attempts for each sample.

    Raises
    ------
    StudyError
        If results cannot be written, or nothing can be run any more.
    """
    running: dict[Any, Batch] = {}
    again: list[Batch] = []
    lost: dict[int, int] = {}
    stopping = False
    while True:
        while not interrupts() and not stopping and len(running) < 2 * engine.width:
            batch = again.pop(0) if again else batches.next(engine.width)
            if batch is None:
                break
            try:
                running[engine.submit(batch)] = batch
            except (BrokenExecutor, RuntimeError) as error:
                raise StudyError(
                    f"the executor takes no more work ({type(error).__name__}: {error}); what was finished is kept, "
                    "and the same call goes on from there."
                ) from error
        if not running:
            return
        done, _ = wait(running, timeout=options.interrupt_check, return_when=FIRST_COMPLETED)
        if interrupts() > 1:
            for future in running:
                future.cancel()
            return
        for future in done:
            batch = running.pop(future)
            found = _result(future, folder, batch)
            if isinstance(found, list):
                for outcome in found:
                    if outcome.status == NOT_STARTED:
                        stopping = True  # somebody has asked the study's folder for it
                    else:
                        batches.note(outcome.seconds)
                yield from (outcome for outcome in found if outcome.status != NOT_STARTED)
            elif interrupts():
                continue  # the interrupt may have ended its worker: these samples stay missing
            elif len(batch) > 1:
                again += [[task] for task in batch]
            elif lost.setdefault(batch[0][0], 1) < options.attempts:
                lost[batch[0][0]] += 1
                again.append(batch)
            else:
                yield found


def _result(future: Future[list[Outcome]], folder: str, batch: Batch) -> list[Outcome] | LostSample:
    """Return the outcomes of a batch; a part in the folder counts, whatever the future says."""
    try:
        return future.result()
    except StudyError:
        raise
    except (Exception, CancelledError) as error:
        if (found := already_done(StudyFolder(folder), batch)) is not None:
            return found
        sample = batch[0][0]
        if isinstance(error, TimeoutError):
            return LostSample(sample, FailureKind.TIMEOUT, str(error) or "took longer than its time limit")
        if isinstance(error, WorkerDied | BrokenExecutor) or type(error).__name__ == "KilledWorker":
            return LostSample(sample, FailureKind.WORKER_DIED, str(error) or "its worker process died")
        return LostSample(sample, "error", f"{type(error).__name__}: {error}")


def sample_timeout(timeout: float | None, limits: Limits, executor: Executor | None) -> float | None:
    """Return the time that a sample may take (s), None for no limit.

    Parameters
    ----------
    timeout : float or None
        Time asked for; None takes that of the limits, infinite is no limit.
    limits : Limits
        Of the study.
    executor : Executor or None
        That of the caller, which has limits of its own.

    Raises
    ------
    InputError
        If the time is no positive number, or goes with an executor.
    """
    if timeout is not None and timeout != math.inf:
        require_number("timeout", timeout, 0.0, unit="s", open_low=True)
    if executor is not None:
        if not any(callable(getattr(executor, name, None)) for name in ("submit", "get_executor")):
            raise InputError(
                f"executor: is of type {type(executor).__name__}; give a concurrent.futures executor or a Dask client."
            )
        if timeout is not None:
            raise InputError("timeout: is for the local workers; with an executor of your own, let it set the limit.")
        return None
    seconds = limits.time if timeout is None else timeout
    return None if seconds == math.inf else float(seconds)
