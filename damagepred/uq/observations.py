"""Observations on a damaged wall, and their likelihood for the states of solved walls.

A measured value is normal about the wall's own, with the survey's error and the model's discrepancy added in squares
(Kennedy and O'Hagan 2001); a limit is censored. All observations share the uncertain discrepancy, so their joint
likelihood is integrated over its distribution (Gauss-Hermite quadrature).

Readings of one quantity at several dates are a series: the model's discrepancy is the same at all of them, except for
a share of each reading's own, and the errors of the survey are independent.
"""

from __future__ import annotations

import datetime as dt
import itertools
import math
import tomllib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from functools import cache, cached_property, partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Literal, NamedTuple

import numpy as np
from pydantic import Field
from scipy import special

from damagepred.arrays import FloatArray
from damagepred.errors import InputError
from damagepred.inputs.data_files import data_file
from damagepred.inputs.input_files import read_toml
from damagepred.scene import Scene
from damagepred.scene.described import described
from damagepred.scene.quantity import Count, Length, Pure
from damagepred.scene.reading import build
from damagepred.scene.survey_tables import SUFFIXES, read_survey, survey_kind
from damagepred.uq.history import Day, History, years_from

Direction = Literal["horizontal", "vertical", "stepped", "diagonal"]

CONTRADICTION = 3.0
"""Standard errors between two measurements of one quantity from which they contradict each other."""

ROUNDING = 1e-9
"""Distance (m) that counts as none."""

ANOTHER = "another cause"
"""Name of all causes without a study, in prior odds and tables."""

VAGUE_WIDTH = 1.6e-3, 1.7
"""Under another cause: median (m) and deviation of the logarithm of crack widths, 90 % of them from 0.1 to 25 mm (the
limits of the damage table). One place in two has no crack. Assumed, as all values of the vague model."""

VAGUE_SLOPE = 1.0 / 150.0
"""Under another cause: mean slope and tilt, and standard deviation of levels over their distance."""

VAGUE_CHANGE = 5e-3
"""Under another cause: standard deviation of the change of an opening's width (m); one opening in two sticks."""

OWN_SHARE = 0.1
"""Share of the model's discrepancy (standard deviation) that is each reading's own, not its series'. Assumed."""

COMMON_POINTS = 7
"""Points of the quadrature over the common discrepancy of a series with limits."""


@cache
def _shipped_terms() -> dict[str, dict[str, Any]]:
    """Read value, interval, source and confidence of each term of the model's discrepancy."""
    return tomllib.loads(data_file("statistics", "discrepancy.toml").read_text(encoding="utf-8"))


def _shipped(name: str) -> Callable[[], float]:
    return partial(lambda key: float(_shipped_terms()[key]["value"]), name)


@described
class Discrepancy:
    """Standard deviations of the model against real walls (``[discrepancy]``), shown with every result.

    Those of crack widths are fitted on the cases of the validation; the others are assumed
    (``data/statistics/discrepancy.toml``). The fitted ones are lognormal about the values here; a value that the user
    gives instead is certain.

    Attributes
    ----------
    width, width_share : float
        Of a crack width: absolute (m), and as a share of it.
    level : float
        Standard deviation of a difference of levels (m).
    slope : float
        Standard deviation of a slope or tilt.
    distortion_share : float
        Of the distortion of an opening, as a share of it.
    direction : float
        Probability that a crack runs in another direction in the model.
    """

    width: Length = Field(default_factory=_shipped("width"), gt=0)
    width_share: Pure = Field(default_factory=_shipped("width_share"), ge=0)
    level: Length = Field(default_factory=_shipped("level"), gt=0)
    slope: Pure = Field(default_factory=_shipped("slope"), gt=0)
    distortion_share: Pure = Field(default_factory=_shipped("distortion_share"), gt=0)
    direction: Pure = Field(default_factory=_shipped("direction"), gt=0, lt=1)

    def origins(self) -> dict[str, tuple[str, str]]:
        """Interval (90 %) and level of confidence of each term; values that the user gave have neither."""
        terms = {}
        for name, term in _shipped_terms().items():
            interval = f"{term['low']:g} to {term['high']:g}" if "low" in term else "-"
            shipped = getattr(self, name) == term["value"]
            terms[name] = (interval, str(term["confidence"])) if shipped else ("-", "given")
        return terms

    @property
    def uncertain(self) -> list[str]:
        """Names of the terms that are fitted and have an interval."""
        return [name for name, (interval, _) in self.origins().items() if interval != "-"]

    def at(self, normal: FloatArray) -> Discrepancy:
        """Discrepancy at independent standard normals, one per uncertain term: correlated lognormal terms."""
        names, terms = self.uncertain, _shipped_terms()
        fitted = [terms[name] for name in names]
        deviation = [np.log(term["high"] / term["low"]) / (2.0 * special.ndtri(0.95)) for term in fitted]
        below = np.array([[term.get("correlation", {}).get(name, 0.0) for name in names] for term in fitted])
        root = np.linalg.cholesky(np.eye(len(names)) + below + below.T)
        factors = np.exp(deviation * (root @ normal))
        return replace(self, **{name: getattr(self, name) * float(f) for name, f in zip(names, factors)})

    def nodes(self, points: int) -> list[tuple[float, Discrepancy]]:
        """Weights and discrepancies of a product Gauss-Hermite quadrature with this many points per uncertain term."""
        if not self.uncertain:
            return [(1.0, self)]
        places, weights = np.polynomial.hermite_e.hermegauss(points)
        product = itertools.product(range(points), repeat=len(self.uncertain))
        chosen = [list(chosen_nodes) for chosen_nodes in product]
        total = float(weights.sum() ** len(self.uncertain))
        return [
            (float(np.prod(weights[chosen_nodes])) / total, self.at(places[chosen_nodes])) for chosen_nodes in chosen
        ]


