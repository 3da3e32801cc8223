"""Sketches of the guide: one function per picture, one style; curves come from the package's own formulas."""

from __future__ import annotations

import io
from collections.abc import Callable, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Arc, Circle, Ellipse, Polygon, Rectangle
from PIL import Image
from scipy.stats import norm

from damagepred.scene.footing_profile import three_loads
from damagepred.scene.mound import bell, gaussian, mitchell, tree, walsh

WIDTH, DPI = 160 / 25.4, 180  # in, 1/in
BRICK, LINE, SOIL, BLUE, RED, GREY = "#e6cdb8", "#8a5a3c", "#d5cbb5", "#1f5fa8", "#b03030", "#6b6b6b"
STYLE = {"font.size": 8, "axes.titlesize": 8, "axes.spines.top": False, "axes.spines.right": False}
ALIGN = {"l": "left", "r": "right", "c": "center", "t": "top", "b": "bottom", "m": "center"}
SKETCHES: dict[str, Callable[[], Figure]] = {}
Openings = Sequence[tuple[float, float, float, float]]
WINDOWS: Openings = ((1.5, 0.96, 1.8, 1.2), (5.7, 0.96, 1.8, 1.2))


def sketch(draw: Callable[[], Figure]) -> Callable[[], Figure]:
    """Register a sketch under the name of its function."""
    SKETCHES[draw.__name__] = draw
    return draw


def write(folder: Path) -> None:
    """Draw all sketches as small PNG files, 160 mm wide."""
    folder.mkdir(exist_ok=True)
    for name, draw in SKETCHES.items():
        memory = io.BytesIO()
        with mpl.rc_context(STYLE):
            draw().savefig(memory, dpi=DPI)
        with Image.open(memory) as picture:
            picture.convert("RGB").quantize(128, Image.Quantize.MEDIANCUT).save(folder / f"{name}.png", optimize=True)
        print(f"sketches/{name}.png", flush=True)


def bare(height: float, *limits: tuple[float, float, float, float], widths: Sequence[float] | None = None) -> Any:
    """Figure ``height`` mm high with axes of equal scales, without frames, each with limits in x and y."""
    made = Figure(figsize=(WIDTH, height / 25.4), layout="constrained")
    axes = made.subplots(1, len(limits), squeeze=False, width_ratios=widths)[0]
    for ax, (left, right, low, high) in zip(axes, limits, strict=True):
        ax.set(xlim=(left, right), ylim=(low, high), aspect="equal")
        ax.axis("off")
    return made, *axes


def note(ax: Any, x: float, y: float, text: str, color: str = "k", align: str = "cm", **more: Any) -> None:
    """Text; ``align`` has a letter for each direction."""
    ax.text(x, y, text, color=color, ha=ALIGN[align[0]], va=ALIGN[align[1]], **more)


def arrow(ax: Any, start: Any, end: Any, color: str = BLUE, style: str = "-|>") -> None:
    """Arrow without text."""
    ax.annotate("", end, start, arrowprops={"arrowstyle": style, "color": color, "lw": 1.2, "shrinkA": 0, "shrinkB": 0})


def span(ax: Any, start: Any, end: Any, color: str = BLUE) -> None:
    """Arrow with two heads."""
    arrow(ax, start, end, color, "<|-|>")


def wall(ax: Any, length: float, height: float, move: Any, openings: Openings = (), start: float = 0.0) -> None:
    """Draw running bond from ``start`` to ``length``, whose corners ``move`` displaces."""
    b, h = 0.643, height / 10
    for course in range(10):
        cuts = np.unique(np.clip(np.arange(-0.5 * (course % 2), 20) * b, start, length))
        for x0, x1 in pairwise(cuts):
            y = course * h
            if not any(a < (x0 + x1) / 2 < a + w and s <= y + h / 2 < s + t for a, s, w, t in openings):
                corners = np.array([(x0, y), (x1, y), (x1, y + h), (x0, y + h)])
                ax.add_patch(Polygon(move(corners), fc=BRICK, ec=LINE, lw=0.5))


