"""Loads on a wall, and laboratory tests: supports, loaded strips and control."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Literal

from pydantic import Field, model_validator

from damagepred.scene.described import described, require_name
from damagepred.scene.quantity import Force, Length, LineLoad, Pressure, Pure, Stiffness
from damagepred.scene.wall import Opening, Wall

SIZES = ("force", "line_load", "pressure")  # keys of the size of a load, of which one is given


@described
class Support:
    """Bearing strip under the wall (``[[support]]``), read with ``[movement] shape = "loads"``.

    Without any the wall rests on its whole underside, in a bed of its mortar.

    Examples
    --------
    >>> from damagepred import scene
    >>> scene.Support(x="0.461 m", width="50 mm").width
    0.05
    """

    x: Length = Field(ge=0)
    """Middle of the strip, from the left end of the wall (m)."""
    width: Length = Field(gt=0)
    """Width of the strip (m)."""


@described
class Load:
    """Load on the wall (``[[load]]``), such as a floor, a beam or a roof.

    A load with a size (``force``, ``line_load`` or ``pressure``) acts from the start, before the ground moves. Without
    a size it is a strip of a laboratory test, ``[movement] shape = "loads"``, and ``[loading]`` controls its size.

    Examples
    --------
    >>> from damagepred import scene
    >>> scene.Load(name="floor", line_load="8 kN/m", y="2.7 m", start="1 m", end="4 m").line_load
    8000.0
    """

    name: str | None = None
    """Name of the load in keys of variables, such as ``load.floor.force``; by default its number, from 1."""
    force: Force | None = Field(default=None, ge=0)
    """Size in all (N)."""
    line_load: LineLoad | None = Field(default=None, ge=0)
    """Size per length of the loaded strip (N/m)."""
    pressure: Pressure | None = Field(default=None, ge=0)
    """Size per area of a floor (Pa), of which the wall carries ``breadth``."""
    breadth: Length | None = Field(default=None, gt=0)
    """Breadth of floor that the wall carries, often half a span (m); only with ``pressure``."""
    kind: Literal["dead", "live"] = "dead"
    """Whether the load is permanent or variable."""
    combination: Pure = Field(default=1.0, ge=0, le=1)
    """Share of a live load that acts (1), such as the long-term factor of a loading code."""
    side: Literal["top", "left", "right"] = "top"
    """Loaded side of the wall."""
    y: Length | None = Field(default=None, gt=0)
    """Height of the bed joint that carries a load inside the wall, above the wall's underside (m); the nearest bed
    joint counts. None: the load is on the side."""
    start: Length | None = Field(default=None, ge=0)
    """Start of the strip: from the left end of the wall, or from its underside (m). None: the start of the side."""
    end: Length | None = Field(default=None, gt=0)
    """End of the strip, likewise. None: the end of the side."""
    at: Length | None = Field(default=None, ge=0)
    """Middle of the strip, in place of ``start`` and ``end``. Without ``width`` a load with a size acts at this
    point."""
    width: Length | None = Field(default=None, gt=0)
    """Length of the strip along the side (m). None: as long as the side."""
    direction: Literal["towards", "along"] = "towards"
    """``towards``: the load presses on the wall. ``along``: it pushes to the right on the top, and down on a side."""
    share: Pure = Field(default=1.0, gt=0)
    """Share of the total load of a test, relative to the other strips (1)."""

    @model_validator(mode="after")
    def _consistent(self) -> Load:
        require_name(self, "load", "floor")
        sizes = [name for name in SIZES if getattr(self, name) is not None]
        if len(sizes) > 1:
            raise ValueError(f"{sizes[0]}, {sizes[1]}: both give the size of the load; give one of them")
        if (self.pressure is None) != (self.breadth is None):
            missing = "breadth" if self.breadth is None else "pressure"
            raise ValueError(f"{missing}: is missing; pressure times breadth is the load per length of the wall")
        if self.combination != 1.0 and self.kind == "dead":
            raise ValueError(f"combination = {self.combination:g}: a dead load acts in full; give kind = 'live'")
        if (self.at is not None or self.width is not None) and (self.start is not None or self.end is not None):
            raise ValueError("at, width: contradict start and end; give the middle of the load, or its two ends")
        if self.start is not None and self.end is not None and self.start >= self.end:
            raise ValueError(f"end = {self.end:g}: must be beyond start = {self.start:g}")
        if self.y is not None and (self.side != "top" or not sizes):
            raise ValueError(
                f"y = {self.y:g}: is the height of a load with a size that presses downwards; leave it out"
                + (" and give at, the height on the side" if self.side != "top" else " or give the size")
            )
        if sizes and self.share != 1.0:
            raise ValueError(f"share = {self.share:g}: is only read without {sizes[0]}, in a test; leave one out")
        return self

    @property
    def sized(self) -> bool:
        """Whether the load has a size and acts from the start."""
        return any(getattr(self, name) is not None for name in SIZES)


def strip_of(load: Load, wall: Wall) -> tuple[float, float]:
    """Start and end of a load along its side of a wall (m); equal at a point."""
    side = wall.length if load.side == "top" else wall.height
    if load.start is not None or load.end is not None:
        return load.start or 0.0, side if load.end is None else load.end
    middle, at_a_point = side / 2.0 if load.at is None else load.at, load.sized and load.at is not None
    half = (0.0 if at_a_point else side / 2.0) if load.width is None else load.width / 2.0
    return middle - half, middle + half


def force_of(load: Load, wall: Wall) -> float:
    """Force of a load on a wall (N), with the share of a live load."""
    start, end = strip_of(load, wall)
    per_length = (load.pressure or 0.0) * (load.breadth or 0.0) + (load.line_load or 0.0)
    return load.combination * ((load.force or 0.0) + per_length * (end - start))


@described
class Loading:
    """Control of a test (``[loading]``), read with ``[movement] shape = "loads"``.

    The test begins under the dead load. The controlled quantity grows in the increments of the movement to the value
    given here; stages of the movement make cycles of it. All measurements count from the dead load.

    Examples
    --------
    >>> from damagepred import scene
    >>> scene.Loading(control="displacement", displacement="2 mm").displacement
    0.002
    """

    control: Literal["force", "displacement", "opening"] = "force"
    """``force``: the load of all strips; the path ends at the load capacity. ``displacement``: displacement of the
    strips in the direction of their loads, by their shares. ``opening``: opening of the gauge. With the last two the
    load is a result, and may fall; without stages the path ends where it reaches 0."""
    force: Force | None = Field(default=None, gt=0)
    """Load of all strips together at the end (N)."""
    displacement: Length | None = Field(default=None, gt=0)
    """Displacement of the strips at the end (m)."""
    opening: Length | None = Field(default=None, gt=0)
    """Opening of the gauge at the end (m)."""
    gauge: tuple[tuple[Length, Length], ...] = ()
    """Two points of the wall (m): the opening is the increase of their distance. It is measured in every test. Bricks
    count as rigid between the points and their middles."""
    beam: Literal["none", "free", "level", "clamped"] = "none"
    """Stiff beam without weight in a bed of mortar on the wall's top, which takes the loads there, ``[loads] roof``
    included. ``free``: it may turn, as the top of a cantilever. ``level``: it stays level under a constant load.
    ``clamped``: it also keeps its height, from the dead load on."""
    bearing_stiffness: Stiffness | None = Field(default=None, gt=0)
    """Normal stiffness of the supports (Pa/m). None: as the joints."""
    bearing_friction: Pure = Field(default=0.0, ge=0)
    """tan(phi) (1) of the supports. 0: rollers."""

    @model_validator(mode="after")
    def _consistent(self) -> Loading:
        for name in ("force", "displacement", "opening"):
            if (getattr(self, name) is None) == (name == self.control):
                what = "is missing" if name == self.control else "is only read with control of its own name"
                raise ValueError(f"{name}: {what}; here control = '{self.control}'")
        if len(self.gauge) not in (0, 2):
            raise ValueError(f"gauge: has {len(self.gauge)} points; give two, as [x, y]")
        if self.gauge and math.dist(*self.gauge) == 0.0:
            raise ValueError("gauge: its two points are the same")
        if self.control == "opening" and not self.gauge:
            raise ValueError("gauge: is missing; control = 'opening' needs its two points")
        return self

    @property
    def target(self) -> float:
        """Controlled force (N) or displacement (m) at the end of the path."""
        return float(getattr(self, self.control))


def check_test(supports: Sequence[Support], loads: Sequence[Load], length: float) -> None:
    """Refuse a test without loads, supports beyond the wall, and a single narrow support."""
    if not any(not load.sized for load in loads):
        raise ValueError("load: is missing; movement.shape = 'loads' needs one [[load]] or more without a size")
    if len(supports) == 1 and supports[0].width < length / 3.0:
        raise ValueError("support: one narrow strip does not hold a wall; give two or more, or none for the underside")
    for number, support in enumerate(supports, start=1):
        half = support.width / 2.0
        _require_within(f"support {number}", support.x - half, support.x + half, length, "length")


def check_loads(loads: Sequence[Load], openings: Sequence[Opening], wall: Wall) -> None:
    """Refuse loads beyond the wall or over an opening, and lengths of a load at a point."""
    for number, load in enumerate(loads, start=1):
        what = f"load {load.name or number}"
        start, end = strip_of(load, wall)
        name, size = ("length", wall.length) if load.side == "top" else ("height", wall.height)
        _require_within(what, start, end, size, name)
        if load.sized and load.force is None and start == end:
            raise ValueError(
                f"{what}: a load per length or area needs start and end, or a width; at a point give force"
            )
        if load.y is not None and load.y > wall.height * (1.0 + 1e-9):
            raise ValueError(f"{what}: y = {load.y:g} m is above the wall, whose height is {wall.height:g} m")
        if load.side == "top" and load.sized:
            for order, hole in enumerate(openings, start=1):
                _require_no_hole(what, load, hole, order, wall)


def _require_no_hole(what: str, load: Load, hole: Opening, order: int, wall: Wall) -> None:
    """Refuse a load on the top, or at a height, that an opening leaves without bricks."""
    (start, end), half = strip_of(load, wall), 0.5 * wall.block_height
    level = wall.height if load.y is None else load.y
    near = 1e-9 * wall.length
    over = start < hole.right - near and hole.x + near < end
    if over and hole.y + half < level < hole.top + (half if load.y else near):
        above = f"take y = {hole.top + wall.block_height:g} m, above its lintel" if level < wall.height - half else ""
        raise ValueError(
            f"{what}: is at a height of {level:g} m over opening {order}, which reaches from x = {hole.x:g} to "
            f"{hole.right:g} m and from y = {hole.y:g} to {hole.top:g} m, where no brick carries it; "
            + (f"{above}, or " if above else "")
            + "give loads beside the opening"
        )


def _require_within(what: str, start: float, end: float, size: float, name: str) -> None:
    if start < -1e-9 * size or end > size * (1.0 + 1e-9):
        raise ValueError(f"{what}: reaches from {start:g} to {end:g} m, beyond the wall's {name} of {size:g} m")