def stacked(models: Sequence[Discrepancy]) -> Any:
    """Discrepancies as one, whose terms are arrays (discrepancies,)."""
    names = [field.name for field in fields(Discrepancy)]
    return SimpleNamespace(**{name: np.array([getattr(model, name) for model in models]) for name in names})


@described
class Reading:
    """What observations have in common.

    Attributes
    ----------
    date, since : date, optional
        Day of the visit; day from which the measured value is a change.
    """

    date: Day | None = None
    since: Day | None = None

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
    """A crack, or its absence (``[[crack]]``).

    Attributes
    ----------
    x, y : float, optional
        Place (m); without it the widest crack of the part is meant.
    within : float
        Distance from the place within which the crack runs (m).
    width, error : float
        Width and standard error of its measurement (m).
    change : float, optional
        Instead of a width: its change since a day (m), as a crack monitor reads it.
    wider_than, narrower_than : float, optional
        Instead of a width: limits (m).
    none : bool
        No crack is seen here: all are narrower than ``visible``.
    visible : float
        Width from which a crack is seen (m).
    direction : str, optional
        How the crack runs; needs a place.
    part : str
        The wall above any dpc, the courses below it, or the dpc.
    """

    x: Length | None = None
    y: Length | None = None
    within: Length = Field(default=0.5, gt=0)
    width: Length | None = Field(default=None, gt=0)
    change: Length | None = None
    error: Length = Field(default=2e-4, ge=0)
    wider_than: Length | None = Field(default=None, gt=0)
    narrower_than: Length | None = Field(default=None, gt=0)
    none: bool = False
    visible: Length = Field(default=1e-4, gt=0)
    direction: Direction | None = None
    part: Literal["wall", "below_dpc", "dpc"] = "wall"

    @property
    def range(self) -> tuple[float, float]:
        """Limits of the widest crack (m), ``CONTRADICTION`` standard errors from a measured width."""
        if self.width is None:
            return _limits(self)
        return self.width - CONTRADICTION * self.error, self.width + CONTRADICTION * self.error

    def contains(self, other: CrackObservation) -> bool:
        """Whether any crack of another observation is one of this observation, too."""
        if (self.part, self.date) != (other.part, other.date) or self.direction not in (None, other.direction):
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
    """Readings of a crack monitor (``[[monitor]]``).

    Attributes
    ----------
    name : str
        Name of the monitor.
    x, y, within, direction, part, error
        Keys of a crack.
    date : tuple of date
        Days of the readings, in order.
    width : tuple of float, optional
        Widths of the crack (m).
    change : tuple of float, optional
        Instead: changes of its width since the first day (m), the first of which is 0.
    """

    name: str = ""
    x: Length | None = None
    y: Length | None = None
    within: Length = Field(default=0.5, gt=0)
    direction: Direction | None = None
    part: Literal["wall", "below_dpc", "dpc"] = "wall"
    error: Length = Field(default=1e-4, ge=0)
    date: tuple[Day, ...]
    width: tuple[Length, ...] = ()
    change: tuple[Length, ...] = ()

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
        common = {key: getattr(self, key) for key in ("x", "y", "within", "direction", "part", "error")}
        if self.change:
            common["since"] = self.date[0]
            return [CrackObservation(**common, date=d, change=c) for d, c in zip(self.date[1:], self.change[1:])]
        if shut := [value for value in self.width if not value > 0]:
            raise InputError(
                f"{where}: width = {shut[0]:g}: must be greater than 0; give a closed crack as a [[crack]] with "
                "none = true, or the changes since the first day as `change`."
            )
        return [CrackObservation(**common, date=d, width=w) for d, w in zip(self.date, self.width)]


