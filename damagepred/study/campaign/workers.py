"""Worker processes on this machine, each with one thread, that may die or hang without taking the rest along.

Each worker has a line of its own to this process and shares nothing with the others: whatever moment it dies at, it
costs the others neither a lock nor a message. It is replaced, and the batch that it was at is given back.
"""

from __future__ import annotations

import contextlib
import os
import pickle
import signal
import socket
import subprocess
import sys
import threading
import time
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from multiprocessing import connection
from typing import Any

from damagepred.errors import StudyError
from damagepred.study.campaign.sample import Batch, Outcome, prepare, run_batch

ONE_THREAD = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"), "1")

HOPELESS = 3
"""Times in a row that a worker may die before it is ready; then something is wrong with all of them."""

Task = Callable[[str, Batch], list[Outcome]]


class WorkerDied(Exception):
    """A worker process ended in the middle of a batch."""


# -- in the worker ----------------------------------------------------------------------------------------------------


def serve(handle: int, parent: int) -> None:
    """Work on what comes along a line until it is closed: what a worker process does.

    Parameters
    ----------
    handle : int
        File descriptor of the worker's end.
    parent : int
        Process that the worker belongs to; without it there is nothing to do.
    """
    for number in (signal.SIGINT, signal.SIGTERM):  # interrupts are the parent's business: it lets samples finish
        signal.signal(number, signal.SIG_IGN)
    threading.Thread(target=_end_with, args=(parent,), daemon=True).start()
    line = connection.Connection(handle)
    with contextlib.suppress(EOFError, OSError):
        folder, task, ready = line.recv()
        ready(folder)
        line.send(None)
        while True:
            batch = line.recv()
            line.send(None)  # it is begun: from here on it may be to blame
            line.send(_answer(task, folder, batch))


def _answer(task: Task, folder: str, batch: Batch) -> tuple[bool, Any]:
    try:
        return True, task(folder, batch)
    except Exception as error:
        try:
            pickle.loads(pickle.dumps(error))
        except Exception:  # not every exception can travel
            return False, RuntimeError(f"{type(error).__name__}: {error}")
        return False, error


