"""Observations on a damaged wall: cracks, monitors, levels, slopes, windows, and checks against contradictions."""

from __future__ import annotations

import datetime as dt
import itertools
import math
from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import Any, Literal

import numpy as np
from pydantic import Field
from scipy import special

from damagepred.errors import InputError
from damagepred.inputs.input_files import read_toml
from damagepred.scene.described import build, described
from damagepred.scene.quantity import Count, Length, Pure
from damagepred.scene.survey_tables import SUFFIXES, read_survey, survey_kind
from damagepred.uq.discrepancy import Discrepancy
from damagepred.uq.history import Day, History

Direction = Literal["horizontal", "vertical", "stepped", "diagonal"]

CONTRADICTION = 3.0  # standard errors between two measurements of one quantity from which they contradict each other
ROUNDING = 1e-9  # distance (m) that counts as none
ANOTHER = "another cause"  # name of all causes without a study, in prior odds and tables
WIDEST, HIGHEST = 0.3, 1.0
"""Largest width of a crack, and difference of levels (m): beyond them millimetres lack their unit."""


@described
class Reading:
    """Date of an observation."""

    wall: str | None = None
    """Wall of a house, from whose start places count. A crack, slope or tilt without it is the largest of the house."""
    date: Day | None = None
    since: Day | None = None
    """Day of the visit; day from which the measured value is a change."""

    @property
    def observed(self) -> float | None:
        """Measured value; limits have no value."""
        return next((v for name in _MEASURED if (v := getattr(self, name, None)) is not None), None)

    @property
    def quantity(self) -> tuple[Any, ...]:
        """Equal for readings of one quantity."""
        return (*(getattr(self, name, None) for name in _QUANTITY), getattr(self, "sticks", None) is None)


@described
class CrackObservation(Reading):
    """A crack, or its absence (``[[crack]]``)."""

    x: Length | None = None
    y: Length | None = None
    """Place (m); without it the widest crack of the part is meant."""
    within: Length = Field(default=0.5, gt=0)
    """Distance from the place within which the crack runs (m)."""
    width: Length | None = Field(default=None, gt=0, le=WIDEST)
    """Width (m)."""
    change: Length | None = Field(default=None, ge=-WIDEST, le=WIDEST)
    """Instead of a width: its change since a day (m), as a crack monitor reads it."""
    error: Length = Field(default=2e-4, ge=0, le=WIDEST)
    """Standard error of the measurement (m)."""
    wider_than: Length | None = Field(default=None, gt=0, le=WIDEST)
    narrower_than: Length | None = Field(default=None, gt=0, le=WIDEST)
    """Instead of a width: limits (m)."""
    none: bool = False
    """No crack is seen here: all are narrower than ``visible``."""
    visible: Length = Field(default=1e-4, gt=0)
    """Width from which a crack is seen (m)."""
    direction: Direction | None = None
    """How the crack runs; needs a place."""
    part: Literal["wall", "below_dpc", "dpc"] = "wall"
    """The wall above any dpc, the courses below it, or the dpc."""

    @property
    def limits(self) -> tuple[float, float]:
        """Limits of a width that was not measured (m)."""
        return (-np.inf, self.visible) if self.none else (self.wider_than or -np.inf, self.narrower_than or np.inf)

    @property
    def range(self) -> tuple[float, float]:
        """Limits of the widest crack (m), ``CONTRADICTION`` standard errors from a measured width."""
        if self.width is None:
            return self.limits
        return self.width - CONTRADICTION * self.error, self.width + CONTRADICTION * self.error

    def contains(self, other: CrackObservation) -> bool:
        """Whether any crack of another observation is one of this observation, too."""
        if (self.part, self.date) != (other.part, other.date) or self.direction not in (None, other.direction):
            return False
        if self.wall not in (None, other.wall):
            return False
        if self.place is None or other.place is None:
            return self.place is None
        return math.dist(self.place, other.place) + other.within <= self.within + ROUNDING

    @property
    def place(self) -> tuple[float, float] | None:
        """Place (m) near which the crack runs."""
        return None if self.x is None or self.y is None else (self.x, self.y)