@described
class LevelObservation(Reading):
    """How much higher one point stands than another (``[[level]]``), both once level.

    Attributes
    ----------
    x, y, to_x, to_y : float
        The points (m).
    difference : float
        Height of the second above the first (m).
    error : float
        Standard error of the survey (m).
    """

    x: Length
    y: Length
    to_x: Length
    to_y: Length
    difference: Length
    error: Length = Field(default=1e-3, ge=0)


@described
class SlopeObservation(Reading):
    """The largest deviation of the wall from level or plumb over a metre (``[[slope]]``, ``[[tilt]]``).

    Attributes
    ----------
    value, error : float
        Slope and its standard error.
    """

    value: Pure = Field(ge=0)
    error: Pure = Field(default=5e-4, ge=0)


@described
class WindowObservation(Reading):
    """Whether a door or window sticks, or how its width has changed (``[[window]]``).

    Attributes
    ----------
    opening : int
        Number of the opening in the scene, from 1.
    sticks : bool, optional
        Whether it does, be it slightly.
    width_change : float, optional
        Instead: change of its width at the top (m); negative where it has closed.
    error : float
        Standard error of the change (m).
    """

    opening: Count = Field(ge=1)
    sticks: bool | None = None
    width_change: Length | None = None
    error: Length = Field(default=5e-4, gt=0)


_KINDS = {
    "crack": CrackObservation,
    "level": LevelObservation,
    "slope": SlopeObservation,
    "tilt": SlopeObservation,
    "window": WindowObservation,
}
_MEASURED = "width", "change", "difference", "value", "width_change"
_QUANTITY = "x", "y", "to_x", "to_y", "within", "part", "opening"
"""Keys of measured values, and of the quantity that is measured."""

TABLES = "crack", "level", "slope", "tilt", "window"
"""Tables of observations."""


