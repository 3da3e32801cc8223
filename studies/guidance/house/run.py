"""Damage of one front wall alone, with returns, and in a house, on two grounds.

    python studies/guidance/house/run.py [--samples 16] [--workers 2]

All variants have the same samples of material and the same ground. Writes table.csv, damage.png and the table of the
page. The same command resumes.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from damagepred import Scene, Study, open_study
from damagepred.archive.files import write_whole
from damagepred.campaign.settings import StudySettings
from damagepred.inputs.input_files import read_toml
from damagepred.plotting.colours import CATEGORY_COLOURS
from damagepred.plotting.sheet import DPI, new_figure, set_title, small
from damagepred.results.house import wall_dataset
from studies.pages import put_in

HERE = Path(__file__).resolve().parent
LENGTH, WIDTH = 12.0, 8.0
"""Outline of the house (m)."""
BLOCKS = {"height": 2.4, "thickness": 0.19, "block_length": 0.4, "block_height": 0.2}
"""Walls of concrete blocks of ordinary size (m)."""
WINDOW = {"kind": "window", "x": 2.4, "y": 0.8, "width": 1.6, "height": 1.2}
DOOR = {"kind": "door", "x": 7.6, "width": 0.8, "height": 2.0}
SIZE = 0.06
"""Largest movement of the ground (m)."""
TREE = {"mound": {"shape": "tree", "point": [-2.0, -2.0], "reach": 12.0}, "movement": {"kind": "settle"}}
CLAY = {"mound": {"shape": "walsh"}, "movement": {"kind": "dishing"}}
VARIANTS = {"front wall alone": 0.0, "returns of 2 m": 2.0, "returns of 4 m": 4.0, "house": WIDTH}
JOINTED = "house, control joints at corners"
BEGIN = "<!-- table: written by run.py -->"


def walls_of(depth: float) -> list[dict[str, Any]]:
    """Front wall with returns of some depth (m) at both ends; the full depth also has a back wall."""
    front = {"name": "front", "start": [0, 0], "end": [LENGTH, 0], "opening": [WINDOW, DOOR], **BLOCKS}
    if not depth:
        return [front]
    left = {"name": "left", "start": [0, depth], "end": [0, 0], **BLOCKS}
    right = {"name": "right", "start": [LENGTH, 0], "end": [LENGTH, depth], **BLOCKS}
    back = {"name": "back", "start": [LENGTH, depth], "end": [0, depth], **BLOCKS}
    return [front, left, right, *([back] if depth == WIDTH else [])]


def ground_of(name: str) -> dict[str, Any]:
    """Ground of the whole house: a tree beyond its corner, or edge heave as levels, so that all variants have it."""
    if name == "tree":
        return {**TREE, "mound": {**TREE["mound"], "surface_movement": SIZE}}
    whole = Scene.from_dict({"wall": walls_of(WIDTH), **CLAY, "mound": {**CLAY["mound"], "surface_movement": SIZE}})
    x, y = np.meshgrid(np.linspace(0.0, LENGTH, 49), np.linspace(0.0, WIDTH, 33), indexing="ij")
    rise = whole.surface(np.stack((x, y), axis=-1))
    levels = np.column_stack((x.ravel(), y.ravel(), (rise / SIZE).ravel())).tolist()
    return {"mound": {"shape": "levels", "levels": levels, "surface_movement": SIZE}, "movement": {"kind": "heave"}}


def study_of(depth: float, ground: str, jointed: bool) -> StudySettings:
    """Study of a variant."""
    tables = read_toml(HERE / "house.toml")
    of_ground = ground_of(ground)
    scene = {**tables["scene"], "wall": walls_of(depth), "mound": of_ground["mound"]}
    scene["movement"] = {**scene["movement"], **of_ground["movement"]}
    scene["corner"] = {**scene["corner"], "control_joint": jointed}
    return StudySettings.from_dict({**tables, "scene": scene}, "house.toml")


def rows_of(ds: xr.Dataset, variant: str, ground: str) -> list[dict[str, Any]]:
    """Share of the front wall, and of the house, in each category or worse by movement."""
    rows = []
    for what, one in (("front", wall_dataset(ds, "front")), ("house", ds)):
        category, moved = one["damage_category"].values, one["surface_movement"].values[0]
        for step in range(3, len(moved), 3):
            known = category[:, step] >= 0
            shares = {f"share_{k}": float((category[known, step] >= k).mean()) for k in (1, 2, 3)}
            width = float(np.nanmedian(one["crack_width_max"].values[:, step]))
            row = {"ground": ground, "variant": variant, "of": what, "movement_mm": round(1e3 * float(moved[step]), 1)}
            rows.append({**row, **shares, "median_width_mm": 1e3 * width, "walls": int(known.sum())})
    return rows


def markdown(table: pd.DataFrame) -> str:
    """Table of the page: shares in category 1 / 2 / 3 or worse of the front wall and of the house, in per cent."""
    lines = ["| ground | variant | of | 15 mm | 30 mm | 45 mm | 60 mm | median crack at 60 mm (mm) |"]
    lines.append("|---|---|---|---|---|---|---|---|")
    for (ground, variant, what), rows in table.groupby(["ground", "variant", "of"], sort=False):
        cells = [" / ".join(f"{100 * row[f'share_{k}']:.0f}" for k in (1, 2, 3)) for _, row in rows.iterrows()]
        lines.append(
            f"| {ground} | {variant} | {what} | {' | '.join(cells)} | {rows['median_width_mm'].iloc[-1]:.2g} |"
        )
    return "\n".join(lines)


def draw(table: pd.DataFrame, path: Path) -> None:
    """Shares of the front wall at full movement, by ground and variant."""
    last = table[(table["of"] == "front") & (table["movement_mm"] == table["movement_mm"].max())]
    figure = new_figure(9.0, 3.4)
    axes = figure.subplots(1, 2, sharey=True)
    for ax, (ground, rows) in zip(axes, last.groupby("ground", sort=False)):
        place = np.arange(len(rows))[::-1]
        for k in (1, 2, 3):
            shares, height = 100 * rows[f"share_{k}"], 0.9 - 0.2 * k
            ax.barh(place, shares, height, color=CATEGORY_COLOURS[k], label=f"{k} or worse")
        ax.set_yticks(place, rows["variant"])
        set_title(ax, ground, f"at {rows['movement_mm'].iloc[0]:g} mm, up to {rows['walls'].max()} walls a bar")
        ax.set_xlabel("share of front walls (%)")
        ax.set_xlim(0, 100)
    axes[0].legend(title="category", loc="lower right", fontsize=small(axes[0]), title_fontsize=small(axes[0]))
    write_whole(path, lambda p: figure.savefig(p, dpi=DPI, format="png"))


def main() -> None:
    """Run the variants and write table, picture and page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--samples", type=int, help="houses per variant and ground; by default as in house.toml")
    parser.add_argument("--workers", type=int, default=2, help="processes")
    parser.add_argument("--output", type=Path, default=HERE, help="folder for table and picture")
    options = parser.parse_args()
    rows = []
    cases = [(name, depth, False) for name, depth in VARIANTS.items()] + [(JOINTED, WIDTH, True)]
    for ground, words in (("tree", "tree at the corner"), ("edge", "edge heave")):
        for number, (name, depth, jointed) in enumerate(cases):
            folder = options.output / "results" / f"{ground}_{number}.dp"
            folder.parent.mkdir(exist_ok=True, parents=True)
            summary = Study(study_of(depth, ground, jointed)).run(folder, options.samples, workers=options.workers)
            print(f"{words}, {name}: {summary.done} done, {summary.failed} failed, {summary.seconds:.0f} s", flush=True)
            rows += rows_of(open_study(folder), name, words)
    table = pd.DataFrame(rows)
    write_whole(options.output / "table.csv", lambda p: table.to_csv(p, index=False, float_format="%.4g"))
    draw(table, options.output / "damage.png")
    if options.output == HERE:
        put_in(HERE / "README.md", markdown(table), BEGIN)


if __name__ == "__main__":
    main()
