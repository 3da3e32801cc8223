"""A limit to the time that one wall may take, and signals, both watched wherever solvers iterate."""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from types import FrameType

from damagepred.errors import TimeLimitError

_LIMIT: ContextVar[tuple[float, float] | None] = ContextVar("time limit", default=None)
"""When the time is over (s, of the monotonic clock), and how long it was (s)."""

_PENDING: dict[int, Callable[[int, FrameType | None], object]] = {}
"""Handlers of signals that wait for the next ``check_time``, by number."""


@contextmanager
def interrupts_between_kernels() -> Iterator[None]:
    """Let handlers of signals (Ctrl-C, timers) act at the next ``check_time``; a second signal acts at once.

    An exception that a handler raises while numba makes the result of a kernel is lost, or another one takes its place.
    """
    known = [(int(number), signal.getsignal(number)) for number in signal.valid_signals()] if _in_main_thread() else []
    handlers = {number: handler for number, handler in known if callable(handler)}

    def note(number: int, frame: FrameType | None) -> None:
        if number in _PENDING:
            handlers[number](number, frame)
        _PENDING[number] = handlers[number]

    for number in handlers:
        signal.signal(number, note)
    try:
        yield
    finally:
        for number, handler in handlers.items():
            if signal.getsignal(number) is note:
                signal.signal(number, handler)
        _handle_pending()


def _in_main_thread() -> bool:
    return threading.current_thread() is threading.main_thread()


def _handle_pending() -> None:
    while _PENDING and _in_main_thread():
        number, handler = _PENDING.popitem()
        handler(number, None)


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
    """Check that there is time left, and let handlers of signals act."""
    _handle_pending()
    limit = _LIMIT.get()
    if limit is not None and time.monotonic() > limit[0]:
        raise TimeLimitError(
            f"took longer than its time limit ({limit[1]:g} s); --timeout, or limits in Python, sets another"
        )
