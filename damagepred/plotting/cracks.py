"""The cracks of a wall, numbered, on the undeformed bricks, with a table of the widest."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from damagepred.arrays import FloatArray, IntArray
from damagepred.damage.growth import DPC_OPENING, DPC_SLIP
from damagepred.inputs.arguments import checked
from damagepred.plotting.categories import table_of
from damagepred.plotting.colours import BRICK_COLOURS, BRICK_EDGE, CATEGORY_COLOURS, DPC_COLOUR, SLIP_COLOUR
from damagepred.plotting.geometry import corners, footing_blocks, polygons
from damagepred.plotting.sheet import (
    MM,
    axes_or_new,
    elevation,
    figure_of,
    height_to_scale,
    legend_below,
    moved_to,
    new_figure,
    plain_number,
    set_title,
    small,
    title_of,
)
from damagepred.results.wall_cracks import WallCracks, crack_frame

if TYPE_CHECKING:
    import pandas as pd


SHOWN = {"wall": 8, "below_dpc": 2, "dpc_opening": 2, "dpc_slip": 2}
"""Cracks of each part that get a number on the drawing and a row of the table: the widest."""

_THICKNESS = (1.0, 1.6, 2.4, 3.4, 4.6, 5.8)
"""Of the line of a piece by its category (points)."""


@checked
def draw_cracks(ds: xr.Dataset, ax: Axes | None = None, increment: int = -1, known: WallCracks | None = None) -> Axes:
    """Draw the cracks of a wall where they run, coloured and as thick as the category of their width is high.

    Parameters
    ----------
    ds : xarray.Dataset
        Of one wall, as ``damagepred.solve`` returns it.
    ax : Axes, optional
        Where to draw; by default on a new figure.
    increment : int
        Position of the increment, -1 for the last.
    known : WallCracks, optional
        The cracks of the same wall, if they have been followed already.

    Returns
    -------
    Axes
        With collections labelled ``bricks``, ``cracks``, and if there are any ``through bricks``, ``dpc open`` and
        ``dpc slip``.

    Raises
    ------
    InputError
        If the dataset is not of one wall, or has no such increment.

    Examples
    --------
    >>> import damagepred, xarray
    >>> ax = damagepred.plotting.draw_cracks(xarray.open_dataset("wall.nc"))
    >>> ax.get_ylabel()
    'height (m)'
    """
    known = WallCracks(ds) if known is None else known
    profile, found = known.profile(increment), known.dataset()
    points, block = corners(ds)
    ax = axes_or_new(ax, 10.0, height_to_scale(points, 1.7, 3.4, 8.6))
    _draw_bricks(ax, ds, points, block)
    table = table_of(ds)
    segment = np.stack([profile[f"piece_{axis}_{end}"].values for end in ("start", "end") for axis in "xy"], axis=-1)
    segment = segment.reshape(-1, 2, 2)
    opening = profile["piece_opening"].values
    part_of = dict(zip(found["crack"].values.tolist(), found["crack_part"].values.tolist()))
    part = np.array([part_of[int(n)] for n in profile["piece_crack"].values], dtype=np.int64)
    in_brick = np.isnan(opening)
    category = table.by_width(np.where(in_brick, 0.0, opening)).astype(np.int64)
    joint = (part < DPC_OPENING) & ~in_brick
    lines = [
        ("dpc open", part == DPC_OPENING, DPC_COLOUR, 3.2, "solid"),
        ("dpc slip", part == DPC_SLIP, SLIP_COLOUR, 2.2, "solid"),
        ("through bricks", in_brick, "black", 1.2, (0, (2, 1.5))),
    ]
    handles = []
    for label, chosen, colour, thick, style in lines:
        if chosen.any():
            ax.add_collection(
                LineCollection(
                    list(segment[chosen]), colors=colour, linewidths=thick, linestyles=style, zorder=3, label=label
                )
            )
            handles.append(Line2D([], [], color=colour, linewidth=thick, linestyle=style, label=label))  # type: ignore[arg-type]
    order = np.flatnonzero(joint)[np.argsort(opening[joint])]
    ax.add_collection(
        LineCollection(
            list(segment[order]),
            colors=[CATEGORY_COLOURS[c] for c in category[order]],
            capstyle="round",
            linewidths=[_THICKNESS[c] for c in category[order]],
            zorder=4,
            label="cracks",
        )
    )
    edges = [plain_number(limit * MM) for limit in table.limits]
    for c in np.unique(category[joint]):
        names = [f"below {edges[0]} mm", *(f"from {edge} mm" for edge in edges)]
        handles.insert(
            int(c),
            Line2D([], [], color=CATEGORY_COLOURS[c], linewidth=_THICKNESS[c], label=f"{names[c]} (category {c})"),
        )
    _number(ax, known, increment)
    _finish(ax, ds, increment, handles, found.attrs["hairline"])
    return ax


def _draw_bricks(ax: Axes, ds: xr.Dataset, points: FloatArray, block: IntArray) -> None:
    footing = footing_blocks(ds)
    shapes = [shape for shape, own in zip(polygons(points, block), footing[np.unique(block)]) if not own]
    ax.add_collection(
        PolyCollection(
            shapes, facecolors=BRICK_COLOURS[3], edgecolors=BRICK_EDGE, linewidths=0.25, zorder=1, label="bricks"
        )
    )


def widest_of_each_part(frame: pd.DataFrame) -> pd.DataFrame:
    """Return the rows of the cracks that are numbered on the drawing."""
    rank = frame.groupby("crack_part").cumcount()
    return frame[rank < frame["crack_part"].map(SHOWN)]


def _number(ax: Axes, known: WallCracks, increment: int) -> None:
    """Write the numbers of the widest cracks where they are widest, moved apart where they would cover each other."""
    frame = widest_of_each_part(crack_frame(known.dataset(), increment))
    taken: list[tuple[float, float]] = []
    apart = 0.035 * float(np.ptp(known.ds["vertex_x"].values))
    for one in frame.to_dict("records"):
        x, y = float(one["crack_x"]), float(one["crack_y"])
        ring = [
            (x + r * apart * np.cos(a), y + r * apart * np.sin(a))
            for r in (1.1, 2.2, 3.3)
            for a in np.arange(8) * np.pi / 4 + np.pi / 8
        ]
        free = [p for p in ring if all(np.hypot(p[0] - a, p[1] - b) > apart for a, b in taken)]
        at = free[0] if free else ring[-1]
        taken.append(at)
        ax.annotate(
            str(one["crack"]),
            (x, y),
            at,
            fontsize=small(ax),
            ha="center",
            va="center",
            zorder=6,
            annotation_clip=False,
            bbox={"boxstyle": "circle,pad=0.2", "facecolor": "white", "edgecolor": "black", "linewidth": 0.6},
            arrowprops={"arrowstyle": "-", "linewidth": 0.6, "color": "black"},
        )


def _finish(ax: Axes, ds: xr.Dataset, increment: int, handles: list[Line2D], hairline: float) -> None:
    elevation(ax)
    ax.autoscale_view()
    ax.margins(0.03)
    if handles:
        legend_below(ax, handles, 4)
    what = f"joints open or slid by more than {plain_number(hairline * MM)} mm; colours by {table_of(ds).name}"
    set_title(ax, title_of(ds, "wall"), f"cracks at {moved_to(ds, increment)}; {what}")


def cracks_sheet(ds: xr.Dataset, increment: int = -1) -> Figure:
    """Draw the cracks of a wall over a table of the widest."""
    known = WallCracks(ds)
    frame = crack_frame(known.dataset(), increment)
    rows = [_row(one) for one in widest_of_each_part(frame).to_dict("records")]
    drawing, listing = min(height_to_scale(corners(ds)[0], 1.7, 3.4, 8.6), 8.0), 0.23 * (len(rows) + 2) + 0.45
    figure = new_figure(10.0, drawing + listing)
    upper, lower = figure.subplots(2, 1, height_ratios=(drawing, listing))
    draw_cracks(ds, upper, increment, known)
    lower.axis("off")
    if not rows:
        lower.text(0.0, 1.0, "nothing has opened or slid by more than a hairline", va="top", transform=lower.transAxes)
        return figure_of(upper)
    grid = lower.table(
        cellText=rows,
        colLabels=_COLUMNS,
        cellLoc="right",
        loc="upper left",
        edges="horizontal",
        colWidths=_shares([*rows, _COLUMNS]),
    )
    grid.auto_set_font_size(False)
    grid.set_fontsize(small(lower))
    for (line, _), cell in grid.get_celld().items():
        cell.set_linewidth(0.4)
        cell.set_height((2.0 if line == 0 else 1.0) / (len(rows) + 2.6))
    if len(frame) > len(rows):
        what = f"the widest of each part of the wall, {len(rows)} of {len(frame)}; `damagepred cracks` lists them all"
        lower.set_title(what, fontsize=small(lower), loc="left")
    return figure_of(upper)


def _shares(rows: Sequence[Sequence[str]]) -> list[float]:
    """Return widths of columns in proportion to their longest lines, adding up to 1."""
    letters = [2 + max(len(line) for cell in column for line in cell.split("\n")) for column in zip(*rows)]
    return [count / sum(letters) for count in letters]


_COLUMNS = (
    "crack",
    "part",
    "width\n(mm)",
    "normal to its\nline (mm)",
    "opening and\nslip (mm)",
    "length\n(m)",
    "how it runs",
    "widest at\nx, y (m)",
    "began\nat (mm)",
)


def _row(one: dict[Hashable, Any]) -> list[str]:
    runs = str(one["crack_orientation"])
    runs += f", {one['crack_inclination']:.0f}°" if runs in ("stepped", "diagonal") else ""
    branches = int(one["crack_branches"])
    runs += f", {branches} branch{'es' if branches > 1 else ''}" if branches else ""
    return [
        str(one["crack"]),
        str(one["crack_part"]).replace("_", " "),
        f"{one['crack_width'] * MM:.2f}",
        f"{one['crack_width_normal'] * MM:.2f}",
        f"{one['crack_displacement'] * MM:.2f}",
        f"{one['crack_length']:.2f}",
        runs + (", bricks" if one["crack_length_through_blocks"] > 0 else ""),
        f"{one['crack_x']:.2f}, {one['crack_y']:.2f}",
        f"{one.get('first_load_displacement', one['first_central_deflection']) * MM:.2f}",
    ]
