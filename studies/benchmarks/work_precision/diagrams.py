"""Work-precision diagrams: error over time, a sheet for each wall, a column for each quantity."""

from __future__ import annotations

import textwrap
from pathlib import Path

import numpy as np
import pandas as pd
from errors import FINE_ENOUGH, edge
from quantities import QUANTITIES

from damagepred.archive.files import write_whole
from damagepred.plotting.sheet import new_figure, small, text_size

DRAWN = (
    "dpc_opening",
    "separation_length",
    "crack_width",
    "base_crack_width",
    "window",
    "first_crack",
    "block_compression",
)
FAMILIES = {
    "default": ("*", "black"),
    "increments": ("o", "#0072b2"),
    "tolerance": ("s", "#0072b2"),
    "skips": ("^", "#0072b2"),
    "same model": ("P", "#0072b2"),
    "explicit": ("o", "#d55e00"),
    "explicit increments": ("v", "#d55e00"),
    "explicit damping": ("s", "#d55e00"),
    "explicit ramp": ("^", "#d55e00"),
    "explicit tolerance": ("D", "#d55e00"),
    "explicit time step": ("x", "#d55e00"),
    "in time, true mass": ("X", "#cc79a7"),
    "contacts": ("o", "#009e73"),
    "rigid blocks": ("x", "#009e73"),
    "elastic blocks": ("D", "#009e73"),
    "auto": ("^", "#56b4e9"),
    "parts": ("v", "#56b4e9"),
    "zones": ("s", "#e69f00"),
    "finest model": ("P", "#e69f00"),
}
"""Mark and colour of each axis."""
NAMES = {
    "skips": "skips turned off",
    "in time, true mass": "dynamic, true mass",
    "contacts": "contacts an interface",
    "auto": "zones where bricks deform",
    "parts": "zones in parts of the wall",
    "zones": "zones in all bricks",
}
"""Words of the legend for an axis whose name is brief."""
LEAST_DRAWN = 1e-6
ROWS = {"solution": "against the same equations,\nsolved closely", "model": "against the finest model"}


def draw(scene: str, what: str, lines: pd.DataFrame, path: Path) -> None:
    """Draw the sheet of a wall.

    Parameters
    ----------
    scene, what : str
        Its name and description.
    lines : DataFrame
        Of ``errors.with_errors``, of this wall.
    path : Path
        Picture to write.
    """
    told = set(lines.dropna(subset=["model", "solution"], how="all")["quantity"])
    lasting = [q for q in DRAWN if q in told and varies(lines, q)]
    if not lasting:  # of a wall whose reference is not solved yet
        return
    figure = new_figure(2.0 + 2.6 * len(lasting), 4.0 + 1.8 * len(lasting))
    panels = figure.subplots(2, len(lasting), squeeze=False, sharex=True, sharey="row")
    seen: dict[str, object] = {}
    for row, (error, label) in enumerate(ROWS.items()):
        for column, quantity in enumerate(lasting):
            ax = panels[row][column]
            own = lines[(lines["quantity"] == quantity) & lines[error].notna()]
            for axis, (mark, colour) in FAMILIES.items():
                part = own[own["axis"] == axis]
                if len(part):
                    drawn = ax.plot(
                        part["seconds"],
                        part[error].clip(LEAST_DRAWN),
                        mark,
                        color=colour,
                        alpha=0.85,
                        markersize=11 if axis == "default" else 5.5,
                        zorder=4 if axis == "default" else 3,
                    )
                    seen.setdefault(axis, drawn[0])
            front = edge(own, error)
            if len(front):
                ax.step(front["seconds"], front[error].clip(LEAST_DRAWN), "-", where="post", color="0.55", zorder=1)
            floor = float(own[f"{error}_floor"].max()) if len(own) else 0.0
            if floor > LEAST_DRAWN:
                ax.axhspan(LEAST_DRAWN / 2, floor, color="0.9", zorder=0)
            ax.axhline(FINE_ENOUGH, color="0.3", linewidth=0.8, linestyle="--")
            ax.set_xscale("log")
            ax.set_yscale("log")
            ax.set_ylim(LEAST_DRAWN / 2, 20.0)
            if row == 0:
                ax.set_title("\n".join(textwrap.wrap(QUANTITIES[quantity], 16)), fontsize=small(ax), loc="left")
            else:
                ax.set_xlabel("processor time\nof a path (s)")
        panels[row][0].set_ylabel(f"error, share of the value,\n{label}")
    figure.legend(
        list(seen.values()),
        [NAMES.get(family, family) for family in seen],
        loc="outside lower center",
        ncols=4,
        frameon=False,
        fontsize=small(ax),
        title="grey: error of the reference; stepped line: Pareto front; dashed: 1 %; both axes logarithmic",
        title_fontsize=small(ax),
    )
    figure.suptitle(f"{scene}: {what}", fontsize=text_size(ax))
    write_whole(path, lambda p: figure.savefig(p, dpi=90, format="png"))


def varies(lines: pd.DataFrame, quantity: str) -> bool:
    """Whether any two choices differ in a quantity beyond rounding."""
    own = lines[lines["quantity"] == quantity]
    return bool(np.nanmax(own[["solution", "model"]].to_numpy(), initial=0.0) > LEAST_DRAWN)
