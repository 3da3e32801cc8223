"""Movement of a wall as a history, and its prior.

A history is the largest movement up to the last visit times a relative history with few parameters. *Steady*: a line
from the day on which the movement began. *Step*: a share of the movement came on one day. *Seasonal*: a yearly swing
about a steady line. The years of a survey count from its last visit.
"""

from __future__ import annotations

import datetime as dt
import math
import re
from collections.abc import Sequence
from typing import Annotated, Any, Literal, NamedTuple

import numpy as np
from pydantic import BeforeValidator, Field

from damagepred.arrays import FloatArray
from damagepred.errors import InputError
from damagepred.inputs.text import written_date
from damagepred.scene.described import described

DAYS = 365.25  # days of a year
LEAST_AGE, LARGEST_AGE = 1.0, 100.0
"""Limits of the time since a steady movement began (years), log-uniform between them. Assumed."""

PARAMETERS = {"steady": 1, "step": 2, "seasonal": 4}  # numbers that a history is drawn by
SEASON_POINTS = 37
"""Points of a year at which the largest movement of a season is looked for: off by less than 0.4 % of its amplitude."""


def _day(value: Any) -> Any:
    """Date of a TOML date, a date with a time or a text."""
    if isinstance(value, dt.datetime):
        return value.date()
    return value if isinstance(value, dt.date) else written_date(str(value))


def _day_or_year(value: Any) -> Any:
    """Date; of a year alone its first day."""
    if not isinstance(value, bool) and re.fullmatch(r"\d{4}", text := str(value).strip()) and text > "0000":
        return dt.date(int(text), 1, 1)
    return _day(value)


def _several(value: Any) -> Any:
    return value if isinstance(value, list | tuple) else (value,)


Day = Annotated[dt.date, BeforeValidator(_day)]
DayOrYear = Annotated[dt.date, BeforeValidator(_day_or_year)]
Kind = Literal["steady", "seasonal", "step"]


@described
class History:
    """Prior of the movement over time (``[history]``), for observations with dates."""

    kind: Annotated[tuple[Kind, ...], BeforeValidator(_several), Field(min_length=1)] = ("steady", "step")
    """``"steady"``, ``"seasonal"``, ``"step"`` or several of them, which are equally likely before the survey."""
    began: Annotated[tuple[DayOrYear, ...], BeforeValidator(_several), Field(max_length=2)] = ()
    """Day, or first and last possible day, on which the steady movement or the step began. By default a steady movement
    is 1 to 100 years old (log-uniform); a step came in the surveyed time, or as long before it."""
    until: Annotated[tuple[DayOrYear, ...], BeforeValidator(_several)] = ()
    """Dates of the forecast; a year is its first day. By default 1, 5 and 10 years after the last visit."""

    def require_dates(self, last: dt.date) -> None:
        """Refuse dates that contradict each other or the last visit."""
        if len(set(self.kind)) < len(self.kind):
            raise InputError(f"history: kind = {', '.join(self.kind)}: names a kind twice.")
        if list(self.began) != sorted(self.began) or self.began[-1:] > (last,):
            raise InputError(
                f"history: began = {', '.join(map(str, self.began))}: give the first possible day and then the last, "
                f"neither after the last visit, {last}."
            )
        if early := [day for day in self.until if day <= last]:
            raise InputError(
                f"until = {early[0]}: must be later than the last visit, {last}; a forecast begins there. Correct the "
                "date of the visit, or give a later date."
            )

    def forecast_dates(self, last: dt.date) -> list[dt.date]:
        """Dates of the forecast, in order."""
        given = {*self.until} or {last + dt.timedelta(days=round(DAYS * years)) for years in (1, 5, 10)}
        return sorted(given)


def years_from(last: dt.date, days: Sequence[dt.date]) -> FloatArray:
    """Years from the last visit to some days; negative before it."""
    return np.array([(day - last).days / DAYS for day in days])


class Histories(NamedTuple):
    """Relative histories (histories,): slope * t - drop * (t < day) + amplitude * sin 2 pi (t - phase), t in years."""

    kind: FloatArray  # number in the list of kinds
    slope: FloatArray  # 1/year
    drop: FloatArray
    day: FloatArray  # years
    amplitude: FloatArray
    phase: FloatArray  # years
    recovery: FloatArray  # share of a response that goes back with the movement, in proportion to it

    def at(self, years: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Largest relative movement up to some times, movement then, and share of the response that is left."""

        def line(t: FloatArray) -> FloatArray:
            each = (slice(None), *(None,) * t.ndim)
            slope, drop, day, amplitude, phase = (values[each] for values in self[1:6])
            return slope * t - drop * (t < day) + amplitude * np.sin(2.0 * math.pi * (t - phase))

        times = np.append(years, 0.0)
        movement = largest = line(times)
        if self.amplitude.any():  # without a season no movement goes back
            largest = line(times[:, None] - np.linspace(0.0, 1.0, SEASON_POINTS)).max(axis=-1)
        below = 1.0 - largest[:, -1:]
        reached, moved = (np.maximum(below + values[:, :-1], 0.0) for values in (largest, movement))
        back = 1.0 - np.divide(moved, reached, out=np.ones_like(moved), where=reached > 0)
        return reached, moved, 1.0 - self.recovery[:, None] * back


PRESENT = Histories(*np.zeros((7, 1)))  # the one history of a single visit


def drawn_histories(prior: History, number: int, unit: FloatArray, first: float, last: dt.date) -> Histories:
    """Histories of a kind by its number from points of the unit cube; ``first``: years to the first visit."""
    kind, nothing = prior.kind[number], np.zeros(len(unit))
    early, late = -years_from(last, [prior.began[0], prior.began[-1]]) if prior.began else (-2.0 * first, 0.0)
    age = late + unit[:, 0] * (early - late)
    if kind == "step":
        return Histories(nothing + number, nothing, unit[:, 1], -age, nothing, nothing, nothing)
    if not prior.began:
        age = LEAST_AGE * (LARGEST_AGE / LEAST_AGE) ** unit[:, 0]
    swing = (0.5 * unit[:, 1], unit[:, 2], unit[:, 3]) if kind == "seasonal" else (nothing,) * 3
    return Histories(nothing + number, 1.0 / np.maximum(age, 1.0 / DAYS), nothing, nothing, *swing)