@described
class Observations:
    """What a survey found (``observations.toml``).

    Attributes
    ----------
    crack, level, slope, tilt, window : tuple
        Observations of each kind: all of them have dates, or none. An entry with ``file`` stands for the rows of a CSV
        or xlsx file; its other keys apply to all rows.
    monitor : tuple of MonitorSeries
        Readings of crack monitors.
    history : History, optional
        Prior of the movement over time, if observations have dates.
    discrepancy : Discrepancy
        Discrepancy of the model.
    movement : str, optional
        Prior of the movement: a site class or a distribution; by default all movements up to the study's are alike.
    prior_odds : dict of str to float
        Of causes, by the name of their study, and of ``"another cause"``; by default they are alike.
    """

    crack: tuple[CrackObservation, ...] = ()
    level: tuple[LevelObservation, ...] = ()
    slope: tuple[SlopeObservation, ...] = ()
    tilt: tuple[SlopeObservation, ...] = ()
    window: tuple[WindowObservation, ...] = ()
    monitor: tuple[MonitorSeries, ...] = ()
    history: History | None = None
    discrepancy: Discrepancy = Field(default_factory=Discrepancy)
    movement: str | None = None
    prior_odds: dict[str, Pure] = Field(default_factory=dict)

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
        named = [(f"{table} {k}", o) for table in TABLES for k, o in enumerate(getattr(self, table), 1)]
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

    @property
    def prior(self) -> History:
        """Prior of the movement over time."""
        return self.history or History()

    @cached_property
    def cracks(self) -> list[tuple[str, CrackObservation]]:
        """Observed cracks and readings of monitors, with their names."""
        named = [(f"crack {k}", crack) for k, crack in enumerate(self.crack, 1)]
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
    def dates(self) -> list[dt.date]:
        """Days of all readings, in order; empty without dates."""
        days = {day for _, found in self.series for reading in found for day in (reading.date, reading.since)}
        return sorted(day for day in days if day is not None)

    def alone(self, day: dt.date) -> Observations | None:
        """Observations of one day by themselves, without changes since another."""
        tables: dict[str, Any] = {"crack": [crack for _, crack in self.cracks]} | {
            t: getattr(self, t) for t in TABLES[1:]
        }
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
        alike = [("slope", "", [(s.value, s.error) for s in slopes]), ("tilt", "", [(t.value, t.error) for t in tilts])]
        for number in sorted({window.opening for window in windows}):
            same = [window for window in windows if window.opening == number]
            if {window.sticks for window in same} >= {True, False}:
                raise InputError(f"window: opening {number} sticks and does not; remove one of the two.")
            changes = [(w.width_change, w.error) for w in same if w.width_change is not None]
            alike.append(("window", f" opening {number}:", changes))
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
        ends = [((level.x, level.y), (level.to_x, level.to_y)) for level in levels]
        if same := [k for k, (start, end) in enumerate(ends, 1) if start == end]:
            raise InputError(
                f"level {self.level.index(levels[same[0] - 1]) + 1}: both points are one; give two points."
            )
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

    def require_on(self, scene: Scene, source: str) -> None:
        """Check that a wall has the places, parts and openings that the survey names."""
        wall = scene.wall
        size = f"the wall of {source}, {wall.length:g} m long and {wall.height:g} m high"
        under = -scene.footing.depth if scene.footing_model != "none" else 0.0
        places = [(where, "x", "y", *c.place, 0.0) for where, c in self.cracks if c.place is not None]
        for k, level in enumerate(self.level, 1):
            places.append((f"level {k}", "x", "y", level.x, level.y, under))
            places.append((f"level {k}", "to_x", "to_y", level.to_x, level.to_y, under))
        for where, x_key, y_key, x, y, lowest in places:
            for key, value, low, high in ((x_key, x, 0.0, wall.length), (y_key, y, lowest, wall.height)):
                if not low - ROUNDING <= value <= high + ROUNDING:
                    raise InputError(
                        f"{where}: {key} = {value:g} m lies off {size}; {key} runs from {low:g} to {high:g} m, from "
                        f"its {'left end' if key == x_key else 'underside'}."
                    )
            for number, hole in enumerate(scene.opening, 1):
                if hole.x + ROUNDING < x < hole.right - ROUNDING and hole.y + ROUNDING < y < hole.top - ROUNDING:
                    raise InputError(
                        f"{where}: {x_key} = {x:g} m, {y_key} = {y:g} m lies in opening {number} of {size} "
                        f"({hole.kind}, x {hole.x:g} to {hole.right:g} m, y {hole.y:g} to {hole.top:g} m); give a "
                        "place on the masonry."
                    )
        for where, crack in self.cracks:
            if crack.part != "wall" and scene.dpc is None:
                raise InputError(f"{where}: part = '{crack.part}': {size}, has no dpc.")
        for k, window in enumerate(self.window, 1):
            if window.opening > (count := len(scene.opening)):
                has = f"openings 1 to {count}" if count else "no opening"
                raise InputError(f"window {k}: opening = {window.opening}: {size}, has {has}.")

    @property
    def count(self) -> int:
        """Number of observations."""
        return sum(len(readings) for _, readings in self.series)

    def vague_log_likelihood(self) -> float:
        """Log likelihood under another cause: each quantity for itself, as vague as surveys are.

        The last reading of a series is as vague as if it were alone; before it the quantity walked randomly.
        """
        return sum(_vague_series(found, self.discrepancy) for _, found in self.series)

    @classmethod
    def from_toml(cls, path: str | Path, until: Sequence[str] = ()) -> Observations:
        """Read the file of a survey: TOML, or a table of cracks or levels (CSV, xlsx); ``until``: forecast dates."""
        path = Path(path)
        try:
            table = path.suffix.lower() in SUFFIXES
            tables: dict[str, Any] = {survey_kind(path): [{"file": path.name}]} if table else dict(read_toml(path))
            for name, kind in _KINDS.items():
                entries = tables.get(name)
                if isinstance(entries, list):
                    filed = [isinstance(entry, dict) and "file" in entry for entry in entries]
                    read = [
                        read_survey(kind, name, entry, path.parent) if from_file else [entry]
                        for entry, from_file in zip(entries, filed)
                    ]
                    tables[name] = list(itertools.chain(*read))
            if until and isinstance(tables.setdefault("history", {}), dict):
                tables["history"]["until"] = list(until)
            return build(cls, tables, str(path))
        except InputError as error:
            raise error if str(path) in str(error) else InputError(f"{path}: {error}") from None


