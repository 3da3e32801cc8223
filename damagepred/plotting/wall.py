"""The deformed wall: bricks, cracks by width, the dpc's opening, the footing."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import to_rgba_array
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from scipy.interpolate import PchipInterpolator

from damagepred.archive.schema import require
from damagepred.arrays import FloatArray
from damagepred.damage import DamageTable
from damagepred.damage.cracks import HAIRLINE
from damagepred.enumerations import ContactKind, PathStatus
from damagepred.inputs.arguments import checked
from damagepred.plotting import colours, sheet
from damagepred.plotting.colours import name_of, table_of
from damagepred.plotting.geometry import Deformed, Faces, ground_profile, settlement
from damagepred.plotting.rig import draw_footing_blocks, draw_rig, draw_soil, draw_test
from damagepred.scene.scene import archived_scene

DATUM = (0, (6, 4))  # dashes of the top of the footing before any movement


@checked
def draw_wall(
    ds: xr.Dataset, ax: Axes | None = None, increment: int = -1, exaggeration: float | None = None, slips: bool = False
) -> Axes:
    """Draw a deformed wall with its cracks coloured by width.

    Parameters
    ----------
    ds : xarray.Dataset
        Result of one wall (``damagepred.solve``).
    ax : Axes, optional
        Axes to draw on; by default on a new figure.
    increment : int
        Position of the increment, -1 for the last.
    exaggeration : float, optional
        Factor on all displacements; by default a round number that shows the largest as about 4.5 % of the
        wall's length.
    slips : bool
        Whether to mark closed joints that have slipped.

    Returns
    -------
    Axes
        Axes with collections labelled ``bricks`` and ``cracks``, and where present ``dpc opening``, ``control joints``
        and ``slips``.

    Examples
    --------
    >>> import damagepred, xarray
    >>> ax = damagepred.plotting.draw_wall(xarray.open_dataset("wall.nc"), increment=4)
    >>> ax.get_xlabel(), ax.get_ylabel()
    ('along the wall (m)', 'height (m)')
    """
    require(ds, ("damage_category",), "the result of one wall with all its fields (`damagepred solve`)")
    wall = Deformed.of(ds, increment, exaggeration)
    ax = sheet.axes_or_new(ax, 10.0, sheet.height_to_scale(wall.shape, 2.9))
    if wall.footing.any():
        draw_footing_blocks(ax, wall)
        _draw_datum(ax, *ground_profile(ds, increment)[:2])
        draw_soil(ax, wall)
        if "jack_load" in ds.variables:
            draw_rig(ax, wall)
    elif "load_force" in ds.variables:
        draw_test(ax, archived_scene(ds.attrs), float(ds["load_force"].values[increment]))
    else:
        _draw_ground(ax, ds, increment, wall.factor)
    # a fixed seed: the same wall always looks the same
    number = np.random.default_rng(1).integers(len(colours.BRICK_COLOURS), size=len(wall.footing))
    tones, bricks = [colours.BRICK_COLOURS[i] for i in number], np.flatnonzero(~wall.footing)
    faces, joints = wall.faces, wall.faces.joints
    halves = faces.pick(joints.kind == ContactKind.BRICK_JOINT)
    left, right = halves.joints.blocks.T.tolist()
    for first, second in zip(left, right):
        tones[second] = tones[first]
    # an upright brick among turned ones must not jump to whole pixels
    style: dict[str, Any] = {"edgecolors": colours.BRICK_EDGE, "linewidths": 0.35, "snap": False}
    shapes = [wall.outlines[i] for i in bricks]
    sheet.add_shapes(ax, shapes, facecolors=[tones[i] for i in bricks], zorder=2, label="bricks", **style)
    if len(left):
        whole = [tones[first] for first, crack in zip(left, halves.crack) if crack <= HAIRLINE]
        sheet.add_lines(ax, wall.unbroken[:, :2], colors=whole, linewidths=0.7, zorder=2.1)
    cracks = faces.pick(joints.is_masonry & (faces.crack > HAIRLINE))
    _draw_cracks(ax, wall.gaps(cracks), cracks.crack * sheet.MM, table_of(ds))
    lifted = wall.gaps(faces.pick(joints.is_footing & (faces.opening > HAIRLINE)))
    if wall.footing.any() and len(lifted):
        _draw_gaps(ax, lifted, to_rgba_array("black"), 0.7, "off the footing", 3)
    dpc = faces.pick(joints.is_dpc)
    if len(dpc.opening):
        gaps, is_open = wall.gaps(dpc), dpc.opening > HAIRLINE
        sheet.add_lines(ax, wall.middles(dpc), colors=colours.DPC_COLOUR, linewidths=0.7, zorder=3, label="dpc")
        if is_open.any():
            _draw_gaps(ax, gaps[is_open], to_rgba_array(colours.DPC_COLOUR), 0.9, "dpc opening", 3)
    control = wall.gaps(faces.pick(joints.kind == ContactKind.CONTROL_JOINT))
    if len(control):
        sheet.add_shapes(ax, control, facecolors="white", edgecolors="none", zorder=2.5)
        sides = np.concatenate((control[:, :2], control[:, 2:]))
        line: dict[str, Any] = {"colors": colours.CONTROL_JOINT_COLOUR, "linewidths": 1.3, "zorder": 3}
        sheet.add_lines(ax, sides, label="control joints", **line)
    slipped = wall.middles(faces.pick((joints.is_masonry | joints.is_dpc) & (faces.slip > HAIRLINE)))
    if slips and len(slipped):
        sheet.add_lines(ax, slipped, colors=colours.SLIP_COLOUR, linewidths=2.2, zorder=3.8, label="slips")
    sheet.elevation(ax)
    ax.margins(0.02)
    ax.autoscale_view()
    sheet.legend_below(ax, _legend(ds, increment, faces), 2, sheet.BELOW_BAR, left=True)
    category = int(ds["damage_category"].values[increment])
    words = f"at {sheet.moved_to(ds, increment)}, damage category {category} ({name_of(ds, category)})"
    early = "limit" in ds.attrs or ds.attrs.get("status", PathStatus.COMPLETE) != PathStatus.COMPLETE
    at_end = early and increment in (-1, ds.sizes["increment"] - 1)
    ending = str(ds.attrs.get("status_message", ds.attrs.get("status"))) if at_end else ""
    sheet.set_title(ax, sheet.title_of(ds, "wall"), words, wall.scale, ending)
    return ax


def _draw_cracks(ax: Axes, gaps: FloatArray, width: FloatArray, table: DamageTable) -> None:
    """Draw cracks (m, 4, 2) coloured by width (mm), the widest on top, and the colour bar."""
    palette, norm = colours.width_colours(table)
    order = np.argsort(width, kind="stable")
    lines = 1.0 + 0.35 * np.asarray(norm(width[order]), dtype=np.float64)
    _draw_gaps(ax, gaps[order], palette(norm(width[order])), lines, "cracks", 4)
    limits = [limit * sheet.MM for limit in table.limits]
    numbered = ", category in the bar" if table.category_names else ""
    bar = sheet.bar_below(ax, ScalarMappable(norm, palette), f"crack width (mm){numbered}")
    bar.ax.tick_params(which="both", length=0)
    bar.set_ticks(limits, labels=[sheet.plain_number(limit) for limit in limits])
    for category in range(palette.N if numbered else 0):
        ink, place = "white" if category > 2 else "black", ((category + 0.5) / palette.N, 0.5)
        style: dict[str, Any] = {"transform": bar.ax.transAxes, "ha": "center", "va": "center_baseline"}
        bar.ax.text(*place, str(category), fontsize=sheet.small(ax), color=ink, **style)


def _draw_gaps(
    ax: Axes, gaps: FloatArray, colour: FloatArray, line: FloatArray | float, label: str, zorder: float
) -> None:
    """Draw gaps (m, 4, 2): pale inside, a colour (m or 1, 4) along both faces, in lines of a width (m,) (points)."""
    colour = np.broadcast_to(colour, (len(gaps), 4))
    pale = _pale(colour)
    sheet.add_shapes(ax, gaps, facecolors=pale, edgecolors=pale, linewidths=0.4, zorder=zorder, label=label)
    faces = np.stack((gaps[:, :2], gaps[:, 2:]), axis=1).reshape(-1, 2, 2)
    widths = np.repeat(np.broadcast_to(line, len(gaps)), 2)
    style: dict[str, Any] = {"linewidths": widths, "capstyle": "round", "zorder": zorder + 0.1}
    sheet.add_lines(ax, faces, colors=np.repeat(colour, 2, axis=0), label=f"faces of {label}", **style)


def _pale(colour: FloatArray) -> FloatArray:
    """Colours (m, 4) mixed with white."""
    return np.column_stack((0.45 * colour[:, :3] + 0.55, colour[:, 3]))


def _draw_ground(ax: Axes, ds: xr.Dataset, increment: int, factor: float) -> None:
    x, height, rise = ground_profile(ds, increment)
    if len(x) < 2:
        return
    depth = 0.05 * float(np.ptp(ds["vertex_y"].values))
    # between contacts, as under a door, a smooth line
    along = np.union1d(x, np.linspace(x[0], x[-1], 121))
    top = PchipInterpolator(x, height + factor * rise)(along)
    style: dict[str, Any] = {"facecolor": colours.FOOTING_COLOUR, "edgecolor": "none", "zorder": 1}
    ax.fill_between(along, top, top - depth, label="footing", **style)
    ax.plot(along, top, color="#55595e", linewidth=1.0, zorder=1)
    _draw_datum(ax, x, height)


def _draw_datum(ax: Axes, x: FloatArray, height: FloatArray) -> None:
    """Draw the top of the footing before any movement."""
    if len(x) > 1:
        ax.plot(x[[0, -1]], height[[0, -1]], color="black", linewidth=0.7, linestyle=DATUM, zorder=3)


def _legend(ds: xr.Dataset, increment: int, faces: Faces) -> list[Line2D | Patch]:
    table, joints = table_of(ds), faces.joints
    parts, has_dpc = {"": joints.is_wall}, bool(joints.is_dpc.any())
    if has_dpc:
        parts = {" above the dpc": joints.is_wall, " below the dpc": joints.is_base}
    handles: list[Line2D | Patch] = []
    for where, chosen in parts.items():
        widest = float(faces.crack[chosen].max(initial=0.0))
        if widest > HAIRLINE:
            colour = colours.CATEGORY_COLOURS[int(table.by_width(widest))]
            handles.append(Line2D([], [], color=colour, linewidth=2.5, label=f"widest crack{where}: {_mm(widest)}"))
        else:
            handles.append(Line2D([], [], linestyle="none", label=f"no crack{where} wider than {_mm(HAIRLINE)}"))
    if has_dpc:
        opening = float(faces.opening[joints.is_dpc].max())
        label = f"dpc, opening at most {_mm(opening)}" if opening > HAIRLINE else "dpc, closed"
        pale = _pale(to_rgba_array(colours.DPC_COLOUR))[0]
        handles.append(Patch(facecolor=pale, edgecolor=colours.DPC_COLOUR, label=label))
    if (joints.kind == ContactKind.CONTROL_JOINT).any():
        most = [float(ds[f"control_joint_{way}_max"].values[increment]) for way in ("opening", "closing")]
        label = f"control joint, widened by at most {_mm(most[0])}, closed by at most {_mm(most[1])}"
        handles.append(Line2D([], [], color=colours.CONTROL_JOINT_COLOUR, linewidth=1.3, label=label))
    on_soil = bool((joints.kind == ContactKind.SOIL).any())
    if joints.is_footing.any():
        lifted = float(faces.opening[joints.is_footing].max())
        off = f"; wall off it by at most {_mm(lifted)}" if lifted > 2 * HAIRLINE else ""
        whole = on_soil or "jack_load" in ds.variables
        settled = settlement(ds)
        datum = "top of footing before any movement"
        if settled is not None:
            datum = f"datum: top of footing under dead load, settled by {sheet.plain_number(-settled * sheet.MM)} mm"
        handles.append(Patch(color=colours.FOOTING_COLOUR, label=f"{'' if whole else 'top of '}footing{off}"))
        handles.append(Line2D([], [], color="black", linewidth=0.7, linestyle=DATUM, label=datum))
    if on_soil:
        label = "surface of the ground, pressed by the footing"
        handles.append(Line2D([], [], color=colours.SOIL_COLOUR, linewidth=1.4, label=label))
    return handles


def _mm(width: float) -> str:
    return f"{width * sheet.MM:.2f} mm"
