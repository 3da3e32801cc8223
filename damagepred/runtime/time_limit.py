"""A limit to the time that one wall may take, watched wherever solvers iterate."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

from damagepred.errors import TimeLimitError

_LIMIT: ContextVar[tuple[float, float] | None] = ContextVar("time limit", default=None)
"""When the time is over (s, of the monotonic clock), and how long it was (s)."""


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
    """Check that there is time left."""
    limit = _LIMIT.get()
    if limit is not None and time.monotonic() > limit[0]:
        raise TimeLimitError(
            f"took longer than its time limit ({limit[1]:g} s); --timeout, or limits in Python, sets another"
        )
