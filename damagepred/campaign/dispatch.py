"""Dispatch of samples to workers in batches, and repetition of lost samples.

A batch is lost if its worker died or exceeded the time limit, or its answer never came. Each sample of a lost batch
runs again, alone. A sample that is lost alone has failed.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, CancelledError, Executor, Future, wait
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from damagepred.archive.folder import StudyFolder
from damagepred.assembly import Limits
from damagepred.campaign.sample import NOT_STARTED, Batch, Outcome, already_done, run_batch
from damagepred.campaign.workers import WorkerDied
from damagepred.enumerations import FailureKind
from damagepred.errors import InputError, StudyError, require_number

ATTEMPTS = 2  # runs of a lost sample alone before it counts as failed
MOST_PARTS = 10_000  # approximate limit of the files in a study folder
SHORTEST_BATCH, LONGEST_BATCH = 4.0, 30.0
"""Work in a batch (s): long enough to limit the number of files, short enough that a kill loses little."""
SHARE_OF_REST = 0.5  # largest batch over a worker's share of the remaining samples; a single worker has no limit
TIMEOUT_SHARE = 0.25  # largest work in a batch over the time limit of a sample
ASSUMED_WORKERS, RECOUNT_INTERVAL = 8, 10.0
"""Workers of an executor of unknown size; interval (s) at which the workers of an executor are counted."""
INTERRUPT_CHECK = 0.25  # interval (s) of checks for interrupts while samples run


class LostSample(NamedTuple):
    """Sample whose worker never answered; the reason is timeout, worker_died or error."""

    sample: int
    reason: str
    message: str


class Engine:
    """Executor of a study's batches: of ``concurrent.futures``, a Dask client, or worker processes."""

    def __init__(self, folder: str, executor: Executor | Any) -> None:
        self._client = getattr(executor, "_client", executor)  # the executor of Dask has a client
        if hasattr(executor, "get_executor"):
            executor = executor.get_executor(pure=False)
        self.folder, self.executor = folder, executor
        self._width, self._counted = ASSUMED_WORKERS, -np.inf

    @property
    def width(self) -> int:
        """Number of workers; a cluster may grow."""
        if time.monotonic() - self._counted > RECOUNT_INTERVAL:
            self._counted = time.monotonic()
            count = getattr(self.executor, "_max_workers", None) or getattr(self.executor, "num_workers", None)
            if hasattr(self._client, "nthreads"):
                count = sum(self._client.nthreads().values())
            self._width = count if isinstance(count, int) and count > 0 else ASSUMED_WORKERS
        return self._width

    def submit(self, batch: Batch) -> Future[list[Outcome]]:
        """Submit a batch to the executor."""
        future = self.executor.submit(run_batch, self.folder, list(batch))
        if not isinstance(future, Future):
            kind = type(future).__name__
            raise InputError(f"executor: its submit returns a {kind}, not a future of concurrent.futures.")
        return future


Task = tuple[int, Mapping[str, float]]  # sample with its values for the whole wall


class Batches:
    """Samples (in ascending order, with their values) in batches whose size follows the measured time of samples."""

    def __init__(self, tasks: Iterable[Task], count: int, timeout: float | None = None) -> None:
        self._tasks = iter(tasks)
        self._next: Task | None = next(self._tasks, None)
        self._count, self._timeout = count, timeout
        self._seconds, self._known, self._taken = 0.0, 0, 0

    def note(self, seconds: float) -> None:
        """Record the time of a sample (s)."""
        self._seconds, self._known = self._seconds + seconds, self._known + 1

    def size(self, width: int = 1) -> int:
        """Number of samples in the next batch (factoring: all workers shall end at the same time)."""
        if not self._known:
            return 1
        each = max(self._seconds / self._known, 1e-6)
        work = min(max(each * self._count / MOST_PARTS, SHORTEST_BATCH), LONGEST_BATCH)
        if self._timeout is not None:
            work = min(work, self._timeout * TIMEOUT_SHARE)
        rest = self._count - self._taken
        return max(1, int(min(work / each, rest if width == 1 else SHARE_OF_REST * rest / width)))

    def next(self, width: int = 1) -> Batch | None:
        """Next batch of consecutive samples, or None."""
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


