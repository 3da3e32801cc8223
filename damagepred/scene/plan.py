"""Walls of a house in plan, and the corners where they meet."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import Annotated, Any, NamedTuple

import numpy as np
from pydantic import AfterValidator, Field

from damagepred.arrays import FloatArray
from damagepred.scene.described import completed_by, described
from damagepred.scene.loading import Load
from damagepred.scene.materials import BlockMaterial, HeadJoint, Joint, Loads
from damagepred.scene.quantity import Length, Pressure, Pure, Stiffness, to_si
from damagepred.scene.wall import ControlJoint, Opening, Wall

PLAN_TOLERANCE = 1e-3  # distance (m) within which walls meet: coordinates of a plan are rounded to millimetres
NARROWEST_PASSAGE = 0.5
"""Distance (m) of a free end from another wall below which it is a mistake in the plan: nobody walks through."""

NARROWEST_ANGLE = 15.0
"""Angle (degrees) between walls that meet: below it their thicknesses overlap over four times as much or more."""


def _check_name(name: str) -> str:
    if not name.isidentifier():
        raise ValueError("must be one word of letters, digits and _, which does not begin with a digit")
    return name


def _with_length(table: Mapping[str, Any]) -> Mapping[str, Any]:
    """Table ``[[wall]]`` with the length between its ends."""
    if (length := plan_length(table)) is None:
        return table
    if "length" in table and abs(to_si(table["length"], "m") - length) > PLAN_TOLERANCE:
        raise ValueError(f"length: follows from start and end ({length:g} m); leave it out")
    if length < PLAN_TOLERANCE:
        raise ValueError(f"end: start and end of wall '{table.get('name')}' are {1e3 * length:.3g} mm apart; move one")
    return {**table, "length": length}


@described
class PlanWall(Wall):
    """A wall of a house (``[[wall]]``), straight in plan. It has the keys of ``[wall]``; its length follows.

    Examples
    --------
    >>> from damagepred.scene import PlanWall
    >>> PlanWall(name="front", start=(0, 0), end=("8 m", 0), height="2.7 m").length
    8.0
    """

    name: Annotated[str, AfterValidator(_check_name)]
    """Name in keys and results: one word."""
    start: tuple[Length, Length]
    end: tuple[Length, Length]
    """Ends of its axis in plan (m): the middle of its thickness, up to the axis of the wall that it meets. In elevation
    x runs from start to end."""
    opening: tuple[Opening, ...] = ()
    control_joint: tuple[ControlJoint, ...] = ()
    load: tuple[Load, ...] = ()
    """Own openings, control joints and loads, as ``[[opening]]``, ``[[control_joint]]`` and ``[[load]]`` of one
    wall."""
    loads: Loads | None = None
    """Own load of the roof."""
    block: BlockMaterial | None = None
    joint: Joint | None = None
    head_joint: HeadJoint | None = None
    """Own materials, complete tables; None: the materials of the house."""

    _take_length = completed_by(_with_length)

    @property
    def direction(self) -> FloatArray:
        """Unit vector from start to end (2,)."""
        return (np.array(self.end) - np.array(self.start)) / self.length

    def points(self, x: FloatArray) -> FloatArray:
        """Plan coordinates (..., 2) of points at distances from the start (m)."""
        return np.array(self.start) + np.asarray(x)[..., None] * self.direction


def plan_length(wall: Mapping[str, Any]) -> float | None:
    """Length of a wall (m) by the ends in its table, or None."""
    try:
        ends = [[to_si(value, "m") for value in wall[key]] for key in ("start", "end")]
        (x_0, y_0), (x_1, y_1) = ends
    except (KeyError, TypeError, ValueError):
        return None
    return float(np.hypot(x_1 - x_0, y_1 - y_0))


@described
class Corner:
    """Vertical shear between the walls of a house that meet (``[corner]``).

    A corner carries vertical shear alone: |tau| <= cohesion + friction * pressure. It has no opening; the push of a
    wall's end on the other wall is left out, because nothing holds a wall out of its plane.

    Examples
    --------
    >>> from damagepred.scene import Corner
    >>> Corner(cohesion="0.2 MPa").cohesion
    200000.0
    """

    stiffness: Stiffness | None = Field(default=None, gt=0)
    """Shear stiffness of the toothing (Pa/m). None: of the head joints; where walls differ, the smaller value."""
    cohesion: Pressure | None = Field(default=None, ge=0)
    """Shear strength of the toothing or ties (Pa). None: of the head joints; where walls differ, the smaller value."""
    friction: Pure | None = Field(default=None, ge=0)
    """tan(phi) (1) under ``pressure``. None: of the head joints."""
    pressure: Pressure = Field(default=0.0, ge=0)
    """Pressure across the toothing (Pa). It is assumed, since the model has no normal force there."""
    brittle: bool | None = None
    """Whether the first slip leaves only the friction. None: as ``joint.brittle_shear``."""
    control_joint: bool = False
    """Whether control joints separate the walls at all corners: then only the footings are joined."""
    join_footings: bool = True
    """Whether footings that meet have the same vertical displacement there. Rotations are not joined."""


class Junction(NamedTuple):
    """Place where two walls meet."""

    walls: tuple[int, int]  # numbers of the walls
    x: tuple[float, float]  # distance from the start of each wall (m)
    point: tuple[float, float]  # in plan (m)
    share: float  # of the toothing: where k walls meet, 2 / k for each pair


def junctions(walls: Sequence[PlanWall]) -> tuple[Junction, ...]:
    """Corners and T-joints of a plan; ValueError for walls that repeat, cross, leave a gap or stand alone."""
    meet: dict[tuple[int, int, float, float], FloatArray] = {}
    for (i, a), (j, b) in combinations(enumerate(walls), 2):
        _refuse_repeat(a, b)
        for first, second, swap in ((a, b, False), (b, a, True)):
            for end, x in ((first.start, 0.0), (first.end, first.length)):
                other_x, away = _nearest(second, np.array(end))
                if away <= PLAN_TOLERANCE:
                    meet[(i, j, other_x, x) if swap else (i, j, x, other_x)] = np.array(end)
    joined = {key[:2] for key in meet}
    for (i, a), (j, b) in combinations(enumerate(walls), 2):
        if (i, j) not in joined:
            _refuse_crossing(a, b)
            _refuse_gap(a, b, list(meet.values()))
    for i, j, *places in meet:
        for wall, other, x in zip((walls[i], walls[j]), (walls[j], walls[i]), places):
            _refuse_in_opening(wall, other, float(x))
            _refuse_stub(wall, other, float(x))
        _refuse_narrow_angle(walls[i], walls[j], places)
    _refuse_loose(walls, {key[:2] for key in meet})
    found = []
    for (i, j, x_i, x_j), point in meet.items():
        here = {w for key, p in meet.items() for w in key[:2] if np.hypot(*(p - point)) <= 2 * PLAN_TOLERANCE}
        place = (float(point[0]), float(point[1]))
        found.append(Junction((int(i), int(j)), (float(x_i), float(x_j)), place, 2.0 / len(here)))
    return tuple(found)


def _nearest(wall: PlanWall, point: FloatArray) -> tuple[float, float]:
    """Position along a wall nearest to a point, its ends where they are within the tolerance, and the distance (m)."""
    x = float(np.clip((point - np.array(wall.start)) @ wall.direction, 0.0, wall.length))
    x = 0.0 if x <= PLAN_TOLERANCE else wall.length if x >= wall.length - PLAN_TOLERANCE else x
    return x, float(np.hypot(*(wall.points(np.array(x)) - point)))


def _across(a: FloatArray, b: FloatArray) -> float:
    return float(a[0] * b[1] - a[1] * b[0])


def _at(point: FloatArray) -> str:
    return f"({point[0]:.6g}, {point[1]:.6g}) m"


def _refuse_repeat(a: PlanWall, b: PlanWall) -> None:
    """Refuse two walls that lie on each other."""
    offset = np.array([b.start, b.end]) - np.array(a.start)
    if max(abs(_across(a.direction, o)) for o in offset) > PLAN_TOLERANCE:
        return
    low, high = sorted(float(o @ a.direction) for o in offset)
    over = min(high, a.length) - max(low, 0.0)
    if over > PLAN_TOLERANCE:
        raise ValueError(
            f"wall: '{a.name}' and '{b.name}' lie on each other over {over:.4g} m; leave one out, or let one end where "
            "the other begins"
        )


def _refuse_crossing(a: PlanWall, b: PlanWall) -> None:
    """Refuse two walls whose axes cross."""
    sine = _across(a.direction, b.direction)
    if abs(sine) < 1e-9:
        return
    between = np.array(b.start) - np.array(a.start)
    x_a, x_b = _across(between, b.direction) / sine, _across(between, a.direction) / sine
    if 0.0 < x_a < a.length and 0.0 < x_b < b.length:
        raise ValueError(
            f"wall: '{a.name}' and '{b.name}' cross at {_at(a.points(np.array(x_a)))}, {x_a:.4g} m along '{a.name}'; "
            f"divide '{b.name}' there into two walls, or end it there"
        )


def _refuse_in_opening(wall: PlanWall, other: PlanWall, x: float) -> None:
    """Refuse an opening that another wall would close in part: nearer to its axis than half its thickness."""
    half = 0.5 * other.thickness
    for number, hole in enumerate(wall.opening, 1):
        if hole.x - half + PLAN_TOLERANCE < x < hole.right + half - PLAN_TOLERANCE:
            raise ValueError(
                f"wall: '{other.name}' meets '{wall.name}' {x:.4g} m along it, at its opening {number} from "
                f"{hole.x:.4g} to {hole.right:.4g} m; leave {1e3 * half:.4g} mm or more, half the thickness of "
                f"'{other.name}', between its axis and the opening"
            )


def _refuse_stub(wall: PlanWall, other: PlanWall, x: float) -> None:
    """Refuse an end that stands out beyond another wall by less than its own thickness."""
    end, beyond = ("start", x) if x < 0.5 * wall.length else ("end", wall.length - x)
    if 0.0 < beyond < wall.thickness:
        raise ValueError(
            f"wall: the {end} of '{wall.name}' stands out {1e3 * beyond:.4g} mm beyond the axis of '{other.name}'; "
            f"let it end at {_at(wall.points(np.array(x)))}"
        )


def _refuse_narrow_angle(a: PlanWall, b: PlanWall, places: Sequence[float]) -> None:
    """Refuse walls that go side by side from the place where they meet."""
    away = [1.0 if x <= PLAN_TOLERANCE else -1.0 for x in places]
    inside = any(0.0 < x < wall.length for wall, x in zip((a, b), places))
    sine, cosine = abs(_across(a.direction, b.direction)), away[0] * away[1] * float(a.direction @ b.direction)
    if (inside or cosine > 0.0) and sine < np.sin(np.radians(NARROWEST_ANGLE)):
        raise ValueError(
            f"wall: '{a.name}' and '{b.name}' meet at {np.degrees(np.arcsin(sine)):.3g} degrees and lie on each other "
            f"there; the least is {NARROWEST_ANGLE:g} degrees"
        )


def _refuse_gap(a: PlanWall, b: PlanWall, corners: Sequence[FloatArray]) -> None:
    """Refuse ends nearer to another wall than both are thick, and free ends nearer than a passage is wide."""
    for first, second in ((a, b), (b, a)):
        for name, end in (("start", first.start), ("end", first.end)):
            x, away = _nearest(second, np.array(end))
            free = all(np.hypot(*(np.array(end) - corner)) > 2 * PLAN_TOLERANCE for corner in corners)
            if away < max(a.thickness + b.thickness, NARROWEST_PASSAGE * free):
                raise ValueError(
                    f"wall: the {name} of '{first.name}' at {_at(np.array(end))} leaves a gap of {1e3 * away:.4g} mm "
                    f"to the axis of '{second.name}'; let it end at {_at(second.points(np.array(x)))}"
                )


def _refuse_loose(walls: Sequence[PlanWall], pairs: set[tuple[int, int]]) -> None:
    """Refuse walls that do not hang together with the first wall."""
    joined, grown = {0}, True
    while grown:
        more = {w for pair in pairs if joined & set(pair) for w in pair}
        grown = not more <= joined
        joined |= more
    for wall in (w for number, w in enumerate(walls) if number not in joined):
        pairs_of_walls = [pair for number in joined for pair in ((wall, walls[number]), (walls[number], wall))]
        gaps = [(_nearest(b, np.array(end))[1], a, b) for a, b in pairs_of_walls for end in (a.start, a.end)]
        away, first, second = min(gaps, key=lambda gap: gap[0])
        other = second if first is wall else first
        raise ValueError(
            f"wall: '{wall.name}' stands {away:.4g} m off '{other.name}', the nearest wall; the "
            "walls of a house hang together, so move it there, or describe it in a file of its own"
        )
