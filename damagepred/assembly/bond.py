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

    x: list[float]  # every half brick along the wall (m), or quarter, and where bricks are cut
    y: list[float]  # bed joints, from the underside to the top (m)
    perpends: tuple[frozenset[int], frozenset[int]]  # lines x of the perpends of even and of odd courses
    step: int = 1  # lines x per half brick


BONDS = {
    "running": (4, (0,), (2,)),
    "stack": (4, (0,), (0,)),
    "header": (2, (0,), (1,)),
    "english": (4, (0,), (1, 3)),
    "flemish": (6, (0, 4), (1, 3)),
}
"""Period of each bond along a course, and perpends of even and of odd courses, in quarters of a brick."""


def gauge(scene: Scene) -> Grid:
    """Lines of joints: between two breakpoints (ends, jambs, control joints) the best number of equal half bricks."""
    (along, half), (up, course) = _marks(scene)
    y = _lines(_breakpoints(up, course), course)
    if scene.wall.fit == "cut":
        return _cut_grid(_breakpoints(along, half), scene.wall, y)
    x = _lines(_breakpoints(along, half), half)
    period, *courses = BONDS[scene.wall.bond]
    step = 2 if any(place % 2 for places in courses for place in places) else 1
    if step == 2:
        x = np.interp(0.5 * np.arange(2 * len(x) - 1), np.arange(len(x)), x).tolist()
    even, odd = (frozenset(i for i in range(len(x)) if 2 // step * i % period in places) for places in courses)
    return Grid(x, y, (even, odd), step)


def _cut_grid(points: list[float], wall: Wall, y: list[float]) -> Grid:
    """Lines of a wall of cut bricks: breakpoints, and perpends that are not too near to them."""
    brick, near = wall.block_length, wall.shortest_cut or wall.block_length / 4
    period, *places = BONDS[wall.bond]
    courses = []
    for quarters in (*places, (0, 2)):  # lintels end on half bricks, too
        length = period * brick / 4 if quarters in places else brick
        first = [(wall.bond_offset + place * brick / 4) % length for place in quarters]
        perpends = np.sort(np.add.outer(first, length * np.arange(math.ceil(wall.length / length))).ravel())
        away = np.abs(perpends[:, None] - np.array(points)).min(axis=1)
        courses.append(perpends[(away >= near * (1 - 1e-9)) & (perpends < wall.length)])
    x = np.unique(np.concatenate((points, *courses)))
    even, odd = (frozenset(np.searchsorted(x, perpends).tolist()) for perpends in courses[:2])
    return Grid(x.tolist(), y, (even, odd))


def courses_and_halves(scene: Scene) -> tuple[int, int, float]:
    """Number of courses, of half bricks per course, and of half bricks inside openings."""
    numbers = []
    for marks, spacing in _marks(scene):
        points = _breakpoints(marks, spacing)
        numbers.append(sum(_count(low, high, spacing) for low, high in itertools.pairwise(points)))
    wall = scene.wall
    above = wall.length * wall.height - (float(np.trapezoid(*np.array(wall.top).T[::-1])) if wall.top else 0.0)
    area = sum(o.width * o.height for o in scene.opening) + (above if wall.top else 0.0)
    holes = 2 * area / (wall.block_length * wall.block_height)
    return numbers[1], numbers[0], holes


def _marks(scene: Scene) -> list[tuple[list[float], float]]:
    """Fixed joint lines along and up the wall (m), with the spacing of half bricks and of courses (m)."""
    wall = scene.wall
    along = [e for o in scene.opening for e in (o.x, o.right)] + [joint.x for joint in scene.control_joint]
    up = [e for o in scene.opening for e in (o.y, o.top)]
    for (x, y), (next_x, next_y) in itertools.pairwise(wall.top):  # steps, and the level tops between them
        along += [x] if x == next_x else []
        up += [y] if y == next_y else []
    return [([0.0, wall.length, *along], wall.block_length / 2), ([0.0, wall.height, *up], wall.block_height)]


def _breakpoints(marks: list[float], spacing: float) -> list[float]:
    # jambs closer than the tolerance share one line: the sliver between them is no brick
    points = np.unique(np.array(marks))
    keep = np.concatenate(([True], np.diff(points) > EDGE_TOLERANCE * spacing))
    keep[-1] = True
    points = points[keep]
    if len(points) > 2 and points[-1] - points[-2] <= EDGE_TOLERANCE * spacing:
        points = np.delete(points, -2)
    return points.tolist()


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
        taken += _above(scene.wall, grid, middle)
        beams = [(first, last) for level, first, last in lintels.values() if level == course]
        ends = {0, len(grid.x) - 1} | {e for span in taken + beams for e in span}
        ends |= {_index(grid.x, joint.x) for joint in scene.control_joint if course >= _lowest_course(scene, joint)}
        perpends, other = grid.perpends[course % 2], grid.perpends[1 - course % 2]
        edges = (_closed(perpends, other, ends) if grid.step == 2 else perpends) | ends
        edges -= {e for first, last in beams for e in range(first + 1, last)}
        joints = sorted(edges)
        bricks += [
            Brick(grid.x[a], bottom, grid.x[b], top, course)
            for a, b in itertools.pairwise(joints)
            if not any(first <= a and b <= last for first, last in taken)
        ]
    return bricks


def _above(wall: Wall, grid: Grid, middle: float) -> list[tuple[int, int]]:
    """Spans of lines x between which a course, by the height of its middle, lies above the top of the wall."""
    lines = np.array(grid.x[:: grid.step])
    out = np.concatenate(([False], wall.top_at(0.5 * (lines[:-1] + lines[1:])) < middle, [False]))
    first, last = np.flatnonzero(np.diff(out.astype(int)) == 1), np.flatnonzero(np.diff(out.astype(int)) == -1)
    return list(zip((grid.step * first).tolist(), (grid.step * last).tolist()))


def exposed_top(scene: Scene, bricks: Sequence[Brick]) -> list[tuple[int, float, float]]:
    """Bricks under the top of the wall, each with start and end of its part of the top (m); no sills."""
    box = np.array(bricks)
    edges = np.unique(box[:, [0, 2]])
    middles = 0.5 * (edges[:-1] + edges[1:])
    over = (box[:, :1] < middles) & (box[:, 2:3] > middles)
    highest = np.where(over.any(axis=0), np.where(over, box[:, 3:4], -1.0).argmax(axis=0), -1)
    for hole in scene.opening:
        if _is_open(scene.wall, hole):
            highest[(middles > hole.x) & (middles < hole.right)] = -1
    runs = np.flatnonzero(np.diff(highest, prepend=-2, append=-2))
    return [(int(highest[a]), float(edges[a]), float(edges[b])) for a, b in itertools.pairwise(runs) if highest[a] >= 0]


def _is_open(wall: Wall, hole: Opening) -> bool:
    """Whether a hole reaches the top of the wall."""
    return hole.top > wall.lowest_top(hole) - EDGE_TOLERANCE * wall.block_height


def _closed(perpends: frozenset[int], other: frozenset[int], ends: set[int]) -> frozenset[int]:
    """Perpends (quarters of a brick) at half a brick or more from each end.

    A perpend a quarter from an end moves to a half: a header with a queen closer. If the ``other`` course has a perpend
    there, it is left out: a three-quarter bat.
    """
    closed = set(perpends)
    for end, side in itertools.product(ends, (1, -1)):
        if end + side in closed - ends:
            closed.remove(end + side)
            closed |= {end + 2 * side} - other
    return frozenset(closed)


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
    if level == len(grid.y) - 1 or _is_open(scene.wall, hole):
        return None
    first, last = _bearing(grid, hole)
    y = (grid.y[level] + grid.y[level + 1]) / 2
    if any(start < last and first < end for start, end in _above(scene.wall, grid, y)):
        raise InputError(
            f"opening at x = {hole.x:g} m: its lintel, from {grid.x[first]:g} to {grid.x[last]:g} m, reaches above the "
            "top of the wall; make the opening lower, or shorten lintel_bearing"
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
    """Lines at the ends of the lintel: at least one half brick beyond each jamb, except at an end of the wall."""
    lines = grid.x[:: grid.step]
    jamb_left, jamb_right = _index(lines, hole.x), _index(lines, hole.right)
    reach = hole.lintel_bearing * (1 + 1e-9)  # of two lines equally near take the farther on both sides
    first = min(_index(lines, hole.x - reach), jamb_left - 1)
    last = max(_index(lines, hole.right + reach), jamb_right + 1)
    return grid.step * max(first, 0), grid.step * min(last, len(lines) - 1)
