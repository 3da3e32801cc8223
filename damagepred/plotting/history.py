"""Widest crack and openings of the beds over the movement, with the damage categories."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from damagepred.archive.schema import is_dynamic, require
from damagepred.damage.cracks import HAIRLINE
from damagepred.inputs.arguments import checked
from damagepred.plotting import colours
from damagepred.plotting.colours import CATEGORY_COLOURS, DPC_COLOUR, FOOTING_GAP_COLOUR
from damagepred.plotting.sheet import MM, axes_or_new, label_movement, legend_below, set_title, title_of
from damagepred.results.house import is_house
from damagepred.results.rejudge import has_dpc, shown_gaps
from damagepred.uq.intensity import movement_measure, movement_words


@checked
def draw_history(ds: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Draw widest crack, crack band, dpc opening and gap on the footing against the movement, over the categories.

    A dynamic run is drawn against the time, a movement in stages against its time or increment, with the widest crack
    of the path up to there.

    The marks on the crack's line have the colour of the wall's category, which exceeds the crack's own category where
    a group of cracks counts. The axis is linear up to the first category's limit and logarithmic above.

    Parameters
    ----------
    ds : xarray.Dataset
        Result of one wall, or of a house: the largest of all walls (``damagepred.solve``).
    ax : Axes, optional
        Axes to draw on; by default on a new figure.

    Examples
    --------
    >>> import damagepred, xarray
    >>> ax = damagepred.plotting.draw_history(xarray.open_dataset("wall.nc"))
    >>> ax.get_xlabel()
    'central deflection (mm)'
    """
    needed = ("crack_width_max", "dpc_opening_max", "damage_category", *["central_deflection"] * (not is_house(ds)))
    require(ds, needed, "the result of one wall (`damagepred solve`)")
    ax = axes_or_new(ax, 8.5, 5.0)
    table, in_stages = colours.table_of(ds), "crack_width_worst" in ds.variables
    x = ds["time"].values if is_dynamic(ds) else ds[movement_measure(ds)].values * MM
    by = "time" if "time" in ds.variables else "increment"
    if in_stages:
        x = ds[by].values

    def width(name: str) -> np.ndarray:
        return ds[name].values * MM if name in ds.variables else np.zeros(len(x))

    crack, visible = width("crack_width_max"), HAIRLINE * MM
    gaps = shown_gaps(ds) if "contact_kind" in ds.variables else ["dpc"] * has_dpc(ds)
    category = ds["damage_category"].values
    marks = [CATEGORY_COLOURS[max(int(c), 0)] for c in category]
    label = f"widest crack{' above the dpc' * ('dpc' in gaps)}"
    ax.plot(x, crack, color="black", linewidth=1.6, zorder=4, label=label)
    ax.scatter(x, crack, c=marks, edgecolors="black", s=32, zorder=5, clip_on=False)
    marked: dict[str, Any] = {"linewidth": 1.6, "linestyle": "--", "markersize": 4, "zorder": 4}
    thin: dict[str, Any] = {"linewidth": 1.2, "zorder": 3}
    others: list[tuple[str, str, Any, dict[str, Any]]] = [  # variable, label, least width that is drawn, style
        ("dpc_opening_max", "widest dpc opening", -1.0, marked | {"color": DPC_COLOUR, "marker": "s"}),
        ("crack_band_width_max", "widest crack band", crack + visible, thin | {"color": "black", "linestyle": "-."}),
        (
            "footing_opening_max",
            "widest gap on the footing",
            visible,
            marked | {"color": FOOTING_GAP_COLOUR, "marker": "^"},
        ),
        ("base_crack_width_max", "widest crack below the dpc", visible, thin | {"color": "0.35", "linestyle": ":"}),
    ]
    drawn = [crack]
    if in_stages:
        ax.plot(x, width("crack_width_worst"), label="widest so far", color="0.55", **thin)
        for last in np.flatnonzero(np.diff(ds["progress"].values[:-1]) * np.diff(ds["progress"].values[1:]) < 0) + 1:
            ax.axvline(x[last], color="0.6", linewidth=0.8, linestyle=":")
    for name, label, least, style in others:
        values, bed = width(name), name.removesuffix("_opening_max")
        if (bed == name or bed in gaps) and (values > least).any():
            ax.plot(x, values, label=label, **style)
            drawn.append(values)
    colours.width_scale(ax, np.concatenate(drawn), table, "width")
    ax.set_xlim(0.0, max(float(x.max()) * 1.02, 1e-6))
    colours.shade_bands(ax, table)
    if is_dynamic(ds):
        ax.set_xlabel("time (s)")
    elif in_stages:
        ax.set_xlabel(f"{'time (years)' if by == 'time' else by}; dotted: the movement turns")
    else:
        label_movement(ax, movement_words(ds))
    legend_below(ax)
    bands = f"bands: crack widths by {table.name}; " if table.category_names else ""
    said = f"marks on the black line: the wall's category{colours.not_reached(ds, int(category.max()))}"
    set_title(ax, title_of(ds, "wall"), bands + said)
    return ax
