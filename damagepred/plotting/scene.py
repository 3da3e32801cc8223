"""A scene before any run: wall, openings, joints, footing, loads, and the ground before and after its movement."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from damagepred.assembly.assembly import rectangle
from damagepred.assembly.bond import Brick, exposed_top, lay_bricks, parted
from damagepred.inputs.arguments import checked
from damagepred.plotting import colours, sheet
from damagepred.plotting.geometry import round_exaggeration
from damagepred.plotting.rig import ARROW, TRIANGLE, draw_arrow, draw_load, draw_support, draw_test
from damagepred.scene import Load, Scene
from damagepred.scene.house import require_one_wall
from damagepred.scene.loading import force_of, strip_of
from damagepred.scene.what_moves import PROFILE_POINTS, load_factors, turning_points, what_moves

LINTEL_COLOUR, BEFORE_COLOUR, OTHER_WAY_COLOUR = "#c9a98f", "#9a9a9a", "#d55e00"
"""Lintels, the ground before it moves, and the ground at its largest movement to the other side."""


@checked
def draw_scene(scene: Scene, ax: Axes | None = None) -> Axes:
    """Draw a wall with openings, joints, footing and loads, and its ground before and after the movement.

    Parameters
    ----------
    scene : Scene
        The wall and its movement.
    ax : Axes, optional
        Axes to draw on; by default on a new figure.

    Returns
    -------
    Axes
        Axes in metres, with collections labelled ``bricks``, and where present ``lintels``, ``dpc`` and ``control
        joints``; lines ``ground before`` and ``ground after``, exaggerated by the factor in the title, and of a history
        ``ground after, other way``.

    Examples
    --------
    >>> import damagepred
    >>> ax = damagepred.plotting.draw_scene(damagepred.Scene())
    >>> ax.get_title(loc="left").splitlines()[1]
    'The middle of the ground goes down by 8 mm, to nothing at both ends'
    """
    require_one_wall(scene, "draw_scene")
    bricks, length = lay_bricks(scene), scene.wall.length
    low = 0.0 if scene.footing_model == "none" else -scene.footing.depth
    reach = np.array([[0.0, low - 0.1 * length], [length, scene.wall.height + 0.08 * length]])
    ax = sheet.axes_or_new(ax, 10.0, sheet.height_to_scale(reach, 1.8))
    _draw_wall(ax, scene, bricks)
    if low:
        style = {"facecolors": colours.FOOTING_COLOUR, "edgecolors": colours.FOOTING_EDGE}
        sheet.add_shapes(ax, [rectangle(0.0, low, length, 0.0)], label="footing", **style)
    _draw_loads(ax, scene, bricks)
    factor = 0.0
    if scene.movement.shape == "jacks":
        _draw_jacks(ax, scene, low)
    elif scene.loading is not None:
        draw_test(ax, scene, scene.loading.target if scene.loading.control == "force" else None)
    else:
        factor = _draw_ground(ax, scene, low)
    sheet.elevation(ax)
    ax.margins(0.03)
    ax.autoscale_view()
    artists = [*ax.collections, *ax.lines]
    named = [artist for artist in artists if not re.match("_|bricks|soil", str(artist.get_label()))]
    sheet.legend_below(ax, named, left=True)
    scale = f"movement of the ground exaggerated {sheet.plain_number(factor)} times" if factor > 1.0 else ""
    sheet.set_title(ax, sheet.verbatim(scene.title), what_moves(scene), scale)
    return ax


def _draw_wall(ax: Axes, scene: Scene, bricks: list[Brick]) -> None:
    """Draw bricks, lintels, dpc and control joints."""
    style = {"edgecolors": colours.BRICK_EDGE, "linewidths": 0.35, "zorder": 2}
    lintels = [  # over the whole width of an opening
        b
        for b in bricks
        for h in scene.opening
        if b.left - 1e-9 < h.x < h.right < b.right + 1e-9 and 0 <= b.bottom - h.top < 1e-3
    ]
    for label, shown, colour in (
        ("bricks", [b for b in bricks if b not in lintels], colours.BRICK_COLOURS[1]),
        ("lintels", lintels, LINTEL_COLOUR),
    ):
        if shown:
            sheet.add_shapes(ax, [rectangle(*brick[:4]) for brick in shown], facecolors=colour, label=label, **style)
    course = None if scene.dpc is None else scene.dpc.course
    beds = [[(b.left, b.bottom), (b.right, b.bottom)] for b in bricks if b.course == course]
    pairs = [(bricks[a], bricks[b]) for a, b, _ in parted(scene, bricks)]
    gaps = [[(a.right, max(a.bottom, b.bottom)), (a.right, min(a.top, b.top))] for a, b in pairs]
    drawn = (("dpc", beds, colours.DPC_COLOUR), ("control joints", gaps, colours.CONTROL_JOINT_COLOUR))
    for label, lines, colour in drawn:
        if lines:
            sheet.add_lines(ax, lines, colors=colour, linewidths=1.8, zorder=3, label=label)


def _draw_loads(ax: Axes, scene: Scene, bricks: list[Brick]) -> None:
    """Draw the roof and the loads with a size over the bricks that carry them."""
    length, height, rows = scene.wall.length, scene.wall.height, dict[float, int]()
    carrying = [(left, right) for _, left, right in exposed_top(scene, bricks)]
    roof = [("roof", Load(force=scene.loads.roof))] if scene.loads.roof else []
    for name, load in roof + [(load.name or f"load {n}", load) for n, load in enumerate(scene.load, 1) if load.sized]:
        start, end = strip_of(load, scene.wall)
        count = 1 + round(12.0 * (end - start) / length)
        places = start + (end - start) * (np.arange(count) + 0.5) / count
        if load.side == "top" and load.y is None:
            places = np.array([x for x in places if any(left <= x <= right for left, right in carrying)])
        level = height if load.y is None else load.y
        raised = 0.065 * length * rows.get(level, 0) if load.side == "top" else 0.0
        rows[level] = rows.get(level, 0) + (load.side == "top")
        words = f"{name} {sheet.plain_number(force_of(load, scene.wall) / 1e3)} kN"
        words += " in all" * (name == "roof") + ", live" * (load.kind == "live")
        draw_load(ax, scene, load, words, places, 0.03 * length, raised)


def _draw_jacks(ax: Axes, scene: Scene, low: float) -> None:
    """Draw supports, and jacks with arrows in the direction of their movement."""
    rig, length, size = scene.rig, scene.wall.length, TRIANGLE * scene.wall.length
    for x in rig.support_places(length):
        draw_support(ax, x, low, size)
    for x in rig.jack_places(length):
        ends = (x, low), (x, low - ARROW * length)
        draw_arrow(ax, *(ends if scene.movement.sign > 0 else ends[::-1]))
        words = "jack" if rig.jack_load is None else f"{sheet.plain_number(rig.jack_load / 1e3)} kN"
        ax.text(x, low - ARROW * length - 0.3 * size, words, ha="center", va="top", fontsize=sheet.small(ax))
    ax.update_datalim([(0.0, low - (ARROW + 2.2 * TRIANGLE) * length)])


def _draw_ground(ax: Axes, scene: Scene, low: float) -> float:
    """Draw the ground before and after its movement, with its largest movements; return the exaggeration."""
    length = scene.wall.length
    x = np.linspace(0.0, length, PROFILE_POINTS)
    profiles = [scene.ground_rise(x, factor) for factor in load_factors(scene)]
    moving = sorted((rise for rise in profiles if rise.any()), key=lambda rise: -float(np.abs(rise).max()))
    ax.plot([0.0, length], [low, low], color=BEFORE_COLOUR, linewidth=1.6, zorder=4, label="ground before")
    ax.update_datalim([(0.0, low - 0.07 * length)])
    if not moving:
        return 0.0
    factor = round_exaggeration(np.column_stack((0.0 * x, moving[0])), length)
    soil: dict[str, Any] = {"facecolor": colours.SOIL_COLOUR, "alpha": 0.35, "zorder": 3.4, "label": "soil"}
    ax.fill_between(x, low, low + factor * moving[0], **soil)
    for rise, colour, other in zip(moving, (colours.SOIL_COLOUR, OTHER_WAY_COLOUR), ("", ", other way")):
        style: dict[str, Any] = {"color": colour, "linewidth": 1.8, "linestyle": "--" if other else "-"}
        ax.plot(x, low + factor * rise, zorder=4.2, label=f"ground after{other}", **style)
        for i in turning_points(rise):
            y, away = low + factor * float(rise[i]), float(np.sign(rise[i])) * 0.014 * length
            draw_arrow(ax, (x[i], y), (x[i], low), colour)
            words = f"{1e3 * rise[i]:+.3g} mm".replace("-", "−")
            aside = "left" if x[i] < 0.04 * length else "right" if x[i] > 0.96 * length else "center"
            place: dict[str, Any] = {"ha": aside, "va": "bottom" if away > 0 else "top", "zorder": 5}
            box = {"facecolor": "white", "edgecolor": "none", "pad": 0.8}
            ax.text(x[i], y + away, words, color=colour, fontsize=sheet.small(ax), fontweight="bold", bbox=box, **place)
        ax.update_datalim([(0.0, low + factor * float(rise.min()) - 0.06 * length)])
    return factor
