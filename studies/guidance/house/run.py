"""Damage of a front wall alone, with returns, and in a house, on two grounds.

    python studies/guidance/house/run.py [--samples 32] [--workers 1]

Writes table.csv, damage.png and the table of the page. The same command resumes.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from damagepred import Scene, open_study
from damagepred.archive.files import write_whole
from damagepred.campaign.settings import StudySettings
from damagepred.inputs.input_files import read_toml
from damagepred.plotting.colours import CATEGORY_COLOURS
from damagepred.plotting.sheet import DPI, new_figure, set_title, small
from damagepred.results.house import wall_dataset
from studies.guidance.run import run_walls
from studies.pages import put_in

HERE = Path(__file__).resolve().parent
LENGTH, WIDTH, SIZE = 12.0, 8.0, 0.06  # outline, largest movement of the ground (m)
BLOCKS = {"height": 2.4, "thickness": 0.19, "block_length": 0.4, "block_height": 0.2}
WINDOW = {"kind": "window", "x": 2.4, "y": 0.8, "width": 1.6, "height": 1.2}
DOOR = {"kind": "door", "x": 7.6, "width": 0.8, "height": 2.0}
TREE = {"shape": "tree", "point": [-2.0, -2.0], "reach": 12.0}
GROUNDS = {"tree at the corner": (TREE, {"kind": "settle"}), "edge heave": ({"shape": "walsh"}, {"kind": "dishing"})}
VARIANTS = {"front wall alone": 0.0, "returns of 2 m": 2.0, "returns of 4 m": 4.0, "house of 12 x 8 m": WIDTH}
BEGIN = "<!-- table: written by run.py -->"


def walls_of(depth: float) -> list[dict[str, Any]]:
    """Front wall with returns of a depth (m) at both ends; at the full depth also a back wall."""
    ends = [("front", [0, 0], [LENGTH, 0]), ("left", [0, depth], [0, 0]), ("right", [LENGTH, 0], [LENGTH, depth])]
    ends = ends if depth < WIDTH else [*ends, ("back", [LENGTH, depth], [0, depth])]
    walls = [{"name": name, "start": a, "end": b, **BLOCKS} for name, a, b in (ends if depth else ends[:1])]
    return [{**walls[0], "opening": [WINDOW, DOOR]}, *walls[1:]]


def study_of(depth: float, ground: str) -> StudySettings:
    """Study of a variant; the mound of edge heave is the mound of the whole house, as levels."""
    tables, (mound, movement) = read_toml(HERE / "house.toml"), GROUNDS[ground]
    mound = {**mound, "surface_movement": SIZE}
    if mound["shape"] == "walsh":
        whole = Scene.from_dict({"wall": walls_of(WIDTH), "mound": mound, "movement": movement})
        x, y = np.meshgrid(np.linspace(0.0, LENGTH, 49), np.linspace(0.0, WIDTH, 33), indexing="ij")
        levels = np.stack((x, y, whole.surface(np.stack((x, y), axis=-1)) / SIZE), axis=-1).reshape(-1, 3)
        mound, movement = {"shape": "levels", "levels": levels.tolist(), "surface_movement": SIZE}, {"kind": "heave"}
    movement = {**tables["scene"]["movement"], **movement}
    scene = {**tables["scene"], "wall": walls_of(depth), "mound": mound, "movement": movement}
    return StudySettings.from_dict({**tables, "scene": scene}, "house.toml")


def rows_of(ds: xr.Dataset, ground: str, variant: str) -> list[dict[str, Any]]:
    """Share of front walls and of houses in each category or worse at quarters of the movement."""
    rows = []
    for what, one in (("front wall", wall_dataset(ds, "front")), ("worst wall", ds)):
        category, moved = one["damage_category"].values, one["surface_movement"].values[0]
        for step in range(2, len(moved), 2):
            known = category[category[:, step] >= 0, step]
            shares = {f"share_{k}": float((known >= k).mean()) for k in (1, 2, 3)}
            width = 1e3 * float(np.nanmedian(one["crack_width_max"].values[:, step]))
            row = {"ground": ground, "variant": variant, "of": what, "movement_mm": round(1e3 * float(moved[step]), 1)}
            rows.append(row | shares | {"median_width_mm": width, "walls": len(known)})
    return rows


def markdown(table: pd.DataFrame) -> str:
    """Table of the page."""
    lines = ["| ground | walls | damage of | 15 mm | 30 mm | 45 mm | 60 mm | crack at 60 mm (mm) |", "|---" * 8 + "|"]
    for names, rows in table.groupby(["ground", "variant", "of"], sort=False):
        cells = [" / ".join(f"{100 * row[f'share_{k}']:.0f}" for k in (1, 2, 3)) for _, row in rows.iterrows()]
        lines.append(f"| {' | '.join([*names, *cells])} | {rows['median_width_mm'].iloc[-1]:.2g} |")
    return "\n".join(lines)


def draw(table: pd.DataFrame, path: Path) -> None:
    """Shares of the front walls at full movement."""
    last = table[(table["of"] == "front wall") & (table["movement_mm"] == table["movement_mm"].max())]
    axes = new_figure(9.0, 3.0).subplots(1, 2, sharey=True)
    for ax, (ground, rows) in zip(axes, last.groupby("ground", sort=False)):
        for k in (1, 2, 3):
            place, shares = np.arange(len(rows))[::-1] + 0.25 * (2 - k), 100 * rows[f"share_{k}"]
            ax.barh(place, shares, 0.22, color=CATEGORY_COLOURS[k], label=f"{k} or worse")
        ax.set_yticks(np.arange(len(rows))[::-1], rows["variant"])
        set_title(ax, ground, f"front walls at {1e3 * SIZE:g} mm, {rows['walls'].max()} per bar")
        ax.set(xlabel="share (%)", xlim=(0, 100))
    axes[1].legend(title="category", loc="lower right", fontsize=small(axes[1]), title_fontsize=small(axes[1]))
    write_whole(path, lambda p: axes[0].figure.savefig(p, dpi=DPI, format="png"))


def main() -> None:
    """Run the variants and write table, picture and page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name, default, words in (("samples", None, "houses per variant and ground"), ("workers", 1, "processes")):
        parser.add_argument(f"--{name}", type=int, default=default, help=words)
    parser.add_argument("--output", type=Path, default=HERE)
    options = parser.parse_args()
    rows: list[dict[str, Any]] = []
    for number, (ground, (name, depth)) in enumerate((g, v) for g in GROUNDS for v in VARIANTS.items()):
        folder = options.output / "results" / f"{number}.dp"
        folder.parent.mkdir(exist_ok=True, parents=True)
        ended = run_walls(study_of(depth, ground), folder, options.samples, options.workers)
        print(f"{ground}, {name}: {ended.done} done, {ended.failed} failed, {ended.seconds:.0f} s", flush=True)
        rows += rows_of(open_study(folder), ground, name)
    table = pd.DataFrame(rows)
    write_whole(options.output / "table.csv", lambda p: table.to_csv(p, index=False, float_format="%.4g"))
    draw(table, options.output / "damage.png")
    if options.output == HERE:
        put_in(HERE / "README.md", markdown(table), BEGIN)


if __name__ == "__main__":
    main()
