"""Laboratory test of a wall: supports, loads and control."""

from __future__ import annotations

import math
from typing import Literal

from pydantic import Field, model_validator

from damagepred.scene.described import described
from damagepred.scene.quantity import Force, Length, Pure, Stiffness


@described
class Support:
    """Bearing strip under the wall (``[[support]]``), read with ``[movement] shape = "loads"``.

    Without any the wall rests on its whole underside, in a bed of its mortar.

    Attributes
    ----------
    x : float
        Middle of the strip, from the left end of the wall (m).
    width : float
        Width of the strip (m).

    Examples
    --------
    >>> from damagepred import scene
    >>> scene.Support(x="0.461 m", width="50 mm").width
    0.05
    """

    x: Length = Field(ge=0)
    width: Length = Field(gt=0)


@described
class Load:
    """Loaded strip of a side of the wall (``[[load]]``), read with ``[movement] shape = "loads"``.

    Attributes
    ----------
    side : {"top", "left", "right"}
        Loaded side of the wall.
    at : float or None
        Middle of the strip: from the left end of the wall, or from its underside (m). None: the middle of the side.
    width : float or None
        Length of the strip along the side (m). None: as long as the side.
    direction : {"towards", "along"}
        ``towards``: the load presses on the wall. ``along``: it pushes to the right on the top, and down on a side.
    share : float
        Share of the total load, relative to the other strips (1).

    Examples
    --------
    >>> from damagepred import scene
    >>> scene.Load(at="0.25 m", width="60 mm").side
    'top'
    """

    side: Literal["top", "left", "right"] = "top"
    at: Length | None = Field(default=None, ge=0)
    width: Length | None = Field(default=None, gt=0)
    direction: Literal["towards", "along"] = "towards"
    share: Pure = Field(default=1.0, gt=0)


@described
class Loading:
    """Control of a test (``[loading]``), read with ``[movement] shape = "loads"``.

    The test begins under the dead load. The controlled quantity grows in the increments of the movement to the value
    given here; stages of the movement make cycles of it. All measurements count from the dead load.

    Attributes
    ----------
    control : {"force", "displacement", "opening"}
        ``force``: the load of all strips; the path ends at the load capacity. ``displacement``: displacement of the
        strips in the direction of their loads, by their shares. ``opening``: opening of the gauge. With the last two
        the load is a result, and may fall; without stages the path ends where it reaches 0.
    force : float or None
        Load of all strips together at the end (N).
    displacement : float or None
        Displacement of the strips at the end (m).
    opening : float or None
        Opening of the gauge at the end (m).
    gauge : sequence of (x, y)
        Two points of the wall (m): the opening is the increase of their distance. It is measured in every test.
        Bricks count as rigid between the points and their middles.
    beam : {"none", "free", "level", "clamped"}
        Stiff beam without weight in a bed of mortar on the wall's top, which takes the loads there, ``[loads] roof``
        included. ``free``: it may turn, as the top of a cantilever. ``level``: it stays level under a constant load.
        ``clamped``: it also keeps its height, from the dead load on.
    bearing_stiffness : float or None
        Normal stiffness of the supports (Pa/m). None: as the joints.
    bearing_friction : float
        tan(phi) (1) of the supports. 0: rollers.

    Examples
    --------
    >>> from damagepred import scene
    >>> scene.Loading(control="displacement", displacement="2 mm").displacement
    0.002
    """

    control: Literal["force", "displacement", "opening"] = "force"
    force: Force | None = Field(default=None, gt=0)
    displacement: Length | None = Field(default=None, gt=0)
    opening: Length | None = Field(default=None, gt=0)
    gauge: tuple[tuple[Length, Length], ...] = ()
    beam: Literal["none", "free", "level", "clamped"] = "none"
    bearing_stiffness: Stiffness | None = Field(default=None, gt=0)
    bearing_friction: Pure = Field(default=0.0, ge=0)

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


def check_loading(supports: tuple[Support, ...], loads: tuple[Load, ...], length: float, height: float) -> None:
    """Refuse a test without loads, strips beyond the wall, and a single narrow support."""
    if not loads:
        raise ValueError("load: is missing; movement.shape = 'loads' needs one [[load]] or more")
    if len(supports) == 1 and supports[0].width < length / 3.0:
        raise ValueError("support: one narrow strip does not hold a wall; give two or more, or none for the underside")
    for number, support in enumerate(supports, start=1):
        _require_within(f"support {number}", support.x, support.width, length, "length")
    for number, load in enumerate(loads, start=1):
        name, size = ("length", length) if load.side == "top" else ("height", height)
        width = size if load.width is None else load.width
        _require_within(f"load {number}", size / 2.0 if load.at is None else load.at, width, size, name)


def _require_within(what: str, middle: float, width: float, size: float, name: str) -> None:
    if not (width / 2.0 - middle <= 1e-9 * size and middle + width / 2.0 <= size * (1.0 + 1e-9)):
        raise ValueError(
            f"{what}: reaches from {middle - width / 2.0:g} to {middle + width / 2.0:g} m, beyond the wall's {name} of "
            f"{size:g} m"
        )
