"""Errors a user can cause or must know of. Each message names key, value and remedy."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches
from numbers import Integral

LONGEST_MESSAGE = 2000
"""Characters of a message."""


class DamagepredError(Exception):
    """Base of all errors this package raises on purpose. A message that is too long ends with dots."""

    def __init__(self, message: str = "") -> None:
        short = message if len(message) <= LONGEST_MESSAGE else f"{message[: LONGEST_MESSAGE - 3]}..."
        super().__init__(short)


class InputError(DamagepredError, ValueError):
    """The input cannot be used as given: the message says what, why and what to do."""


class StudyError(DamagepredError):
    """A study folder cannot be written, resumed or read."""


class SolverError(DamagepredError):
    """A path ended before its last increment without a physical reason.

    Attributes
    ----------
    increment : int
        Increment in which it ended.
    block : int
        Block that was worst off (largest unbalanced force or displacement), -1 if none.
    """

    def __init__(self, message: str, *, increment: int = -1, block: int = -1) -> None:
        super().__init__(message)
        self.increment = increment
        self.block = block

    def __reduce__(self) -> tuple[object, ...]:
        """Survive the trip from a worker process."""
        return (_rebuild_solver_error, (type(self), str(self), self.increment, self.block))


class DivergenceError(SolverError):
    """The solution grew without bound or became NaN."""


class ConvergenceError(SolverError):
    """No equilibrium was found within the work allowed."""


def _rebuild_solver_error(kind: type[SolverError], message: str, increment: int, block: int) -> SolverError:
    return kind(message, increment=increment, block=block)


def require_count(name: str, value: object, least: int = 1) -> None:
    """Check that a value is a whole number.

    Parameters
    ----------
    name : str
        What it is called.
    value : object
        The value.
    least : int
        Smallest number allowed.

    Raises
    ------
    InputError
        If it is something else, or less.
    """
    if not isinstance(value, Integral) or isinstance(value, bool) or int(value) < least:
        raise InputError(f"{name} = {value!r}: must be a whole number, {least} or more.")


def nearest(word: str, allowed: Iterable[str]) -> str:
    """Return a ' Did you mean ...?' hint, or '' when nothing allowed comes close to ``word``.

    Parameters
    ----------
    word : str
        What the user wrote.
    allowed : iterable of str
        What would have been accepted.
    """
    found = get_close_matches(word, list(allowed), n=1, cutoff=0.6)
    return f" Did you mean '{found[0]}'?" if found else ""
