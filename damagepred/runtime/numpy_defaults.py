"""Error settings and print options of NumPy while this package computes."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from contextvars import ContextVar
from typing import Any

import numpy as np

_DEFAULTS = ContextVar("numpy defaults", default=False)  # whether they hold
_PRINTING: dict[str, Any] = {"precision": 8, "threshold": 1000, "edgeitems": 3, "linewidth": 75, "suppress": False}
_PRINTING |= {"nanstr": "nan", "infstr": "inf", "formatter": None, "sign": "-", "floatmode": "maxprec", "legacy": False}


@contextmanager
def numpy_defaults() -> Iterator[None]:
    """Defaults of NumPy and scipy.special for floating-point errors and printed numbers; the caller's come back."""
    if _DEFAULTS.get():
        yield
        return
    with ExitStack() as settings:
        settings.callback(_DEFAULTS.reset, _DEFAULTS.set(True))
        settings.enter_context(np.errstate(divide="warn", over="warn", under="ignore", invalid="warn"))
        settings.enter_context(np.printoptions(**_PRINTING))
        if special := sys.modules.get("scipy.special"):  # slow to import
            settings.enter_context(special.errstate(all="ignore"))
        yield
