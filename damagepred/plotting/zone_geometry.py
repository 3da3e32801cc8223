"""Zones of deformable blocks: corners, areas, boundary edges, gridpoints as they have moved."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr

from damagepred.arrays import FloatArray, IntArray


def has_zones(ds: xr.Dataset) -> bool:
    """Whether zones are stored."""
    return "zone_state" in ds.variables


@dataclass(frozen=True)
class Zones:
    """Zones of a wall, before it has moved; g gridpoints, z zones.

    Attributes
    ----------
    points : array (g, 2)
        Gridpoints (m).
    corners : array of int (z, 3)
        Gridpoints of each zone.
    block : array of int (z,)
        Block of each zone.
    """

    points: FloatArray
    corners: IntArray
    block: IntArray

    @classmethod
    def of(cls, ds: xr.Dataset) -> Zones:
        """Read the zones of a dataset."""
        points = np.column_stack((ds["gridpoint_x"].values, ds["gridpoint_y"].values))
        return cls(points, ds["zone_gridpoint"].values.astype(np.int64), ds["zone_block"].values.astype(np.int64))

    @property
    def area(self) -> FloatArray:
        """Area of each zone (z,) (m2)."""
        a, b, c = (self.points[self.corners[:, k]] for k in range(3))
        return np.asarray(0.5 * ((b - a)[:, 0] * (c - a)[:, 1] - (c - a)[:, 0] * (b - a)[:, 1]), dtype=np.float64)

    def at_gridpoints(self, values: FloatArray) -> FloatArray:
        """Return values of the zones (z,) as means at the gridpoints (g,), weighted by area, each block on its own."""
        weight = np.repeat(self.area, 3)
        count = len(self.points)
        total = np.bincount(self.corners.ravel(), weight * np.repeat(values, 3), count)
        return np.asarray(total / np.bincount(self.corners.ravel(), weight, count))

    def rims(self) -> IntArray:
        """Return the gridpoints at both ends of every edge on a block's boundary, (r, 2)."""
        edges = np.concatenate([self.corners[:, [k, (k + 1) % 3]] for k in range(3)])
        key = edges.min(axis=1) * len(self.points) + edges.max(axis=1)
        _, first, count = np.unique(key, return_index=True, return_counts=True)
        return np.asarray(edges[first[count == 1]])