def run_all(engine: Engine, batches: Batches, interrupts: Callable[[], int]) -> Iterator[Outcome | LostSample]:
    """Keep workers busy and yield the outcomes of samples as they arrive."""
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
                    f"the executor takes no more work ({type(error).__name__}: {error}); finished samples are saved, "
                    "and the same call resumes the study."
                ) from error
        if not running:
            return
        done, _ = wait(running, timeout=INTERRUPT_CHECK, return_when=FIRST_COMPLETED)
        if interrupts() > 1:
            for future in running:
                future.cancel()
            return
        for future in done:
            batch = running.pop(future)
            outcomes = _result(future, engine.folder, batch)
            if isinstance(outcomes, list):
                for outcome in outcomes:
                    if outcome.status == NOT_STARTED:
                        stopping = True  # a stop was requested through the study folder
                    else:
                        batches.note(outcome.seconds)
                yield from (outcome for outcome in outcomes if outcome.status != NOT_STARTED)
            elif interrupts():
                continue  # the interrupt may have ended its worker: its samples stay missing
            elif len(batch) > 1:
                again += [[task] for task in batch]
            elif lost.setdefault(batch[0][0], 1) < ATTEMPTS:
                lost[batch[0][0]] += 1
                again.append(batch)
            else:
                yield outcomes


def _result(future: Future[list[Outcome]], folder: str, batch: Batch) -> list[Outcome] | LostSample:
    """Outcomes of a batch; a part in the folder counts even if the answer was lost."""
    try:
        return future.result()
    except StudyError:
        raise
    except (Exception, CancelledError) as error:
        if (outcomes := already_done(StudyFolder(folder), batch)) is not None:
            return outcomes
        sample = batch[0][0]
        if isinstance(error, TimeoutError):
            return LostSample(sample, FailureKind.TIMEOUT, str(error) or "took longer than its time limit")
        if isinstance(error, WorkerDied | BrokenExecutor) or type(error).__name__ == "KilledWorker":
            return LostSample(sample, FailureKind.WORKER_DIED, str(error) or "its worker process died")
        return LostSample(sample, "error", f"{type(error).__name__}: {error}")


def sample_timeout(timeout: float | None, limits: Limits, executor: Executor | None) -> float | None:
    """Time limit of a sample (s), None for none; by default the limit of the study. An executor has its own."""
    if timeout is not None and timeout != math.inf:
        require_number("timeout", timeout, 0.0, unit="s", open_low=True)
    if executor is not None:
        if not any(callable(getattr(executor, name, None)) for name in ("submit", "get_executor")):
            raise InputError(
                f"executor: is of type {type(executor).__name__}; give a concurrent.futures executor or a Dask client."
            )
        if timeout is not None:
            raise InputError("timeout: is for the local workers; set the limit in your executor instead.")
        return None
    seconds = limits.time if timeout is None else timeout
    return None if seconds == math.inf else float(seconds)


def connect_dask_scheduler(address: str, timeout: float = 10.0) -> Any:
    """Client of a Dask scheduler, by its address (``tcp://192.168.1.2:8786``) or scheduler file (``*.json``)."""
    try:
        from distributed import Client
    except ImportError:
        raise InputError("--scheduler needs the package distributed: pip install 'damagepred[dask]'") from None
    where = {"scheduler_file": address} if address.endswith(".json") else {"address": address}
    try:
        if address.endswith(".json") and not Path(address).is_file():  # Dask would wait for it
            raise FileNotFoundError(f"{address} does not exist")
        client = Client(**where, timeout=timeout, set_as_default=False)
    except (OSError, ValueError, TimeoutError) as error:
        raise InputError(
            f"--scheduler {address}: no Dask scheduler answers there ({type(error).__name__}: {error}); give what "
            "`dask scheduler` prints, such as tcp://192.168.1.2:8786, or the path of its scheduler file (*.json)."
        ) from None
    if not client.nthreads():
        client.close()
        raise InputError(f"--scheduler {address}: has no workers yet; start some with `dask worker {address}`.")
    return client
