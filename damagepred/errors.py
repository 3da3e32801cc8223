"""Errors a user can cause or must know of. Each message names key, value and remedy."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from difflib import get_close_matches
from math import inf, isfinite, nan
from numbers import Integral, Real

LONGEST_MESSAGE = 2000  # characters of a message
LONGEST_VALUE = 100  # characters of a value in a message


class DamagepredError(Exception):
    """Base of all errors this package raises on purpose. A message that is too long ends with dots.

    Examples
    --------
    >>> import damagepred
    >>> try:
    ...     damagepred.open_study("nowhere.dp")
    ... except damagepred.DamagepredError as error:
    ...     print(type(error).__name__)
    InputError
    """

    def __init__(self, message: str = "") -> None:
        short = message if len(message) <= LONGEST_MESSAGE else f"{message[: LONGEST_MESSAGE - 3]}..."
        super().__init__(short)


class InputError(DamagepredError, ValueError):
    """The input cannot be used as given: the message says what, why and what to do.

    Examples
    --------
    >>> import damagepred
    >>> damagepred.Wall(length="6 km")
    Traceback (most recent call last):
        ...
    damagepred.errors.InputError: Wall: length = 6000.0: must be at most 1000 m. Did you mean '6000 mm'?
    """


class DamagedError(InputError):
    """A file of an archive is not what was written, or belongs to another study."""


class NewerError(InputError):
    """An archive was written by a newer version of this package."""


class ArchiveWarning(UserWarning):
    """A file of an archive is left out or made again; the results are right without it."""


class StudyError(DamagepredError):
    """A study folder cannot be written, resumed or read.

    Examples
    --------
    >>> import damagepred
    >>> issubclass(damagepred.StudyError, damagepred.DamagepredError)
    True
    """


class SolverError(DamagepredError):
    """A path ended before its last increment without a physical reason.

    Attributes
    ----------
    increment : int
        Increment in which it ended.
    block : int
        Block that was worst off (largest unbalanced force or displacement), -1 if none.

    Examples
    --------
    >>> import damagepred
    >>> issubclass(damagepred.SolverError, damagepred.DamagepredError)
    True
    """

    def __init__(self, message: str, *, increment: int = -1, block: int = -1) -> None:
        super().__init__(message)
        self.increment = increment
        self.block = block


class DivergenceError(SolverError):
    """The solution grew without bound or became NaN."""


class ConvergenceError(SolverError):
    """No equilibrium was found within the work allowed."""


class TimeLimitError(SolverError):
    """A path took longer than its time limit."""


def require_count(name: str, value: object, least: int = 1) -> None:
    """Check that a value is a whole number."""
    if not isinstance(value, Integral) or isinstance(value, bool) or int(value) < least:
        raise InputError(f"{name} = {shown(value)}: must be a whole number, {least} or more.")


def require_confidence(value: float) -> None:
    """Check a confidence level."""
    if not 0 < value < 1:
        raise InputError(f"confidence = {value!r}: must lie between 0 and 1.")


def require_one_of(name: str, value: object, allowed: Collection[str]) -> None:
    """Check that a value is one of some words."""
    if not isinstance(value, str) or value not in allowed:
        hint = nearest(value, allowed) if isinstance(value, str) else ""
        raise InputError(f"{name} = {shown(value)}: must be one of {', '.join(allowed)}.{hint}")


def require_number(
    name: str, value: object, low: float = -inf, high: float = inf, *, unit: str = "", open_low: bool = False
) -> float:
    """Return a value as a finite number within bounds."""
    try:
        number = float(value) if isinstance(value, Real) and not isinstance(value, bool) else nan
    except OverflowError:  # a whole number may have any number of digits
        number = inf
    if isfinite(number) and low <= number <= high and not (open_low and number == low):
        return number
    least = f" {'greater than' if open_low else 'of at least'} {low:g}" if isfinite(low) else ""
    most = f" {'and' if least else 'of'} at most {high:g}" if isfinite(high) else ""
    raise InputError(f"{name} = {shown(value)}: must be a finite number{least}{most}{' ' + unit if unit else ''}.")


def shown(value: object) -> str:
    """Return a value in writing, a long one shortened."""
    try:
        text = repr(value)
    except ValueError:  # a whole number of more digits than Python writes
        text = f"a number of type {type(value).__name__}"
    return text if len(text) <= LONGEST_VALUE else f"{text[: LONGEST_VALUE - 3]}..."


def nearest(word: str, allowed: Iterable[str]) -> str:
    """Return a ' Did you mean ...?' hint, or '' when nothing allowed comes close to ``word``."""
    found = get_close_matches(word, list(allowed), n=1, cutoff=0.6)
    return f" Did you mean '{found[0]}'?" if found else ""


def likely_unit(value: object, most: float, unit: str) -> str:
    """Return a ' Did you mean ...?' hint for a number too large in its unit that fits in mm or per cent, or ''."""
    factor, smaller = {"m": (1e3, "mm"), "1": (1e2, "%")}.get(unit, (1.0, ""))
    fits = isinstance(value, float | int) and 3.0 * most <= value <= factor * most  # a little too much is no other unit
    return f" Did you mean '{value:g} {smaller}'?" if fits else ""
