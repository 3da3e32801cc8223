"""Observations on a damaged wall, and their likelihood for the states of solved walls.

A measured value is normal about the wall's own, with the survey's error and the model's discrepancy added in squares
(Kennedy and O'Hagan 2001); a limit is censored. All observations share the uncertain discrepancy, so their joint
likelihood is integrated over its distribution (Gauss-Hermite quadrature).
"""

from __future__ import annotations

import itertools
import math
import tomllib
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, partial
from pathlib import Path
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


@described
class CrackObservation:
    """A crack, or its absence (``[[crack]]``).

    Attributes
    ----------
    x, y : float, optional
        Place (m); without it the widest crack of the part is meant.
    within : float
        Distance from the place within which the crack runs (m).
    width, error : float
        Width and standard error of its measurement (m).
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
    error: Length = Field(default=2e-4, ge=0)
    wider_than: Length | None = Field(default=None, gt=0)
    narrower_than: Length | None = Field(default=None, gt=0)
    none: bool = False
    visible: Length = Field(default=1e-4, gt=0)
    direction: Direction | None = None
    part: Literal["wall", "below_dpc", "dpc"] = "wall"

    @property
    def limits(self) -> tuple[float, float]:
        """Limits of the widest crack (m), ``CONTRADICTION`` standard errors from a measured width."""
        if self.width is not None:
            return self.width - CONTRADICTION * self.error, self.width + CONTRADICTION * self.error
        return (-np.inf, self.visible) if self.none else (self.wider_than or -np.inf, self.narrower_than or np.inf)

    def contains(self, other: CrackObservation) -> bool:
        """Whether any crack of another observation is one of this observation, too."""
        if self.part != other.part or self.direction not in (None, other.direction):
            return False
        if self.place is None or other.place is None:
            return self.place is None
        return math.dist(self.place, other.place) + other.within <= self.within + ROUNDING

    @property
    def place(self) -> tuple[float, float] | None:
        """Place (m) near which the crack runs."""
        return None if self.x is None or self.y is None else (self.x, self.y)


@described
class LevelObservation:
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
class SlopeObservation:
    """The largest deviation of the wall from level or plumb over a metre (``[[slope]]``, ``[[tilt]]``).

    Attributes
    ----------
    value, error : float
        Slope and its standard error.
    """

    value: Pure = Field(ge=0)
    error: Pure = Field(default=5e-4, ge=0)


@described
class WindowObservation:
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


@described
class Observations:
    """What a survey found (``observations.toml``).

    Attributes
    ----------
    crack, level, slope, tilt, window : tuple
        Observations of each kind. An entry with ``file`` stands for the rows of a CSV or xlsx file; its other keys
        apply to all rows.
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
            if (crack.width is not None) + limits + crack.none != 1:
                raise InputError(f"{where}: give one of width, none = true, or the limits wider_than, narrower_than.")
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
        if any(not odds > 0 for odds in self.prior_odds.values()):
            raise InputError("prior_odds: must be greater than 0.")
        self._refuse_contradictions()

    def _refuse_contradictions(self) -> None:
        """Refuse pairs of observations of one quantity that differ by more than ``CONTRADICTION`` standard errors."""
        for (a, inner), (b, outer) in itertools.permutations(enumerate(self.crack, 1), 2):
            if outer.contains(inner) and inner.limits[0] > outer.limits[1]:
                raise InputError(
                    f"crack {a} and crack {b} contradict each other: one is wider than {inner.limits[0] * 1e3:.3g} mm, "
                    f"and where it runs none is wider than {outer.limits[1] * 1e3:.3g} mm. Correct one of them, or "
                    "give places or a smaller `within`."
                )
        alike = [("slope", "", [(s.value, s.error) for s in self.slope])]
        alike.append(("tilt", "", [(t.value, t.error) for t in self.tilt]))
        for number in sorted({window.opening for window in self.window}):
            windows = [window for window in self.window if window.opening == number]
            if {window.sticks for window in windows} >= {True, False}:
                raise InputError(f"window: opening {number} sticks and does not; remove one of the two.")
            changes = [(w.width_change, w.error) for w in windows if w.width_change is not None]
            alike.append(("window", f" opening {number}:", changes))
        for kind, which, values in alike:
            for (first, error), (second, other) in itertools.combinations(values, 2):
                if abs(first - second) > CONTRADICTION * max(np.hypot(error, other), np.finfo(np.float64).tiny):
                    raise InputError(
                        f"{kind}:{which} {first:g} and {second:g} are measurements of one quantity and differ by more "
                        f"than {CONTRADICTION:g} standard errors; correct one of them, or give larger errors."
                    )
        self._levels_close()

    def _levels_close(self) -> None:
        """Refuse differences of levels whose loops do not close (least squares adjustment of the survey)."""
        if not self.level:
            return
        ends = [((level.x, level.y), (level.to_x, level.to_y)) for level in self.level]
        if same := [k for k, (start, end) in enumerate(ends, 1) if start == end]:
            raise InputError(f"level {same[0]}: both points are one; give two points.")
        points = {point: k for k, point in enumerate(dict.fromkeys(itertools.chain(*ends)))}
        error = np.maximum([level.error for level in self.level], 1e-6)
        rows = np.zeros((len(ends), len(points)))
        for row, (start, end) in zip(rows, ends):
            row[points[start]], row[points[end]] = -1.0, 1.0
        rows, rise = rows / error[:, None], np.array([level.difference for level in self.level]) / error
        heights, _, rank, _ = np.linalg.lstsq(rows, rise)
        gap = rise - rows @ heights
        if rank < len(ends) and special.chdtrc(len(ends) - rank, gap @ gap) < special.chdtrc(1, CONTRADICTION**2):
            worst = int(np.argmax(np.abs(gap)))
            raise InputError(
                f"level {worst + 1}: contradicts the other levels by {abs(gap[worst]) * error[worst] * 1e3:.3g} mm: "
                "differences along a loop must add up to 0 within their errors. Correct it, or give larger errors."
            )

    def require_on(self, scene: Scene, source: str) -> None:
        """Check that a wall has the places, parts and openings that the survey names."""
        wall = scene.wall
        size = f"the wall of {source}, {wall.length:g} m long and {wall.height:g} m high"
        under = -scene.footing.depth if scene.footing_model != "none" else 0.0
        places = [(f"crack {k}", "x", "y", *c.place, 0.0) for k, c in enumerate(self.crack, 1) if c.place is not None]
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
        for k, crack in enumerate(self.crack, 1):
            if crack.part != "wall" and scene.dpc is None:
                raise InputError(f"crack {k}: part = '{crack.part}': {size}, has no dpc.")
        for k, window in enumerate(self.window, 1):
            if window.opening > (count := len(scene.opening)):
                has = f"openings 1 to {count}" if count else "no opening"
                raise InputError(f"window {k}: opening = {window.opening}: {size}, has {has}.")

    @property
    def count(self) -> int:
        """Number of observations."""
        return len(self.crack) + len(self.level) + len(self.slope) + len(self.tilt) + len(self.window)

    def vague_log_likelihood(self) -> float:
        """Log likelihood under another cause: each observation for itself, as vague as surveys are."""
        model, terms = self.discrepancy, []
        middle, deviation = VAGUE_WIDTH
        for crack in self.crack:
            if crack.width is not None:
                error = math.hypot(crack.error, model.width)
                whole = math.exp(-0.5 * (crack.width / error) ** 2) / (error * math.sqrt(0.5 * math.pi))
                z = math.log(crack.width / middle) / deviation
                open_ = math.exp(-0.5 * z**2) / (crack.width * deviation * math.sqrt(2.0 * math.pi))
                chance = 0.5 * (whole + open_)
            else:
                ends = np.maximum(crack.limits, 0.0)
                below = [0.5 * (x > 0) + 0.5 * special.ndtr(np.log(max(x, 1e-300) / middle) / deviation) for x in ends]
                chance = float(below[1] - below[0])
            other = 1.0 - model.direction  # one of four directions, or the model's runs otherwise
            terms.append(math.log(chance * (1.0 if crack.direction is None else 1.0 - 0.75 * other)))
        for level in self.level:
            distance = math.hypot(level.to_x - level.x, level.to_y - level.y)
            spread = np.sqrt((VAGUE_SLOPE * distance) ** 2 + level.error**2 + model.level**2)
            terms.append(float(measured(np.zeros(1), level.difference, spread).log_likelihood[0]))
        terms += [-slope.value / VAGUE_SLOPE - math.log(VAGUE_SLOPE) for slope in (*self.slope, *self.tilt)]
        for window in self.window:
            if window.width_change is None:
                terms.append(math.log(0.5))
            else:
                spread = np.hypot(VAGUE_CHANGE, window.error)
                terms.append(float(measured(np.zeros(1), window.width_change, spread).log_likelihood[0]))
        return sum(terms)

    @classmethod
    def from_toml(cls, path: str | Path) -> Observations:
        """Read the file of a survey: TOML, or a table of cracks or levels (CSV, xlsx)."""
        path = Path(path)
        try:
            table = path.suffix.lower() in SUFFIXES
            tables = {survey_kind(path): [{"file": path.name}]} if table else read_toml(path)
            for name, kind in _KINDS.items():
                entries = tables.get(name)
                if isinstance(entries, list):
                    filed = [isinstance(entry, dict) and "file" in entry for entry in entries]
                    read = [
                        read_survey(kind, name, entry, path.parent) if from_file else [entry]
                        for entry, from_file in zip(entries, filed)
                    ]
                    tables[name] = list(itertools.chain(*read))
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
    flip = a > 0  # both in the upper tail, where differences of ndtr cancel
    chance = special.ndtr(np.where(flip, -a, b)) - special.ndtr(np.where(flip, -b, a))
    logarithm = np.log(np.maximum(chance, np.finfo(np.float64).tiny))
    return Fit(logarithm, -2.0 * logarithm)


@dataclass(frozen=True)
class CrackPrediction:
    """Widest crack (m) at an observed place, of any direction and of the observed one, (samples, increments)."""

    any: FloatArray
    along: FloatArray


def crack_fit(seen: CrackObservation, predicted: CrackPrediction, model: Discrepancy) -> Fit:
    """Fit of an observed crack."""

    def of(width: FloatArray) -> Fit:
        deviation = np.sqrt(seen.error**2 + model.width**2 + (model.width_share * width) ** 2)
        if seen.width is not None:
            return measured(width, seen.width, deviation)
        if seen.none:
            return censored(width, -np.inf, seen.visible, deviation)
        return censored(width, seen.wider_than or -np.inf, seen.narrower_than or np.inf, deviation)

    if seen.direction is None:
        return of(predicted.any)
    # a mixture: the model's crack may run otherwise than the real one
    share = model.direction
    other, same = of(predicted.any), of(predicted.along)
    both = np.logaddexp(np.log1p(-share) + same.log_likelihood, np.log(share) + other.log_likelihood)
    return Fit(both, np.minimum(same.misfit, other.misfit - 2.0 * np.log(share)))
