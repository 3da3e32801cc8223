"""A house: plan with the ground and the damage of its walls, walls unfolded, and an axonometric drawing."""

from __future__ import annotations

import textwrap
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from damagepred.arrays import FloatArray, IntArray
from damagepred.damage.cracks import HAIRLINE
from damagepred.plotting import sheet
from damagepred.plotting.colours import BRICK_COLOURS, BRICK_EDGE, CATEGORY_COLOURS, FOOTING_COLOUR, name_of, table_of
from damagepred.plotting.geometry import Deformed, Faces, polygons
from damagepred.plotting.sheet import MM, small
from damagepred.results.house import house_of, unfolded, unfolded_places
from damagepred.scene import House
from damagepred.scene.plan import PlanWall

GRID = 61  # points of the ground along each axis of the plan
BOX = {"boxstyle": "round,pad=0.15", "facecolor": "white", "edgecolor": "none", "alpha": 0.8}
"""Box behind words on bricks."""
MARGIN = 0.2  # plan around the house, over its longer side (1)


def draw_plan(house: House, ds: xr.Dataset | None = None, ax: Axes | None = None) -> Axes:
    """Plan of a house on the movement of its ground; with its result, walls have the colour of their category."""
    ax, outline, mound = sheet.axes_or_new(ax, 8.0, 6.5), house.outline, house.mound
    margin = MARGIN * max(outline.size)
    low, high = np.array(outline.low) - margin, np.array(outline.high) + margin
    sources = [(one.shape, one.point) for one in (mound, *house.source) if one.point is not None]
    for _, point in sources:
        low, high = np.minimum(low, np.array(point) - margin / 2), np.maximum(high, np.array(point) + margin / 2)
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
        sheet.figure_of(ax).colorbar(ground, ax=ax, label="movement of the ground, up positive (mm)", shrink=0.75)
    for shape, point in sources:
        ax.plot(*point, "^", color="black", markersize=8)
        ax.annotate(shape, point, (6, 6), textcoords="offset points", fontsize=small(ax))
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
        number = house.names.index(wall.name)
        cuts = [x for j in house.junctions for w, x in zip(j.walls, j.x) if w == number]
        start, end = max(pairwise(sorted({0.0, wall.length, *cuts})), key=lambda bay: bay[1] - bay[0])
        ax.annotate(label, tuple(wall.points(np.array(0.5 * (start + end)))), **place)
    ax.plot(*np.array([j.point for j in house.junctions]).reshape(-1, 2).T, "o", color="black", markersize=3.5)
    ax.set_aspect("equal")
    ax.set_xlabel("x (m)")
    ax.set_ylabel("y (m)")
    if ds is not None:
        _category_legend(ds, ax, category, 0.5)
    what = f"{len(house.wall)} walls, corners and T-joints: {len(house.junctions)}"
    sheet.set_title(ax, sheet.verbatim(house.title), what)
    return ax


