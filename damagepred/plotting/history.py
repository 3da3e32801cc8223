"""Widest crack and dpc opening as the ground moves."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from damagepred.arguments import checked
from damagepred.damage.cracks import HAIRLINE
from damagepred.enumerations import ContactKind
from damagepred.plotting.categories import shade_bands, table_of, width_scale
from damagepred.plotting.colours import CATEGORY_COLOURS, DPC_COLOUR, FOOTING_GAP_COLOUR
from damagepred.plotting.sheet import (
    MM,
    axes_or_new,
    label_movement,
    legend_below,
    require,
    set_title,
    title_of,
)
from damagepred.rejudge import shown_gaps
from damagepred.uq.fragility import movement_measure


@checked
def draw_history(ds: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Draw widest crack, crack band, dpc opening and gap on the footing against the movement, over the categories.

    On a mound they are drawn against the movement of the ground's surface, of a run in time against the time.

    The marks on the crack's line have the colour of the wall's category, which may be higher than the crack's own
    where a group of cracks counts. The axis is linear up to the first category's limit and logarithmic above.

    Parameters
    ----------
    ds : xarray.Dataset
        Of one wall, as ``damagepred.solve`` returns it.
    ax : Axes, optional
        Where to draw; by default on a new figure.

    Raises
    ------
    InputError
        If the dataset is not of one wall.
    """
    require(
        ds,
        ("crack_width_max", "dpc_opening_max", "central_deflection", "damage_category"),
        "the result of one wall (`damagepred solve`)",
    )
    ax = axes_or_new(ax, 8.5, 5.0)
    table = table_of(ds)
    in_time = "time" in ds.variables
    measure = movement_measure(ds)
    x = ds["time"].values if in_time else ds[measure].values * MM
    crack, dpc = ds["crack_width_max"].values * MM, ds["dpc_opening_max"].values * MM
    has_dpc = "contact_kind" not in ds.variables or bool((ds["contact_kind"].values == ContactKind.DPC).any())
    band = ds["crack_band_width_max"].values * MM if "crack_band_width_max" in ds.variables else crack
    has_footing = "contact_kind" in ds.variables and "footing" in shown_gaps(ds)
    footing = ds["footing_opening_max"].values * MM if has_footing else np.zeros_like(x)
    base = ds["base_crack_width_max"].values * MM if "base_crack_width_max" in ds.variables else np.zeros_like(x)
    has_base = bool(base.max(initial=0.0) > HAIRLINE * MM)
    category = ds["damage_category"].values
    ax.plot(
        x, crack, color="black", linewidth=1.6, zorder=4, label="widest crack" + (" above the dpc" if has_dpc else "")
    )
    ax.scatter(
        x,
        crack,
        c=[CATEGORY_COLOURS[max(int(c), 0)] for c in category],
        edgecolors="black",
        s=32,
        zorder=5,
        clip_on=False,
    )
    if has_dpc:
        ax.plot(
            x,
            dpc,
            color=DPC_COLOUR,
            linewidth=1.6,
            linestyle="--",
            marker="s",
            markersize=4,
            zorder=4,
            label="widest dpc opening",
        )
    if (band > crack + HAIRLINE * MM).any():
        ax.plot(x, band, color="black", linewidth=1.2, linestyle="-.", zorder=3, label="widest crack band")
    if footing.max(initial=0.0) > HAIRLINE * MM:
        ax.plot(
            x,
            footing,
            color=FOOTING_GAP_COLOUR,
            linewidth=1.6,
            linestyle="--",
            marker="^",
            markersize=4,
            zorder=4,
            label="widest gap on the footing",
        )
    if has_base:
        ax.plot(x, base, color="0.35", linewidth=1.2, linestyle=":", zorder=3, label="widest crack below the dpc")
    drawn = np.concatenate((crack, band, footing, dpc if has_dpc else crack, base if has_base else crack))
    width_scale(ax, drawn, table)
    ax.set_xlim(0.0, max(float(x.max()) * 1.02, 1e-6))
    shade_bands(ax, table)
    if in_time:
        ax.set_xlabel("time (s)")
    else:
        label_movement(ax, measure)
    ax.set_ylabel("width (mm)")
    legend_below(ax, ax.get_legend_handles_labels()[0])
    set_title(
        ax,
        title_of(ds, "wall"),
        f"bands: crack widths by {table.name}; marks on the black line: the wall's category",
    )
    return ax
