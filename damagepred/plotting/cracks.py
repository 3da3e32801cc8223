"""The cracks of a wall, numbered, on the undeformed bricks."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from damagepred.arrays import BoolArray
from damagepred.damage.tracing import DPC_OPENING, DPC_SLIP
from damagepred.inputs.arguments import checked
from damagepred.plotting import sheet
from damagepred.plotting.colours import CATEGORY_COLOURS, DPC_COLOUR, SLIP_COLOUR, table_of
from damagepred.plotting.geometry import corners, footing_blocks, polygons
from damagepred.plotting.rig import draw_bricks
from damagepred.results.wall_cracks import WallCracks, crack_frame

SHOWN = {"wall": 8, "below_dpc": 2, "dpc_opening": 2, "dpc_slip": 2}
"""Cracks of each part that get a number on the drawing: the widest."""

_THICKNESS = (1.0, 1.6, 2.4, 3.4, 4.6, 5.8)  # thickness of the line of a piece by its category (points)


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
    ax = sheet.axes_or_new(ax, 10.0, sheet.height_to_scale(points, 2.2))
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
    lines: tuple[tuple[str, BoolArray, str, float, Any], ...] = (
        ("dpc open", parts == DPC_OPENING, DPC_COLOUR, 3.2, "solid"),
        ("dpc slip", parts == DPC_SLIP, SLIP_COLOUR, 2.2, "solid"),
        ("through bricks", in_brick, "black", 1.2, (0, (2, 1.5))),
    )
    handles = []
    for label, chosen, colour, thick, dashes in lines:
        if chosen.any():
            style = {"linewidths": thick, "linestyles": dashes, "zorder": 3, "label": label}
            sheet.add_lines(ax, segment[chosen], colors=colour, **style)
            handles.append(Line2D([], [], color=colour, linewidth=thick, linestyle=dashes, label=label))
    order = np.flatnonzero(joint)[np.argsort(opening[joint], kind="stable")]
    shades, widths = ([scale[c] for c in category[order]] for scale in (CATEGORY_COLOURS, _THICKNESS))
    sheet.add_lines(ax, segment[order], colors=shades, linewidths=widths, capstyle="round", zorder=4, label="cracks")
    edges = [sheet.plain_number(limit * sheet.MM) for limit in table.limits]
    names = [f"below {edges[0]} mm", *(f"from {edge} mm" for edge in edges)]
    for c in np.unique(category[joint]):
        label = names[c] + (f" (category {c})" if table.category_names else "")
        handles.insert(int(c), Line2D([], [], color=CATEGORY_COLOURS[c], linewidth=_THICKNESS[c], label=label))
    sheet.elevation(ax)
    ax.autoscale_view()
    ax.margins(0.03)
    _number(ax, traced, increment)
    if handles:
        sheet.legend_below(ax, handles, 4)
    hairline = f"{sheet.plain_number(cracks.attrs['hairline'] * sheet.MM)} mm"
    what = f"joints open or slid by more than {hairline}; colours by {table.name if table.category_names else 'width'}"
    sheet.set_title(ax, sheet.title_of(ds, "wall"), f"cracks at {sheet.moved_to(ds, increment)}; {what}")
    return ax


def _number(ax: Axes, traced: WallCracks, increment: int) -> None:
    """Write numbers beside the widest cracks, inside the axes and apart from each other."""
    frame = crack_frame(traced.dataset(), increment)
    frame = frame[frame.groupby("crack_part").cumcount() < frame["crack_part"].map(SHOWN)]
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
        style: dict[str, Any] = {"ha": "center", "va": "center", "zorder": 6, "annotation_clip": False}
        style["bbox"] = {"boxstyle": "circle,pad=0.2", "facecolor": "white", "edgecolor": "black", "linewidth": 0.6}
        style["arrowprops"] = {"arrowstyle": "-", "linewidth": 0.6, "color": "black"}
        ax.annotate(str(crack["crack"]), (x, y), numbers[-1], fontsize=sheet.small(ax), **style)
