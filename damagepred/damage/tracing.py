"""Cracks as objects in one state of a wall: contacts that have opened or slid, joined end to end, and traced.

The tributary length of each contact is a piece of its joint. Pieces that meet, within a joint or at a corner, are
joined; yielded parts of bricks join the pieces that they touch. The longest path of a connected set, along its widest
joints and as far as it is straight, is one crack with its short branches. Longer branches are further cracks: a fan or
an arch is several. ``damagepred.damage.cracks.find_cracks``, which determines categories, joins whole joints instead.
Along the increments of a path each crack keeps its number as it grows, closes and opens again.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
import scipy

from damagepred.arrays import BoolArray, FloatArray, IntArray
from damagepred.damage.cracks import HAIRLINE
from damagepred.damage.joints import JointMap

ORIENTATIONS = ("horizontal", "vertical", "stepped", "diagonal")
HORIZONTAL, VERTICAL, STEPPED, DIAGONAL = range(4)

LEVEL, UPRIGHT = 15.0, 75.0
"""Inclination (degrees) up to which a crack counts as horizontal, and from which as vertical."""


@dataclass(frozen=True)
class Pieces:
    """Joints of a wall cut into pieces, p = m q of them, one per contact, and the points where they meet."""

    joints: JointMap

    @cached_property
    def ends(self) -> IntArray:
        """Numbers of the two end points of each piece (p, 2), along the tangent of its joint."""
        m, q = self.joints.contact_x.shape
        count = self.joints.corners.shape[1]
        points = np.empty((m, q + 1), dtype=np.int64)
        points[:, [0, -1]] = self.joints.corner_numbers
        points[:, 1:-1] = count + np.arange(m * (q - 1)).reshape(m, q - 1)
        return np.stack((points[:, :-1], points[:, 1:]), axis=-1).reshape(-1, 2)

    @cached_property
    def place(self) -> FloatArray:
        """Position of the two ends of each piece (p, 2, 2) (m)."""
        length = self.joints.contact_length
        whole = length.sum(axis=1, keepdims=True)
        share = np.concatenate((np.zeros_like(whole), np.cumsum(length, axis=1) / whole), axis=1)[..., None]
        start, end = self.joints.start[:, None], self.joints.end[:, None]
        points = start + share * (end - start)
        return np.stack((points[:, :-1], points[:, 1:]), axis=2).reshape(-1, 2, 2)

    @cached_property
    def tangent(self) -> FloatArray:
        """Unit tangent of each piece: array (p, 2)."""
        along = self.joints.end - self.joints.start
        unit = along / np.hypot(*along.T)[:, None]
        return np.repeat(unit, self.joints.contact_x.shape[1], axis=0)

    @cached_property
    def length(self) -> FloatArray:
        """Length of each piece (m), (p,)."""
        return self.joints.contact_length.ravel()

    @cached_property
    def points(self) -> int:
        """Number of points where pieces may meet."""
        return int(self.ends.max(initial=-1)) + 1

    @cached_property
    def longest_branch(self) -> float:
        """Length of two joints (m): a longer branch is a separate crack."""
        return 2.0 * float(np.median(np.hypot(*(self.joints.end - self.joints.start).T)))


class Links(NamedTuple):
    """Links of cracks through yielded zones: graph edges in addition to the pieces of joints; l of them."""

    ends: IntArray  # (l, 2): points: ends of pieces, and from ``Pieces.points`` on, zones
    place: FloatArray  # (l, 2, 2): position of the points (m)


NO_LINKS = Links(np.empty((0, 2), dtype=np.int64), np.empty((0, 2, 2)))


class Crack(NamedTuple):
    """One crack in one state; a pieces of joints that have opened or slid, s steps of its path."""

    pieces: IntArray  # (a,): contacts
    opening: FloatArray  # (a,): opening normal to the joint (m), 0 if closed
    displacement: FloatArray  # (a,): relative displacement of the two faces (m)
    width: FloatArray  # (a,): component normal to the crack's mean line (m), opening positive
    along: FloatArray  # (a,): position along the mean line (m), 0 at its middle
    path: FloatArray  # (s + 1, 2): points of its longest path, from the lower or left end (m)
    path_pieces: IntArray  # (s,): contact of each step, -1 through a brick
    length: float  # of all its pieces (m)
    length_through_blocks: float  # of its path through bricks (m)
    branches: int  # pieces off the path
    inclination: float  # of the mean line, from the horizontal (degrees), above -90 and up to 90
    orientation: int  # index into ``ORIENTATIONS``
    widest: int  # position in ``pieces`` of the widest opening


def links_of(
    pieces: Pieces, open_pieces: BoolArray, x: FloatArray, y: FloatArray, zones: IntArray, yields: BoolArray
) -> Links:
    """Links of cracks through yielded zones (z,), between joint pieces that have opened or slid (p,)."""
    failed = zones[yields]
    cracked = np.flatnonzero(open_pieces)
    if not len(failed) or not cracked.size:
        return NO_LINKS
    corner = np.stack((x[failed], y[failed]), axis=-1)
    middle = corner.mean(axis=1)
    number = pieces.points + np.arange(len(failed))
    # zones that share a gridpoint
    order = np.argsort(failed.ravel(), kind="stable")
    gridpoint, owner = failed.ravel()[order], order // 3
    same = np.flatnonzero(gridpoint[1:] == gridpoint[:-1])
    first, second = owner[same], owner[same + 1]
    ends = [np.column_stack((number[first], number[second]))]
    positions = [np.stack((middle[first], middle[second]), axis=1)]
    # zones that a cracked piece touches: with its ends or its middle
    piece_ends = pieces.place[cracked]
    for point in (piece_ends[:, 0], piece_ends[:, 1], piece_ends.mean(axis=1)):
        for rows in np.array_split(np.arange(len(failed)), len(failed) // 256 + 1):
            zone, piece = np.nonzero(_inside(corner[rows], point))
            zone = rows[zone]
            gap = np.linalg.norm(piece_ends[piece] - middle[zone][:, None], axis=-1)
            nearer = gap.argmin(axis=1)
            ends.append(np.column_stack((pieces.ends[cracked[piece], nearer], number[zone])))
            positions.append(np.stack((piece_ends[piece, nearer], middle[zone]), axis=1))
    return Links(np.concatenate(ends), np.concatenate(positions))


def _inside(corner: FloatArray, point: FloatArray) -> BoolArray:
    """Which triangles (t, 3, 2) contain which points (p, 2), sides included: array (t, p)."""
    inside = np.ones((len(corner), len(point)), dtype=np.bool_)
    for a, b in ((0, 1), (1, 2), (2, 0)):
        edge = corner[:, b] - corner[:, a]
        arm = point[None] - corner[:, None, a]
        area = edge[:, None, 0] * arm[..., 1] - edge[:, None, 1] * arm[..., 0]
        inside &= area >= -1e-6 * (edge**2).sum(axis=1)[:, None]
    return inside


def trace(pieces: Pieces, opening: FloatArray, slip: FloatArray, active: BoolArray, links: Links) -> list[Crack]:
    """Cracks of joined pieces that have opened or slid (p,), widest first, cracks that only slid last."""
    chosen = np.flatnonzero(active)
    if not chosen.size:
        return []
    ends = np.concatenate((pieces.ends[chosen], links.ends))
    position = np.concatenate((pieces.place[chosen], links.place))
    cracks = []
    waiting = _joined(ends)
    while waiting:
        edges = waiting.pop()
        if (edges < len(chosen)).any():  # zones alone are no crack of joints
            contact = np.where(edges < len(chosen), chosen[np.minimum(edges, len(chosen) - 1)], -1)
            crack, others = _crack(pieces, opening, slip, contact, ends[edges], position[edges])
            cracks.append(crack)
            waiting += [edges[other] for other in others]
    return sorted(cracks, key=lambda c: (-float(c.opening.max()), -c.length, int(c.pieces[0])))


def _crack(
    pieces: Pieces, opening: FloatArray, slip: FloatArray, contact: IntArray, ends: IntArray, place: FloatArray
) -> tuple[Crack, list[IntArray]]:
    """Crack along the longest path of some edges, and the edges of other cracks that branch off."""
    step = np.hypot(*(place[:, 1] - place[:, 0]).T)
    joint = contact >= 0
    displacement = np.where(joint, np.hypot(np.maximum(opening[contact], 0.0), slip[contact]), np.inf)
    cost = step / np.where(joint, displacement, displacement.min())
    path, forward = _longest_course(ends, step, cost)
    corners = np.vstack((place[path[0], 1 - forward[0].astype(int)], place[path, forward.astype(int)]))
    straight = _straight_part(corners, displacement[path], pieces.longest_branch)
    path, forward, corners = path[straight], forward[straight], corners[straight.start : straight.stop + 1]
    leaving = [edges for edges in _leaving(ends, path) if joint[edges].any()]

    def joint_length(edges: IntArray) -> float:  # on the longest path of some edges
        path = edges[_longest_course(ends[edges], step[edges], cost[edges])[0]]
        return float(step[path][joint[path]].sum())

    others = [edges for edges in leaving if joint_length(edges) > pieces.longest_branch]
    kept = joint.copy()
    kept[[edge for edges in others for edge in edges]] = False
    if not kept.any():  # a path through bricks alone has no joint, hence no width
        others, kept = [], joint
    members = contact[kept]
    direction, middle = _mean_line(place[kept], step[kept])
    if (corners[-1] - corners[0]) @ direction < 0:
        path, forward, corners = path[::-1], ~forward[::-1], corners[::-1]
    normal = np.array((-direction[1], direction[0]))
    tangent = pieces.tangent[members]
    gap = np.maximum(opening[members], 0.0)
    # the normal of a joint points from block a to block b, its tangent is the normal turned clockwise
    moved = gap[:, None] * np.column_stack((-tangent[:, 1], tangent[:, 0])) + slip[members][:, None] * tangent
    width = _which_side(pieces, members, contact, path, forward, normal) * (moved @ normal)
    through = path[contact[path] < 0]
    inclination = float(np.degrees(np.arctan2(direction[1], direction[0])))
    crack = Crack(
        pieces=members,
        opening=gap,
        displacement=np.hypot(gap, slip[members]),
        width=width,
        along=(pieces.place[members].mean(axis=1) - middle) @ direction,
        path=corners,
        path_pieces=contact[path],
        length=float(pieces.length[members].sum()),
        length_through_blocks=float(step[through].sum()),
        branches=len(leaving) - len(others),
        inclination=inclination,
        orientation=_orientation(abs(inclination), bool(through.size)),
        widest=int(np.lexsort((-np.hypot(gap, slip[members]), -gap))[0]),
    )
    return crack, others


def _mean_line(place: FloatArray, step: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Direction (to the right or up) and a point of the line closest to some edges."""
    weight = step / step.sum()
    middle = weight @ place.mean(axis=1)
    arms = place - middle
    # second moment of a straight edge about the middle, by Simpson's rule
    parts = ((weight / 6, arms[:, 0]), (weight / 6, arms[:, 1]), (weight * 4 / 6, arms.mean(axis=1)))
    spread = sum(np.einsum("e,ei,ej->ij", w, a, a) for w, a in parts)
    values, vectors = np.linalg.eigh(np.asarray(spread))
    direction = vectors[:, int(np.argmax(values))]
    if direction[0] < -1e-9 or (abs(direction[0]) <= 1e-9 and direction[1] < 0):
        direction = -direction
    return direction, middle