class Fit(NamedTuple):
    """Agreement of states with an observation; ``misfit``: squared standard deviations, -2 ln p of a limit."""

    log_likelihood: FloatArray
    misfit: FloatArray

    def __add__(self, other: object) -> Fit:
        """Fit of two independent observations."""
        if not isinstance(other, Fit):
            return NotImplemented
        return Fit(self.log_likelihood + other.log_likelihood, self.misfit + other.misfit)


def measured(predicted: FloatArray, value: float, deviation: FloatArray | float) -> Fit:
    """Fit of a measured value; ``deviation`` is its standard deviation about the prediction."""
    misfit = ((predicted - value) / deviation) ** 2
    return Fit(-0.5 * misfit - np.log(deviation * math.sqrt(2.0 * math.pi)), misfit)


def censored(predicted: FloatArray, lower: float, upper: float, deviation: FloatArray | float) -> Fit:
    """Fit of a value known to lie between limits, which may be infinite."""
    a, b = (lower - predicted) / deviation, (upper - predicted) / deviation
    if math.isinf(lower) or math.isinf(upper):
        chance = special.ndtr(b if math.isinf(lower) else -a)
    else:
        flip = a > 0  # both in the upper tail, where differences of ndtr cancel
        chance = special.ndtr(np.where(flip, -a, b)) - special.ndtr(np.where(flip, -b, a))
    logarithm = np.log(np.maximum(chance, np.finfo(np.float64).tiny))
    return Fit(logarithm, -2.0 * logarithm)


@dataclass(frozen=True)
class CrackPrediction:
    """Value of a reading on each wall: width (m) of any crack, of the observed direction, and before the change."""

    any: FloatArray
    along: FloatArray
    before: CrackPrediction | None = None


def crack_fit(seen: CrackObservation, predicted: CrackPrediction, model: Any) -> Fit:
    """Fit of an observed crack."""
    return series_fit([seen], [predicted], model)


def series_fit(series: Sequence[Reading], predicted: Sequence[CrackPrediction], model: Any) -> Fit:
    """Fit of the readings of one quantity; ``model``: discrepancy, or the terms of several (``stacked``)."""
    other = _fit(
        [_deviations(r, p.any, None if p.before is None else p.before.any, model) for r, p in zip(series, predicted)]
    )
    if all(getattr(reading, "direction", None) is None for reading in series):
        return other
    # a mixture: the model's crack may run otherwise than the real one
    share = model.direction
    same = _fit(
        [
            _deviations(r, p.along, None if p.before is None else p.before.along, model)
            for r, p in zip(series, predicted)
        ]
    )
    both = np.logaddexp(np.log1p(-share) + same.log_likelihood, np.log(share) + other.log_likelihood)
    return Fit(both, np.minimum(same.misfit, other.misfit - 2.0 * np.log(share)))


def _deviations(reading: Reading, value: FloatArray, before: FloatArray | None, model: Any) -> tuple[Any, ...]:
    """Reading, its prediction, and the standard deviations that it shares with its series and has of its own."""
    discrepancy, error = _errors(reading, value, model)
    own = np.hypot(error, OWN_SHARE * discrepancy)
    if before is not None:
        value, discrepancy = value - before, discrepancy - _errors(reading, before, model)[0]
    return reading, value, math.sqrt(1.0 - OWN_SHARE**2) * discrepancy, own


def _fit(readings: Sequence[tuple[Any, ...]]) -> Fit:
    """Fit of readings with one common standard normal (Sherman and Morrison 1950; quadrature for limits)."""
    values = [(reading.observed, *rest) for reading, *rest in readings if reading.observed is not None]
    limits = [(_limits(reading), *rest) for reading, *rest in readings if reading.observed is None]
    if len(readings) == 1:
        for value, mean, shared, own in values:
            return measured(mean, value, np.hypot(shared, own))
        for (lower, upper), mean, shared, own in limits:
            return censored(mean, lower, upper, np.hypot(shared, own))
    squares: Any = 0.0
    cross = along = logs = squares  # of residuals, of residual and common deviation, of the latter, of variances
    for value, mean, shared, own in values:
        own = np.maximum(own, np.finfo(np.float64).tiny)
        gap, common = (value - mean) / own, shared / own
        squares, cross, along = squares + gap**2, cross + gap * common, along + common**2
        logs = logs + 2.0 * np.log(own)
    rest = 1.0 + along
    misfit = squares - cross**2 / rest
    log = -0.5 * (misfit + logs + np.log(rest) + len(values) * math.log(2.0 * math.pi))
    if not limits:
        return Fit(log, misfit)
    chances = []
    for node, weight in zip(*np.polynomial.hermite_e.hermegauss(COMMON_POINTS)):
        common = cross / rest + node / np.sqrt(rest)
        terms = [
            censored(m + shared * common, low, high, np.maximum(own, 1e-12)) for (low, high), m, shared, own in limits
        ]
        chances.append(math.log(weight / math.sqrt(2.0 * math.pi)) + sum(term.log_likelihood for term in terms))
    chance: Any = special.logsumexp(chances, axis=0)
    return Fit(log + chance, misfit - 2.0 * chance)


