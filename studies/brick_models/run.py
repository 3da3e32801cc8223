"""The fragility of the window wall with rigid, elastic and zoned bricks, over the same samples.

    python studies/brick_models/run.py [--samples 64] [--workers 2]

runs the same samples with each kind of bricks, half of them with zones, and resumes. It then solves two walls of
each kind again, in turn, for their processor time, and writes the tables of the README and ``fragility.png``.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import replace
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import xarray as xr

from damagepred import Study, compare, fit_fragility, open_study
from damagepred.campaign.replay import replay
from damagepred.campaign.settings import StudySettings
from damagepred.plotting import draw_fragility

HERE = Path(__file__).resolve().parent
STUDY = HERE.parents[1] / "data" / "bryant_study.toml"
BRICKS = {"rigid": "rigid", "elastic": "elastic", "zones": "deformable"}
"""Name in the tables, and value of ``[solver] blocks``."""

DEFLECTION, INCREMENTS = 10e-3, 20
"""Every wall dishes to that (m): past the medians of categories 1 and 2."""

AT = (1e-3, 2e-3, 5e-3, 8e-3)
"""Deflections (m) at which probabilities are compared."""

TIMED = 2
"""Walls of each kind that are solved again for their time."""
FEWER = 2
"""One sample of so many is also solved with bricks of zones, which take twenty times as long."""

BEGIN, END = "<!-- written by run.py -->", "<!-- end -->"


def settings(blocks: str, samples: int) -> StudySettings:
    """Return the study of the test wall with one kind of bricks and one movement for all samples."""
    study = StudySettings.from_toml(STUDY).with_samples(samples, None)
    scene = replace(
        study.scene,
        movement=replace(study.scene.movement, central_deflection=DEFLECTION, increments=INCREMENTS),
        solver=replace(study.scene.solver, blocks=blocks),
    )
    variables = {place: v for place, v in study.variables.items() if place != "movement.central_deflection"}
    title = f"Bryant (1993) window wall, dishing to {1e3 * DEFLECTION:g} mm, {blocks} bricks"
    return replace(study, scene=scene, variables=variables, study=replace(study.study, title=title))


def seconds_of_walls(folders: dict[str, Path]) -> dict[str, float]:
    """Return the mean processor time of a wall (s): the kinds in turn, after one wall of each that is not counted."""
    seconds: dict[str, list[float]] = {name: [] for name in folders}
    for sample in [0, *range(TIMED)]:
        for name, folder in folders.items():
            began = time.process_time()
            replay(folder, sample)
            seconds[name].append(time.process_time() - began)
    return {name: float(np.mean(values[1:])) for name, values in seconds.items()}


def curve_rows(studies: dict[str, xr.Dataset], seconds: dict[str, float]) -> list[str]:
    """Return the rows of the table of curves."""
    rows = []
    for name, ds in studies.items():
        curves = fit_fragility(ds, categories=[1, 2])
        for category in (1, 2):
            one = curves.sel(category=category)
            median = [1e3 * float(one[f"median{end}"]) for end in ("", "_lower", "_upper")]
            spread = [float(one[f"dispersion{end}"]) for end in ("", "_lower", "_upper")]
            fit = " | ".join(f"{mean:.2f} ({low:.2f} to {high:.2f})" for mean, low, high in (median, spread))
            status = str(one["fit_status"].values)
            fit = fit if status == "fitted" else f"{status} | "
            rows.append(f"| {name} | {category} | {fit} | {int(one['reached'])} | {seconds[name]:.1f} |")
    return rows


def difference_rows(studies: dict[str, xr.Dataset]) -> list[str]:
    """Return the rows of the table of differences to rigid bricks, of the same samples."""
    few = min(ds.sizes["sample"] for ds in studies.values())
    same = {name: ds.isel(sample=slice(few)) for name, ds in studies.items()}  # Sobol points: the first of them
    found = compare(same, categories=[1, 2], at=list(AT))
    rows = []
    for category in (1, 2):
        for m, at in enumerate(AT):
            cells = []
            for name in studies:
                one = found.sel(study=name, category=category).isel(movement=m)
                cell = f"{float(one['probability']):.2f}"
                if name != "rigid":
                    change = [float(one[f"difference{end}"]) for end in ("", "_lower", "_upper")]
                    cell += f"; {change[0]:+.2f} ({change[1]:+.2f} to {change[2]:+.2f})"
                cells.append(cell)
            rows.append(f"| {category} | {1e3 * at:g} | " + " | ".join(cells) + " |")
    return rows


def main() -> None:
    """Run the studies, write the tables, draw the curves."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--samples", type=int, default=64)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--bricks", nargs="+", choices=list(BRICKS), default=list(BRICKS))
    parser.add_argument("--folder", type=Path, default=HERE / "results")
    asked = parser.parse_args()
    asked.folder.mkdir(parents=True, exist_ok=True)
    folders = {name: asked.folder / f"{name}.dp" for name in asked.bricks}
    for name, folder in folders.items():
        summary = Study(settings(BRICKS[name], asked.samples // (FEWER if name == "zones" else 1))).run(
            folder, workers=asked.workers
        )
        print(f"{name}: {summary.done} of {summary.total} walls, {summary.failed} failed", flush=True)
        if summary.interrupted:
            raise SystemExit(130)
    studies = {name: open_study(folder) for name, folder in folders.items()}
    text = [
        "| bricks | category | median, mm (90 %) | dispersion (90 %) | walls that reached it | time of a wall, s |",
        "|---|---|---|---|---|---|",
        *curve_rows(studies, seconds_of_walls(folders)),
    ]
    if "rigid" in studies and len(studies) > 1:
        text += ["", "| category | at, mm | " + " | ".join(studies) + " |", "|---|---|" + "---|" * len(studies)]
        text += difference_rows(studies)
    print("\n".join(["", *text]))
    if studies.keys() == BRICKS.keys() and asked.folder == HERE / "results":
        page = HERE / "README.md"
        before, rest = page.read_text(encoding="utf-8").split(BEGIN)
        parts = [before + BEGIN, "\n".join(text), END + rest.split(END)[1]]
        page.write_text("\n\n".join(parts), encoding="utf-8")
        draw(studies)


def draw(studies: dict[str, xr.Dataset]) -> None:
    """Draw the curves of the three kinds, one above the other."""
    figure, axes = plt.subplots(len(studies), 1, figsize=(8, 13), sharex=True, layout="constrained")
    for ax, (name, ds) in zip(axes, studies.items()):
        draw_fragility(fit_fragility(ds, categories=[1, 2]), ax=ax)
        ax.set_ylabel("probability of the category\nor worse")
        ax.set_title({"zones": "bricks of zones"}.get(name, f"{name} bricks"), loc="left")
    figure.savefig(HERE / "fragility.png", dpi=110)


if __name__ == "__main__":
    main()