def _longest_course(ends: IntArray, step: FloatArray, cost: FloatArray) -> tuple[IntArray, BoolArray]:
    """Edges of the cheapest path between the two points farthest apart, and which of them run forward."""
    points, local = np.unique(ends, return_inverse=True)
    local = local.reshape(-1, 2)
    n = len(points)
    # of parallel edges the cheapest counts
    key = local.min(axis=1) * n + local.max(axis=1)
    order = np.lexsort((cost, key))
    key, cheapest = np.unique(key[order], return_index=True)
    edge_of = order[cheapest]

    def search(weight: FloatArray, start: int) -> tuple[FloatArray, IntArray]:
        graph = scipy.sparse.csr_array((np.maximum(weight[edge_of], 1e-12), (key // n, key % n)), shape=(n, n))
        return scipy.sparse.csgraph.dijkstra(graph, directed=False, indices=start, return_predecessors=True)

    first = int(np.argmax(search(step, 0)[0]))
    last = int(np.argmax(search(step, first)[0]))
    before = search(cost, first)[1]
    course = [last]
    while course[-1] != first:
        course.append(int(before[course[-1]]))
    walk = np.array(course[::-1])
    walked = np.minimum(walk[:-1], walk[1:]) * n + np.maximum(walk[:-1], walk[1:])
    edges = edge_of[np.searchsorted(key, walked)]
    return edges, local[edges, 1] == walk[1:]


def _straight_part(corners: FloatArray, width: FloatArray, least: float) -> slice:
    """Steps of a path around its widest that deviate from their chord by less than a quarter of it."""
    start, stop = 0, len(width)
    widest = int(np.argmax(np.where(np.isfinite(width), width, 0.0)))
    while True:
        arms = corners[start : stop + 1] - corners[start]
        chord = float(np.hypot(*arms[-1]))
        across = np.abs(arms[:, 0] * arms[-1, 1] - arms[:, 1] * arms[-1, 0]) / chord if chord else np.hypot(*arms.T)
        bend = start + int(np.argmax(across))
        if across.max() <= max(least, 0.25 * chord):
            return slice(start, stop)
        start, stop = (bend, stop) if widest >= bend else (start, bend)


def _which_side(
    pieces: Pieces, members: IntArray, contact: IntArray, path: IntArray, forward: BoolArray, normal: FloatArray
) -> FloatArray:
    """+1 for each piece with block b on the left of the path (off it: of the mean line), otherwise -1."""
    tangent = pieces.tangent[members]
    beside = np.column_stack((-tangent[:, 1], tangent[:, 0])) @ normal
    side = np.where(beside >= 0, 1.0, -1.0)
    on_path = contact[path] >= 0
    position = np.searchsorted(members, contact[path[on_path]], sorter=np.argsort(members))
    rows = np.argsort(members)[position]
    side[rows] = np.where(forward[on_path], 1.0, -1.0)
    return side


def _leaving(ends: IntArray, path: IntArray) -> list[IntArray]:
    """Connected groups of the edges that remain without the path."""
    remaining = np.setdiff1d(np.arange(len(ends)), path)
    # cut at the path: each edge gets its own copy of a point of the path
    points = ends[remaining].astype(np.int64)
    cut = np.isin(points, ends[path])
    points[cut] = ends.max() + 1 + np.arange(int(cut.sum()))
    return [remaining[group] for group in _joined(points)]


def _joined(ends: IntArray) -> list[IntArray]:
    """Edges of each connected part of a graph."""
    if not len(ends):
        return []
    points, local = np.unique(ends, return_inverse=True)
    local = local.reshape(-1, 2)
    graph = scipy.sparse.csr_array((np.ones(len(local), np.int8), (local[:, 0], local[:, 1])), shape=(len(points),) * 2)
    _, label = scipy.sparse.csgraph.connected_components(graph, directed=False)
    of_edge = label[local[:, 0]]
    order = np.argsort(of_edge, kind="stable")
    return np.split(order, np.flatnonzero(np.diff(of_edge[order])) + 1)


def _orientation(inclination: float, through: bool) -> int:
    if inclination <= LEVEL:
        return HORIZONTAL
    if inclination >= UPRIGHT:
        return VERTICAL
    return DIAGONAL if through else STEPPED


PARTS = ("wall", "below_dpc", "dpc_opening", "dpc_slip")
"""Parts of the wall with their own cracks: the wall proper, the courses below the dpc, the open dpc, the closed dpc
that has slipped."""
WALL, BELOW_DPC, DPC_OPENING, DPC_SLIP = range(4)


class Numbered(NamedTuple):
    """Crack with its number."""

    number: int  # from 1, older cracks first, then wider cracks
    part: int  # index into ``PARTS``
    crack: Crack  # present state
    first_increment: int  # increment and piece of its first broken bond or first slip
    first_piece: int


class Growth:
    """Cracks of one wall along its increments; ``merged``: cracks that have joined an older one -> its number."""

    def __init__(self, joints: JointMap, hairline: float = HAIRLINE) -> None:
        self.pieces, self.hairline = Pieces(joints), hairline
        q = joints.contact_x.shape[1]
        wall, below, dpc = (np.repeat(members, q) for members in (joints.is_wall, joints.is_base, joints.is_dpc))
        self._in_part = (wall, below, dpc, dpc)
        count = joints.contact_x.size
        self._number = [np.zeros(count, dtype=np.int64) for _ in PARTS]  # 0: never part of a crack
        self._first = np.full(count, -1, dtype=np.int64)
        self._first_gap = np.zeros(count)
        self._next = 1
        self.merged: dict[int, int] = {}

    def step(
        self, increment: int, opening: FloatArray, slip: FloatArray, cracked: BoolArray, links: Links = NO_LINKS
    ) -> list[Numbered]:
        """Cracks of the next increment, by number, from opening, slip (m) and broken bonds at the contacts."""
        joints = self.pieces.joints
        opening = joints.widest(np.reshape(opening, joints.contact_x.shape)).ravel()
        slip, cracked = np.ravel(slip), np.ravel(cracked)
        is_open = opening > self.hairline
        slid = np.abs(slip) > self.hairline
        new = (cracked | slid | (is_open & self._in_part[DPC_OPENING])) & (self._first < 0)
        self._first[new] = increment
        self._first_gap[new] = opening[new]
        joint = (is_open & cracked) | slid
        members = (joint, joint, is_open, slid & ~is_open)
        numbered = []
        for part, (in_part, member) in enumerate(zip(self._in_part, members)):
            through = links if part in (WALL, BELOW_DPC) else NO_LINKS
            cracks = trace(self.pieces, opening, slip, in_part & member, through)
            numbered += [Numbered(n, part, c, *self._origin(c)) for n, c in self._numbered(part, cracks)]
        return sorted(numbered, key=lambda crack: crack.number)

    def _origin(self, crack: Crack) -> tuple[int, int]:
        """Increment and piece in which a crack began; of several pieces the widest one then."""
        first = self._first[crack.pieces]
        oldest = np.flatnonzero(first == first.min())
        piece = crack.pieces[oldest[np.argmax(self._first_gap[crack.pieces[oldest]])]]
        return int(first.min()), int(piece)

    def _numbered(self, part: int, cracks: list[Crack]) -> list[tuple[int, Crack]]:
        """Give each crack the oldest number of its pieces; of two with the same number, the longest keeps it."""
        bears = self._number[part]
        taken: dict[int, int] = {}
        claims = [np.unique(bears[crack.pieces]) for crack in cracks]
        for which in sorted(range(len(cracks)), key=lambda i: -cracks[i].length):
            free = [int(n) for n in claims[which] if n > 0 and n not in taken]
            if free:
                taken[free[0]] = which
        given = {which: number for number, which in taken.items()}
        for which, crack in enumerate(cracks):
            if which not in given:
                given[which], self._next = self._next, self._next + 1
            for other in claims[which]:
                if 0 < other != given[which] and int(other) not in taken:
                    self.merged[int(other)] = given[which]
            bears[crack.pieces] = given[which]
        for number in taken:
            self.merged.pop(number, None)
        return [(given[which], crack) for which, crack in enumerate(cracks)]
