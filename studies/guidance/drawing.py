"""The picture of a study: shares of walls in each category at each limit, variant by variant."""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from damagepred.archive.files import write_whole
from damagepred.plotting.colours import CATEGORY_COLOURS
from damagepred.plotting.sheet import DPI, new_figure, set_title, small, text_size

NAMES = {1: "very slight or worse", 2: "slight or worse", 3: "moderate or worse"}


def draw(title: str, rows: pd.DataFrame, path: Path) -> None:
    """Draw a table of ``tables.rows_of``: a row of panels for each way of movement, a panel for each limit."""
    kinds, variants = list(dict.fromkeys(rows["movement"])), list(dict.fromkeys(rows["variant"]))
    limits = list(dict.fromkeys(rows["limit of"]))
    figure = new_figure(3.1 + 2.9 * len(limits), 1.9 + (0.42 * len(variants) + 0.9) * len(kinds))
    panels = figure.subplots(len(kinds), len(limits), squeeze=False, sharex=True, sharey=True)
    for (kind, limit), part in rows.groupby(["movement", "limit of"], sort=False):
        ax = panels[kinds.index(kind)][limits.index(limit)]
        for category, own in part.groupby("category"):
            at = [variants.index(v) + 0.24 * (category - 2) for v in own["variant"]]
            ax.barh(at, own["share"], height=0.22, color=CATEGORY_COLOURS[category], label=NAMES[category])
            ax.errorbar(
                own["share"],
                at,
                xerr=[(own["share"] - own["lower"]).clip(0), (own["upper"] - own["share"]).clip(0)],
                fmt="none",
                ecolor="black",
                elinewidth=0.8,
            )
        where = part["limit"].iloc[0]
        set_title(ax, f"{kind} to {where}", f"limit of {limit}")
        ax.set_xlim(0, 1)
        ax.set_yticks(range(len(variants)), variants)
    panels[0][0].invert_yaxis()
    for ax in panels[-1]:
        ax.set_xlabel("share of the walls")
    handles, labels = panels[0][0].get_legend_handles_labels()
    walls = int(rows["walls"].max())
    figure.legend(
        handles,
        labels,
        loc="outside lower center",
        ncols=3,
        frameon=False,
        fontsize=small(panels[0][0]),
        title_fontsize=small(panels[0][0]),
        title=f"damage category (AS 2870 Table C1); up to {walls} walls a bar, lines: 90 % confidence",
    )
    figure.suptitle(title, fontsize=text_size(panels[0][0]))
    write_whole(path, lambda p: figure.savefig(p, dpi=DPI, format="png"))