@described
class MonitorSeries:
    """Readings of a crack monitor (``[[monitor]]``); with ``file``, the rows of a table."""

    name: str = ""
    """Name of the monitor."""
    wall: str | None = None
    x: Length | None = None
    y: Length | None = None
    within: Length = Field(default=0.5, gt=0)
    direction: Direction | None = None
    part: Literal["wall", "below_dpc", "dpc"] = "wall"
    """Place (m), direction and part of the crack."""
    error: Length = Field(default=1e-4, ge=0)
    """Standard error of a reading (m)."""
    date: tuple[Day, ...]
    """Days of the readings, in order."""
    width: tuple[Length, ...] = ()
    """Widths of the crack (m)."""
    change: tuple[Length, ...] = ()
    """Instead: changes of its width since the first day (m), the first of which is 0."""

    def readings(self, where: str) -> list[CrackObservation]:
        """Readings as observed cracks."""
        read = self.width or self.change
        if bool(self.width) == bool(self.change):
            raise InputError(f"{where}: give one of width and change, a list with one value per date.")
        if len(read) != len(self.date):
            raise InputError(f"{where}: has {len(self.date)} dates and {len(read)} readings; give one per date.")
        if later := [(a, b) for a, b in itertools.pairwise(self.date) if b <= a]:
            raise InputError(f"{where}: {later[0][1]} follows {later[0][0]}; dates must increase.")
        if self.change and (self.change[0] != 0 or len(read) < 2):
            raise InputError(f"{where}: change must begin with 0, on the day the monitor was set, and go on after it.")
        common = {key: getattr(self, key) for key in ("wall", "x", "y", "within", "direction", "part", "error")}
        if self.change:
            common["since"] = self.date[0]
        if shut := [value for value in self.width if not value > 0]:
            raise InputError(
                f"{where}: width = {shut[0]:g}: must be greater than 0; give a closed crack as a [[crack]] with "
                "none = true, or the changes since the first day as `change`."
            )
        key, first = ("change", 1) if self.change else ("width", 0)
        rows = ({**common, "date": day, key: value} for day, value in zip(self.date[first:], read[first:]))
        return [build(CrackObservation, row, where) for row in rows]


@described
class LevelObservation(Reading):
    """How much higher one point stands than another (``[[level]]``), both once level."""

    to_wall: str | None = None
    """Wall of the second point, if another than of the first."""
    x: Length
    y: Length
    to_x: Length
    to_y: Length
    """The points (m)."""
    difference: Length = Field(ge=-HIGHEST, le=HIGHEST)
    """Height of the second above the first (m)."""
    error: Length = Field(default=1e-3, ge=0, le=HIGHEST)
    """Standard error of the difference of both levels (m)."""

    @property
    def ends(self) -> tuple[tuple[str | None, float, float], ...]:
        """Wall and place of both points."""
        return (self.wall, self.x, self.y), (self.to_wall or self.wall, self.to_x, self.to_y)


@described
class SlopeObservation(Reading):
    """The largest deviation of the wall from level or plumb over a metre (``[[slope]]``, ``[[tilt]]``)."""

    value: Pure = Field(ge=0)
    """Slope, such as ``"3 mm/m"``."""
    error: Pure = Field(default=5e-4, ge=0)
    """Standard error of the slope."""


@described
class WindowObservation(Reading):
    """Whether a door or window sticks, or how its width has changed (``[[window]]``)."""

    opening: Count = Field(ge=1)
    """Number of the opening in the scene, from 1."""
    sticks: bool | None = None
    """Whether it does, be it slightly."""
    width_change: Length | None = Field(default=None, ge=-WIDEST, le=WIDEST)
    """Instead: change of its width at the top (m); negative where it has closed."""
    error: Length = Field(default=5e-4, gt=0, le=WIDEST)
    """Standard error of the change (m)."""

    @property
    def limits(self) -> tuple[float, float]:
        """Limits of the distortion over the distortion from which an opening sticks."""
        return (1.0, np.inf) if self.sticks else (-np.inf, 1.0)


