"""The cracks of a wall, numbered, on the undeformed bricks, with a table of the widest."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from damagepred.damage.tracing import DPC_OPENING, DPC_SLIP
from damagepred.inputs.arguments import checked
from damagepred.plotting.categories import table_of
from damagepred.plotting.colours import CATEGORY_COLOURS, DPC_COLOUR, SLIP_COLOUR
from damagepred.plotting.geometry import corners, footing_blocks, polygons
from damagepred.plotting.rig import draw_bricks
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
from damagepred.results.tables import Table, crack_columns
from damagepred.results.wall_cracks import WallCracks, crack_frame

if TYPE_CHECKING:
    import pandas as pd


SHOWN = {"wall": 8, "below_dpc": 2, "dpc_opening": 2, "dpc_slip": 2}
"""Cracks of each part that get a number on the drawing and a row of the table: the widest."""

_THICKNESS = (1.0, 1.6, 2.4, 3.4, 4.6, 5.8)
"""Thickness of the line of a piece by its category (points)."""


@checked
def draw_cracks(ds: xr.Dataset, ax: Axes | None = None, increment: int = -1, traced: WallCracks | None = None) -> Axes:
    """Draw the cracks of a wall on the undeformed bricks, numbered, with colour and thickness by category.

    Parameters
    ----------
    ds : xarray.Dataset
        Result of one wall (``damagepred.solve``).
    ax : Axes, optional
        Axes to draw on; by default on a new figure.
    increment : int
        Position of the increment, -1 for the last.
    traced : WallCracks, optional
        Cracks of the same wall, if they have been traced already.

    Returns
    -------
    Axes
        Axes with collections labelled ``bricks``, ``cracks``, and where present ``through bricks``, ``dpc open`` and
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
    traced = WallCracks(ds) if traced is None else traced
    profile, cracks = traced.profile(increment), traced.dataset()
    points, block = corners(ds)
    ax = axes_or_new(ax, 10.0, height_to_scale(points, 2.2))
    below = footing_blocks(ds)[np.unique(block)]
    draw_bricks(ax, [shape for shape, of_footing in zip(polygons(points, block), below) if not of_footing])
    table = table_of(ds)
    segment = np.stack([profile[f"piece_{axis}_{end}"].values for end in ("start", "end") for axis in "xy"], axis=-1)
    segment = segment.reshape(-1, 2, 2)
    opening = profile["piece_opening"].values
    part_of = dict(zip(cracks["crack"].values.tolist(), cracks["crack_part"].values.tolist()))
    parts = np.array([part_of[int(n)] for n in profile["piece_crack"].values], dtype=np.int64)
    in_brick = np.isnan(opening)
    category = table.by_width(np.where(in_brick, 0.0, opening)).astype(np.int64)
    joint = (parts < DPC_OPENING) & ~in_brick
    lines = [
        ("dpc open", parts == DPC_OPENING, DPC_COLOUR, 3.2, "solid"),
        ("dpc slip", parts == DPC_SLIP, SLIP_COLOUR, 2.2, "solid"),
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
        of = f" (category {c})" if table.category_names else ""
        names = [f"below {edges[0]} mm", *(f"from {edge} mm" for edge in edges)]
        handles.insert(
            int(c),
            Line2D([], [], color=CATEGORY_COLOURS[c], linewidth=_THICKNESS[c], label=f"{names[c]}{of}"),
        )
    elevation(ax)
    ax.autoscale_view()
    ax.margins(0.03)
    _number(ax, traced, increment)
    if handles:
        legend_below(ax, handles, 4)
    hairline = f"{plain_number(cracks.attrs['hairline'] * MM)} mm"
    what = f"joints open or slid by more than {hairline}; colours by {table.name}"
    set_title(ax, title_of(ds, "wall"), f"cracks at {moved_to(ds, increment)}; {what}")
    return ax


def widest_of_each_part(frame: pd.DataFrame) -> pd.DataFrame:
    """Rows of the cracks that have a number on the drawing."""
    rank = frame.groupby("crack_part").cumcount()
    return frame[rank < frame["crack_part"].map(SHOWN)]


def _number(ax: Axes, traced: WallCracks, increment: int) -> None:
    """Write numbers beside the widest cracks, inside the axes and apart from each other."""
    frame = widest_of_each_part(crack_frame(traced.dataset(), increment))
    numbers: list[tuple[float, float]] = []
    apart = 0.035 * float(np.ptp(traced.ds["vertex_x"].values))
    (left, right), (bottom, top) = ax.get_xlim(), ax.get_ylim()
    for crack in frame.to_dict("records"):
        x, y = float(crack["crack_x"]), float(crack["crack_y"])
        ring = [
            (x + r * apart * np.cos(a), y + r * apart * np.sin(a))
            for r in (1.1, 2.2, 3.3, 4.4)
            for a in np.arange(8) * np.pi / 4 + np.pi / 8
        ]
        free = [p for p in ring if all(np.hypot(p[0] - a, p[1] - b) > apart for a, b in numbers)]
        inside = [p for p in free if left < p[0] < right and bottom < p[1] < top - 0.3 * apart]
        numbers.append([*inside, *free, ring[-1]][0])
        ax.annotate(
            str(crack["crack"]),
            (x, y),
            numbers[-1],
            fontsize=small(ax),
            ha="center",
            va="center",
            zorder=6,
            annotation_clip=False,
            bbox={"boxstyle": "circle,pad=0.2", "facecolor": "white", "edgecolor": "black", "linewidth": 0.6},
            arrowprops={"arrowstyle": "-", "linewidth": 0.6, "color": "black"},
        )


def cracks_sheet(ds: xr.Dataset, increment: int = -1) -> Figure:
    """Draw the cracks of a wall over a table of the widest."""
    traced = WallCracks(ds)
    frame = crack_frame(traced.dataset(), increment)
    listed = Table.brief("", crack_columns(widest_of_each_part(frame)))
    heads, rows = list(listed.columns), [list(row) for row in listed.rows]
    drawing, listing = height_to_scale(corners(ds)[0], 2.2), 0.23 * (len(rows) + 2) + 0.45
    figure = new_figure(10.0, drawing + listing)
    upper, lower = figure.subplots(2, 1, height_ratios=(drawing, listing))
    draw_cracks(ds, upper, increment, traced)
    lower.axis("off")
    if not rows:
        lower.text(0.0, 1.0, "nothing has opened or slid by more than a hairline", va="top", transform=lower.transAxes)
        return figure_of(upper)
    grid = lower.table(
        cellText=rows,
        colLabels=heads,
        cellLoc="right",
        loc="upper left",
        edges="horizontal",
        colWidths=_shares([*rows, heads]),
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
    """Widths of columns in proportion to their longest lines, adding up to 1."""
    letters = [2 + max(len(line) for cell in column for line in cell.split("\n")) for column in zip(*rows)]
    return [count / sum(letters) for count in letters]
