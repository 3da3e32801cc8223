"""A limit to the time that one wall may take, and Ctrl-C, both watched wherever solvers iterate."""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from types import FrameType

from damagepred.errors import TimeLimitError

_LIMIT: ContextVar[tuple[float, float] | None] = ContextVar("time limit", default=None)
"""When the time is over (s, of the monotonic clock), and how long it was (s)."""

_INTERRUPTED = threading.Event()


@contextmanager
def interrupts_between_kernels() -> Iterator[None]:
    """Let Ctrl-C act at the next ``check_time``, the second one at once.

    An exception that a handler raises while numba makes the result of a kernel is lost, or another one takes its place.
    """
    first = signal.default_int_handler
    if not _in_main_thread() or signal.getsignal(signal.SIGINT) is not first:
        yield
        return

    def note(number: int, frame: FrameType | None) -> None:
        if _INTERRUPTED.is_set():
            first(number, frame)
        _INTERRUPTED.set()

    _INTERRUPTED.clear()
    signal.signal(signal.SIGINT, note)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, first)
    _raise_interrupt()


def _in_main_thread() -> bool:
    return threading.current_thread() is threading.main_thread()


def _raise_interrupt() -> None:
    if _INTERRUPTED.is_set() and _in_main_thread():
        _INTERRUPTED.clear()
        raise KeyboardInterrupt


@contextmanager
def time_limit(seconds: float) -> Iterator[None]:
    """Limit the time of a solution; an earlier limit stays."""
    outer, end = _LIMIT.get(), time.monotonic() + seconds
    token = _LIMIT.set(outer if outer is not None and outer[0] <= end else (end, seconds))
    try:
        yield
    finally:
        _LIMIT.reset(token)


def check_time() -> None:
    """Check that there is time left, and no interrupt."""
    _raise_interrupt()
    limit = _LIMIT.get()
    if limit is not None and time.monotonic() > limit[0]:
        raise TimeLimitError(
            f"took longer than its time limit ({limit[1]:g} s); --timeout, or limits in Python, sets another"
        )
