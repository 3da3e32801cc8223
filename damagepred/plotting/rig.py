"""Drawings under a wall: footing beam, supports, jacks, ground."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from damagepred.arrays import FloatArray
from damagepred.plotting import colours
from damagepred.plotting.geometry import Deformed, footing_rise, soil_surface
from damagepred.plotting.sheet import KN, add_lines, add_shapes, plain_number, small
from damagepred.scene import Load, Scene
from damagepred.scene.loading import strip_of

TRIANGLE, ARROW = 0.018, 0.06
"""Size of a support, and of the arrow of the largest load of a jack, as fractions of the wall's length."""


def draw_bricks(ax: Axes, shapes: Sequence[Any]) -> None:
    """Draw pale bricks (corners in m) as a ground for cracks."""
    style = {"facecolors": colours.BRICK_COLOURS[3], "edgecolors": colours.BRICK_EDGE, "linewidths": 0.25}
    add_shapes(ax, shapes, zorder=1, label="bricks", **style)


def draw_footing_blocks(ax: Axes, wall: Deformed) -> None:
    """Draw the blocks of a footing, deformable ones zone by zone."""
    style: dict[str, Any] = {"facecolors": colours.FOOTING_COLOUR, "zorder": 2, "snap": False, "label": "footing"}
    rigid = [wall.outlines[i] for i in np.flatnonzero(wall.footing & wall.rigid)]
    if rigid:
        add_shapes(ax, rigid, edgecolors=colours.FOOTING_EDGE, linewidths=0.35, **style)
    if (wall.footing & ~wall.rigid).any():
        zones, places = wall.zones, wall.gridpoints
        beam = places[zones.corners[wall.footing[zones.block]]]
        add_shapes(ax, beam, edgecolors=colours.FOOTING_COLOUR, linewidths=0.3, **style)
        rims = zones.rims()
        rims = rims[wall.footing[wall.ds["gridpoint_block"].values[rims[:, 0]]]]
        add_lines(ax, places[rims], colors=colours.FOOTING_EDGE, linewidths=0.5, zorder=2)


def draw_soil(ax: Axes, wall: Deformed) -> None:
    """Draw the surface of the ground, pressed down where the footing rests on it."""
    x, height, rise = soil_surface(wall.ds, wall.increment, wall.footing)
    if len(x):
        style: dict[str, Any] = {"color": colours.SOIL_COLOUR, "linewidth": 1.4, "zorder": 3.5}
        ax.plot(x, height + wall.factor * (rise - (wall.datum or 0.0)), label="surface of the ground", **style)


def draw_rig(ax: Axes, wall: Deformed) -> None:
    """Draw supports as triangles and jacks as arrows with their loads, in proportion to the largest of the path."""
    ds, increment, factor = wall.ds, wall.increment, wall.factor
    length = float(np.ptp(ds["vertex_x"].values))
    low = float(ds["vertex_y"].values.min())
    along, rise = footing_rise(ds, increment, wall.footing)
    size = TRIANGLE * length
    for x, load in zip(ds["support_x"].values, ds["support_load"].values[increment]):
        y = low + factor * float(np.interp(x, along, rise))
        draw_support(ax, x, y, size)
        ax.text(x, y - 1.3 * size, _load(float(load)), ha="center", va="top", fontsize=small(ax))
    loads = ds["jack_load"].values
    largest = max(float(np.abs(loads).max()), 1e-9)
    for x in ds["jack_x"].values:
        y, load = low + factor * float(np.interp(x, along, rise)), float(loads[increment])
        reach = ARROW * length * abs(load) / largest
        tail = y - max(reach, 0.3 * size)
        if abs(load) > 1e-3 * largest:
            draw_arrow(ax, *(((x, y), (x, tail)) if load > 0 else ((x, tail), (x, y))))
        ax.text(x, tail - 0.3 * size, _load(load), ha="center", va="top", fontsize=small(ax))
    # text and annotations do not widen the axes by themselves
    bottom = low - (ARROW + 2.2 * TRIANGLE) * length
    left = float(ds["vertex_x"].values.min())
    ax.update_datalim([(left - 0.03 * length, bottom), (left + 1.03 * length, bottom)])


def draw_support(ax: Axes, x: float, y: float, size: float, half: float = 0.0) -> None:
    """Draw a support with its top at (x, y), ``half`` of its width to each side (m)."""
    across, upwards = [x - half, x + half, x + 0.6 * size, x - 0.6 * size], [y, y, y - size, y - size]
    ax.fill(across, upwards, facecolor="white", edgecolor=colours.RIG_COLOUR, linewidth=1.0, zorder=4, label="support")


def draw_arrow(ax: Axes, tip: tuple[float, float], tail: tuple[float, float], colour: str = colours.RIG_COLOUR) -> None:
    """Draw an arrow between two points (m)."""
    ax.annotate("", tip, tail, zorder=4, arrowprops={"arrowstyle": "-|>", "color": colour, "shrinkA": 0, "shrinkB": 0})


def draw_test(ax: Axes, scene: Scene, force: float | None) -> None:
    """Draw supports of a laboratory test as triangles, and its loads as arrows with their share of a force (N)."""
    length, size = scene.wall.length, TRIANGLE * scene.wall.length
    for support in scene.support:
        draw_support(ax, support.x, 0.0, size, support.width / 2.0)
    if not scene.support:
        ax.plot([0.0, length], [0.0, 0.0], color=colours.RIG_COLOUR, linewidth=1.4, zorder=1)
    strips = [load for load in scene.load if not load.sized]
    shares = sum(load.share for load in strips)
    for load in strips:
        words = "" if force is None else _load(force * load.share / shares)
        draw_load(ax, scene, load, words, np.array([sum(strip_of(load, scene.wall)) / 2.0]), ARROW * length, 0.2 * size)
    ax.update_datalim([(0.0, -1.6 * size)])


def draw_load(ax: Axes, scene: Scene, load: Load, words: str, places: FloatArray, reach: float, near: float) -> None:
    """Draw a load as arrows of some reach at places along its side, ``near`` the wall (m), with words."""
    length, gap = scene.wall.length, 0.3 * TRIANGLE * scene.wall.length
    out_x, out_y = {"top": (0.0, 1.0), "left": (-1.0, 0.0), "right": (1.0, 0.0)}[load.side]
    from_x, from_y = (out_x, out_y) if load.direction == "towards" else (-out_y, abs(out_x))
    levels = scene.wall.top_at(places) if load.y is None else np.full(len(places), load.y)
    tails = []
    for place, level in zip(places.tolist(), levels.tolist()):
        x, y = (place, level) if load.side == "top" else (length if load.side == "right" else 0.0, place)
        tip = x + near * out_x, y + near * out_y
        tails.append((tip[0] + reach * from_x, tip[1] + reach * from_y))
        draw_arrow(ax, tip, tails[-1])
    x, y = np.mean(tails, axis=0)[0], np.max(tails, axis=0)[1]
    style: dict[str, Any] = {"ha": {"top": "center", "left": "right", "right": "left"}[load.side], "va": "bottom"}
    if load.y is not None:
        style["bbox"] = {"facecolor": "white", "edgecolor": "none", "alpha": 0.85, "pad": 1.0}
    ax.text(x, y + gap, words, fontsize=small(ax), zorder=5, **style)
    ax.update_datalim([(x + 10.0 * gap * out_x, y + 10.0 * gap)])


def _load(load: float) -> str:
    return ("-" if load < -5.0 else "") + f"{plain_number(abs(round(load * KN, 2)))} kN"
