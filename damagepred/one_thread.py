"""One thread for BLAS while small matrices are worked on: more would spend their time waiting for each other.

Walls may be solved side by side in threads of one process. Whether a limit holds for the thread that sets it or for all
depends on the BLAS; so everyone sets it, and only the last that goes lifts it again.
"""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache

from threadpoolctl import ThreadpoolController


@cache
def _blas() -> ThreadpoolController:
    """Return what controls the BLAS of numpy and of scipy; both are loaded first, so that it finds them."""
    import scipy.linalg  # noqa: F401

    return ThreadpoolController().select(user_api="blas")


class _Holders:
    """How many hold the limit."""

    def __init__(self) -> None:
        self.lock, self.count = threading.Lock(), 0


_HOLDERS = _Holders()


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Let BLAS work with one thread as long as anyone is in here."""
    with _HOLDERS.lock:
        limiter = _blas().limit(limits=1)
        _HOLDERS.count += 1
    try:
        yield
    finally:
        with _HOLDERS.lock:
            _HOLDERS.count -= 1
            if _HOLDERS.count == 0:
                limiter.restore_original_limits()