def draw_unfolded(ds: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Walls of a house side by side at the end, cracks in the colour of their category, with the widest of each."""
    house, drawn = house_of(ds), Deformed.of(unfolded(ds), -1, None)
    places = unfolded_places(house)
    ax = sheet.axes_or_new(ax, 10.0, sheet.height_to_scale(drawn.shape, 2.0))
    ax.set_xlim(min(0.0, drawn.shape[:, 0].min()) - 0.2, drawn.shape[:, 0].max() + 0.2)
    line = small(ax) * float(np.ptp(ax.get_xlim())) / (72.0 * ax.bbox.width / sheet.figure_of(ax).dpi)  # of text (m)
    for chosen, colour in ((~drawn.footing, BRICK_COLOURS[0]), (drawn.footing, FOOTING_COLOUR)):
        shapes = [drawn.outlines[i] for i in np.flatnonzero(chosen)]
        sheet.add_shapes(ax, shapes, facecolors=colour, edgecolors=BRICK_EDGE, linewidths=0.25)
    wall_of, cracks = _cracks(ds, drawn)
    middle, colours = drawn.middles(cracks), _crack_colours(ds, cracks.crack)
    sheet.add_lines(ax, middle, colors=colours, linewidths=2.2, zorder=4, label="cracks")
    widths, categories = (ds[f"wall_{name}"].values[-1] for name in ("crack_width_max", "damage_category"))
    wall_at, y = ds["block_wall"].values[drawn.block], drawn.shape[:, 1]
    row_of = np.array([level for _, level in places])[wall_at]
    letters, top = sheet.letters_across(ax) / float(np.ptp(ax.get_xlim())), 0.0  # per metre
    for number, (wall, (left, level)) in enumerate(zip(house.wall, places)):
        words = f"{wall.name}: {MM * widths[number]:.2f} mm, category {categories[number]}"
        room = min((x - left for x, y in places if y == level and x > left), default=np.inf)
        if room * letters < len(words):
            words = textwrap.fill(words, max(8, int(room * letters)))
        title: dict[str, Any] = {"textcoords": "offset points", "va": "bottom", "fontsize": small(ax)}
        highest = float(y[wall_at == number].max())
        ax.annotate(words, (left, highest), (0, 3), **title)
        top = max(top, highest + 1.4 * line * (1 + words.count("\n")))
        own = np.flatnonzero(wall_of == number)
        if own.size:
            widest = own[cracks.crack[own].argmax()]
            words, place = f"{MM * cracks.crack[widest]:.2f}", middle[widest].mean(axis=0)
            ax.annotate(words, place, (8, -8), textcoords="offset points", fontsize=small(ax), zorder=6, bbox=BOX)
    meet: dict[tuple[int, float], list[str]] = {}
    for junction in house.junctions:
        for number, x, other in zip(junction.walls, junction.x, junction.walls[::-1]):
            meet.setdefault((number, round(x, 3)), []).append(house.names[other])
    for (number, x), names in meet.items():
        left, level = places[number]
        below: dict[str, Any] = {"textcoords": "offset points", "va": "top", "fontsize": 0.9 * small(ax)}
        below["ha"] = {0.0: "left", round(house.wall[number].length, 3): "right"}.get(x, "center")
        ax.annotate(", ".join(names), (left + x, y[row_of == level].min()), (0, -3), color="0.4", **below)
    sheet.elevation(ax)
    low = float(drawn.shape[:, 1].min()) - 3.0 * line
    ax.set_ylim(low, top + 0.5 * line)
    ax.set_axis_off()
    ax.plot([0.0, 2.0], [low, low], color="black", linewidth=2.0, solid_capstyle="butt")
    ax.text(2.2, low, "2 m; walls from start to end, below them the walls they meet", va="center", fontsize=small(ax))
    _category_legend(ds, ax, categories)
    sheet.set_title(ax, sheet.title_of(ds, "house"), *_worst(ds, drawn))
    return ax


def _cracks(ds: xr.Dataset, drawn: Deformed) -> tuple[IntArray, Faces]:
    """Number of the wall of each open joint, and the joints."""
    faces, first = drawn.faces, np.unique(ds["contact_interface"].values, return_index=True)[1]
    cracked = faces.joints.is_masonry & (faces.crack > HAIRLINE)
    return ds["contact_wall"].values[first][cracked], faces.pick(cracked)


def _crack_colours(ds: xr.Dataset, widths: FloatArray) -> list[str]:
    """Colour of the category of each width."""
    return [CATEGORY_COLOURS[int(c)] for c in table_of(ds).by_width(widths)]


def _category_legend(ds: xr.Dataset, ax: Axes, categories: FloatArray, inches: float = 0.1) -> None:
    """Legend of the categories up to the worst, below the axes."""
    shown = range(int(max(categories)) + 1)
    lines = [Line2D([], [], color=CATEGORY_COLOURS[c], linewidth=5, label=f"{c} {name_of(ds, c)}") for c in shown]
    sheet.legend_below(ax, lines, inches=inches)


def _worst(ds: xr.Dataset, drawn: Deformed) -> tuple[str, str]:
    """Category of the house, by its worst wall, and number of damaged walls in words; movement and scale."""
    worst, damaged = (int(ds[name][drawn.increment]) for name in ("damage_category", "damaged_walls"))
    words = f"worst wall: category {worst} ({name_of(ds, worst)}); {damaged} of {ds.sizes['wall']} walls damaged"
    return words, f"at {sheet.moved_to(ds, drawn.increment)}; {drawn.scale}"


ELEVATION, ACROSS, AWAY = np.radians(38.0), np.array([0.75**0.5, 0.5]), np.array([-0.5, 0.75**0.5])
"""View of the axonometric drawing: from 38 degrees above; unit vectors in plan across it and away from the viewer."""
CORNER_REACH = 0.4  # distance from a corner (m) within which blocks show how a wall moves there


def draw_axonometric(
    ds: xr.Dataset, ax: Axes | None = None, increment: int = -1, exaggeration: float | None = None
) -> Axes:
    """Deformed house from above and one side; across its plane each wall follows the walls that meet it."""
    house, drawn = house_of(ds), Deformed.of(unfolded(ds), increment, exaggeration)
    places, wall_of = np.array(unfolded_places(house)), ds["block_wall"].values
    crack_wall, cracks = _cracks(ds, drawn)
    corner_wall = wall_of[drawn.block]
    lean = _lean(house, drawn.points - places[corner_wall], drawn.shape - drawn.points, corner_wall)
    before = polygons(drawn.points, drawn.block)
    before += [np.stack((s, e, e, s)) for s, e in zip(cracks.joints.start, cracks.joints.end)]
    seen, depth = [], []
    for shape, still, number in zip([*drawn.outlines, *drawn.gaps(cracks)], before, [*wall_of, *crack_wall]):
        wall, (x, z), at = house.wall[number], (shape - places[number]).T, still - places[number]
        seen.append(_project(wall.points(x) + lean(number, at)[:, None] * _normal(wall), z))
        depth.append(float((wall.points(at[:, 0]) @ AWAY).mean()))
    tones = [BRICK_COLOURS[0] if abs(w.direction @ AWAY) > 0.6 else BRICK_COLOURS[2] for w in house.wall]
    look = [(FOOTING_COLOUR if foot else tones[n], BRICK_EDGE, 0.25) for foot, n in zip(drawn.footing, wall_of)]
    look += [("white", colour, 1.6) for colour in _crack_colours(ds, cracks.crack)]
    nearer = np.arange(len(seen)) >= len(wall_of)  # a crack lies over the bricks beside it
    order = np.argsort(0.15 * nearer - np.array(depth), kind="stable")
    faces, edges, lines = zip(*(look[k] for k in order))
    ax = sheet.axes_or_new(ax, 8.0, sheet.height_to_scale(np.concatenate(seen), 1.9, 7.6))
    style: dict[str, Any] = {"facecolors": faces, "edgecolors": edges, "linewidths": lines, "snap": False}
    sheet.add_shapes(ax, [seen[k] for k in order], **style)
    categories = ds["wall_damage_category"].values[increment]
    for number, wall in enumerate(house.wall):
        ends = np.array([wall.start, wall.end])
        ax.plot(*_project(ends, np.zeros(2)).T, color="0.5", linewidth=0.6, linestyle=(0, (6, 4)))
        x, y = _project(ends, np.full(2, wall.height + 0.15)).mean(axis=0)
        box = {**BOX, "edgecolor": CATEGORY_COLOURS[categories[number]]}
        ax.text(x, y, f"{wall.name}: {categories[number]}", ha="center", fontsize=small(ax), zorder=6, bbox=box)
    ax.set_aspect("equal")
    ax.set_axis_off()
    ax.autoscale_view()
    _category_legend(ds, ax, categories)
    sheet.set_title(
        ax, sheet.title_of(ds, "house"), *_worst(ds, drawn), "dashed: top of the footings before any movement"
    )
    return ax


def _normal(wall: PlanWall) -> FloatArray:
    """Unit vector across a wall, to the left of its direction."""
    return wall.direction[::-1] * [-1.0, 1.0]


def _project(plan: FloatArray, z: FloatArray) -> FloatArray:
    """Places on the drawing (k, 2) of points in plan (k, 2) at heights (k,)."""
    return np.column_stack((plan @ ACROSS, z * np.cos(ELEVATION) + (plan @ AWAY) * np.sin(ELEVATION)))


def _lean(
    house: House, points: FloatArray, moved: FloatArray, wall_of: IntArray
) -> Callable[[int, FloatArray], FloatArray]:
    """Displacement across a wall, linear between its corners, where it follows the walls that meet it."""
    bends: dict[int, list[tuple[float, ...]]] = {number: [] for number in range(len(house.wall))}
    for junction in house.junctions:
        lines = []  # displacement along both walls: of the bricks at the base and per height, of the footing
        for number, x in zip(junction.walls, junction.x):
            near = (wall_of == number) & (np.abs(points[:, 0] - x) < CORNER_REACH)
            bricks, footing = near & (points[:, 1] > 0.0), near & (points[:, 1] < 0.0)
            fit = np.polynomial.polynomial.polyfit(points[bricks, 1], moved[bricks, 0], 1)
            lines.append([*fit, moved[footing, 0].mean() if footing.any() else 0.0])
        axes = np.array([house.wall[number].direction for number in junction.walls])
        if abs(np.linalg.det(axes)) > 0.1:
            both = np.linalg.solve(axes, np.array(lines))  # in plan
            for number, x in zip(junction.walls, junction.x):
                bends[number].append((x, *(_normal(house.wall[number]) @ both)))

    def lean(number: int, at: FloatArray) -> FloatArray:
        if not bends[number]:
            return np.zeros(len(at))
        x, base, slope, footing = np.array(sorted(bends[number])).T
        if at[:, 1].mean() < 0.0:
            return np.interp(at[:, 0], x, footing)
        return np.asarray(np.interp(at[:, 0], x, base) + at[:, 1] * np.interp(at[:, 0], x, slope))

    return lean
