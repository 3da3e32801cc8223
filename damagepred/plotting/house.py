"""A house: its plan with the ground and the damage of its walls, and all walls unfolded."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.lines import Line2D

from damagepred.damage.cracks import HAIRLINE
from damagepred.plotting.categories import name_of, table_of
from damagepred.plotting.colours import BRICK_COLOURS, BRICK_EDGE, CATEGORY_COLOURS, FOOTING_COLOUR
from damagepred.plotting.deformed import Deformed
from damagepred.plotting.sheet import MM, axes_or_new, elevation, figure_of, set_title, small, title_of, verbatim
from damagepred.results.house import wall_dataset
from damagepred.scene import House
from damagepred.scene.scene import archived_scene

GRID = 61
"""Points of the ground along each axis of the plan."""
MARGIN = 0.2
"""Plan around the house, over its longer side (1)."""


def draw_plan(house: House, ds: xr.Dataset | None = None, ax: Axes | None = None) -> Axes:
    """Plan of a house on the movement of its ground; with its result, walls have the colour of their category."""
    ax, outline, mound = axes_or_new(ax, 8.0, 6.5), house.outline, house.mound
    margin = MARGIN * max(outline.size)
    low, high = np.array(outline.low) - margin, np.array(outline.high) + margin
    if mound.point is not None:
        source = np.array(mound.point)
        low, high = np.minimum(low, source - margin / 2), np.maximum(high, source + margin / 2)
    if mound.levels:  # known on the grid only
        points = np.array(mound.levels)[:, :2]
        low, high = np.maximum(low, points.min(axis=0)), np.minimum(high, points.max(axis=0))
    x, y = np.linspace(low[0], high[0], GRID), np.linspace(low[1], high[1], GRID)
    points = np.stack(np.meshgrid(x, y), axis=-1)
    inside = ((points >= np.array(outline.low)) & (points <= np.array(outline.high))).all(axis=-1)
    rise = MM * house.surface(points)
    if mound.shape in ("walsh", "mitchell") and min(outline.size) > 0.0:  # the mound ends with the house
        rise = np.where(inside, rise, np.nan)
    if np.nanmax(np.abs(rise)) > 0.0:
        most = float(np.nanmax(np.abs(rise)))
        ground = ax.contourf(x, y, rise, levels=12, cmap="BrBG", vmin=-most, vmax=most, alpha=0.55)
        figure_of(ax).colorbar(ground, ax=ax, label="movement of the ground, up positive (mm)", shrink=0.75)
    if mound.point is not None:
        ax.plot(*mound.point, "^", color="black", markersize=8)
        ax.annotate(mound.shape, mound.point, (6, 6), textcoords="offset points", fontsize=small(ax))
    category = np.zeros(len(house.wall), int) if ds is None else ds["wall_damage_category"].values[-1]
    for wall, c in zip(house.wall, category):
        colour = "#3c3c3c" if ds is None else CATEGORY_COLOURS[c]
        ax.plot(*zip(wall.start, wall.end), color=colour, linewidth=6.0, solid_capstyle="butt")
        for hole in wall.opening:
            ax.plot(*wall.points(np.array([hole.x, hole.right])).T, color="white", linewidth=3.0, solid_capstyle="butt")
        label = wall.name if ds is None else f"{wall.name}: {c}"
        level = abs(wall.direction[0]) > abs(wall.direction[1])  # its name lies along it
        place: dict[str, Any] = {"ha": "center", "va": "center", "rotation": 0 if level else 90, "fontsize": small(ax)}
        place |= {"xytext": tuple(12.0 * np.array([-1.0, 1.0]) * wall.direction[::-1]), "textcoords": "offset points"}
        ax.annotate(label, tuple(wall.points(np.array(0.5 * wall.length))), **place)
    ax.plot(*np.array([j.point for j in house.junctions]).reshape(-1, 2).T, "o", color="black", markersize=3.5)
    ax.set_aspect("equal")
    ax.set_xlabel("x (m)")
    ax.set_ylabel("y (m)")
    shown = sorted(set(category.tolist())) if ds is not None else []
    if ds is not None:
        lines = [Line2D([], [], color=CATEGORY_COLOURS[c], linewidth=5, label=f"{c} {name_of(ds, c)}") for c in shown]
        ax.legend(handles=lines, fontsize=small(ax), title="damage category", title_fontsize=small(ax))
    what = f"{len(house.wall)} walls, {len(house.junctions)} corners and T-joints"
    set_title(ax, verbatim(house.title), what)
    return ax


def draw_unfolded(ds: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Walls of a house side by side at the end of their path, with cracks in the colour of their category."""
    house = archived_scene(ds.attrs)
    assert isinstance(house, House)
    length = sum(wall.length for wall in house.wall)
    gap, height = 0.04 * length, max(wall.height for wall in house.wall)
    width = length + gap * (len(house.wall) - 1)
    ax = axes_or_new(ax, 14.0, min(max(14.0 * 1.5 * height / width + 1.5, 3.0), 9.0))
    parts = [wall_dataset(ds, wall.name) for wall in house.wall]
    factor = min(Deformed.of(part, -1, None).factor for part in parts)
    table, left = table_of(ds), 0.0
    for number, (wall, part) in enumerate(zip(house.wall, parts)):
        drawn, shift = Deformed.of(part, -1, factor), np.array([left, 0.0])
        for chosen, colour in ((~drawn.footing, BRICK_COLOURS[number % 2]), (drawn.footing, FOOTING_COLOUR)):
            shapes = [drawn.outlines[i] + shift for i in np.flatnonzero(chosen)]
            ax.add_collection(PolyCollection(shapes, facecolors=colour, edgecolors=BRICK_EDGE, linewidths=0.3))
        faces = drawn.faces
        cracks = faces.pick(faces.is_mortar & (faces.crack > HAIRLINE))
        gaps = drawn.gaps(cracks) + shift
        colours = [CATEGORY_COLOURS[int(c)] for c in table.by_width(cracks.crack)]
        lines = list((gaps[:, :2] + gaps[:, [3, 2]]) / 2)
        ax.add_collection(LineCollection(lines, colors=colours, linewidths=2.0, zorder=4, label=f"cracks {wall.name}"))
        width, category = MM * float(part["crack_width_max"][-1]), int(part["damage_category"][-1])
        words = f"{wall.name}: {width:.2f} mm, category {category}"
        ax.text(left + 0.5 * wall.length, 1.08 * height, words, ha="center", va="bottom", fontsize=small(ax))
        left += wall.length + gap
    elevation(ax)
    ax.update_datalim([(0.0, 1.35 * height)])
    ax.autoscale_view()
    ax.set_xlabel("walls side by side, each from its start (m)")
    worst = int(ds["damage_category"][-1])
    damaged = f"{int(ds['damaged_walls'][-1])} of {len(house.wall)} walls are damaged"
    set_title(ax, title_of(ds, "house"), f"worst wall: category {worst} ({name_of(ds, worst)}); {damaged}", drawn.scale)
    return ax
