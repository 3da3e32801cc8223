"""Movement of the footing: shape, size and increments."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field, model_validator

from damagepred.arrays import FloatArray
from damagepred.errors import InputError, require_count
from damagepred.scene.described import completed_by, described
from damagepred.scene.footing_profile import arc, require_positions, three_loads, through_points
from damagepred.scene.movement_stage import OPPOSITE, UP, History, Kind, Seasons, Stage, largest_size, sizes
from damagepred.scene.quantity import Count, Length, Pure
from damagepred.scene.settlement import (
    LEAST_IN_MIDDLE,
    POINTS,
    SETTLEMENTS,
    ZERO,
    axis,
    by_volume_loss,
    profile_measures,
    require_settlement,
    settlement_form,
    signed_size,
    trough,
)

if TYPE_CHECKING:
    from damagepred.scene.wall import Wall


def _with_size(table: Mapping[str, Any]) -> Mapping[str, Any]:
    """Table ``[movement]`` with the words of a settlement, and the largest of its stages as its size."""
    stages = table.get("stage")
    settles = table.get("shape") in SETTLEMENTS or table.get("settlement") is not None
    settles = settles or bool(sizes(stages, "settlement"))
    key = "settlement" if settles else "central_deflection"
    full = largest_size(stages, key)
    if settles:
        table = {"kind": "settle", "central_deflection": 0.0, **table}
    if full is not None and table.get(key) is None and table.get("shape") not in ("mound", "loads"):
        table = {**table, key: full}
    return table


@described
class Movement:
    """Movement of the footing (``[movement]``), reached in equal increments.

    Examples
    --------
    >>> from damagepred import Movement
    >>> Movement(kind="doming", central_deflection="12 mm", increments=24).central_deflection
    0.012
    """

    kind: Kind = "dishing"
    """Dishing (sagging): the centre goes down relative to the ends; doming (hogging): it goes up. At a tree, a pipe, a
    tunnel and a table of ``[mound]``, and with ``settlement``: the ground goes down (settle) or up (heave)."""
    central_deflection: Length = Field(default=8e-3, ge=0)
    """Final deflection of the centre relative to the ends (m), not negative; 0 for self weight alone. Not read on a
    mound, nor on jacks under load control; 0 in a test under loads and with ``settlement``."""
    increments: Count = Field(default=20, ge=1)
    """Number of equal increments."""
    shape: Literal[
        "three_loads", "parabola", "arc", "table", "settle", "tilt", "trough", "step", "jacks", "mound", "loads"
    ] = "three_loads"
    """Form of the footing. ``three_loads``: elastic beam under equal loads at the quarter points. ``parabola``: uniform
    small curvature. ``arc``: circle through ends and centre, flatter at smaller deflections; under a deformable footing
    the final circle is scaled, a difference of (deflection / length)^2. ``table``: as given. ``settle``: one end, or
    the ground at ``position``, goes down, level there and at its ``reach``. ``tilt``: a straight line. ``trough``:
    Gaussian, across a tunnel. ``step``: one part of the ground goes down, the other stays. With the other shapes the
    footing is a beam that bends freely. ``jacks``: on the supports and jacks of ``[rig]``. ``mound``: on the
    ``[soil]``, whose surface moves by ``[mound]``. ``loads``: fixed ground, and a laboratory test with the loads of
    ``[loading]`` in these increments."""
    table: tuple[tuple[Pure, Pure], ...] = ()
    """For ``shape = "table"``: position along the wall from 0 to 1, and deflection there in any unit. They are scaled
    to a deviation of 1 of the middle from the line through the ends, or to ``settlement``. Unequal ends also tilt the
    wall. A monotone cubic (PCHIP) runs between the points. In a scene file it may be the name of a CSV or xlsx file. It
    has ``x`` from the wall's left end (m, or the unit in its name) and ``level`` (up positive) or ``settlement`` (down
    positive). ``displacement`` is to the right; of two visits (``date``) the table is the change. Columns without such
    names are position, level and displacement. Levels with a unit, such as ``level (mm)``, have sign and size: ``kind``
    and ``central_deflection`` follow from them, and must not contradict them. ``settlement`` follows where the middle
    lies on the line through the ends. Without a unit they are a form, and both must be given."""
    table_ends: Literal["refuse", "cut", "level", "extend"] = "refuse"
    """Treatment of a file that does not end at the ends of the wall. ``cut``: points beyond the wall are cut off. The
    others also continue a short profile: at its last level, or in a straight line through its last two points."""
    stage: tuple[Stage, ...] = ()
    """Movement history, from level ground through the deflections of the stages, in both directions. Then
    ``increments`` is not read, and ``central_deflection`` is the largest deflection of all stages; on a mound
    ``[mound]`` has the largest surface movement. Either may be left out. A study that samples this value scales the
    whole history. Jacks are controlled by deflection, and push in one direction."""
    history: str | None = None
    """In a scene file, instead of stages: name of a CSV or xlsx file, each line the end of a stage. Its columns are
    time (years) and movement (m), or in the unit of the column's name, and optionally increments and strain (of the
    bricks). Doming is positive; on a mound it is the surface movement."""
    seasons: Seasons | None = None
    """History of some years, of a trend, seasons and steps. It determines the stages and the largest movement."""
    settlement: Length | None = Field(default=None, ge=0)
    """Size of settle, tilt, trough and step (m), not negative; in a table instead of ``central_deflection``."""
    settlement_is: Literal["largest", "range", "relative"] | None = None
    """Meaning of ``settlement``. ``largest`` (None): displacement of the ground, of a trough at its axis. ``range``:
    from the lowest to the highest ground under the wall. ``relative``: largest deviation from the line through the
    ends."""
    end: Literal["left", "right"] | None = None
    """End that settles, or side of a step. None: left."""
    position: Length | None = None
    """Place of the largest settlement, instead of an end; axis of the trough; place of the step, along the wall from
    its left end (m). None: the middle for trough and step."""
    reach: Length | None = Field(default=None, gt=0)
    """Distance to the end of the settlement (m). None: half the wall's length."""
    trough_width: Length | None = Field(default=None, gt=0)
    """Distance i of the trough's inflection point from its axis (m). None: half of ``tunnel_depth``."""
    tunnel_depth: Length | None = Field(default=None, gt=0)
    """Depth z_0 of the tunnel's axis below the footing (m). The ground also moves along the wall, by u = v (x - x_axis)
    / z_0 (O'Reilly and New 1982). None: twice ``trough_width``."""
    volume_loss: Pure | None = Field(default=None, gt=0, lt=1)
    """V_l of the tunnel (1), from which ``settlement`` follows: V_l pi D^2 / 4 over sqrt(2 pi) i (Peck 1969)."""
    tunnel_diameter: Length | None = Field(default=None, gt=0)
    """D (m), read with ``volume_loss``."""
    horizontal: tuple[tuple[Pure, Pure], ...] = ()
    """Displacement to the right, in a table's unit."""
    survey_error: Length | None = Field(default=None, ge=0)
    """Standard deviation of each level of a table (m). Each sample of a study draws other errors."""
    survey_seed: Count | None = Field(default=None, ge=0)
    """Seed of these errors, which a study sets. None: no errors."""

    _take_largest_stage = completed_by(_with_size)

    @model_validator(mode="after")
    def _stages_fit(self) -> Movement:
        require_settlement(self)
        if self.local:  # the same side in the words of the movement
            words: dict[str, Kind] = {"dishing": "settle", "doming": "heave"}
            stages = tuple(replace(s, kind=words.get(s.kind, s.kind)) for s in self.stage)
            object.__setattr__(self, "stage", stages)
        elif any(s.kind in ("settle", "heave") for s in self.stage):
            raise ValueError(f"stage: settle and heave go with kind = 'settle' or 'heave'; here kind = '{self.kind}'")
        if self.shape == "loads":
            object.__setattr__(self, "central_deflection", 0.0)
            if self.seasons is not None:
                raise ValueError("seasons: a test under loads has none; give [[movement.stage]] for its cycles")
        if self.seasons is not None:
            self._take_stages(self.seasons)
        if self.history is not None:
            raise ValueError("history: names a CSV file beside a scene file; here give stage instead")
        if not self.stage:
            return self
        wanted = self.size_key
        names = ("central_deflection", "surface_movement", "settlement", "load_factor")
        others = [name for name in names if name != wanted]
        held: list[Stage] = []
        for s in self.stage:  # a stage of time or strain alone stays where the last one ended
            before = held[-1] if held else Stage(kind=self.kind, **{wanted: 0.0})  # type: ignore[arg-type]
            alone = all(getattr(s, name) is None for name in (wanted, *others)) and (s.time or s.strain) is not None
            held.append(replace(s, kind=before.kind, **{wanted: getattr(before, wanted)}) if alone else s)
        object.__setattr__(self, "stage", tuple(held))
        if any(getattr(s, wanted) is None or any(getattr(s, n) is not None for n in others) for s in self.stage):
            raise ValueError(
                f"stage: with shape = '{self.shape}' each stage has a {wanted}, and no {' or '.join(others)}"
            )
        if self.shape == "jacks" and any(s.kind != self.kind for s in self.stage if s.central_deflection):
            raise ValueError(f"stage: jacks push one way; with kind = '{self.kind}' all stages are of that kind")
        times = [0.0 if s.time is None else s.time for s in self.stage]
        if any(times) and any(b <= a for a, b in itertools.pairwise([0.0, *times])):
            raise ValueError("stage: time must rise from stage to stage, and all stages have one, or none")
        if self.shape == "loads" and self.largest != 1.0:
            raise ValueError(
                f"stage: the largest load_factor of all stages must be 1 or -1; it is {self.largest:g}. [loading] has "
                "the largest value of the test"
            )
        if self.shape not in ("mound", "loads"):
            self.require_largest(self.size)
        return self

    def _take_stages(self, seasons: Seasons) -> None:
        """Set the stages of seasons, and the largest deflection."""
        size = self.size_key
        stages = tuple(
            Stage(kind=self.kind if u >= 0 else self.other, time=t, increments=seasons.increments, **{size: abs(u)})
            for u, t in zip(seasons.movements().tolist(), seasons.times.tolist())
        )
        object.__setattr__(self, "stage", stages)
        if self.shape != "mound":
            object.__setattr__(self, size, self.largest)

    @property
    def largest(self) -> float:
        """Largest size of all stages; 0 without stages."""
        return max((abs(s.size) for s in self.stage), default=0.0)

    def with_seed(self, *entropy: int) -> Movement:
        """Same movement with other seasons and survey errors, from numbers such as a study's seed and a sample."""
        first = (self.survey_seed or 0) if self.seasons is None else self.seasons.seed
        seed = int(np.random.SeedSequence([first, *entropy]).generate_state(1)[0])
        seeded = self if not self.survey_error else replace(self, survey_seed=seed)
        return seeded if self.seasons is None else replace(seeded, seasons=replace(self.seasons, seed=seed))

    def require_largest(self, full: float) -> None:
        """Check that the full movement (m) is the largest of the stages (ValueError)."""
        if full != self.largest:
            raise ValueError(
                f"stage: {self.size_key} must be the largest of the stages; it is {full:g} m, and the largest of the "
                f"stages is {self.largest:g} m"
            )

    @model_validator(mode="after")
    def _table_fits(self) -> Movement:
        if self.shape != "table":
            return self
        for name, points, least in (("table", self.table, 3 - self.settles), ("horizontal", self.horizontal, 2)):
            if points or name == "table":
                require_positions(name, points, least)
        if self.settles:
            if abs(self._table_size) <= ZERO * np.abs(self.table).max():
                measure = self.settlement_is or "largest"
                raise ValueError(f"table: nothing moves by settlement_is = '{measure}'; give other points")
            return self
        position, value = np.array(self.table).T
        departure = np.abs(value - np.interp(position, [0.0, 1.0], value[[0, -1]])).max()
        if abs(self._off_chord) <= LEAST_IN_MIDDLE * departure:
            raise ValueError(
                "table: the middle (position 0.5) lies on the line through the ends, or nearly; its distance from it "
                "is the central deflection, to which the others scale. Give settlement in place of central_deflection"
            )
        return self

    @classmethod
    def from_function(
        cls,
        profile: Callable[[FloatArray], ArrayLike],
        points: int = 41,
        horizontal: Callable[[FloatArray], ArrayLike] | None = None,
        **settings: Any,
    ) -> Movement:
        """Movement with the shape of a function.

        Parameters
        ----------
        profile : callable
            Positions from 0 to 1, an array -> deflections there, in any unit.
        points : int
            Number of equally spaced points of the table.
        horizontal : callable, optional
            Likewise the displacements to the right.
        **settings
            Other values of the movement, such as ``central_deflection`` or ``settlement``.

        Examples
        --------
        >>> import numpy as np
        >>> from damagepred.scene import Movement
        >>> trough = Movement.from_function(lambda x: np.exp(-8 * x**2), central_deflection=0.004)
        >>> trough.shape, len(trough.table)
        ('table', 41)
        """
        require_count("points", points)
        position = np.linspace(0.0, 1.0, max(points, 3))
        tables: dict[str, Any] = {}
        for name, function in (("table", profile), ("horizontal", horizontal)):
            if function is None:
                continue
            values = np.asarray(function(position), dtype=np.float64)
            if values.shape != position.shape or not np.isfinite(values).all():
                raise InputError("profile: must return a finite number for each of the positions it is given.")
            tables[name] = tuple(zip(position.tolist(), values.tolist()))
        return cls(shape="table", **tables, **settings)

    @property
    def settles(self) -> bool:
        """Whether the size of the movement is its settlement."""
        return self.shape in SETTLEMENTS or self.settlement is not None

    @property
    def size_key(self) -> str:
        """Name of the size, in stages and in the tables ``[movement]`` or ``[mound]``."""
        keys = {"mound": "surface_movement", "loads": "load_factor"}
        return keys.get(self.shape, "settlement" if self.settles else "central_deflection")

    @property
    def size(self) -> float:
        """Settlement or central deflection (m)."""
        if not self.settles:
            return self.central_deflection
        return by_volume_loss(self) if self.settlement is None else self.settlement

    @property
    def _table_size(self) -> float:
        """Size of the table, in its unit, with the sign of its largest value."""
        if not self.settles:
            return self._off_chord
        position, value = np.array(self.table).T
        return signed_size(value, position, self.settlement_is)

    @property
    def _off_chord(self) -> float:
        """Deviation of the middle from the line through the ends, in the unit of the table."""
        ends = 0.5 * (self.table[0][1] + self.table[-1][1])
        return float(through_points(self.table, np.array([0.5]))[0]) - ends

    @property
    def prescribed(self) -> bool:
        """Whether the underside of the wall or footing follows a given form; False on jacks and mounds."""
        return self.shape not in ("jacks", "mound")

    @property
    def sign(self) -> float:
        """+1 for doming and heave (up), -1 for dishing and settle (down)."""
        return 1.0 if self.kind in UP else -1.0

    @property
    def local(self) -> bool:
        """Whether the ground settles or heaves locally."""
        return self.kind in ("settle", "heave")

    @property
    def other(self) -> Kind:
        """The opposite kind."""
        return OPPOSITE[self.kind]

    def increments_of_history(self) -> History | None:
        """Increments of the stages; None without stages."""
        if not self.stage:
            return None
        full = self.largest or 1.0
        sides = [1.0 if s.kind == self.kind or self.shape == "loads" else -1.0 for s in self.stage]
        counts = [s.increments for s in self.stage]

        def stepwise(ends: list[float]) -> FloatArray:
            parts = [np.linspace(a, b, n + 1)[1:] for a, b, n in zip([0.0, *ends], ends, counts)]
            return np.concatenate([[0.0], *parts])

        times = [s.time for s in self.stage if s.time is not None]
        strains = [0.0]
        for s in self.stage:
            strains.append(strains[-1] if s.strain is None else s.strain)
        return History(
            stepwise([side * s.size / full for side, s in zip(sides, self.stage)]),
            np.repeat(np.arange(len(counts) + 1), [1, *counts]),
            stepwise(times) if times else None,
            stepwise(strains[1:]) if any(strains) else None,
        )

    @property
    def reverses(self) -> bool:
        """Whether a history goes beyond level ground, to the side opposite to ``kind``."""
        return any(s.kind != self.kind and s.size != 0.0 for s in self.stage)

    @property
    def increment_count(self) -> int:
        """Number of increments of the movement, of all stages."""
        return sum(stage.increments for stage in self.stage) or self.increments

    @property
    def proportional(self) -> bool:
        """Whether smaller movements have the same form; arcs differ by (deflection / length)^2."""
        return self.shape != "arc"

    def profile(self, position: FloatArray, length: float, load_factor: float = 1.0) -> FloatArray:
        """Vertical displacement (m, upwards) of the footing.

        Parameters
        ----------
        position : array of float
            Distance x from the left end of the wall (m), any shape.
        length : float
            Length of the wall (m).
        load_factor : float
            Present movement over the full one.

        Returns
        -------
        array of float
            Same shape. The middle deviates by +/- ``load_factor`` times ``central_deflection`` from the line through
            the ends, which are fixed except in a table. With ``settlement`` this is the size of the profile.

        Raises
        ------
        InputError
            If the footing bends freely.
        """
        if not self.prescribed:
            raise InputError(
                f"movement.shape = '{self.shape}': the footing finds its own form, so there is no profile to follow; "
                "take 'three_loads', 'parabola', 'arc' or 'table' for a prescribed one."
            )
        xi = np.asarray(position, dtype=np.float64) / length
        size = load_factor * self.size
        return self.sign * size * self._form(xi, length, abs(size) / length)

    def _form(self, xi: FloatArray, length: float, ratio: float) -> FloatArray:
        if self.shape == "three_loads":
            return three_loads(xi)
        if self.shape == "parabola":
            return 4.0 * xi * (1.0 - xi)
        if self.shape == "arc":
            return arc(xi, ratio)
        if self.shape == "table":
            return through_points(self._surveyed, xi) / self._table_size
        form = settlement_form(self, xi * length, length)
        if self.settlement_is in (None, "largest"):
            return form
        x = np.linspace(0.0, length, POINTS)
        return form / abs(signed_size(settlement_form(self, x, length), x, self.settlement_is))

    @property
    def _surveyed(self) -> tuple[tuple[float, float], ...]:
        """Table with errors of survey."""
        if self.survey_seed is None or not (self.survey_error and self.size):
            return self.table
        errors = np.random.default_rng(self.survey_seed).standard_normal(len(self.table))
        scale = self.survey_error * self._table_size / self.size
        return tuple((x, value + scale * error) for (x, value), error in zip(self.table, errors.tolist()))

    @property
    def moves_along(self) -> bool:
        """Whether the ground also moves along the wall."""
        return self.shape == "trough" or bool(self.horizontal)

    def horizontal_profile(self, position: FloatArray, length: float) -> FloatArray:
        """Displacement of the ground to the right at full movement (m).

        Parameters
        ----------
        position, length
            Same as for ``profile``.
        """
        x = np.asarray(position, dtype=np.float64)
        if self.shape == "trough":
            return self.profile(x, length) * (x - axis(self, length)) / trough(self)[1]
        if not self.horizontal:
            return np.zeros_like(x)
        return self.sign * self.size * through_points(self.horizontal, x / length) / self._table_size

    def measures(self, wall: Wall) -> dict[str, float]:
        """Settlement of the ground (m) and the measures of its distortion, over the length of a brick, by variable."""
        x = np.linspace(0.0, wall.length, POINTS)
        profiles = self.profile(x, wall.length), self.horizontal_profile(x, wall.length)
        return {"settlement": self.size, **profile_measures(*profiles, wall.length, wall.block_length)}

    def check_settlement(self, length: float) -> None:
        """Refuse a settlement that the wall does not feel (ValueError)."""
        if self.shape not in SETTLEMENTS:
            return
        x = np.linspace(0.0, length, POINTS)
        form = settlement_form(self, x, length)
        if np.abs(form).max() <= 1e-6:
            raise ValueError(
                f"movement.position = {self.position:g} m: the movement does not reach the wall (0 to {length:g} m); "
                "move it nearer, or make it wider"
            )
        if abs(signed_size(form, x, self.settlement_is)) <= 1e-6:
            raise ValueError(
                f"movement.settlement_is = '{self.settlement_is}': the ground under the wall stays "
                f"{'level' if self.settlement_is == 'range' else 'straight'}; take 'largest'"
            )
