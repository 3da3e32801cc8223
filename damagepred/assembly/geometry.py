"""Polygons: area, centroid, inertia, convexity; and the edges they share."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy import spatial

from damagepred.arrays import BoolArray, FloatArray, IntArray
from damagepred.errors import InputError

_EPS = float(np.finfo(np.float64).eps)


def convex_polygon(vertices: ArrayLike, name: str) -> FloatArray:
    """Checked corners (v, 2) of a convex polygon, counter-clockwise (m)."""
    try:
        corners = np.asarray(vertices, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        raise InputError(f"{name}: vertices must be points (x, y), got {vertices!r}.") from None
    if corners.ndim != 2 or corners.shape[1] != 2 or len(corners) < 3:
        raise InputError(f"{name}: vertices must be 3 or more points (x, y), got an array of shape {corners.shape}.")
    if not np.isfinite(corners).all():
        raise InputError(f"{name}: vertices must be finite numbers.")
    # plain numbers: arrays of a few corners would take ten times as long, and a wall has many blocks
    x, y = corners[:, 0].tolist(), corners[:, 1].tolist()
    edges = [(x1 - x0, y1 - y0) for x0, y0, x1, y1 in zip(x, y, x[1:] + x[:1], y[1:] + y[:1], strict=True)]
    size = max(max(x) - min(x), max(y) - min(y))
    if any(math.hypot(*edge) <= 1e-9 * size for edge in edges):
        raise InputError(f"{name}: two neighbouring vertices coincide; leave one out.")
    turns = [ax * by - ay * bx for (ax, ay), (bx, by) in zip(edges, edges[1:] + edges[:1], strict=True)]
    if sum(turns) < 0:
        return convex_polygon(corners[::-1], name)
    corners_of = zip(turns[:-1], edges[:-1], edges[1:], strict=True)
    bends = [math.atan2(turn, ax * bx + ay * by) for turn, (ax, ay), (bx, by) in corners_of]
    rounding = 8 * _EPS * max(max(map(abs, x)), max(map(abs, y))) * size  # far from the origin digits are few
    if min(turns) < -1e-12 * size**2 - rounding or sum(bends) > 2 * math.pi:
        raise InputError(f"{name}: is not convex; cut it into convex blocks.")
    area = sum((x0 - x[0]) * ey - (y0 - y[0]) * ex for x0, y0, (ex, ey) in zip(x, y, edges, strict=True))
    if abs(area) <= 2e-9 * size**2 + rounding:
        raise InputError(f"{name}: has no area; its vertices lie on one line.")
    return corners


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    product: FloatArray = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return product


def mass_properties(corners: FloatArray) -> tuple[float, float, float, float]:
    """Area (m2), centroid x and y (m), and polar second moment of area about it (m4); corners counter-clockwise."""
    count = len(corners)
    x, y = corners[:, 0].tolist(), corners[:, 1].tolist()
    x0, y0 = sum(x) / count, sum(y) / count  # near the polygon, so that far-away coordinates lose no digits
    x, y = [a - x0 for a in x], [b - y0 for b in y]
    twice = first_x = first_y = second = 0.0
    for px, py, qx, qy in zip(x, y, x[1:] + x[:1], y[1:] + y[:1], strict=True):
        cross = px * qy - py * qx
        twice += cross
        first_x += (px + qx) * cross
        first_y += (py + qy) * cross
        second += cross * (px * px + py * py + px * qx + py * qy + qx * qx + qy * qy)
    cx, cy = first_x / (3.0 * twice), first_y / (3.0 * twice)
    area = twice / 2.0
    return area, x0 + cx, y0 + cy, second / 12.0 - area * (cx * cx + cy * cy)


_UP_RIGHT = np.array([np.cos(0.6180339887), np.sin(0.6180339887)])


def refuse_overlaps(vertices: FloatArray, first_vertex: IntArray, tolerance: float) -> None:
    """Raise InputError if two convex polygons overlap by more than a depth (m)."""
    polygons = np.split(vertices, first_vertex[1:-1])
    low = np.minimum.reduceat(vertices, first_vertex[:-1])
    high = np.maximum.reduceat(vertices, first_vertex[:-1])
    for i, j in _near_boxes(low, high, tolerance):
        depth = min(_depth(polygons[i], polygons[j]), _depth(polygons[j], polygons[i]))
        if depth > tolerance:
            raise InputError(f"blocks {i} and {j} overlap by {depth:.3g} m; move them apart or cut them.")


def _near_boxes(low: FloatArray, high: FloatArray, tolerance: float) -> IntArray:
    """Pairs (k, 2) whose bounding boxes overlap by more than ``tolerance`` in both directions."""
    centre, half = (low + high) / 2, (high - low) / 2
    # large blocks see all they may touch; small ones look only as far as their own size
    reach = half.max(axis=1)
    tree = spatial.cKDTree(centre)
    seen = tree.query_ball_point(centre, 2 * reach, p=np.inf, return_sorted=True)
    first = np.repeat(np.arange(len(low)), [len(s) for s in seen])
    second = np.concatenate([np.asarray(s, dtype=np.int64) for s in seen])
    larger = (reach[first] > reach[second]) | ((reach[first] == reach[second]) & (first < second))
    i, j = first[larger], second[larger]
    over = (np.minimum(high[i], high[j]) - np.maximum(low[i], low[j]) > tolerance).all(axis=1)
    return np.sort(np.column_stack((i[over], j[over])), axis=1)


def _depth(first: FloatArray, second: FloatArray) -> float:
    """Penetration of the second convex polygon behind the best separating edge of the first (m)."""
    along = np.roll(first, -1, axis=0) - first
    outward = np.column_stack((along[:, 1], -along[:, 0])) / np.hypot(*along.T)[:, None]
    return float(((first * outward).sum(axis=1) - (outward @ second.T).min(axis=1)).min())


class SharedEdges(NamedTuple):
    """Common edges of polygons a and b, m of them; the normal points from a to b."""

    a: IntArray  # (m,): polygons
    b: IntArray
    start: FloatArray  # (m, 2): ends (m), start to end along the tangent (normal_y, -normal_x)
    end: FloatArray
    normal: FloatArray  # (m, 2): unit vector
    edge_a: IntArray  # (m,): edge of a and of b, by the number of its first vertex
    edge_b: IntArray


def shared_edges(vertices: FloatArray, first_vertex: IntArray, tolerance: float) -> SharedEdges:
    """Common edges of all pairs of polygons, in time n log n.

    Edges are grouped by line; on each line, edges that face up and edges that face down are matched where their
    spans overlap. Lines closer than the tolerance (m) are one line, shorter common edges are left out.
    """
    sizes = np.diff(first_vertex)
    owner = np.repeat(np.arange(len(sizes)), sizes)
    following = np.arange(len(vertices)) + 1
    following[first_vertex[1:] - 1] = first_vertex[:-1]
    along = vertices[following] - vertices
    length = np.hypot(along[:, 0], along[:, 1])
    normal = np.column_stack((along[:, 1], -along[:, 0])) / length[:, None]  # outward
    # One normal for both sides of a line, pointing right or up; ``flip`` has the side of the block. Split directions at
    # an angle no joint has, so that rounding gives both sides of a line the same normal.
    forward, across = normal @ _UP_RIGHT, _cross(_UP_RIGHT, normal)
    flip = forward < 0
    line_normal = np.where(flip[:, None], -normal, normal)
    centre = vertices.mean(axis=0)
    angle = np.arctan2(np.where(flip, -across, across), np.abs(forward))
    reach = np.hypot(*np.ptp(vertices, axis=0))
    order = np.argsort(angle, kind="stable")
    direction = _numbered(order, np.diff(angle[order]) > tolerance / reach)
    offset = ((vertices - centre) * line_normal).sum(axis=1)
    line = _lines(direction, offset, tolerance)

    shared: list[tuple[IntArray, IntArray, FloatArray, FloatArray, FloatArray, IntArray, IntArray]] = []
    order = np.argsort(line, kind="stable")
    for members in np.split(order, np.flatnonzero(np.diff(line[order])) + 1):
        if flip[members].all() or not flip[members].any():
            continue
        n = line_normal[members[0]]
        tangent = np.array([n[1], -n[0]])
        ends = np.stack((vertices[members] @ tangent, vertices[following[members]] @ tangent))
        low, high = ends.min(axis=0), ends.max(axis=0)
        # the outward normal of block a is the normal of the line
        below, above = np.flatnonzero(~flip[members]), np.flatnonzero(flip[members])
        i, j = _overlaps(low, high, below, above, tolerance)
        s, e = np.maximum(low[below][i], low[above][j]), np.minimum(high[below][i], high[above][j])
        foot = vertices[members[0]] - (vertices[members[0]] @ tangent) * tangent
        a, b = members[below[i]], members[above[j]]
        ends_of = (foot + s[:, None] * tangent, foot + e[:, None] * tangent)
        shared.append((owner[a], owner[b], *ends_of, np.broadcast_to(n, (len(i), 2)), a, b))
    if not shared:
        none, nobody = np.empty((0, 2)), np.empty(0, np.int64)
        return SharedEdges(nobody, nobody, none, none, none, nobody, nobody)
    return SharedEdges(*(np.concatenate(column) for column in zip(*shared)))


def _lines(direction: IntArray, offset: FloatArray, tolerance: float) -> IntArray:
    """Line numbers of edges, by direction and offset."""
    order = np.lexsort((offset, direction))
    return _numbered(order, (np.diff(direction[order]) != 0) | (np.diff(offset[order]) > tolerance))


def _numbered(order: IntArray, begins: BoolArray) -> IntArray:
    """Numbers of groups in an order, at whose places from the second on a group begins or goes on."""
    number = np.empty(len(order), dtype=np.int64)
    number[order] = np.concatenate(([0], np.cumsum(begins)))
    return number


def _overlaps(
    low: FloatArray, high: FloatArray, below: IntArray, above: IntArray, tolerance: float
) -> tuple[IntArray, IntArray]:
    """Index pairs (into below, above) whose spans overlap by more than ``tolerance``."""
    rank = np.argsort(low[above], kind="stable")
    start, end = low[above][rank], high[above][rank]
    for side in (below, above):
        sequence = side[np.argsort(low[side], kind="stable")]
        if (low[sequence[1:]] < high[sequence[:-1]] - tolerance).any():
            raise InputError("two blocks overlap: they lie on the same side of one line and share part of it.")
    first = np.searchsorted(end, low[below] + tolerance, side="right")
    last = np.searchsorted(start, high[below] - tolerance, side="left")
    count = np.maximum(last - first, 0)
    i = np.repeat(np.arange(len(below)), count)
    within = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
    return i, rank[np.repeat(first, count) + within]