def lifted(profile: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """Vertical displacement by a profile along x."""
    return lambda corners: corners + np.column_stack([0 * corners[:, 0], profile(corners[:, 0])])


def turned(angle: float, pivot: float) -> Callable[[Any], Any]:
    """Rotation about a point on the ground, counter-clockwise."""
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    return lambda corners: (corners - (pivot, 0)) @ turn + (pivot, 0)


def ground(ax: Any, x: Any, y: Any, bottom: float) -> None:
    """Soil below a profile."""
    ax.fill_between(x, y, bottom, color=SOIL, lw=0)
    ax.plot(x, y, color=GREY, lw=1)


def footing(ax: Any, length: float, bottom: Callable[[Any], Any], depth: float) -> None:
    """Footing beam whose underside follows a profile."""
    x = np.linspace(0, length, 60)
    ax.fill_between(x, bottom(x), bottom(x) + depth, fc="#bdbdbd", ec=GREY, lw=0.8, zorder=2.5)


def through_origin(ax: Any, x: str, y: str) -> None:
    """Axes through the origin, without numbers."""
    ax.spines[["left", "bottom"]].set_position("zero")
    ax.set(xticks=[], yticks=[])
    note(ax, ax.get_xlim()[1], -0.08, x, align="rt")
    note(ax, -0.1, ax.get_ylim()[1], y, align="rt")


@sketch
def signs() -> Figure:
    """Dishing, doming, axes, opening and slip."""
    made, *axes, ax = bare(46, *[(-0.2, 6.2, -1.2, 3.2)] * 2, (-0.5, 3.6, -2.8, 1.4), widths=(1, 1, 0.85))
    for panel, sign, name in zip(axes, (-1, 1), ("dishing (sagging)", "doming (hogging)"), strict=True):
        profile = lambda x, sign=sign: 0.5 * sign * three_loads(x / 6)  # noqa: E731
        wall(panel, 6, 2.4, lifted(profile))
        ground(panel, np.linspace(0, 6, 100), profile(np.linspace(0, 6, 100)), -1.2)
        panel.plot([0, 6], [0, 0], ls="--", color=BLUE, lw=1)
        arrow(panel, (3, 0), (3, 0.5 * sign))
        note(panel, 3, -0.85, "central deflection", BLUE)
        panel.set_title(name)
    arrow(ax, (0, 0), (1.1, 0), "k")
    arrow(ax, (0, 0), (0, 1.1), "k")
    note(ax, 1.2, 0, "x", align="lm")
    note(ax, 0.12, 1.05, "y, up", align="lm")
    ax.add_patch(Arc((0, 0), 1.1, 1.1, theta1=20, theta2=70))
    arrow(ax, (0.28, 0.475), (0.17, 0.52), "k")
    note(ax, 0.55, 0.5, "rotation +", align="lm")
    for x, right, up, text in ((-0.2, 0.0, 0.3, "opening +,\ntension +"), (1.8, 0.35, 0.0, "slip +")):
        ax.add_patch(Rectangle((x, -2.7), 1.4, 0.5, fc=BRICK, ec=LINE))
        ax.add_patch(Rectangle((x + right, -2.2 + up), 1.4, 0.5, fc=BRICK, ec=LINE))
        note(ax, x + 0.7 + right / 2, -1.3, text, BLUE, "cb")
    arrow(ax, (0.5, -2.2), (0.5, -1.9))
    arrow(ax, (1.8, -1.55), (2.15, -1.55))
    return made


@sketch
def contact() -> Figure:
    """Blocks, interface, contacts, zones."""
    made, ax = bare(46, (-3.0, 8.7, -0.2, 2.9))
    for x, y, name in ((0, 0, "block a"), (-1.6, 1.05, ""), (1.6, 1.05, "block b")):
        ax.add_patch(Rectangle((x, y), 3, 0.9, fc=BRICK, ec=LINE))
        note(ax, x + (2.2 if y else 1.5), y + 0.4, name)
    for x in (0.0, 1.6):
        ax.plot([x, x + 1.4], [0.975] * 2, color=BLUE, lw=2.5)
        for at, weight, align in ((0, "1/6", "lt"), (0.7, "4/6", "ct"), (1.4, "1/6", "rt")):
            ax.add_patch(Circle((x + at, 0.975), 0.055, fc=RED, ec="w", lw=0.5, zorder=3))
            note(ax, x + at, 0.84, weight if x else "", RED, align, fontsize=7)
    arrow(ax, (2.3, 0.975), (2.3, 1.7))
    arrow(ax, (2.3, 0.975), (3.45, 0.975))
    note(ax, 2.4, 1.65, r"$\mathbf{n}$", BLUE, "lm")
    note(ax, 3.5, 0.97, r"$\mathbf{t}$", BLUE, "lm")
    note(ax, -0.3, 0.45, "interface: the common\nedge of two blocks", BLUE, "rm")
    arrow(ax, (-0.28, 0.55), (0.2, 0.93))
    note(ax, 3.4, 0.4, "contact: integration point of an\ninterface, with its weight", RED, "lm")
    arrow(ax, (3.37, 0.45), (3.05, 0.91), RED)
    ax.add_patch(Rectangle((5.4, 1.05), 3, 0.9, fc=BRICK, ec=LINE))
    for x in (5.4, 6.4, 7.4):
        ax.plot([x, x + 1, x + 1, x, x], [1.05, 1.95, 1.05, 1.95, 1.05], color=LINE, lw=0.8)
        ax.plot([x, x, x + 0.5, x + 1, x + 1], [1.05, 1.95, 1.5, 1.05, 1.95], "o", color=BLUE, ms=3.5)
    note(ax, 6.9, 2.1, "deformable block: zones (triangles)\nand gridpoints (dots)", align="cb")
    note(ax, 1.5, 2.1, "rigid or elastic blocks\nin running bond", align="cb")
    return made


@sketch
def joint_law() -> Figure:
    """Tension, shear and the limits of both."""
    made = Figure(figsize=(WIDTH, 60 / 25.4), layout="constrained")
    tension, shear, limits = made.subplots(1, 3, width_ratios=(1, 1, 1.35))
    u = np.linspace(0.2, 1.4, 200)
    x = (u - 0.2) / 1.2
    tension.plot([-0.35, 0.2, 0.2, 1.7], [-1.75, 1, 0, 0], color="k", label="brittle (default)")
    tension.plot(u, 1 - x, color=BLUE, ls="--", label="linear softening")
    tension.plot(u, np.exp(-5 * x) - x * np.exp(-5), color=RED, ls="-.", label="exponential")
    note(tension, 0.12, 1, "$f_t$", align="rm")
    note(tension, -0.25, -0.75, "$k_n$", align="rm")
    tension.set(xlim=(-0.6, 1.8), ylim=(-1.8, 1.6), title="tension")
    tension.legend(loc="lower right", frameon=False, fontsize=7, handlelength=1.8, borderpad=0)
    shear.plot([-1.8, -0.7, 0.7, 1.8], [-1, -1, 1, 1], color="k")
    shear.plot([0.7, 0.7, 1.8], [1, 0.6, 0.6], color=BLUE, ls="--")
    note(shear, 1.2, 1.08, r"$C-\sigma\,\tan\varphi$", align="cb")
    note(shear, 0.15, -0.5, "dashed: residual\ncohesion with\nbrittle_shear", BLUE, "lt", fontsize=7)
    note(shear, -0.45, -0.45, "$k_s$", align="rm")
    shear.set(xlim=(-1.9, 2.1), ylim=(-1.8, 1.6), title="shear")
    s = np.linspace(-3, 0.35, 300)
    bound = np.minimum(0.55 - 0.75 * s, np.sqrt(np.clip(9 - s**2, 0, None) / 4))
    limits.fill_between(s, -bound, bound, color=BRICK, alpha=0.6, lw=0)
    for sign in (1, -1):
        limits.plot([*s, 0.35], [*(sign * bound), 0], color="k")
    limits.plot([-1.4, 0.733], [1.6, 0], color=BLUE, ls="--", lw=1)
    note(limits, 0.15, 0.85, "Coulomb\n$C-\\sigma\\,\\tan\\varphi$", BLUE, "lb")
    note(limits, -3.0, 1.3, "cap\n(ellipse)", RED, "lb")
    note(limits, 0.3, -0.08, "$f_t$", align="rt")
    note(limits, -3.05, 0.08, "$-f_c$", align="rb")
    note(limits, 0.75, 0.08, r"$C/\tan\varphi$", BLUE, "lb", fontsize=7)
    note(limits, -1.5, -0.4, "elastic")
    limits.set(xlim=(-3.9, 2.0), ylim=(-2.0, 2.3), title="limits of stress")
    for ax, x_name, y_name in (
        (tension, "$u_n$", r"$\sigma$"),
        (shear, "$u_s$", r"$\tau$"),
        (limits, r"$\sigma$", r"$\tau$"),
    ):
        through_origin(ax, x_name, y_name)
    return made


@sketch
def mounds() -> Figure:
    """Forms of mounds, by the functions of the package: profile, measure of width (from, to, name), place of y."""
    made = Figure(figsize=(WIDTH, 82 / 25.4), layout="constrained")
    x = np.linspace(0, 9, 300)
    panels: list[tuple[str, Any, tuple[float, float, str] | None, float]] = [
        ("Walsh, doming: edges dry", -walsh(x, 9, 1.9), (0, 1.9, "e"), 0.0),
        ("Walsh, dishing: edges wet", walsh(x, 9, 1.4), (0, 1.4, "e"), 0.0),
        ("Mitchell, doming", -mitchell(x, 9, 4.0), None, 0.0),
        ("tree at the left end", -tree(x, 5.0), (0, 5, "R"), 0.0),
        ("leaking pipe at 6 m", bell(np.abs(x - 6), 2.0), (6, 8, "R"), 6.0),
        ("tunnel at 4.5 m", -gaussian(np.abs(x - 4.5), 1.6), (4.5, 6.1, "i"), 4.5),
    ]
    for ax, (name, y, width, at) in zip(made.subplots(2, 3).flat, panels, strict=True):
        ground(ax, x, y, -1.6)
        ax.plot([0, 9], [0, 0], color=BLUE, ls="--", lw=1)
        peak = float(np.interp(at, x, y))
        if width:
            level = -0.4 if peak > 0 else 0.3
            span(ax, (width[0], level), (width[1], level))
            note(ax, (width[0] + width[1]) / 2, level + 0.08, width[2], BLUE, "cb")
        arrow(ax, (at + 0.1, 0), (at + 0.1, peak), RED)
        note(ax, at + 0.35, peak * (0.85 if peak > 0 and at == 0 else 0.25), "y", RED, "lm")
        ax.set(xlim=(0, 9), ylim=(-1.6, 1.25), yticks=[], xticks=[0, 3, 6, 9], title=name)
        ax.spines["left"].set_visible(False)
        if at:
            ax.set_xlabel("along the wall (m)")
    return made


@sketch
def movement() -> Figure:
    """Surface movement of the free ground, central deflection of the footing."""
    made, ax = bare(62, (-2.9, 13.4, -2.2, 2.9))
    x = np.linspace(-1.5, 10.5, 400)
    bottom = lambda at: -0.06 - 0.5 * ((at - 4.5) / 4.5) ** 2  # noqa: E731
    ground(ax, x, -1.1 * walsh(np.clip(x, 0, 9), 9, 2.6), -2.2)
    ax.plot([-1.5, 10.5], [0, 0], color=GREY, ls=":", lw=1)
    wall(ax, 9, 2.2, lifted(lambda at: bottom(at) + 0.4))
    footing(ax, 9, bottom, 0.4)
    note(ax, 10.6, 0.03, "ground before", GREY, "lm")
    note(ax, 10.6, -1.05, "free ground after,\nwithout the house", GREY, "lm")
    span(ax, (-0.8, 0), (-0.8, -1.1), RED)
    note(ax, -0.95, -0.55, "surface\nmovement", RED, "rm")
    ax.plot([0, 9], [-0.56, -0.56], color=BLUE, ls="--", lw=1)
    span(ax, (4.5, -0.56), (4.5, -0.06))
    note(
        ax,
        4.5,
        -0.75,
        "central deflection: the centre of the footing\nrelative to the line through its ends",
        BLUE,
        "ct",
    )
    note(ax, 4.5, 0.14, "footing", zorder=3)
    note(ax, 9.2, -0.55, "gap", RED, "lm")
    return made


@sketch
def tree_at_one_end() -> Figure:
    """Ground that a tree dries, under one end of a wall."""
    made, ax = bare(62, (-2.7, 12, -2.2, 3.2))
    x = np.linspace(-2.6, 12, 400)
    settled = lambda at: -0.9 * tree(np.abs(at), 5.5)  # noqa: E731
    bottom = lambda at: 0.55 * settled(at)  # noqa: E731
    ground(ax, x, settled(x), -2.2)
    ax.fill_between(x, settled(x), -2.2, where=np.abs(x) < 5.5, color="#e0b070", alpha=0.45, lw=0)
    wall(ax, 9, 2.2, lifted(lambda at: bottom(at) + 0.3), ((1.9, 0.66, 1.5, 1.1), (5.7, 0.66, 1.5, 1.1)))
    footing(ax, 9, bottom, 0.3)
    ax.plot([-1.3, -1.3], [settled(-1.3), 1.5], color=LINE, lw=4)
    ax.add_patch(Ellipse((-1.3, 2.2), 1.9, 1.8, fc="#8fb07a"))
    ax.plot([-2.6, 12], [0, 0], color=BLUE, ls="--", lw=1)
    ax.plot([0, 0, np.nan, 5.5, 5.5], [-0.9, -1.6, 0, 0, -1.6], color=BLUE, lw=0.6)
    span(ax, (0, -1.5), (5.5, -1.5))
    note(ax, 2.75, -1.6, "reach $R$, from the end of the wall", BLUE, "ct")
    arrow(ax, (-0.3, 0), (-0.3, settled(0)), RED)
    note(ax, -2.5, -1.35, "surface\nmovement $y_{max}$", RED, "lm")
    note(ax, 9.4, -0.3, "no movement", GREY, "lm")
    note(ax, 9.4, 0.28, "ground before", BLUE, "lm")
    return made


@sketch
def end_that_settles() -> Figure:
    """Ground that goes down under one end of a wall, in a straight line."""
    made, ax = bare(52, (-1.2, 11, -1.9, 3.0))
    x = np.linspace(-1.2, 11, 300)
    settled = lambda at: -0.9 * np.clip(1.0 - np.maximum(at, 0.0) / 3.0, 0.0, 1.0)  # noqa: E731
    bottom = lambda at: 0.5 * settled(at)  # noqa: E731
    ground(ax, x, settled(x), -1.9)
    wall(ax, 9, 2.3, lifted(lambda at: bottom(at) + 0.3), WINDOWS)
    footing(ax, 9, bottom, 0.3)
    ax.plot([-1.2, 11], [0, 0], color=BLUE, ls="--", lw=1)
    ax.plot([3.5, 3.2, 3.45, 3.1], [2.55, 2.3, 2.1, 1.9], color=RED, lw=2.2)
    note(ax, 3.6, 2.75, "crack", RED, "cb")
    arrow(ax, (-0.5, 0), (-0.5, settled(0.0)), RED)
    note(ax, -0.5, -1.25, "25 mm", RED, "ct")
    span(ax, (0, -1.5), (3, -1.5))
    note(ax, 1.5, -1.55, "3 m", BLUE, "ct")
    note(ax, 9.3, 0.1, "ground before", BLUE, "lb")
    return made


@sketch
def soil_log() -> Figure:
    """Layers of clay under a footing, and the change of suction with depth."""
    made, layers, suction = bare(56, (-0.6, 9.6, -4.6, 2.6), (-0.2, 2.4, -4.6, 2.6), widths=(3, 1))
    for top, end, words, colour in (
        (0.0, -0.8, "topsoil 0.4 m, $I_{ss}$ = 1 %", "#c9b98f"),
        (-0.8, -2.4, "clay 1.2 m, 4 %", "#d9a066"),
        (-2.4, -4.6, "deep clay 3 m, 3 %", SOIL),
    ):
        layers.fill_between([-0.6, 9.6], top, end, color=colour, lw=0)
        note(layers, 4.4, (top + end) / 2 - (0.15 if top == 0.0 else 0.0), words)
    footing(layers, 8, lambda at: 0.0 * at - 0.3, 0.3)
    wall(layers, 8, 2.3, lifted(lambda at: 0.0 * at), ((1.5, 0.8, 1.8, 1.0), (4.7, 0.8, 1.8, 1.0)))
    suction.plot([0, 1.6, 0, 0], [0, 0, -4.2, 0], color=RED)
    suction.fill([0, 1.6, 0], [0, 0, -4.2], color=RED, alpha=0.2)
    note(suction, 0.9, 0.2, "change of suction", RED, "cb")
    note(suction, 0.3, -4.2, "$H_s$", RED, "lm")
    return made


@sketch
def survey() -> Figure:
    """Observed cracks and levels of a wall."""
    made, ax = bare(48, (-0.8, 7.6, -1.0, 3.0))
    wall(ax, 6, 2.4, lifted(lambda at: 0.0 * at), ((2.1, 0.9, 1.8, 1.2),))
    for x, y, words in ((1.75, 1.9, "width?"), (2.3, 0.5, "width?"), (4.4, 1.9, "no crack")):
        ax.add_patch(Circle((x, y), 0.28, fill=False, color=RED, lw=1.3))
        box = {"fc": "w", "ec": "none", "pad": 1}
        note(ax, x + (0.35 if x > 4 else -0.35), y, words, RED, "lm" if x > 4 else "rm", bbox=box)
    for x in (0.0, 3.0, 6.0):
        arrow(ax, (x, -0.75), (x, -0.05))
    note(ax, 6.2, -0.45, "levels", BLUE, "lm")
    return made


@sketch
def control_joint() -> Figure:
    """Wall with and without a control joint, on doming ground."""
    made, whole, jointed = bare(46, *[(-0.6, 9.6, -1.3, 3.7)] * 2)
    x = np.linspace(-0.5, 9.5, 200)
    for ax, title in ((whole, "whole wall: one wide crack"), (jointed, "with a control joint: both halves turn")):
        ground(ax, x, -0.6 * ((x - 4.5) / 4.5) ** 2, -1.3)
        ax.set_title(title)
    wall(whole, 9, 2.4, lifted(lambda at: -0.45 * ((at - 4.5) / 4.5) ** 2), WINDOWS)
    whole.plot([4.45, 4.18, 4.45, 4.15, 4.4, 4.2], np.arange(2.4, 1.1, -0.24), color=RED, lw=2.2)
    note(whole, 4.5, 2.6, "crack", RED, "cb")
    wall(jointed, 4.46, 2.4, turned(0.075, 4.46), WINDOWS)
    wall(jointed, 9, 2.4, turned(-0.075, 4.54), WINDOWS, start=4.54)
    note(jointed, 4.5, 2.6, "the joint opens: no category", BLUE, "cb")
    return made


@sketch
def elimination_tree() -> Figure:
    """Separators of a wall by nested dissection, and the tree of fronts."""
    made, plan, graph = bare(56, (-0.2, 13.2, -0.9, 4.9), (-0.8, 8.8, -0.6, 5.3), widths=(1.25, 1))
    shades = dict(zip("1234567", ("#c9daf0", "#f0d9c0", "#d5e8cf", "#eed3dc", "#8fb3df", "#e0a870", RED), strict=True))
    regions = {"1": (0, 4, 6, 4), "2": (0, 0, 6, 3), "3": (7, 4, 6, 4), "4": (7, 0, 6, 3), "5": (0, 3, 6, 1)}
    for name, (left, low, columns, rows) in (regions | {"6": (7, 3, 6, 1), "7": (6, 0, 1, 8)}).items():
        for x, y in np.ndindex(columns, rows):
            plan.add_patch(Rectangle((left + x, (low + y) / 2), 1, 0.5, fc=shades[name], ec="w", lw=0.8))
        at = (left + columns / 2, (low + rows / 2) / 2)
        note(plan, *at, name, "w" if name == "7" else "k", weight="bold")
    note(plan, 6.5, 4.3, "7 divides the wall; 5 and 6 divide its halves")
    nodes = dict(zip("7561234", ((4, 4), (2, 2.4), (6, 2.4), (1, 0.8), (3, 0.8), (5, 0.8), (7, 0.8)), strict=True))
    for child, parent in ("57", "67", "15", "25", "36", "46"):
        new = child + parent in ("36", "67")
        ends = np.transpose([nodes[child], nodes[parent]])
        graph.plot(*ends, color=RED if new else GREY, lw=2.5 if new else 1, zorder=0)
    for name, at in nodes.items():
        graph.add_patch(Circle(at, 0.45, fc=shades[name], ec=RED if name in "367" else GREY, lw=1.5))
        note(graph, *at, name, "w" if name == "7" else "k", weight="bold")
    note(graph, 4, -0.15, "crack in 3: only 3, 6, 7 are eliminated again", RED)
    note(graph, 4, 4.85, "elimination: leaves first, root last")
    return made


@sketch
def crack_band() -> Figure:
    """One joint, or all joints along a gauge."""
    made, ax = bare(38, (-0.2, 11.4, -0.2, 2.6))
    wall(ax, 7, 2.4, lifted(lambda x: 0 * x))
    for number, width in ((3, 1.5), (4, 3.0), (5, 1.8)):
        for course in range(3, 9):
            x = 0.643 * (number - 0.5 * (course % 2))
            ax.plot([x, x], [course * 0.24, course * 0.24 + 0.24], color=RED, lw=width)
    span(ax, (1.45, 1.32), (3.45, 1.32))
    arrow(ax, (3.45, 1.32), (7.3, 1.8), style="-")
    note(ax, 7.4, 1.8, "crack band: openings of neighbouring\njoints, added up along a gauge of 0.75 m", BLUE, "lm")
    arrow(ax, (2.25, 0.84), (7.3, 0.6), RED, "-")
    note(ax, 7.4, 0.6, "widest crack: the largest opening\nof one joint", RED, "lm")
    return made


@sketch
def capacity() -> Figure:
    """From paths of walls to a fragility curve."""
    made = Figure(figsize=(WIDTH, 58 / 25.4), layout="constrained")
    paths, curve = made.subplots(1, 2)
    steps = np.arange(0, 25, 4.0)
    paths.plot(steps, [0, 0.4, 0.9, 2.2, 5.6, 7.5, 9], "o-", color="k", ms=3, lw=1.4, clip_on=False)
    paths.plot(steps, [0, 0.1, 0.3, 0.9, 1.6, 3.2, 4.1], "o-", color=BLUE, ms=3, lw=1, clip_on=False)
    paths.plot(steps, [0, 0.7, 2.9, 6.0, 9, 11, 12.6], "o-", color=GREY, ms=3, lw=1, clip_on=False)
    paths.axhline(5, color=RED, ls="--", lw=1)
    note(paths, 0.3, 5.1, "category 3: 5 mm", RED, "lb", fontsize=7)
    paths.axvspan(12, 16, color=BRICK, alpha=0.7, lw=0)
    note(paths, 11.5, 12.6, "bracket of the black\nwall's capacity", align="rt", fontsize=7)
    arrow(paths, (9, 10.8), (13, 9.8), "k")
    note(paths, 24, 2.3, "censored", BLUE, "rt", fontsize=7)
    paths.set(xlabel="movement (mm)", ylabel="widest crack (mm)", xlim=(0, 24), ylim=(0, 13))
    x = np.linspace(0.1, 40, 200)
    curve.plot(x, norm.cdf(np.log(x / 14) / 0.5), color="k")
    curve.plot([0, 14, 14], [0.5, 0.5, 0], color=BLUE, ls="--", lw=1)
    note(curve, 14.6, 0.06, r"median $\theta$", BLUE, "lm")
    note(curve, 21, 0.5, "a smaller dispersion $\\beta$\nmakes it steeper", GREY, "lm", fontsize=7)
    curve.set(xlabel="movement (mm)", ylabel="P(category 3 or worse)", xlim=(0, 40), ylim=(0, 1))
    return made
