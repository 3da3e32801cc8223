"""Running many samples at once, and surviving what happens to single ones.

Workers are processes of their own, each with one thread. A worker that dies or hangs costs the sample it was at, and
no other: it is replaced, and the sample is reported as failed.
"""

from __future__ import annotations

import os
import signal
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, wait
from contextlib import ExitStack, contextmanager
from multiprocessing import get_context
from typing import Any, NamedTuple

from damagepred.errors import StudyError
from damagepred.study.sample import HANDED_BACK, Outcome, run_sample

ONE_THREAD = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"), "1")


class Lost(NamedTuple):
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


SECOND_CHANCES = 3
"""Times a sample is tried again because the pool around it broke."""

Task = Callable[[str, int, Mapping[str, float]], Outcome]
Submit = Callable[[int, Mapping[str, float]], "Future[Outcome]"]


def prepare_worker() -> None:
    """Set up a worker process: interrupts are the parent's business."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


@contextmanager
def one_thread_each() -> Iterator[None]:
    """Let processes started inside use one thread each."""
    before = {name: os.environ.get(name) for name in ONE_THREAD}
    os.environ.update(ONE_THREAD)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


class LocalPool:
    """Worker processes on this machine.

    Parameters
    ----------
    folder : str
        Study folder.
    workers : int
        Number of processes.
    timeout : float or None
        Seconds a sample may take before its worker is ended.
    task : callable
        What a worker does with (folder, sample, values).
    """

    def __init__(self, folder: str, workers: int, timeout: float | None, task: Task = run_sample) -> None:
        self.folder, self.workers, self.timeout, self.task = folder, workers, timeout, task
        # for as long as the pool lives: a worker that replaces a lost one starts at any time
        self._environment = ExitStack()
        self._environment.enter_context(one_thread_each())
        self.pool = self._start()

    def _start(self) -> Any:
        from pebble import ProcessPool

        pool = ProcessPool(max_workers=self.workers, context=get_context("spawn"), initializer=prepare_worker)
        pool.schedule(os.getpid).result()  # its processes start with the first task
        return pool

    def submit(self, sample: int, values: Mapping[str, float]) -> Future[Outcome]:
        """Hand a sample to the next free worker."""
        if not self.pool.active:
            self._stop()
            self.pool = self._start()
        future: Future[Outcome] = self.pool.schedule(
            self.task, args=(self.folder, sample, dict(values)), timeout=self.timeout
        )
        return future

    def close(self) -> None:
        """End the workers once they are idle."""
        self.pool.close()
        self.pool.join()
        self._environment.close()

    def kill(self) -> None:
        """End the workers now."""
        self._stop()
        self._environment.close()

    def _stop(self) -> None:
        self.pool.stop()
        self.pool.join()


class GivenExecutor:
    """Any ``concurrent.futures`` executor, or a Dask client: what they share is ``submit``.

    Parameters
    ----------
    folder : str
        Study folder, as the executor's workers see it.
    executor : Executor
        The executor; it is left open.
    """

    def __init__(self, folder: str, executor: Executor) -> None:
        self.folder, self.executor = folder, executor

    def submit(self, sample: int, values: Mapping[str, float]) -> Future[Outcome]:
        """Hand a sample to the executor."""
        return self.executor.submit(run_sample, self.folder, sample, dict(values))

    def close(self) -> None:
        """Leave the executor as it is: it is the caller's."""

    kill = close


def run_all(
    submit: Submit,
    tasks: Iterable[tuple[int, Mapping[str, float]]],
    ahead: int,
    draining: Callable[[], bool],
) -> Iterator[Outcome | Lost]:
    """Keep workers busy and yield what they bring, in the order in which it comes.

    A sample that its worker handed back unsolved, because the study is to stop, is not among it.

    Parameters
    ----------
    submit : callable
        Hands over one sample.
    tasks : iterable of (int, mapping)
        Samples with their values.
    ahead : int
        Samples handed over at a time.
    draining : callable
        Asked before each hand-over; once True, only what runs is waited for.

    Raises
    ------
    StudyError
        If a sample's result cannot be written.
    """
    queue = iter(tasks)
    running: dict[Any, tuple[int, Mapping[str, float]]] = {}
    again: list[tuple[int, Mapping[str, float]]] = []
    broken: Counter[int] = Counter()
    while True:
        while not draining() and len(running) < ahead:
            task = again.pop() if again else next(queue, None)
            if task is None:
                break
            try:
                running[submit(*task)] = task
            except BrokenExecutor as error:
                raise StudyError(
                    f"the executor broke ({error}); what was finished is kept, and the same call goes on from there."
                ) from error
        if not running:
            return
        # a short wait, so that an interrupt is seen also while all samples are slow
        done, _ = wait(running, timeout=0.5, return_when=FIRST_COMPLETED)
        for future in done:
            task = running.pop(future)
            # a pool that lost a worker between two tasks gives up all of them: most of these are innocent
            if isinstance(future.exception(), BrokenExecutor) and broken[task[0]] < SECOND_CHANCES:
                broken[task[0]] += 1
                again.append(task)
                continue
            result = _result(future, task[0])
            if not (isinstance(result, Outcome) and result.status == HANDED_BACK):
                yield result


def _result(future: Future[Outcome], sample: int) -> Outcome | Lost:
    from pebble import ProcessExpired

    try:
        return future.result()
    except StudyError:
        raise
    except BrokenExecutor:
        return Lost(sample, "worker_died", f"the worker pool broke {SECOND_CHANCES + 1} times while it was waiting")
    except TimeoutError as error:
        return Lost(sample, "timeout", f"took longer than its time limit ({error.args[-1] if error.args else '?'} s)")
    except ProcessExpired as error:
        return Lost(sample, "worker_died", f"its worker process died with exit code {error.exitcode}")
    except Exception as error:  # an executor's own failures have no common ancestor
        return Lost(sample, "error", f"{type(error).__name__}: {error}")
