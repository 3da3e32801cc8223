"""Neighbour search: the blocks near each boundary point (Verlet list with a skin)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from damagepred.arrays import FloatArray, IntArray
from damagepred.kernels.dynamics.detection import find_neighbours
from damagepred.solvers.dynamics.body_arrays import BodyArrays


class NeighbourList(NamedTuple):
    """Blocks near each of p boundary points.

    Attributes
    ----------
    first : array of int (p + 1,)
        Where the list of each point begins.
    polygon, edge : array of int (k,), distance : array (k,)
        Neighbouring block, its edge that the point's face looks at, and signed distance to it at the last search (m).
    """

    first: IntArray
    polygon: IntArray
    edge: IntArray
    distance: FloatArray


def empty_neighbour_list(scene: BodyArrays) -> NeighbourList:
    """Return a list without neighbours."""
    none = np.zeros(0, np.int64)
    return NeighbourList(np.zeros(len(scene.points) + 1, np.int64), none, none, np.zeros(0))


def neighbour_list(scene: BodyArrays, pose: FloatArray, margin: float, wide: float) -> NeighbourList:
    """Return the blocks nearer to each point than a margin.

    Parameters
    ----------
    scene : BodyArrays
        Points and edges.
    pose : array (bodies, 4)
        x, y (m), cosine and sine of the rotation of each body.
    margin : float
        Distance of neighbours (m).
    wide : float
        Width over the median from which a block is tried for every point (1).
    """
    points, edges = scene.points, scene.edges
    own = edges[: scene.first_edge[-1]]
    corner = world_coordinates(pose, own["body"], own["x"], own["y"])
    corners = np.diff(scene.first_edge)
    low = np.minimum.reduceat(corner, scene.first_edge[:-1])
    high = np.maximum.reduceat(corner, scene.first_edge[:-1])
    low[corners < 3], high[corners < 3] = -np.inf, np.inf  # the ground: a line without end
    width = high[:, 0] - low[:, 0]
    is_wide = width > wide * np.median(width)
    narrow = np.flatnonzero(~is_wide)
    narrow = narrow[np.argsort(low[narrow, 0], kind="stable")]
    left = world_coordinates(pose, points["body"], points["x"], points["y"])[:, 0].copy()
    first = np.zeros(len(points) + 1, dtype=np.int64)
    room = 8 * len(points)
    while True:
        polygon, edge, distance = np.empty(room, dtype=np.int64), np.empty(room, dtype=np.int64), np.empty(room)
        count = find_neighbours(
            scene,
            left,
            pose,
            low,
            high,
            narrow,
            low[narrow, 0].copy(),
            float(width[narrow].max(initial=0.0)),
            np.flatnonzero(is_wide),
            margin,
            first,
            polygon,
            edge,
            distance,
        )
        if count <= room:
            return NeighbourList(first, polygon[:count], edge[:count], distance[:count])
        room = count


def world_coordinates(pose: FloatArray, body: IntArray, x: FloatArray, y: FloatArray) -> FloatArray:
    """Return the positions of points of bodies, array (p, 2) (m).

    Parameters
    ----------
    pose : array (bodies, 4)
        x, y (m), cosine and sine of the rotation of each body.
    body : array of int (p,)
        Body of each point.
    x, y : array (p,)
        Coordinates in its frame (m).
    """
    c, s = pose[body, 2], pose[body, 3]
    return np.column_stack((pose[body, 0] + c * x - s * y, pose[body, 1] + s * x + c * y))