def _limits(reading: Any) -> tuple[float, float]:
    """Limits of a value that was not measured: width (m), or distortion over that from which an opening sticks."""
    if isinstance(reading, WindowObservation):
        return (1.0, np.inf) if reading.sticks else (-np.inf, 1.0)
    return (
        (-np.inf, reading.visible) if reading.none else (reading.wider_than or -np.inf, reading.narrower_than or np.inf)
    )


def _errors(reading: Any, value: FloatArray, model: Any) -> tuple[FloatArray, float]:
    """Standard deviations of the model's discrepancy at a predicted value, and of the reading."""
    match reading:
        case CrackObservation():
            return np.sqrt(model.width**2 + (model.width_share * value) ** 2), reading.error
        case WindowObservation(sticks=None):
            return model.distortion_share * value, reading.error
        case WindowObservation():
            return model.distortion_share * np.maximum(value, 1.0), 0.0
    return (model.level if isinstance(reading, LevelObservation) else model.slope) + 0.0 * value, reading.error


def _vague(reading: Any, model: Discrepancy) -> tuple[float, float]:
    """Log likelihood of a reading under another cause, and standard deviation of the change in a year."""
    match reading:
        case CrackObservation():
            middle, deviation = VAGUE_WIDTH
            if reading.width is not None:
                error = math.hypot(reading.error, model.width)
                whole = math.exp(-0.5 * (reading.width / error) ** 2) / (error * math.sqrt(0.5 * math.pi))
                z = math.log(reading.width / middle) / deviation
                open_ = math.exp(-0.5 * z**2) / (reading.width * deviation * math.sqrt(2.0 * math.pi))
                chance = 0.5 * (whole + open_)
            else:  # any width fits a change
                ends = np.maximum(_limits(reading), 0.0) if reading.change is None else (0.0, np.inf)
                below = [0.5 * (x > 0) + 0.5 * special.ndtr(np.log(max(x, 1e-300) / middle) / deviation) for x in ends]
                chance = float(below[1] - below[0])
            other = 1.0 - model.direction  # one of four directions, or the model's runs otherwise
            return math.log(chance * (1.0 if reading.direction is None else 1.0 - 0.75 * other)), middle
        case SlopeObservation():
            return -reading.value / VAGUE_SLOPE - math.log(VAGUE_SLOPE), VAGUE_SLOPE
        case WindowObservation(width_change=None):
            return math.log(0.5), VAGUE_CHANGE
    level = isinstance(reading, LevelObservation)
    scatter = VAGUE_SLOPE * math.hypot(reading.to_x - reading.x, reading.to_y - reading.y) if level else VAGUE_CHANGE
    spread = math.hypot(scatter, math.hypot(reading.error, model.level if level else 0.0))
    return float(measured(np.zeros(1), reading.observed, spread).log_likelihood[0]), scatter


def _vague_series(series: Sequence[Any], model: Discrepancy) -> float:
    """Log likelihood under another cause of the readings of one quantity (a random walk back from the last)."""
    values = [reading for reading in series if reading.since is None]
    total = _vague(values[-1], model)[0] if values else 0.0
    for walk in (values, [reading for reading in series if reading.since is not None]):
        *found, last = [reading for reading in walk if reading.observed is not None] or [None]
        if last is None or (last.since is None and last is not values[-1]):
            continue
        day, value, error = (last.date, last.observed, last.error) if last.since is None else (last.since, 0.0, 0.0)
        found += [last] if last.since is not None else []
        years = np.abs(years_from(day, [reading.date for reading in found]))
        scatter = _vague(last, model)[1]
        covariance = scatter**2 * np.minimum.outer(years, years) + error**2
        covariance += np.diag(np.array([max(reading.error, 1e-9) for reading in found]) ** 2)
        gap = np.array([reading.observed for reading in found]) - value
        size = np.linalg.slogdet(2.0 * math.pi * covariance)[1]
        total -= 0.5 * float(gap @ np.linalg.solve(covariance, gap) + size)
    return total
