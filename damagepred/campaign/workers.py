"""Worker processes on this machine, each with one thread, whose death or hanging does not affect the others.

One socket per worker, no shared locks: a worker that dies blocks no lock and loses no message of the others. It is
replaced, and its call is reported as lost.
"""

from __future__ import annotations

import contextlib
import math
import os
import pickle
import socket
import subprocess
import sys
import threading
import time
from collections import deque
from collections.abc import Callable
from concurrent.futures import Executor, Future
from functools import partial
from importlib import import_module
from multiprocessing.connection import Connection, Pipe, wait
from typing import Any

from damagepred.errors import StudyError

ONE_THREAD = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"), "1")


class WorkerDied(Exception):
    """A worker process ended in the middle of a call."""


FAILED_STARTS = 3  # consecutive workers that die before they are ready until all futures fail
EXIT_WAIT, START_LIMIT, PARENT_CHECK = 2.0, 900.0, 1.0
"""Times (s): for a worker that has closed its socket to end with its own exit code; after which a worker that is not
ready, with its kernels compiled, counts as dead; between two checks of a worker that its parent lives."""


# -- in the worker ----------------------------------------------------------------------------------------------------


def serve(handle: int, parent: int) -> None:
    """Answer the calls that arrive at a socket until it is closed: the main function of a worker process."""
    threading.Thread(target=_end_with, args=(parent,), daemon=True).start()
    import_module("damagepred.campaign.sample")  # the program, while the parent draws the design
    parent_socket = Connection(handle)
    with contextlib.suppress(EOFError, OSError):
        prepare = parent_socket.recv()
        if prepare is not None:
            prepare()
        parent_socket.send(None)
        while True:
            call = parent_socket.recv()
            parent_socket.send(None)  # the call has started: now it may kill its worker
            parent_socket.send(_answer(call))


def _answer(call: Callable[[], Any]) -> tuple[bool, Any]:
    try:
        return True, call()
    except Exception as error:
        try:
            pickle.loads(pickle.dumps(error))
        except Exception:  # not every exception can be pickled
            return False, RuntimeError(f"{type(error).__name__}: {error}")
        return False, error


