"""Wall: size, bricks, openings and control joints."""

from __future__ import annotations

import math
from typing import Literal

from pydantic import Field, model_validator

from damagepred.scene.described import described
from damagepred.scene.quantity import Length

EDGE_TOLERANCE = 0.05
"""Tolerance between edges on the same joint, as a share of a half brick or of a course."""


@described
class Wall:
    """A straight leaf of masonry (``[wall]``), seen in elevation; x runs along it, y up from its underside.

    Attributes
    ----------
    length : float
        Length of the wall (m).
    height : float
        Height of the wall (m).
    thickness : float
        Out-of-plane thickness (m).
    block_length : float
        Length of a brick with its joint, centre to centre (m). The bond is gauged to the wall and its openings:
        perpends and courses move a little so that every end, jamb, sill and head meets a joint.
    block_height : float
        Height of a course, brick and bed joint (m).
    bond : {"running", "stack"}
        Running bond breaks the perpends at half bricks; stack bond does not.
    fit : {"gauged", "cut"}
        Bricks at ends, jambs and control joints. ``gauged``: a little longer or shorter, so that half bricks fill every
        stretch. ``cut``: bricks keep their length along the whole wall, and are cut there.
    bond_offset : float
        First perpend of the lowest course, from the left end (m), less than a brick; only with ``fit = "cut"``. The
        start of the bond is rarely known: a study may sample it.
    shortest_cut : float or None
        Least distance of a perpend from an end, jamb or control joint (m); closer perpends are left out. None: a
        quarter of a brick. Only with ``fit = "cut"``.

    Examples
    --------
    >>> from damagepred import Wall
    >>> Wall(length="9 m", height="2.7 m", block_length="300 mm").block_length
    0.3
    """

    length: Length = Field(default=6.0, gt=0, le=1000)
    height: Length = Field(default=2.4, gt=0, le=200)
    thickness: Length = Field(default=0.11, ge=1e-3, le=5)
    block_length: Length = Field(default=0.24, ge=1e-3, le=20)
    block_height: Length = Field(default=0.075, ge=1e-3, le=20)
    bond: Literal["running", "stack"] = "running"
    fit: Literal["gauged", "cut"] = "gauged"
    bond_offset: Length = Field(default=0.0, ge=0)
    shortest_cut: Length | None = Field(default=None, gt=0)

    @property
    def bricks(self) -> int:
        """Approximate number of whole bricks in the elevation."""
        return math.ceil(self.length / self.block_length) * math.ceil(self.height / self.block_height)

    @model_validator(mode="after")
    def _holds_a_brick(self) -> Wall:
        for size, brick in (("length", "block_length"), ("height", "block_height")):
            if getattr(self, brick) > getattr(self, size):
                raise ValueError(
                    f"{brick} = {getattr(self, brick):g}: must not exceed the wall's {size} = {getattr(self, size):g}"
                )
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

    Attributes
    ----------
    kind : {"window", "door"}
        A door reaches down to the underside of the wall (y = 0).
    x : float
        Left edge (m).
    y : float
        Sill (m).
    width : float
        Clear width (m).
    height : float
        Clear height (m).
    lintel_bearing : float
        Bearing length of the lintel on either side (m). The lintel is one block, a course high, of the bricks'
        material; an opening up to the top of the wall has no lintel.

    Examples
    --------
    >>> from damagepred import Opening
    >>> door = Opening(kind="door", x="1 m", width="0.9 m", height="2.1 m")
    >>> door.right, door.top
    (1.9, 2.1)
    """

    kind: Literal["window", "door"] = "window"
    x: Length = Field(ge=0)
    y: Length = Field(default=0.0, ge=0)
    width: Length = Field(gt=0)
    height: Length = Field(gt=0)
    lintel_bearing: Length = Field(default=0.12, gt=0)

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

    def overlaps(self, other: Opening, margin: float = 1e-9) -> bool:
        """Whether the two holes share area, or touch within ``margin`` (m).

        Parameters
        ----------
        other : Opening
            Another hole.
        margin : float
            Distance (m) that counts as touching.
        """
        return (
            self.x < other.right + margin
            and other.x < self.right + margin
            and self.y < other.top + margin
            and other.y < self.top + margin
        )


@described
class ControlJoint:
    """Control joint or articulation joint (``[[control_joint]]``), which divides the leaf from top to bottom.

    Every course ends at it. It carries no tension and no shear, and pressure only after it has closed by its width; the
    closed joint carries no shear either. The resistance of the filler, and ties across the joint, are neglected.

    Attributes
    ----------
    x : float
        Position along the wall (m).
    width : float
        Width of the gap (m), the largest closing.
    through_dpc : bool
        Whether it reaches the footing, or begins on the damp-proof course.

    Examples
    --------
    >>> from damagepred import ControlJoint, Scene, Wall
    >>> scene = Scene(wall=Wall(length=6.0), control_joint=(ControlJoint(x="3 m"),))
    >>> scene.control_joint[0].width
    0.01
    """

    x: Length = Field(gt=0)
    width: Length = Field(default=0.01, ge=0)
    through_dpc: bool = False
