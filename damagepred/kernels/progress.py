"""Progress of compilation."""

from __future__ import annotations

from typing import Any

_functions: list[tuple[str, Any]] = []


def counted(function: Any, module: str) -> Any:
    """Count a function of a module of kernels, whose ``signatures`` are not empty once it is compiled."""
    _functions.append((module.removeprefix("damagepred.kernels.").partition(".")[0], function))
    return function


def progress() -> tuple[int, int]:
    """Number of compiled or loaded functions, and of all functions in their rooms; some walls need fewer."""
    ready = [room for room, function in _functions if function.signatures]
    return len(ready), sum(room in ready for room, _ in _functions)
