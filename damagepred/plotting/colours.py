"""Colours and line styles of all pictures, and categories of damage as they show them: limits, names, bands."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import xarray as xr
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, Colormap, ListedColormap, Normalize
from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

from damagepred.archive.schema import flag_name
from damagepred.arrays import FloatArray
from damagepred.damage import DamageTable, load_table
from damagepred.plotting.sheet import MM, plain_number, small, verbatim
from damagepred.results.rejudge import archived_rules

CATEGORY_COLOURS = ("#8f8f8f", "#f0ab00", "#e4600f", "#b3152b", "#5c0f55", "#000000")
"""Categories 0, 1, ...: warm and ever darker, distinct in grey and to the colour-blind."""
BRICK_COLOURS = ("#efe2d6", "#ead9ca", "#e6d2c1", "#f2e7dd")
"""Tones of the bricks: pale, so that cracks stand out."""
BRICK_EDGE = "#a98f7c"
DPC_COLOUR = "#0072b2"
CONTROL_JOINT_COLOUR = "#3b3b8f"
SLIP_COLOUR = "#cc79a7"
FOOTING_COLOUR, FOOTING_EDGE = "#b9bcc0", "#85898e"
FOOTING_GAP_COLOUR = "#009e73"
"""Gap between the wall and its footing."""
SOIL_COLOUR = "#8c6d46"
RIG_COLOUR = "#22262a"
OUTLINE_COLOUR = "#00000030"
"""Outlines of blocks under a field."""
ZONE_STATES = (
    ("elastic", "#ece7e1"),
    ("yields in shear", "#d55e00"),
    ("yields in tension", "#0072b2"),
    ("yields in shear and tension", "#5c0f55"),
    ("elastic, has yielded before", "#f0c97a"),
)
"""Name and colour of each value of ``zone_state``."""
STATE_COLOURS = ("#d8d2cb", "#b3152b", "#cc79a7")
"""Values of ``contact_state``: intact, cracked, slipping."""
RANK_COLOURS, SHARE_COLOURS = ("#08519c", "#6baed6"), ("#a63603", "#fd8d3c")
"""Rank correlations (plain, partial) and shares of variance (first order, total)."""
OPENING_STYLES = tuple(zip(("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#000000", "#e69f00"), "os^DvP"))
"""Colour and marker of each window or door."""
CURVE_STYLES = ("-", "--", "-.", (0, (1, 1)), (0, (5, 1, 1, 1, 1, 1)))
"""Line style of fragility curves in their order, beside their colour."""


def field_colours(values: FloatArray) -> tuple[Colormap, Normalize]:
    """Colours of a field: blue below and red above zero where it has both signs, otherwise from pale to dark."""
    low, high = float(values.min(initial=0.0)), float(values.max(initial=0.0))
    reach = max(-low, high) or 1.0
    if low < -0.02 * reach and high > 0.02 * reach:
        return colormaps["RdBu_r"], Normalize(-reach, reach)
    return (colormaps["Blues_r"], Normalize(low, 0.0)) if -low > high else (colormaps["Reds"], Normalize(0.0, reach))


def width_colours(table: DamageTable) -> tuple[ListedColormap, BoundaryNorm]:
    """Colour map and norm for crack widths in mm, one colour per category."""
    limits = [limit * MM for limit in table.limits]
    # the outer fields have no end; these only give the colour bar as many fields as there are categories
    boundaries = [0.0, *limits, 2.0 * limits[-1]]
    colours = ListedColormap(list(CATEGORY_COLOURS[: len(limits) + 1]), name="damage categories")
    return colours, BoundaryNorm(boundaries, colours.N, clip=True)


def table_of(ds: xr.Dataset) -> DamageTable:
    """Damage table of a dataset; for states by other measures than a width AS 2870 without names, for widths alone."""
    table = archived_rules(ds).table
    return table if table.draws_widths else replace(load_table("as2870"), category_names=())


def name_of(ds: xr.Dataset, category: int) -> str:
    """Name of a category from the flag meanings of ``damage_category``."""
    return verbatim(flag_name(ds, category))


def shade_bands(ax: Axes, table: DamageTable) -> None:
    """Shade the range of widths of each category on the vertical axis, and number the bands at the right edge."""
    if not table.category_names:
        return
    low, high = ax.get_ylim()
    edges = [0.0, *(limit * MM for limit in table.limits), np.inf]
    for category, (lower, upper) in enumerate(pairwise(edges)):
        if lower >= high:
            break
        bottom, top = max(lower, low), min(upper, high)
        ax.axhspan(bottom, top, color=CATEGORY_COLOURS[category], alpha=0.13, linewidth=0, zorder=0)
        if category:
            ax.axhline(lower, color=CATEGORY_COLOURS[category], linewidth=0.8, zorder=1)
        points = ax.transData.transform([(0.0, bottom), (0.0, top)])
        middle = float(ax.transData.inverted().transform(points.mean(axis=0))[1])  # on paper
        place: dict[str, Any] = {"xycoords": ("axes fraction", "data"), "textcoords": "offset points", "va": "center"}
        ax.annotate(f"{category} {table.category_names[category]}", (1.0, middle), (4, 0), fontsize=small(ax), **place)


def width_scale(ax: Axes, widths: Sequence[float] | FloatArray, table: DamageTable, what: str) -> None:
    """Scale and name the vertical axis for widths of many mm: linear to the first limit, logarithmic above."""
    limits = [limit * MM for limit in table.limits]
    values = np.asarray(widths, dtype=np.float64)
    largest = float(np.max(values[np.isfinite(values)], initial=0.0))
    top = next((limit for limit in limits[1:] if limit > largest), 2 * limits[-1])
    while top < 1.15 * largest:
        top *= 1.5
    ax.set_yscale("symlog", linthresh=limits[0], linscale=0.6)
    ax.set_ylim(0.0, top * 1.15)
    marks = {0.0, *limits, 0.3, 3.0, 10.0, 30.0, 100.0, 300.0, 1000.0}
    ax.yaxis.set_major_locator(FixedLocator(sorted(mark for mark in marks if mark <= top * 1.15)))
    ax.yaxis.set_major_formatter(FuncFormatter(lambda value, _: plain_number(value)))
    ax.yaxis.set_minor_locator(NullLocator())
    ax.set_ylabel(f"{what} (mm), logarithmic above {plain_number(limits[0])}")


def not_reached(ds: xr.Dataset, reached: int) -> str:
    """Categories above the highest reached in words, empty without any."""
    highest = highest_of(ds)
    if reached >= highest:
        return ""
    missing = f"category {highest}" if reached == highest - 1 else f"categories {reached + 1} to {highest}"
    return f"; not reached: {missing}"


def highest_of(ds: xr.Dataset) -> int:
    """Highest category of the damage table, also of archives that do not state it."""
    return int(ds.attrs.get("highest_category", archived_rules(ds).table.highest))