def _end_with(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(1.0)
    os._exit(1)  # in the middle of a sample: its part is either there, whole, or not


# -- in the parent ----------------------------------------------------------------------------------------------------


class _Worker:
    """One worker process, seen from its parent."""

    def __init__(self, folder: str, task: Task, ready: Callable[[str], None]) -> None:
        ours, theirs = socket.socketpair()
        self.line = connection.Connection(ours.detach())
        program = (
            f"import sys; sys.path[:] = {sys.path!r}; from damagepred.study.campaign.workers import serve; "
            f"serve({theirs.fileno()}, {os.getpid()})"
        )
        self.process = subprocess.Popen(
            [sys.executable, "-c", program],
            pass_fds=[theirs.fileno()],
            env=os.environ | ONE_THREAD,
            stdin=subprocess.DEVNULL,
        )
        theirs.close()
        self.line.send((folder, task, ready))
        self.is_ready = False
        self.batch: Batch = ()
        self.future: Future[list[Outcome]] | None = None
        self.began: float | None = None

    def give(self, batch: Batch, future: Future[list[Outcome]]) -> None:
        self.batch, self.future, self.began = batch, future, None
        with contextlib.suppress(OSError):  # it has just died, which is noticed when its line is read
            self.line.send(batch)

    def end(self) -> int:
        """End the process now; return its exit code."""
        with contextlib.suppress(OSError):
            self.line.close()
        self.process.kill()
        return self.process.wait()


class LocalPool:
    """Worker processes on this machine.

    Parameters
    ----------
    folder : str
        Study folder.
    workers : int
        Number of processes.
    timeout : float or None
        Seconds a batch may take before its worker is ended.
    task : callable
        What a worker does with (folder, batch).
    ready : callable
        What a worker does with (folder) before it takes its first batch; its time is not counted.
    """

    def __init__(
        self,
        folder: str,
        workers: int,
        timeout: float | None,
        task: Task = run_batch,
        ready: Callable[[str], None] = prepare,
    ) -> None:
        self.folder, self.width, self.timeout, self.task, self.ready = folder, workers, timeout, task, ready
        self._queue: deque[tuple[Batch, Future[list[Outcome]]]] = deque()
        self._workers: list[_Worker] = []
        self._stillborn = 0
        self._ending: str | None = None
        self._change = threading.Lock()
        self._bell, self._ear = connection.Pipe()
        self._manager = threading.Thread(target=self._manage, daemon=True, name="workers")
        self._manager.start()

    def submit(self, batch: Batch) -> Future[list[Outcome]]:
        """Hand a batch to the next free worker."""
        future: Future[list[Outcome]] = Future()
        with self._change:
            self._queue.append((list(batch), future))
        self._bell.send(None)
        return future

    def close(self) -> None:
        """End the workers once they are idle."""
        self._finish("idle")

    def kill(self) -> None:
        """End the workers now, and give up what they are at."""
        self.terminate()
        self._finish("now")

    def terminate(self) -> None:
        """End the processes of the workers, nothing else: safe in a signal handler."""
        self._ending = "now"
        for worker in list(self._workers):
            worker.process.kill()

    @property
    def processes(self) -> list[int]:
        """Numbers of the worker processes."""
        return [worker.process.pid for worker in list(self._workers)]

    def _finish(self, how: str) -> None:
        self._ending = how
        with contextlib.suppress(OSError):
            self._bell.send(None)
        self._manager.join()

    # -- the manager's thread -----------------------------------------------------------------------------------------

    def _manage(self) -> None:
        try:
            while not self._over():
                self._hire()
                self._hand_out()
                self._listen()
        except Exception as error:
            self._give_up(StudyError(f"the workers cannot be run: {type(error).__name__}: {error}"))
        finally:
            for worker in self._workers:
                worker.end()
            self._give_up(WorkerDied("the workers were ended"))
            self._workers.clear()

    def _over(self) -> bool:
        busy = self._queue or any(worker.future for worker in self._workers)
        return self._ending == "now" or (self._ending == "idle" and not busy)

    def _hire(self) -> None:
        while len(self._workers) < self.width and self._ending is None:
            self._workers.append(_Worker(self.folder, self.task, self.ready))

    def _hand_out(self) -> None:
        for worker in self._workers:
            while self._queue and worker.is_ready and worker.future is None:
                with self._change:
                    batch, future = self._queue.popleft()
                if future.running() or future.set_running_or_notify_cancel():
                    worker.give(batch, future)

    def _listen(self) -> None:
        """Wait until a worker has something to say, has died or has taken too long, or there is more to do."""
        by_line = {worker.line: worker for worker in self._workers}
        for line in connection.wait([*by_line, self._ear], timeout=self._patience()):
            if line is self._ear:
                self._ear.recv()
            else:
                self._hear(by_line[line])  # type: ignore[index]
        if self.timeout is not None:
            for worker in list(self._workers):
                if worker.began is not None and time.monotonic() - worker.began > self.timeout:
                    self._dismiss(worker, TimeoutError(f"took longer than its time limit ({self.timeout:g} s)"))

    def _patience(self) -> float | None:
        busy = [worker.began for worker in self._workers if worker.began is not None]
        if self.timeout is None or not busy:
            return None
        return max(0.0, min(busy) + self.timeout - time.monotonic()) + 1e-3

    def _hear(self, worker: _Worker) -> None:
        try:
            message = worker.line.recv()
        except (EOFError, OSError, pickle.UnpicklingError):
            self._dismiss(worker, None)
            return
        self._stillborn = 0
        if not worker.is_ready:
            worker.is_ready = True
            return
        if worker.began is None:
            worker.began = time.monotonic()
            return
        future, worker.future, worker.began = worker.future, None, None
        if future is not None:
            good, content = message
            future.set_result(content) if good else future.set_exception(content)

    def _dismiss(self, worker: _Worker, reason: Exception | None) -> None:
        """Part with a worker that has died, or is to for that reason."""
        self._workers.remove(worker)
        if reason is None:
            with contextlib.suppress(subprocess.TimeoutExpired):  # a moment to end, so that its exit code is its own
                worker.process.wait(timeout=2.0)
        code = worker.end()
        if worker.future is not None and worker.began is not None:
            worker.future.set_exception(reason or WorkerDied(f"its worker process died with exit code {code}"))
        elif worker.future is not None:  # it died idle, before it took notice of the batch
            with self._change:
                self._queue.appendleft((worker.batch, worker.future))
        elif not worker.is_ready:
            self._stillborn += 1
            if self._stillborn >= HOPELESS:
                self._give_up(
                    StudyError(
                        f"{self._stillborn} worker processes in a row died before they began (exit code "
                        f"{code}); is there "
                        "memory for that many? What was finished is kept, and the same command goes on from there."
                    )
                )
                self._stillborn = 0

    def _give_up(self, error: Exception) -> None:
        with self._change:
            waiting = [future for _, future in self._queue]
            self._queue.clear()
        for worker in self._workers:
            if worker.future is not None:
                waiting.append(worker.future)
                worker.future = None
        for future in waiting:
            if not future.done():
                with contextlib.suppress(Exception):  # cancelled at this very moment
                    future.set_exception(error)
