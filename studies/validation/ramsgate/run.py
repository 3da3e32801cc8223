"""Ramsgate: predicted damage of a terrace over a tunnel, and what was seen.

    python studies/validation/ramsgate/run.py --samples 16 --workers 2

solves the sampled walls (half a minute each), goes on where it was stopped, and writes the tables of the README.
"""

from __future__ import annotations

import argparse
import csv
from pathlib import Path

import numpy as np

from damagepred import Study, open_study
from damagepred.uq.scores import crps, pit

HERE = Path(__file__).resolve().parent
BEGIN, END = "<!-- written by run.py -->", "<!-- end -->"


def main() -> None:
    """Run the study and write the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--samples", type=int, default=16)
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--folder", type=Path, default=HERE / "results")
    asked = parser.parse_args()
    asked.folder.mkdir(parents=True, exist_ok=True)
    folder = asked.folder / "front.dp"
    summary = Study.from_toml(HERE / "front.toml").run(folder, samples=asked.samples, workers=asked.workers)
    if summary.interrupted:
        raise SystemExit(130)
    ds = open_study(folder)
    movement = ds["surface_movement"].values
    movement = movement[0] if movement.ndim == 2 else movement
    rows = list(csv.DictReader((HERE / "observed.csv").open(encoding="utf-8")))
    lines = [
        "| wall | s_max, mm | seen: widest, mm | predicted: 5, 50, 95 % of the walls, mm | PIT | CRPS, mm | "
        "category at most 1 |",
        "|---|---|---|---|---|---|---|",
    ]
    for row in rows:
        at, seen = float(row["s_max_mm"]) / 1e3, [float(row["width_from_mm"]), float(row["width_to_mm"])]
        widths = np.array([1e3 * np.interp(at, movement, w) for w in ds["crack_width_max"].values])
        reached = int(np.searchsorted(movement, at * (1 - 1e-9)))
        low = (ds["damage_category"].values[:, reached] <= int(row["category"])).mean()
        ends = ", ".join(f"{q:.2f}" for q in np.quantile(widths, [0.05, 0.5, 0.95]))
        middle = float(np.mean(seen))
        lines.append(
            f"| {row['wall']} | {1e3 * at:g} | {seen[0]:g} to {seen[1]:g} | {ends} | {pit(widths, middle)[0]:.2f} | "
            f"{crps(widths, middle)[0]:.2f} | {low:.2f} |"
        )
    lines += ["", f"{summary.done} walls, {summary.failed} failed."]
    print("\n".join(lines))
    if asked.folder == HERE / "results":
        page = HERE / "README.md"
        before, rest = page.read_text(encoding="utf-8").split(BEGIN)
        page.write_text("\n\n".join((before + BEGIN, "\n".join(lines), END + rest.split(END)[1])), encoding="utf-8")


if __name__ == "__main__":
    main()
