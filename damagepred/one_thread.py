"""One thread for BLAS while small matrices are worked on: more would spend their time waiting for each other.

Limits of BLAS hold for the whole process. Walls may be solved side by side in threads of one process; so the limit is
set by the first that comes and lifted by the last that goes. (OpenBLAS heeds only the thread that set it: if another is
the last, the limit stays.)
"""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any

from threadpoolctl import ThreadpoolController


@cache
def _blas() -> ThreadpoolController:
    """Return what controls the BLAS of numpy and of scipy; both are loaded first, so that it finds them."""
    import scipy.linalg  # noqa: F401

    return ThreadpoolController().select(user_api="blas")


class _Limit:
    """How many hold the limit, and how to lift it."""

    def __init__(self) -> None:
        self.lock, self.holders = threading.Lock(), 0
        self.limiter: Any = None


_LIMIT = _Limit()


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Let BLAS work with one thread, in the whole process, as long as anyone is in here."""
    with _LIMIT.lock:
        if _LIMIT.holders == 0:
            _LIMIT.limiter = _blas().limit(limits=1)
        _LIMIT.holders += 1
    try:
        yield
    finally:
        with _LIMIT.lock:
            _LIMIT.holders -= 1
            if _LIMIT.holders == 0:
                _LIMIT.limiter.restore_original_limits()
