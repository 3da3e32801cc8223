"""Pictures of the comparison: time over size, and the wall over ground that has dropped, solver by solver."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
from cases import CASES
from matplotlib.cm import ScalarMappable
from matplotlib.collections import PolyCollection
from matplotlib.colors import Normalize
from matplotlib.ticker import NullLocator
from tables import NAMES, fastest

from damagepred.archive.files import write_whole
from damagepred.plotting.sheet import DPI, new_figure

LOOKS = {
    "quasi_static": ("#0b5394", "o"),
    "explicit": ("#6fa8dc", "s"),
    "pymunk": ("#38761d", "^"),
    "lmgc90": ("#990000", "D"),
    "openseespy": ("#b45f06", "v"),
    "exudyn": ("#674ea7", "P"),
}
LEVEL = "s at 0.001"
TITLES = {"settling": "Under its own weight", "gap": "Ground dropped by 8 mm under the middle"}
SETTLED = 1e-2
"""Residual up to which a wall is drawn."""
DRAWN = {"5x6": 8, "10x12": 15, "25x28": 30}
"""Exaggeration of the displacements."""


def draw_times(runs: pd.DataFrame, path: Path) -> None:
    """Draw the time to a residual of 1e-3 over the number of blocks."""
    figure = new_figure(11.0, 4.6)
    panels = figure.subplots(1, 2, sharey=True)
    for ax, (case, words) in zip(panels, TITLES.items()):
        best = fastest(runs, case)
        for solver, (colour, marker) in LOOKS.items():
            own = best[best["solver"] == solver].dropna(subset=[LEVEL]).sort_values("blocks")
            if len(own):
                ax.loglog(own["blocks"], own[LEVEL], color=colour, marker=marker, label=NAMES[solver])
        ax.set(title=words, xlabel="blocks", xlim=(25, 900))
        ax.xaxis.set_minor_locator(NullLocator())
        sizes = sorted(runs.loc[runs["case"] == case, "blocks"].unique())
        ax.set_xticks(sizes, [str(blocks) for blocks in sizes])
        ax.grid(which="both", alpha=0.25)
    panels[0].set_ylabel("processor time to a residual of 1e-3, s")
    handles = {}
    for ax in panels:
        handles |= dict(zip(*ax.get_legend_handles_labels()[::-1]))
    figure.legend(handles.values(), handles.keys(), loc="outside lower center", ncols=6, frameon=False)
    write_whole(path, lambda p: figure.savefig(p, dpi=DPI, format="png"))


def draw_gap(runs: pd.DataFrame, moved: pd.DataFrame, size: str, path: Path) -> None:
    """Draw the wall over the ground that dropped, solver by solver: by default, or its run with the least residual."""
    part = runs[(runs["case"] == "gap") & (runs["size"] == size) & (runs["residual"] < SETTLED)]
    part = part[part["solver"].isin(LOOKS)]
    part = part.sort_values("residual").sort_values("settings", key=lambda c: c != "default", kind="stable")
    chosen = [part[part["solver"] == s].iloc[0] for s in LOOKS if (part["solver"] == s).any()]
    case = CASES["gap"](size)
    corners, larger = np.array(case["blocks"]), DRAWN[size]
    columns = 3
    rows = -(-len(chosen) // columns)
    high = 3.3 * np.ptp(corners[..., 1]) / np.ptp(corners[..., 0])
    figure = new_figure(12.0, 0.6 + (high + 0.9) * rows)
    panels = figure.subplots(rows, columns, squeeze=False, sharex=True, sharey=True)
    norm = Normalize(0.0, 1e3 * max(case["drop"]))
    for ax in panels.flat[len(chosen) :]:
        ax.axis("off")
    for ax, run in zip(panels.flat, chosen):
        own = moved[
            (moved["case"] == "gap")
            & (moved["size"] == size)
            & (moved["solver"] == run["solver"])
            & (moved["settings"] == run["settings"])
        ].sort_values("block")
        shift = larger * own[["x", "y"]].to_numpy()[:, None] / 1e3
        arm = corners - corners.mean(axis=1, keepdims=True)
        turn = larger * own["turn"].to_numpy()[:, None]
        rotated = np.stack((-arm[..., 1] * turn, arm[..., 0] * turn), axis=-1)
        faces = PolyCollection(
            corners + shift + rotated,
            array=-own["y"].to_numpy(),
            cmap="viridis_r",
            norm=norm,
            edgecolors="white",
            linewidths=0.4,
        )
        ax.add_collection(faces)
        for piece, drop in zip(case["ground"], case["drop"]):
            ground = np.array(piece) - (0.0, larger * drop)
            ax.fill(*ground.T, color="0.75")
        settings = "" if run["settings"] == "default" else f"\n{run['settings']}"
        ax.set_title(f"{NAMES[run['solver']]}{settings}", fontsize=9)
        ax.set(
            xlim=(-0.3, corners[..., 0].max() + 0.3),
            ylim=(-0.1 - larger * max(case["drop"]), corners[..., 1].max() + 0.05),
            aspect="equal",
        )
        ax.set_xticks([])
        ax.set_yticks([])
    bar = figure.colorbar(ScalarMappable(norm, "viridis_r"), ax=panels, shrink=0.8)
    bar.set_label("down, mm")
    figure.suptitle(
        f"Wall of {len(corners)} blocks over ground dropped by 8 mm (displacements x {larger})", fontsize=11
    )
    write_whole(path, lambda p: figure.savefig(p, dpi=DPI, format="png"))


def draw(folder: Path) -> None:
    """Draw all pictures from the data in a folder."""
    runs = pd.read_csv(folder / "runs.csv")
    draw_times(runs, folder / "times.png")
    moved = folder / "moved.csv"
    if moved.exists():
        known = pd.read_csv(moved)
        settled = runs[(runs["case"] == "gap") & (runs["residual"] < SETTLED) & runs["solver"].isin(LOOKS)]
        solvers = settled.groupby("size")["solver"].nunique()
        for size in solvers.index[solvers > 1]:
            draw_gap(runs, known, str(size), folder / f"gap_{size}.png")
