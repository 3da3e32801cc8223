"""Zones of deformable blocks on the deformed wall: where they are, and what yields in them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgba_array
from matplotlib.patches import Patch

from damagepred.arguments import checked
from damagepred.arrays import FloatArray, IntArray
from damagepred.plotting.deformed import Deformed, add_magnification
from damagepred.plotting.sheet import axes_or_new, below, require, set_title

STATES = (
    ("elastic", "#ece7e1"),
    ("yields in shear", "#d55e00"),
    ("yields in tension", "#0072b2"),
    ("yields in shear and tension", "#5c0f55"),
    ("elastic, has yielded before", "#f0c97a"),
)
"""What is drawn for each value of ``zone_state``, and its colour."""


def has_zones(ds: xr.Dataset) -> bool:
    """Tell whether zones are stored."""
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


def moved_gridpoints(ds: xr.Dataset, zones: Zones, increment: int, factor: float) -> FloatArray:
    """Return where the gridpoints are drawn (g, 2) (m), displacements multiplied by a factor."""
    moved = [ds[f"gridpoint_displacement_{axis}"].values[increment] for axis in "xy"]
    return np.asarray(zones.points + factor * np.column_stack(moved))


@checked
def draw_zone_states(
    ds: xr.Dataset, ax: Axes | None = None, increment: int = -1, exaggeration: float | None = None
) -> Axes:
    """Draw what yields in the zones of the deformable blocks, on the deformed wall.

    Parameters
    ----------
    ds : xarray.Dataset
        Of one wall with zones, as ``damagepred.solve`` returns it.
    ax : Axes, optional
        Where to draw; by default on a new figure.
    increment : int
        Position of the increment, -1 for the last.
    exaggeration : float, optional
        Factor on all displacements; by default a round number.

    Raises
    ------
    InputError
        If the dataset has no zones, or no such increment.
    """
    require(ds, ("zone_state",), "the result of a wall with deformable blocks (`[solver] blocks`), zones stored")
    wall = Deformed.of(ds, increment, exaggeration)
    ax = axes_or_new(ax, 10.0, wall.sheet_height(2.3))
    wall.draw_rigid(ax, "white")
    zones = Zones.of(ds)
    shape = moved_gridpoints(ds, zones, increment, wall.factor)
    state = ds["zone_state"].values[increment].astype(np.int64)
    colours = to_rgba_array([colour for _, colour in STATES])
    ax.add_collection(
        PolyCollection(
            list(shape[zones.corners]),
            facecolors=colours[state],
            edgecolors=colours[state],
            linewidths=0.1,
            zorder=2,
            label="zones",
        )
    )
    wall.draw_outlines(ax)
    wall.draw_cracks(ax)
    wall.finish(ax)
    add_magnification(ax, wall)
    count = np.bincount(state, minlength=len(STATES))
    ax.legend(
        handles=[
            Patch(facecolor=colour, edgecolor="0.6", linewidth=0.5, label=f"{name}: {number}")
            for (name, colour), number in zip(STATES, count)
            if number
        ],
        loc="upper left",
        bbox_to_anchor=(0.0, 0.0),
        bbox_transform=below(ax, 0.65),
        ncols=3,
        frameon=False,
        fontsize="small",
        borderaxespad=0.0,
    )
    set_title(ax, wall.title, f"zones that yield at {wall.movement}; {wall.scale}")
    return ax
