"""Neighbour search: blocks near each boundary point (Verlet list with a skin)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from damagepred.arrays import FloatArray, IntArray
from damagepred.kernels.dynamics.contact import find_neighbours
from damagepred.solvers.dynamics.body_arrays import BodyArrays
from damagepred.solvers.dynamics.body_motion import BlockStrains, Motion

WIDE_BLOCK_RATIO = 4.0
"""Width over the median from which a block is a candidate for every point (1)."""


class NeighbourList(NamedTuple):
    """Blocks near each of p boundary points."""

    first: IntArray  # (p + 1,) start of each point's list
    polygon: IntArray  # (k,) neighbouring block
    edge: IntArray  # (k,) edge that the point's face looks at
    distance: FloatArray  # (k,) signed, at the last search (m)


class NeighbourSearch:
    """Neighbour search, repeated after points have moved far enough."""

    def __init__(self, bodies: BodyArrays, motion: Motion, skin: float, distance: float) -> None:
        self._bodies, self._motion, self._skin, self.distance = bodies, motion, skin, distance
        none = np.zeros(0, np.int64)
        self.neighbours = NeighbourList(np.zeros(len(bodies.points) + 1, np.int64), none, none, np.zeros(0))
        self.searched_at = np.zeros_like(motion.displacement)
        self.count = 0

    def update(self) -> None:
        """Search for neighbours at the present displacements."""
        if self.distance > 0.0:
            self.neighbours = neighbour_list(self._bodies, self._motion.pose, self._skin, self._motion.strains)
            self.searched_at[:] = self._motion.displacement
            self.count += 1

    def update_if_moved(self) -> None:
        """Search for neighbours if a point has moved by more than the distance since the last search."""
        if self.distance > 0.0 and self._largest_movement() > self.distance:
            self.update()

    def _largest_movement(self) -> float:
        """Upper bound of the movement of a point since the last search (m)."""
        moved = self._motion.displacement - self.searched_at
        base = np.array([*moved[-1, :2], 0.0])
        moved = np.abs(moved[:-1] - base)
        return float((moved[:, 0] + moved[:, 1] + self._bodies.radius * moved[:, 2]).max())


def neighbour_list(
    scene: BodyArrays, pose: FloatArray, margin: float, strains: BlockStrains | None = None
) -> NeighbourList:
    """Blocks nearer to each point than a margin."""
    points, edges = scene.points, scene.edges
    of_polygons = edges[: scene.first_edge[-1]]
    corner = world_coordinates(pose, of_polygons["body"], of_polygons["x"], of_polygons["y"])
    corners = np.diff(scene.first_edge)
    low = np.minimum.reduceat(corner, scene.first_edge[:-1])
    high = np.maximum.reduceat(corner, scene.first_edge[:-1])
    low[corners < 3], high[corners < 3] = -np.inf, np.inf  # the endless ground
    width = high[:, 0] - low[:, 0]
    is_wide = width > WIDE_BLOCK_RATIO * np.median(width)
    narrow = np.flatnonzero(~is_wide)
    narrow = narrow[np.argsort(low[narrow, 0], kind="stable")]
    x_points = world_coordinates(pose, points["body"], points["x"], points["y"])[:, 0].copy()
    first = np.zeros(len(points) + 1, dtype=np.int64)
    room = 8 * len(points)
    while True:
        polygon, edge, distance = np.empty(room, dtype=np.int64), np.empty(room, dtype=np.int64), np.empty(room)
        count = find_neighbours(
            scene,
            x_points,
            pose,
            strains,
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
            return NeighbourList(first=first, polygon=polygon[:count], edge=edge[:count], distance=distance[:count])
        room = count


def world_coordinates(pose: FloatArray, body: IntArray, x: FloatArray, y: FloatArray) -> FloatArray:
    """Positions of points of bodies, array (p, 2) (m)."""
    c, s = pose[body, 2], pose[body, 3]
    return np.column_stack((pose[body, 0] + c * x - s * y, pose[body, 1] + s * x + c * y))