_KINDS = {
    "monitor": MonitorSeries,
    "crack": CrackObservation,
    "level": LevelObservation,
    "slope": SlopeObservation,
    "tilt": SlopeObservation,
    "window": WindowObservation,
}
_MEASURED = "width", "change", "difference", "value", "width_change"
_QUANTITY = "wall", "to_wall", "x", "y", "to_x", "to_y", "within", "part", "opening"
"""Keys of measured values, and of the quantity that is measured."""

TABLES = "crack", "level", "slope", "tilt", "window"  # tables of observations


@described
class Observations:
    """What a survey found (``observations.toml``)."""

    crack: tuple[CrackObservation, ...] = ()
    level: tuple[LevelObservation, ...] = ()
    slope: tuple[SlopeObservation, ...] = ()
    tilt: tuple[SlopeObservation, ...] = ()
    window: tuple[WindowObservation, ...] = ()
    """Observations of each kind: all of them have dates, or none. An entry with ``file`` stands for the rows of a CSV
    or xlsx file; its other keys apply to all rows."""
    monitor: tuple[MonitorSeries, ...] = ()
    """Readings of crack monitors."""
    history: History | None = None
    """Prior of the movement over time, if observations have dates."""
    discrepancy: Discrepancy = Field(default_factory=Discrepancy)
    """Discrepancy of the model."""
    movement: str | None = None
    """Prior of the movement: a site class or a distribution; uniform up to the study's largest by default."""
    prior_odds: dict[str, Pure] = Field(default_factory=dict)
    """Of causes, by the name of their study, and of ``"another cause"``; equal by default."""

    def __post_init__(self) -> None:
        """Refuse observations that say nothing or two things."""
        for number, crack in enumerate(self.crack, 1):
            where = f"crack {number}"
            if (crack.x is None) != (crack.y is None):
                raise InputError(f"{where}: give x and y, or neither of them.")
            if crack.x is None and crack.direction is not None:
                raise InputError(f"{where}: a direction needs the place of the crack; give x and y.")
            limits = crack.wider_than is not None or crack.narrower_than is not None
            if (crack.width is not None) + (crack.change is not None) + limits + crack.none != 1:
                raise InputError(
                    f"{where}: give one of width, none = true, or the limits wider_than, narrower_than; or a change "
                    "since a day."
                )
            if (crack.wider_than or 0.0) >= (crack.narrower_than or np.inf):
                raise InputError(f"{where}: wider_than must be less than narrower_than.")
            if crack.direction is not None and crack.none:
                raise InputError(f"{where}: an absent crack has no direction; leave it out.")
        for number, window in enumerate(self.window, 1):
            if (window.sticks is None) == (window.width_change is None):
                raise InputError(f"window {number}: give one of sticks and width_change.")
        if not self.count:
            raise InputError(
                "observations: there are none; give a [[crack]], [[level]], [[slope]], [[tilt]], [[window]]."
            )
        self._require_dates()
        if any(not odds > 0 for odds in self.prior_odds.values()):
            raise InputError("prior_odds: must be greater than 0.")
        self._refuse_contradictions()

    def _require_dates(self) -> None:
        """Refuse dates of some observations and not of others, in a wrong order, or without sense."""
        named = self.named(TABLES)
        undated = [where for where, reading in named if reading.date is None]
        if undated and (self.monitor or len(undated) < len(named)):
            raise InputError(f"{undated[0]}: has no date, but other observations have; give each of them its date.")
        if undated and self.history is not None:
            raise InputError("history: needs dates, and the observations have none; give each of them its date.")
        for where, reading in named:
            if reading.since is not None and not (reading.date is not None and reading.since < reading.date):
                raise InputError(f"{where}: since = {reading.since}: must be earlier than its date, {reading.date}.")
            by = getattr(reading, "change", reading.observed if reading.since else None)
            if (by is None) != (reading.since is None):
                raise InputError(f"{where}: give a change and the day `since` which it counts, or neither of them.")
        if self.dates:
            self.prior.require_dates(self.dates[-1])

    def named(self, tables: Sequence[str]) -> list[tuple[str, Any]]:
        """Readings of some tables with their names: table and number."""
        return [(f"{table} {k}", reading) for table in tables for k, reading in enumerate(getattr(self, table), 1)]

    @property
    def prior(self) -> History:
        """Prior of the movement over time."""
        return self.history or History()

    @cached_property
    def cracks(self) -> list[tuple[str, CrackObservation]]:
        """Observed cracks and readings of monitors, with their names."""
        named = self.named(["crack"])
        for k, monitor in enumerate(self.monitor, 1):
            where = f"monitor {k}" + (f" ({monitor.name})" if monitor.name else "")
            named += [(where, reading) for reading in monitor.readings(where)]
        return named

    @cached_property
    def series(self) -> list[tuple[str, list[Any]]]:
        """Readings of each quantity in the order of their dates, with their table; undated ones stand alone."""
        grouped: dict[tuple[Any, ...], list[Any]] = {}
        for table in TABLES:
            readings = [crack for _, crack in self.cracks] if table == "crack" else getattr(self, table)
            for k, reading in enumerate(readings):
                key = (k,) if reading.date is None else reading.quantity
                grouped.setdefault((table, *key), []).append(reading)
        return [(key[0], sorted(found, key=lambda r: r.date or dt.date.min)) for key, found in grouped.items()]

    @cached_property
    def names(self) -> list[str]:
        """Names of the quantities of ``series``: tables and numbers of their readings in the survey."""
        name = {id(reading): where for where, reading in [*self.cracks, *self.named(TABLES[1:])]}
        return [", ".join(dict.fromkeys(name[id(reading)] for reading in readings)) for _, readings in self.series]

    @cached_property
    def dates(self) -> list[dt.date]:
        """Days of all readings, in order; empty without dates."""
        days = {day for _, found in self.series for reading in found for day in (reading.date, reading.since)}
        return sorted(day for day in days if day is not None)

    def alone(self, day: dt.date) -> Observations | None:
        """Observations of one day by themselves, without changes since another."""
        tables = {table: getattr(self, table) for table in TABLES} | {"crack": [crack for _, crack in self.cracks]}
        chosen: dict[str, Any] = {
            table: tuple(replace(r, date=None) for r in readings if r.date == day and r.since is None)
            for table, readings in tables.items()
        }
        return replace(self, **chosen, monitor=(), history=None) if any(chosen.values()) else None

    def _refuse_contradictions(self) -> None:
        """Refuse pairs of observations of one quantity that differ by more than ``CONTRADICTION`` standard errors."""
        widths = [(where, crack) for where, crack in self.cracks if crack.change is None]
        for (a, inner), (b, outer) in itertools.permutations(widths, 2):
            if inner.range[0] > outer.range[1] and outer.contains(inner):
                raise InputError(
                    f"{a} and {b} contradict each other: one is wider than {inner.range[0] * 1e3:.3g} mm, "
                    f"and where it runs none is wider than {outer.range[1] * 1e3:.3g} mm. Correct one of them, or "
                    "give places or a smaller `within`."
                )
        days: list[Any] = self.dates or [None]
        for day in days:
            self._refuse_contradictions_of(day)

    def _refuse_contradictions_of(self, day: dt.date | None) -> None:
        """Refuse measurements of one quantity on one day that differ."""
        slopes, tilts, windows, levels = (
            [r for r in getattr(self, table) if r.date == day] for table in ("slope", "tilt", "window", "level")
        )
        alike = [
            (kind, f" wall '{wall}':" if wall else "", [(r.value, r.error) for r in readings if r.wall == wall])
            for kind, readings in (("slope", slopes), ("tilt", tilts))
            for wall in dict.fromkeys(reading.wall for reading in readings)
        ]
        for wall, number in dict.fromkeys((window.wall, window.opening) for window in windows):
            same = [window for window in windows if (window.wall, window.opening) == (wall, number)]
            which = f"opening {number}" + (f" of wall '{wall}'" if wall else "")
            if {window.sticks for window in same} >= {True, False}:
                raise InputError(f"window: {which} sticks and does not; remove one of the two.")
            changes = [(w.width_change, w.error) for w in same if w.width_change is not None]
            alike.append(("window", f" {which}:", changes))
        for kind, which, values in alike:
            for (first, error), (second, other) in itertools.combinations(values, 2):
                if abs(first - second) > CONTRADICTION * max(np.hypot(error, other), np.finfo(np.float64).tiny):
                    raise InputError(
                        f"{kind}:{which} {first:g} and {second:g} are measurements of one quantity and differ by more "
                        f"than {CONTRADICTION:g} standard errors; correct one of them, or give larger errors."
                    )
        for start in {level.since for level in levels}:
            self._levels_close([level for level in levels if level.since == start])

    def _levels_close(self, levels: Sequence[LevelObservation]) -> None:
        """Refuse differences of levels whose loops do not close (least squares adjustment of the survey)."""
        ends = [level.ends for level in levels]
        if same := [k for k, (start, end) in enumerate(ends, 1) if start == end]:
            number = self.level.index(levels[same[0] - 1]) + 1
            raise InputError(f"level {number}: both points are one; give two points.")
        points = {point: k for k, point in enumerate(dict.fromkeys(itertools.chain(*ends)))}
        error = np.maximum([level.error for level in levels], 1e-6)
        rows = np.zeros((len(ends), len(points)))
        for row, (start, end) in zip(rows, ends):
            row[points[start]], row[points[end]] = -1.0, 1.0
        rows, rise = rows / error[:, None], np.array([level.difference for level in levels]) / error
        heights, _, rank, _ = np.linalg.lstsq(rows, rise)
        gap = rise - rows @ heights
        if rank < len(ends) and special.chdtrc(len(ends) - rank, gap @ gap) < special.chdtrc(1, CONTRADICTION**2):
            worst = int(np.argmax(np.abs(gap)))
            which, off = self.level.index(levels[worst]) + 1, abs(gap[worst]) * error[worst] * 1e3
            raise InputError(
                f"level {which}: contradicts the other levels by {off:.3g} mm: "
                "differences along a loop must add up to 0 within their errors. Correct it, or give larger errors."
            )

    @property
    def count(self) -> int:
        """Number of observations."""
        return sum(len(readings) for _, readings in self.series)

    @classmethod
    def from_toml(cls, path: str | Path, until: Sequence[str] = ()) -> Observations:
        """Read the file of a survey: TOML, or a table of cracks or levels (CSV, xlsx); ``until``: forecast dates."""
        path = Path(path)
        try:
            table = path.suffix.lower() in SUFFIXES
            tables: dict[str, Any] = {survey_kind(path): [{"file": path.name}]} if table else dict(read_toml(path))
            dated = bool(until) or "history" in tables or "monitor" in tables
            for name in ("monitor", *(table for table in TABLES if table != "level"), "level"):
                entries = tables.get(name)
                if isinstance(entries, list):
                    items: list[Any] = []
                    for entry in entries:
                        filed = isinstance(entry, dict) and "file" in entry
                        items += read_survey(_KINDS[name], name, entry, path.parent, dated) if filed else [entry]
                    tables[name] = items
                    dated |= any(i.get("date") if isinstance(i, dict) else getattr(i, "date", None) for i in items)
            if until and isinstance(tables.setdefault("history", {}), dict):
                tables["history"]["until"] = list(until)
            return build(cls, tables, str(path))
        except InputError as error:
            raise error if str(path) in str(error) else InputError(f"{path}: {error}") from None
