"""Zones of deformable blocks on the deformed wall: where they are, and what yields in them."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgba_array
from matplotlib.patches import Patch

from damagepred.inputs.arguments import checked
from damagepred.plotting.colours import ZONE_STATES
from damagepred.plotting.deformed import Deformed
from damagepred.plotting.sheet import axes_or_new, legend_below, require, set_title


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

    Examples
    --------
    >>> import damagepred, xarray
    >>> ax = damagepred.plotting.draw_zone_states(xarray.open_dataset("zones.nc"))
    >>> ax.get_xlabel()
    'along the wall (m)'
    """
    require(ds, ("zone_state",), "the result of a wall with deformable blocks (`[solver] blocks`), zones stored")
    wall = Deformed.of(ds, increment, exaggeration)
    ax = axes_or_new(ax, 10.0, wall.sheet_height(2.3))
    wall.draw_rigid(ax, "white")
    state = ds["zone_state"].values[increment].astype(np.int64)
    colours = to_rgba_array([colour for _, colour in ZONE_STATES])
    ax.add_collection(
        PolyCollection(
            list(wall.gridpoints[wall.zones.corners]),
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
    count = np.bincount(state, minlength=len(ZONE_STATES))
    handles = [
        Patch(facecolor=colour, edgecolor="0.6", linewidth=0.5, label=f"{name}: {number}")
        for (name, colour), number in zip(ZONE_STATES, count)
        if number
    ]
    legend_below(ax, handles, 3, 0.65, left=True)
    set_title(ax, wall.title, f"zones that yield at {wall.movement}", wall.scale)
    return ax