def _end_with(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(PARENT_CHECK)
    os._exit(1)  # also in the middle of a sample: parts are written completely or not at all


# -- in the parent ----------------------------------------------------------------------------------------------------


class _Worker:
    """Worker process, as its parent sees it."""

    def __init__(self, prepare: Callable[[], None] | None) -> None:
        ours, theirs = socket.socketpair()
        self.socket = Connection(ours.detach())
        program = (  # the parent handles interrupts: it lets samples finish
            "from signal import SIG_IGN, SIGINT, SIGTERM, signal; signal(SIGINT, SIG_IGN); signal(SIGTERM, SIG_IGN); "
            f"import sys; sys.path[:] = {sys.path!r}; from damagepred.campaign.workers import serve; "
            f"serve({theirs.fileno()}, {os.getpid()})"
        )
        command, environment = [sys.executable, "-c", program], os.environ | ONE_THREAD
        self.process = subprocess.Popen(command, pass_fds=[theirs.fileno()], env=environment, stdin=subprocess.DEVNULL)
        theirs.close()
        self.prepare = prepare
        self.is_told = self.is_ready = False
        self.call: Callable[[], Any] | None = None
        self.future: Future[Any] | None = None
        self.asked = time.monotonic()
        self.began: float | None = None

    def tell(self) -> None:
        """Let the worker, which has loaded the program, prepare for its calls."""
        self.is_told, self.asked = True, time.monotonic()
        with contextlib.suppress(OSError):  # a dead worker is noticed when its socket is read
            self.socket.send(self.prepare)

    def assign(self, call: Callable[[], Any], future: Future[Any]) -> None:
        self.call, self.future, self.asked, self.began = call, future, time.monotonic(), None
        with contextlib.suppress(OSError):  # a dead worker is noticed when its socket is read
            self.socket.send(call)

    def kill(self) -> int:
        """End the process now; return its exit code."""
        with contextlib.suppress(OSError):
            self.socket.close()
        self.process.kill()
        return self.process.wait()


class LocalPool(Executor):
    """Worker processes on this machine, at most one per waiting call; each calls ``prepare`` once.

    ``timeout``: time limit of a call (s). ``preload``: all workers start at once and load the program.
    """

    def __init__(
        self,
        workers: int,
        timeout: float | None,
        prepare: Callable[[], None] | None = None,
        *,
        preload: bool = False,
        answer_limit: float = 60.0,
    ) -> None:
        self._max_workers = workers  # as executors of concurrent.futures tell their width
        self._preload, self.timeout, self.prepare = preload, timeout, prepare
        self.answer_limit = answer_limit  # s until an idle worker that does not begin its call is replaced
        self._queue: deque[tuple[Callable[[], Any], Future[Any]]] = deque()
        self._workers: list[_Worker] = []
        self._failed_starts = 0
        self._has_work = False
        self._ending: str | None = None
        self._lock = threading.Lock()
        self._woken, self._waker = Pipe(duplex=False)
        self._manager = threading.Thread(target=self._manage, daemon=True, name="workers")
        self._manager.start()

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Queue a call for the next free worker."""
        future: Future[Any] = Future()
        with self._lock:
            self._queue.append((partial(fn, *args, **kwargs), future))
            self._has_work = True
        self._waker.send(None)
        return future

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """End the workers once they are idle, or now: then their calls are lost; wait for their end."""
        if cancel_futures:
            self.terminate()
        self._ending = "now" if cancel_futures else "idle"
        with contextlib.suppress(OSError):
            self._waker.send(None)
        self._manager.join()

    def __exit__(self, *failure: Any) -> None:
        """End the workers, after a failure at once."""
        self.shutdown(cancel_futures=failure[0] is not None)

    def terminate(self) -> None:
        """End only the processes of the workers: safe in a signal handler."""
        self._ending = "now"
        for worker in list(self._workers):
            worker.process.kill()

    @property
    def processes(self) -> list[int]:
        """Process identifiers of the workers."""
        return [worker.process.pid for worker in list(self._workers)]

    # -- the manager's thread -----------------------------------------------------------------------------------------

    def _manage(self) -> None:
        try:
            while not self._over():
                self._start_missing()
                self._assign_calls()
                self._wait()
        except Exception as error:
            self._fail_all(StudyError(f"the workers cannot be run: {type(error).__name__}: {error}"))
        finally:
            for worker in self._workers:
                worker.kill()
            self._fail_all(WorkerDied("the workers were ended"))
            self._workers.clear()

    def _over(self) -> bool:
        busy = self._queue or any(worker.future for worker in self._workers)
        return self._ending == "now" or (self._ending == "idle" and not busy)

    def _start_missing(self) -> None:
        calls = len(self._queue) + sum(worker.future is not None for worker in self._workers)
        useful = self._max_workers if self._preload and not self._has_work else min(self._max_workers, calls)
        while len(self._workers) < useful and self._ending is None:
            self._workers.append(_Worker(self.prepare))
        for worker in self._workers if self._has_work else ():
            if not worker.is_told:
                worker.tell()

    def _assign_calls(self) -> None:
        for worker in self._workers:
            while self._queue and worker.is_ready and worker.future is None:
                with self._lock:
                    call, future = self._queue.popleft()
                if future.running() or future.set_running_or_notify_cancel():
                    worker.assign(call, future)

    def _wait(self) -> None:
        """Wait until a worker answers, dies or exceeds the time limit, or a call is submitted."""
        by_socket = {worker.socket: worker for worker in self._workers}
        soonest = min(map(self._deadline, self._workers), default=math.inf)
        limit = None if soonest == math.inf else max(0.0, soonest - time.monotonic()) + 1e-3
        for readable in wait([*by_socket, self._woken], timeout=limit):
            if readable is self._woken:
                self._woken.recv()
            else:
                self._receive(by_socket[readable])  # type: ignore[index]
        for worker in list(self._workers):
            if time.monotonic() > self._deadline(worker):
                most = self.answer_limit if worker.began is None else self.timeout
                self._remove(worker, TimeoutError(f"took longer than its time limit ({most:g} s)"))

    def _deadline(self, worker: _Worker) -> float:
        """Time by which a worker must answer (s, monotonic clock)."""
        if worker.began is not None:
            return math.inf if self.timeout is None else worker.began + self.timeout
        if not worker.is_ready:
            return worker.asked + START_LIMIT if worker.is_told else math.inf
        return math.inf if worker.future is None else worker.asked + self.answer_limit

    def _receive(self, worker: _Worker) -> None:
        try:
            message = worker.socket.recv()
        except (EOFError, OSError, pickle.UnpicklingError):
            self._remove(worker, None)
            return
        self._failed_starts = 0
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

    def _remove(self, worker: _Worker, reason: Exception | None) -> None:
        """Remove a dead worker, or end it for a reason; its call is lost if it had started."""
        self._workers.remove(worker)
        if reason is None:
            with contextlib.suppress(subprocess.TimeoutExpired):  # let it end by itself, for its own exit code
                worker.process.wait(timeout=EXIT_WAIT)
        code = worker.kill()
        if worker.future is not None and worker.began is not None:
            worker.future.set_exception(reason or WorkerDied(f"its worker process died with exit code {code}"))
        elif worker.future is not None and worker.call is not None:  # it died idle, before the call had started
            with self._lock:
                self._queue.appendleft((worker.call, worker.future))
        elif not worker.is_ready:
            self._failed_starts += 1
            if self._failed_starts >= FAILED_STARTS:
                self._fail_all(
                    StudyError(
                        f"{self._failed_starts} worker processes in a row died before they began (exit code {code}); "
                        "is there memory for that many? Finished samples are saved, and the same command resumes the "
                        "study."
                    )
                )
                self._failed_starts = 0

    def _fail_all(self, error: Exception) -> None:
        with self._lock:
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
