"""Wall: size, bricks, openings and control joints."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Literal

import numpy as np
from pydantic import Field, model_validator

from damagepred.arrays import FloatArray
from damagepred.scene.described import described
from damagepred.scene.quantity import Length

ROUNDING = 1e-9  # distance (m) up to which two edges touch
EDGE_TOLERANCE = 0.05  # tolerance between edges on the same joint, as a share of a half brick or of a course
THINNEST = 0.9
"""Least pier over half a brick with its joint, and least strip over a course: a brick alone is thinner by the joint."""


@described
class Wall:
    """A straight leaf of masonry (``[wall]``), seen in elevation; x runs along it, y up from its underside.

    Examples
    --------
    >>> from damagepred import Wall
    >>> Wall(length="9 m", height="2.7 m", block_length="300 mm").block_length
    0.3
    """

    length: Length = Field(default=6.0, gt=0, le=1000)
    """Length of the wall (m)."""
    height: Length = Field(default=2.4, gt=0, le=200)
    """Height of the wall (m)."""
    top: tuple[tuple[Length, Length], ...] = ()
    """Points of a gable or of a stepped top (m), from x = 0 to the wall's length; two points at one x are a step. The
    highest is at ``height``. Half bricks whose middle lies above the line are left out. Without: a level top."""
    thickness: Length = Field(default=0.11, ge=1e-3, le=5)
    """Out-of-plane thickness (m)."""
    block_length: Length = Field(default=0.24, ge=1e-3, le=20)
    """Length of a brick with its joint, centre to centre (m). The bond is gauged to the wall and its openings: perpends
    and courses move a little so that every end, jamb, sill and head meets a joint."""
    block_height: Length = Field(default=0.075, ge=1e-3, le=20)
    """Height of a course, brick and bed joint (m)."""
    bond: Literal["running", "stack", "header", "english", "flemish"] = "running"
    """Running bond breaks the perpends at half bricks; stack bond does not. Headers are half a brick long: header bond
    has them alone, English bond in every other course, Flemish bond beside each stretcher. With these, queen closers of
    a quarter brick follow the header at ends and jambs; header bond has three-quarter bats there."""
    fit: Literal["gauged", "cut"] = "gauged"
    """Bricks at ends, jambs and control joints. ``gauged``: a little longer or shorter, so that half bricks fill every
    stretch. ``cut``: bricks keep their length along the whole wall, and are cut there."""
    bond_offset: Length = Field(default=0.0, ge=0)
    """First perpend of the lowest course, from the left end (m), less than a brick; only with ``fit = "cut"``. The
    start of the bond is rarely known: a study may sample it."""
    shortest_cut: Length | None = Field(default=None, gt=0)
    """Least distance of a perpend from an end, jamb or control joint (m); closer perpends are left out. None: a quarter
    of a brick. Only with ``fit = "cut"``."""

    def top_at(self, x: FloatArray) -> FloatArray:
        """Height of the top (m) at distances from the left end (m)."""
        return np.interp(x, *np.array(self.top).T) if self.top else np.full(np.shape(x), self.height)

    def lowest_top(self, hole: Opening) -> float:
        """Least height of the top (m) over an opening."""
        inside = [y for x, y in self.top if hole.x < x < hole.right]
        ends = self.top_at(np.array([hole.x, hole.right]) + 1e-6 * (hole.right - hole.x) * np.array([1.0, -1.0]))
        return min([*inside, *ends.tolist()])

    @model_validator(mode="after")
    def _top_is_a_line(self) -> Wall:
        if not self.top:
            return self
        x, y = np.array(self.top).T
        near = 1e-6 * self.length
        if abs(x[0]) > near or abs(x[-1] - self.length) > near or (np.diff(x) < 0).any():
            raise ValueError(
                f"top: its points go from x = {x[0]:g} to {x[-1]:g} m; they must go from 0 to the wall's length "
                f"({self.length:g} m), from left to right"
            )
        if abs(y.max() - self.height) > 1e-6 * self.height:
            raise ValueError(
                f"top: its highest point is at {y.max():g} m, and height = {self.height:g} m; both must be the same"
            )
        if (low := y.min()) < self.block_height:
            raise ValueError(f"top: its lowest point, {low:g} m, is below the first course ({self.block_height:g} m)")
        return self

    @model_validator(mode="after")
    def _holds_a_brick(self) -> Wall:
        for size, brick in (("length", "block_length"), ("height", "block_height")):
            if (length := getattr(self, brick)) > (most := getattr(self, size)):
                raise ValueError(f"{brick} = {length:g}: must not exceed the wall's {size} = {most:g}")
        if self.fit == "gauged" and (self.bond_offset > 0.0 or self.shortest_cut is not None):
            name = "bond_offset" if self.bond_offset > 0.0 else "shortest_cut"
            raise ValueError(f"{name}: gauged bricks are not cut; take fit = 'cut', or leave it out")
        if self.bond_offset >= self.block_length:
            raise ValueError(
                f"bond_offset = {self.bond_offset:g}: must be less than a brick, block_length = {self.block_length:g}"
            )
        return self


@described
class Opening:
    """A rectangular hole (``[[opening]]``).

    Examples
    --------
    >>> from damagepred import Opening
    >>> door = Opening(kind="door", x="1 m", width="0.9 m", height="2.1 m")
    >>> door.right, door.top
    (1.9, 2.1)
    """

    kind: Literal["window", "door"] = "window"
    """A door reaches down to the underside of the wall (y = 0)."""
    x: Length = Field(ge=0)
    """Left edge (m)."""
    y: Length = Field(default=0.0, ge=0)
    """Sill (m)."""
    width: Length = Field(gt=0)
    """Clear width (m)."""
    height: Length = Field(gt=0)
    """Clear height (m)."""
    lintel_bearing: Length = Field(default=0.12, gt=0)
    """Bearing length of the lintel on either side (m). The lintel is one block, a course high, of the bricks' material;
    an opening up to the top of the wall has no lintel. At an end of the wall it bears on one side, as a cantilever:
    give it a bearing that holds it."""

    @model_validator(mode="after")
    def _door_at_floor(self) -> Opening:
        if self.kind == "door" and self.y != 0:
            raise ValueError(f"y = {self.y:g}: a door starts at y = 0; leave y out, or make it a window")
        if self.kind == "window" and self.y == 0:
            raise ValueError("y = 0: a window needs a sill above the footing; give y, or make it a door")
        return self

    @property
    def right(self) -> float:
        """Right edge (m)."""
        return self.x + self.width

    @property
    def top(self) -> float:
        """Head (m)."""
        return self.y + self.height

    def overlaps(self, other: Opening) -> bool:
        """Whether the two holes share area or touch."""
        along = max(self.x, other.x) < min(self.right, other.right) + ROUNDING
        return along and max(self.y, other.y) < min(self.top, other.top) + ROUNDING


def thin_strips(wall: Wall, openings: Sequence[Opening]) -> Iterator[str]:
    """Piers thinner than half a brick and strips thinner than a course, each in a sentence with the nearest value."""
    least = {"pier": 0.5 * wall.block_length, "strip": wall.block_height}
    for number, hole in enumerate(openings, start=1):
        others = [other for other in openings if other is not hole]
        beside = [other for other in others if other.y < hole.top and hole.y < other.top]
        over = [other for other in others if other.x < hole.right and hole.x < other.right]
        left = max([0.0, *(other.right for other in beside if other.right <= hole.x)])
        right = min([wall.length, *(other.x for other in beside if other.x >= hole.right)])
        low = max([0.0, *(other.top for other in over if other.top <= hole.y)])
        high = min([wall.lowest_top(hole), *(other.y for other in over if other.y >= hole.top)])
        for what, place, size, key, value in (
            ("pier", "to its left", hole.x - left, "x", left + least["pier"]),
            ("pier", "to its right", right - hole.right, "x", right - least["pier"] - hole.width),
            ("strip", "below it", hole.y - low, "y", low + least["strip"]),
            ("strip", "above it", high - hole.top, "height", high - least["strip"] - hole.y),
        ):
            if what == "pier" and not left <= value <= right - hole.width + 1e-9:
                key, value = "width", hole.width + size - least["pier"]
            if 1e-9 * wall.length < size < THINNEST * least[what]:
                of = "half a brick" if what == "pier" else "a course"
                yield (
                    f"opening {number} ({hole.kind}): the {what} {place} is {size:.4g} m, thinner than {of} "
                    f"({least[what]:.4g} m); the nearest {key} that works is {value:.6g} m"
                )


@described
class ControlJoint:
    """Control joint or articulation joint (``[[control_joint]]``), which divides the leaf from top to bottom.

    Every course ends at it. It carries no tension and no shear, and pressure only after it has closed by its width; the
    closed joint carries no shear either. The resistance of the filler, and ties across the joint, are neglected.

    Examples
    --------
    >>> from damagepred import ControlJoint, Scene, Wall
    >>> scene = Scene(wall=Wall(length=6.0), control_joint=(ControlJoint(x="3 m"),))
    >>> scene.control_joint[0].width
    0.01
    """

    x: Length = Field(gt=0)
    """Position along the wall (m)."""
    width: Length = Field(default=0.01, ge=0)
    """Width of the gap (m), the largest closing."""
    through_dpc: bool = False
    """Whether it reaches the footing, or begins on the damp-proof course."""
