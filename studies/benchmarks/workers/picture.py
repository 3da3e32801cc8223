"""Time and efficiency over the number of workers."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.ticker import FuncFormatter
from model import Costs, predicted

from damagepred.archive.files import write_whole
from damagepred.plotting.sheet import DPI, new_figure, set_title, small

NAMES = {"window": "small window wall", "solid": "solid wall of the full-scale test"}
COLOURS = {100_000: "tab:blue", 1_000_000: "tab:red"}


def draw(costs: Mapping[str, Costs], runs: pd.DataFrame, path: Path) -> None:
    """Draw the model's time and efficiency, and the measured runs."""
    figure = new_figure(9.5, 7.5)
    panels = figure.subplots(2, len(costs), squeeze=False, sharex=True)
    workers = 2 ** np.linspace(0, 12, 73)
    for j, (wall, own) in enumerate(costs.items()):
        above, below = panels[0][j], panels[1][j]
        for samples, colour in COLOURS.items():
            found = [predicted(own, samples, w) for w in workers]
            above.plot(
                workers, [f.total / 3600 for f in found], color=colour, label=f"{samples:,} walls".replace(",", " ")
            )
            below.plot(workers, [f.efficiency for f in found], color=colour)
        measured = runs[runs["wall"] == wall]
        for way, mark in (("own", "o"), ("Dask", "s")):
            part = measured[measured["way"].str.startswith(way)]
            count = int(measured["walls"].iloc[0]) if len(measured) else 0
            label = f"measured, {count} walls, {way}" + (" pool" if way == "own" else "")
            inside = "none" if way == "Dask" else "black"
            above.plot(part["workers"], part["seconds"] / 3600, mark, color="black", mfc=inside, label=label)
        if len(measured):
            above.plot(
                workers,
                [predicted(own, count, w).total / 3600 for w in workers],
                ":",
                color="black",
                label=f"model, {count} walls",
            )
        set_title(above, NAMES[wall], f"{1e3 * own.wall:.0f} ms a wall")
        above.set_ylabel("hours")
        below.set_ylabel("share of workers' time spent on walls")
        below.set_xlabel("workers")
        above.set_xscale("log")
        above.set_yscale("log")
        below.set_ylim(0, 1.02)
        below.xaxis.set_major_formatter(FuncFormatter(lambda v, _: f"{v:g}"))
        above.yaxis.set_major_formatter(FuncFormatter(lambda v, _: f"{v:g}"))
        above.legend(frameon=False, fontsize=small(above))
        for ax in (above, below):
            ax.grid(True, color="0.9")
    write_whole(path, lambda p: figure.savefig(p, dpi=DPI, format="png"))
