"""One BLAS thread for everything that goes into a result.

With more threads BLAS adds in another order, and the last bits of a result would depend on thread variables, on the
number of cores, on other work of the process. Public functions that multiply or factorise matrices are therefore
decorated with ``one_blas_thread()``; generators with ``each_with_one_blas_thread``.

OpenBLAS built on OpenMP has a limit for each calling thread; other BLAS libraries have one for the process. Of the
latter threadpoolctl obeys only the first thread of a process that sets it (the controlling thread) and ignores all
others without a word, so control is taken over here before each setting.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Generator, Iterator
from contextlib import contextmanager
from functools import cache, wraps
from typing import Any, ParamSpec, TypeVar

from threadpoolctl import LibController, OpenBLASController, ThreadpoolController

from damagepred.runtime.numpy_defaults import numpy_defaults

P = ParamSpec("P")
T = TypeVar("T")


@cache
def blas_libraries() -> tuple[LibController, ...]:
    """BLAS libraries of this process, after the import of numpy and scipy."""
    import scipy.linalg  # noqa: F401

    return tuple(ThreadpoolController().select(user_api="blas").lib_controllers)


def _set(library: LibController, threads: int) -> None:
    OpenBLASController.clear_controlling_thread(force=True)
    library.set_num_threads(threads)


class _Limit:
    """Who holds the limit: the process's count of threads, each thread's depth, and the numbers of threads before."""

    def __init__(self) -> None:
        self.lock = threading.RLock()  # a signal handler may come in between
        self.threads = 0
        self.before: dict[str, int] = {}
        self.own: Any = threading.local()

    def enter(self) -> None:
        with self.lock:
            depth = getattr(self.own, "depth", 0)
            if depth == 0:
                self.own.before = {lib.filepath: lib.num_threads for lib in blas_libraries()}
                if self.threads == 0:
                    self.before = self.own.before
                self.threads += 1
            self.own.depth = depth + 1
            for library in blas_libraries():
                if library.num_threads != 1:
                    _set(library, 1)

    def leave(self) -> None:
        with self.lock:
            self.own.depth -= 1
            if self.own.depth > 0:
                return
            self.threads -= 1
            for library in blas_libraries():
                if isinstance(library, OpenBLASController) and library.threading_layer == "openmp":
                    _set(library, self.own.before[library.filepath])
                elif self.threads == 0:
                    _set(library, self.before[library.filepath])
            if self.threads == 0:
                OpenBLASController.clear_controlling_thread(force=True)


_LIMIT = _Limit()
os.register_at_fork(after_in_child=_LIMIT.__init__)  # type: ignore[misc]


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Limit BLAS to one thread until all threads of the process that asked for it have left; also a decorator."""
    _LIMIT.enter()
    try:
        with numpy_defaults():
            yield
    finally:
        _LIMIT.leave()


def has_one_blas_thread() -> bool:
    """Whether the calling thread holds the limit."""
    return getattr(_LIMIT.own, "depth", 0) > 0


def each_with_one_blas_thread(function: Callable[P, Iterator[T]]) -> Callable[P, Iterator[T]]:
    """Decorate a generator function: the limit holds while it computes a value and not while the value is used."""

    @wraps(function)
    def limited(*args: P.args, **kwargs: P.kwargs) -> Iterator[T]:
        values = function(*args, **kwargs)
        try:
            while True:
                with one_blas_thread():
                    try:
                        value = next(values)
                    except StopIteration:
                        return
                yield value
        finally:
            if isinstance(values, Generator):
                values.close()

    return limited
