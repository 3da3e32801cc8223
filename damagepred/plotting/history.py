"""Widest crack and openings of the beds over the movement, with the damage categories."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from damagepred.archive.schema import is_dynamic
from damagepred.damage.cracks import HAIRLINE
from damagepred.enumerations import ContactKind
from damagepred.inputs.arguments import checked
from damagepred.plotting.categories import not_reached, shade_bands, table_of, width_scale
from damagepred.plotting.colours import CATEGORY_COLOURS, DPC_COLOUR, FOOTING_GAP_COLOUR
from damagepred.plotting.sheet import MM, axes_or_new, label_movement, legend_below, require, set_title, title_of
from damagepred.results.house import is_house
from damagepred.results.rejudge import shown_gaps
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
    table, in_stages = table_of(ds), "crack_width_worst" in ds.variables
    x = ds["time"].values if is_dynamic(ds) else ds[movement_measure(ds)].values * MM
    by = "time" if "time" in ds.variables else "increment"
    if in_stages:
        x = ds[by].values

    def width(name: str) -> np.ndarray:
        return ds[name].values * MM if name in ds.variables else np.zeros(len(x))

    crack, visible = width("crack_width_max"), HAIRLINE * MM
    has_dpc = "contact_kind" not in ds.variables or bool((ds["contact_kind"].values == ContactKind.DPC).any())
    has_footing = "contact_kind" in ds.variables and "footing" in shown_gaps(ds)
    category = ds["damage_category"].values
    colours = [CATEGORY_COLOURS[max(int(c), 0)] for c in category]
    label = f"widest crack{' above the dpc' * has_dpc}"
    ax.plot(x, crack, color="black", linewidth=1.6, zorder=4, label=label)
    ax.scatter(x, crack, c=colours, edgecolors="black", s=32, zorder=5, clip_on=False)
    marked: dict[str, Any] = {"linewidth": 1.6, "linestyle": "--", "markersize": 4, "zorder": 4}
    of_dpc, of_footing = (
        {**marked, "color": colour, "marker": marker}
        for colour, marker in ((DPC_COLOUR, "s"), (FOOTING_GAP_COLOUR, "^"))
    )
    thin: dict[str, Any] = {"linewidth": 1.2, "zorder": 3}
    drawn = [crack]
    if in_stages:
        ax.plot(x, width("crack_width_worst"), label="widest so far", color="0.55", **thin)
        for last in np.flatnonzero(np.diff(ds["progress"].values[:-1]) * np.diff(ds["progress"].values[1:]) < 0) + 1:
            ax.axvline(x[last], color="0.6", linewidth=0.8, linestyle=":")
    for name, known, least, label, style in (
        ("dpc_opening_max", has_dpc, -1.0, "widest dpc opening", of_dpc),
        (
            "crack_band_width_max",
            True,
            crack + visible,
            "widest crack band",
            thin | {"color": "black", "linestyle": "-."},
        ),
        ("footing_opening_max", has_footing, visible, "widest gap on the footing", of_footing),
        (
            "base_crack_width_max",
            True,
            visible,
            "widest crack below the dpc",
            thin | {"color": "0.35", "linestyle": ":"},
        ),
    ):
        values = width(name)
        if known and (values > least).any():
            ax.plot(x, values, label=label, **style)
            drawn.append(values)
    width_scale(ax, np.concatenate(drawn), table, "width")
    ax.set_xlim(0.0, max(float(x.max()) * 1.02, 1e-6))
    shade_bands(ax, table)
    if is_dynamic(ds):
        ax.set_xlabel("time (s)")
    elif in_stages:
        ax.set_xlabel(f"{'time (years)' if by == 'time' else by}; dotted: the movement turns")
    else:
        label_movement(ax, movement_words(ds))
    legend_below(ax, ax.get_legend_handles_labels()[0])
    bands = f"bands: crack widths by {table.name}; " if table.category_names else ""
    marks = f"marks on the black line: the wall's category{not_reached(ds, int(category.max()))}"
    set_title(ax, title_of(ds, "wall"), bands + marks)
    return ax
