"""Picture of the comparison."""

from __future__ import annotations

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from damagepred.damage import deflection_over_strain, load_strain_table
from damagepred.plotting.colours import CATEGORY_COLOURS
from damagepred.plotting.sheet import new_figure, small, text_size
from damagepred.scene import Scene

MARKERS = {"none": ("o", -0.11), "window": ("s", 0.0), "door": ("^", 0.11)}
ANYWHERE = "#2a7fb8"
"""Style of each opening, and its shift (L/H)."""
NEVER = 1 / 215
"""Ordinate of walls that did not reach the category."""
HIGHEST = 4
BASE = {False: "no damp-proof course", True: "with a damp-proof course"}


def draw_diagram(reached: pd.DataFrame, category: int = 2) -> Figure:
    """Draw the diagram of Burland and Wroth, with the movement at which the model reaches a category."""
    figure = new_figure(9.5, 8.6)
    panels = figure.subplots(2, 2, sharex=True, sharey=True)
    for row, dpc in enumerate((False, True)):
        for column, movement in enumerate(("dishing", "doming")):
            ax = panels[row][column]
            _curves(ax, movement, category)
            own = reached[
                (reached["dpc"] == dpc) & (reached["movement"] == movement) & (reached["reaches"] == category)
            ]
            _walls(ax, own)
            ax.set_title(f"{movement.capitalize()}, {BASE[dpc]}", loc="left", fontsize=text_size(ax))
    for ax in panels[1]:
        ax.set_xlabel("length / height")
    for ax in panels[:, 0]:
        ax.set_ylabel("central deflection / length, logarithmic")
    limits = load_strain_table().limits
    handles = [
        Line2D(
            [],
            [],
            color=CATEGORY_COLOURS[k],
            linewidth=2.4 if k == category else 1.0,
            label=f"deep beam, category {k} beyond {100 * limits[k - 1]:g} %",
        )
        for k in range(1, HIGHEST + 1)
    ]

    dot = {"linestyle": "none", "color": "black"}
    handles += [Line2D([], [], marker=MARKERS[n][0], label=n, **dot) for n in ("window", "door")]
    handles += [
        Line2D([], [], marker="o", label="no opening", **dot),
        Line2D([], [], marker="o", markerfacecolor="white", label="a third of the bond", **dot),
        Patch(color="black", label="crack of 1 mm in perpends"),
        Patch(color=ANYWHERE, label="in any joint above the dpc or footing"),
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=3, frameon=False, fontsize=small(ax))
    figure.suptitle(
        f"Where walls of bricks and joints crack as wide as category {category} (1 mm), and where the deep beam does",
        x=0.01,
        ha="left",
        fontsize=text_size(ax),
    )
    return figure


def _curves(ax: Axes, movement: str, category: int) -> None:
    slenderness = np.linspace(0.55, 4.6, 200)
    shear = 2 * (1 + Scene().block.poisson_ratio)
    critical = np.minimum(*deflection_over_strain(slenderness, 1.0, movement, shear))
    for number, limit in enumerate(load_strain_table().limits, start=1):
        width = 2.4 if number == category else 1.0
        ax.semilogy(slenderness, limit * critical, color=CATEGORY_COLOURS[number], linewidth=width, zorder=1)
    ratios = (5000, 2000, 1000, 500, 300)
    ax.set_yticks(
        [1 / r for r in ratios] + [NEVER], [f"1/{r}" for r in ratios] + ["not up\nto 1/300"], fontsize=small(ax)
    )
    ax.minorticks_off()
    ax.axhline(1 / 300, color="0.6", linewidth=0.8, linestyle=":")
    ax.set_ylim(1 / 7000, 1 / 185)
    ax.set_xlim(0.55, 4.6)
    ax.grid(axis="y", color="0.9", linewidth=0.6)


def _walls(ax: Axes, own: pd.DataFrame) -> None:
    for column, colour, order in (("model", ANYWHERE, 3), ("perpends", "black", 4)):
        for wall in own.itertuples():
            marker, aside = MARKERS[wall.opening]
            weak, reached = wall.bond < 1, getattr(wall, column)
            y = NEVER * (0.96 if weak else 1.04) if np.isnan(reached) else reached
            followed = wall.followed_to > (1 - 1e-4) / 300
            if np.isnan(reached) and (column == "model" or not followed):
                continue
            ax.plot(
                wall.length / wall.height + aside + (0.025 if weak else -0.025),
                y,
                marker,
                markersize=5.5,
                color=colour,
                markerfacecolor="white" if weak else colour,
                markeredgewidth=0.9,
                zorder=order,
            )
