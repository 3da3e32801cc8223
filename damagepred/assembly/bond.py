"""Laying the bricks: courses and perpends gauged to the wall, its openings and control joints."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from damagepred.errors import InputError
from damagepred.scene import ControlJoint, Opening, Scene, Wall
from damagepred.scene.wall import EDGE_TOLERANCE


class Brick(NamedTuple):
    """Rectangular block of the wall: edges (m), and course counted from 0 at the bottom."""

    left: float
    bottom: float
    right: float
    top: float
    course: int


class Grid(NamedTuple):
    """Lines on which joints may lie."""

    x: list[float]  # every half brick along the wall (m), and where bricks are cut
    y: list[float]  # bed joints, from the underside to the top (m)
    # lines x on which the perpends of even and of odd courses of running bond lie; stack bond has the first
    perpends: tuple[frozenset[int], frozenset[int]]


def gauge(scene: Scene) -> Grid:
    """Space half bricks and courses so that ends, jambs, control joints, sills and heads fall on joints.

    Between two neighbouring breakpoints (an end, a jamb, a control joint) lie as many half bricks as fit best, made
    equal; so a brick differs a little from its nominal size where they do not suit the bond. Likewise the courses.
    Cut bricks (``wall.fit``) keep their length; see ``_cut_lines``.
    """
    (along, half), (up, course) = _marks(scene)
    y = _lines(_breakpoints(up, course), course)
    if scene.wall.fit == "cut":
        return Grid(*_cut_lines(_breakpoints(along, half), scene.wall, y))
    x = _lines(_breakpoints(along, half), half)
    return Grid(x, y, (frozenset(range(0, len(x), 2)), frozenset(range(1, len(x), 2))))


def _cut_lines(
    points: list[float], wall: Wall, y: list[float]
) -> tuple[list[float], list[float], tuple[frozenset[int], frozenset[int]]]:
    """Lines of a wall of cut bricks: breakpoints, and perpends that are not too near to them."""
    brick, near = wall.block_length, wall.shortest_cut or wall.block_length / 4
    courses = []
    for shift in (0.0, brick / 2):
        first = (wall.bond_offset + shift) % brick
        perpends = first + brick * np.arange(math.ceil(wall.length / brick))
        away = np.abs(perpends[:, None] - np.array(points)).min(axis=1)
        courses.append(perpends[(away >= near * (1 - 1e-9)) & (perpends < wall.length)])
    x = np.unique(np.concatenate((points, *courses)))
    even, odd = (frozenset(np.searchsorted(x, perpends).tolist()) for perpends in courses)
    return x.tolist(), y, (even, odd)


def courses_and_halves(scene: Scene) -> tuple[int, int, float]:
    """Number of courses, of half bricks per course, and of half bricks inside openings."""
    numbers = []
    for marks, spacing in _marks(scene):
        points = _breakpoints(marks, spacing)
        numbers.append(sum(_count(low, high, spacing) for low, high in itertools.pairwise(points)))
    wall = scene.wall
    holes = sum(2 * o.width * o.height for o in scene.opening) / (wall.block_length * wall.block_height)
    return numbers[1], numbers[0], holes


def _marks(scene: Scene) -> list[tuple[list[float], float]]:
    """Fixed joint lines along and up the wall (m), with the spacing of half bricks and of courses (m)."""
    wall = scene.wall
    along = [e for o in scene.opening for e in (o.x, o.right)] + [joint.x for joint in scene.control_joint]
    up = [e for o in scene.opening for e in (o.y, o.top)]
    return [([0.0, wall.length, *along], wall.block_length / 2), ([0.0, wall.height, *up], wall.block_height)]


def _breakpoints(marks: list[float], spacing: float) -> list[float]:
    # jambs closer than the tolerance share one line: the sliver between them is no brick
    points = np.unique(np.array(marks))
    keep = np.concatenate(([True], np.diff(points) > EDGE_TOLERANCE * spacing))
    keep[-1] = True
    points = points[keep]
    if len(points) > 2 and points[-1] - points[-2] <= EDGE_TOLERANCE * spacing:
        points = np.delete(points, -2)
    return [float(v) for v in points]


def _count(low: float, high: float, spacing: float) -> int:
    # round halves up so that mirrored walls get mirrored bonds
    return max(1, math.floor((high - low) / spacing * (1 + 1e-9) + 0.5))


def _lines(points: list[float], spacing: float) -> list[float]:
    lines = [0.0]
    for low, high in itertools.pairwise(points):
        count = _count(low, high, spacing)
        lines.extend(low + (high - low) * (np.arange(count) + 1) / count)
    return [float(v) for v in lines]


def lay_bricks(scene: Scene) -> list[Brick]:
    """All blocks of the wall, course by course from the bottom, left to right, lintels included."""
    grid = gauge(scene)
    lintels = {i: span for i, hole in enumerate(scene.opening) if (span := _lintel(scene, hole, grid))}
    bricks: list[Brick] = []
    for course, (bottom, top) in enumerate(zip(grid.y[:-1], grid.y[1:])):
        middle = (bottom + top) / 2
        taken = [(_index(grid.x, o.x), _index(grid.x, o.right)) for o in scene.opening if o.y < middle < o.top]
        beams = [(first, last) for level, first, last in lintels.values() if level == course]
        edges = set(grid.perpends[course % 2 if scene.wall.bond == "running" else 0])
        edges |= {0, len(grid.x) - 1} | {e for span in taken + beams for e in span}
        edges |= {_index(grid.x, joint.x) for joint in scene.control_joint if course >= _lowest_course(scene, joint)}
        edges -= {e for first, last in beams for e in range(first + 1, last)}
        joints = sorted(edges)
        bricks += [
            Brick(grid.x[a], bottom, grid.x[b], top, course)
            for a, b in itertools.pairwise(joints)
            if not any(first <= a and b <= last for first, last in taken)
        ]
    return bricks


def may_break(length: Any, block_length: float) -> Any:
    """Whether blocks of some length (m) are bricks with a potential crack: no closers, no lintels."""
    return (length > 0.75 * block_length) & (length < 1.4 * block_length)


def halved(bricks: Sequence[Brick], block_length: float, breaks: Sequence[bool]) -> tuple[list[Brick], list[int]]:
    """Bricks with each whole brick that breaks in two halves, and the numbers of the left halves."""
    pieces: list[Brick] = []
    left_halves = []
    for brick, splits in zip(bricks, breaks):
        if splits and may_break(brick.right - brick.left, block_length):
            middle = 0.5 * (brick.left + brick.right)
            left_halves.append(len(pieces))
            pieces += [brick._replace(right=middle), brick._replace(left=middle)]
        else:
            pieces.append(brick)
    return pieces, left_halves


def _lowest_course(scene: Scene, joint: ControlJoint) -> int:
    """First course that a control joint divides."""
    return 0 if scene.dpc is None or joint.through_dpc else scene.dpc.course


def parted(scene: Scene, bricks: Sequence[Brick]) -> list[tuple[int, int, ControlJoint]]:
    """Pairs of bricks (left, right) that meet at a control joint, and the joint."""
    grid = gauge(scene)
    pairs = []
    for joint in scene.control_joint:
        x = grid.x[_index(grid.x, joint.x)]
        begins = {b.course: i for i, b in enumerate(bricks) if b.left == x and b.course >= _lowest_course(scene, joint)}
        ends = {b.course: i for i, b in enumerate(bricks) if b.right == x}
        pairs += [(ends[course], i, joint) for course, i in begins.items() if course in ends]
    return pairs


def _index(lines: list[float], value: float) -> int:
    return int(np.argmin(np.abs(np.array(lines) - value)))


def _lintel(scene: Scene, hole: Opening, grid: Grid) -> tuple[int, int, int] | None:
    """(course, first, last half-brick line) of the lintel over a hole; None if the hole reaches the top."""
    level = _index(grid.y, hole.top)
    if level == len(grid.y) - 1:
        return None
    first, last = _bearing(grid, hole)
    y = (grid.y[level] + grid.y[level + 1]) / 2
    if grid.x[first] > hole.x - 1e-9 or grid.x[last] < hole.right + 1e-9:
        raise InputError(
            f"opening at x = {hole.x:g} m: its lintel finds no bearing at an end of the wall; move the opening inwards"
        )
    for joint in scene.control_joint:
        if grid.x[first] + 1e-9 < grid.x[_index(grid.x, joint.x)] < grid.x[last] - 1e-9:
            raise InputError(
                f"control joint at x = {joint.x:g} m: it would part the lintel of the opening at x = {hole.x:g} m, "
                f"which lies from {grid.x[first]:g} to {grid.x[last]:g} m; put the joint beside it, or let the "
                "opening reach the top of the wall, where it has no lintel"
            )
    for other in scene.opening:
        if other is hole:
            continue
        if other.y < y < other.top and other.x < grid.x[last] - 1e-9 and other.right > grid.x[first] + 1e-9:
            raise InputError(
                f"opening at x = {hole.x:g} m: its lintel, {hole.lintel_bearing:g} m of bearing on either side, "
                f"reaches into the opening at x = {other.x:g} m; move one of them or shorten lintel_bearing"
            )
        if _index(grid.y, other.top) == level:
            others = _bearing(grid, other)
            if first < others[1] and others[0] < last:
                raise InputError(
                    f"openings at x = {hole.x:g} m and x = {other.x:g} m: their lintels overlap; move them apart or "
                    "shorten lintel_bearing"
                )
    return level, first, last


def _bearing(grid: Grid, hole: Opening) -> tuple[int, int]:
    """Half-brick lines at the ends of the lintel: at least one half brick beyond each jamb."""
    jamb_left, jamb_right = _index(grid.x, hole.x), _index(grid.x, hole.right)
    reach = hole.lintel_bearing * (1 + 1e-9)  # of two lines equally near take the farther on both sides
    first = min(_index(grid.x, hole.x - reach), jamb_left - 1)
    last = max(_index(grid.x, hole.right + reach), jamb_right + 1)
    return max(first, 0), min(last, len(grid.x) - 1)
