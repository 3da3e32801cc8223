"""Damage of a wall by thirty years of wet and dry seasons, by site class.

    python studies/seasons/run.py [--samples 16] [--workers 2]

Runs the wall through thirty years on sites of four classes, and once, in one growing movement, through all y_s. It goes
on where it was stopped, writes the table of the README, and draws the probability of damage by year.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import xarray as xr

from damagepred import Study, fit_fragility, open_study
from damagepred.arrays import FloatArray
from damagepred.campaign.settings import StudySettings
from damagepred.plotting import draw_fragility
from damagepred.scene import site_classes
from studies.pages import put_in

HERE = Path(__file__).resolve().parent
SWING, TREND = 0.8, 0.4
"""Shares of y_s, so chosen that the largest movement of thirty years is about y_s in the mean. Assumed."""

YEARS = (1, 10, 30)
ONCE = 0.15
"""Largest y_s of the one growing movement (m): beyond the largest of the histories."""


def through_years(kind: str, y_s: float, samples: int) -> StudySettings:
    """Return the study of the wall on a site."""
    study = StudySettings.from_toml(HERE / "wall.toml").with_samples(samples, None)
    movement = study.scene.movement
    seasons = replace(movement.seasons, swing=SWING * y_s, trend=TREND * y_s)
    scene = replace(study.scene, movement=replace(movement, kind=kind, seasons=seasons))
    title = f"{kind} on {1e3 * y_s:.0f} mm, {seasons.years} years"
    return replace(study, scene=scene, study=replace(study.study, title=title))


def at_once(kind: str, samples: int) -> StudySettings:
    """Return the study of the wall in one growing movement."""
    study = StudySettings.from_toml(HERE / "wall.toml").with_samples(samples, None)
    movement = replace(study.scene.movement, kind=kind, seasons=None, stage=(), increments=60)
    scene = replace(study.scene, movement=movement, mound=replace(study.scene.mound, surface_movement=ONCE))
    return replace(study, scene=scene, study=replace(study.study, title=f"{kind} once to {1e3 * ONCE:.0f} mm"))


def run(settings: StudySettings, folder: Path, workers: int) -> xr.Dataset:
    """Run a study, or go on with it."""
    summary = Study(settings).run(folder, workers=workers)
    print(f"{folder.stem}: {summary.done} of {summary.total} walls, {summary.failed} failed", flush=True)
    if summary.interrupted:
        raise SystemExit(130)
    return open_study(folder)


def worst(ds: xr.Dataset) -> FloatArray:
    """Return the worst category so far, array (samples, increments)."""
    return np.maximum.accumulate(ds["damage_category"].values, axis=1)


def row(kind: str, name: str, years: xr.Dataset, once: xr.Dataset) -> str:
    """Return the row of a site."""
    time = years["time"].values
    time = time[0] if time.ndim == 2 else time
    so_far, now = worst(years), years["damage_category"].values
    shares = []
    for year in YEARS:
        at = int(np.searchsorted(time, year + 1e-9)) - 1
        shares.append(" / ".join(f"{100 * (so_far[:, at] >= c).mean():.0f}" for c in (1, 2)))
    end = " / ".join(f"{100 * (now[:, -1] >= c).mean():.0f}" for c in (1, 2))
    largest = years["surface_movement"].values.max(axis=1)
    passed = (
        once["surface_movement"].values[0] if once["surface_movement"].ndim == 2 else once["surface_movement"].values
    )
    reached = worst(once)[np.arange(len(largest)), np.searchsorted(passed, largest * (1 - 1e-9))]
    alone = " / ".join(f"{100 * (reached >= c).mean():.0f}" for c in (1, 2))
    width = 1e3 * np.median(years["crack_width_worst"].values[:, -1])
    left = 1e3 * np.median(years["crack_width_max"].values[:, -1])
    return (
        f"| {name} | {kind} | {1e3 * largest.mean():.0f} | " + " | ".join(shares) + f" | {end} | {alone} | "
        f"{width:.2f} / {left:.2f} |"
    )


def main() -> None:
    """Run all studies, write the table, draw the curves."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--samples", type=int, default=16)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--classes", nargs="+", help="of sites (S M H1 H2)")
    parser.add_argument("--folder", type=Path, default=HERE / "results")
    asked = parser.parse_args()
    asked.folder.mkdir(parents=True, exist_ok=True)
    head = [f"by year {year}" for year in YEARS]
    lines = [
        "| class | movement | largest movement, mm | "
        + " | ".join(head)
        + " | at the end | once, same largest | widest so far / at the end, mm |",
        "|---" * (len(head) + 6) + "|",
    ]
    figure, axes = plt.subplots(2, 1, figsize=(8, 10), layout="constrained")
    for kind, ax in zip(("dishing", "doming"), axes):
        once = run(at_once(kind, asked.samples), asked.folder / f"{kind}_once.dp", asked.workers)
        for site in site_classes():
            if not 0.0 < site.up_to < np.inf or site.name not in (asked.classes or [site.name]):
                continue
            folder = asked.folder / f"{kind}_{site.name}.dp"
            years = run(through_years(kind, site.up_to, asked.samples), folder, asked.workers)
            lines.append(row(kind, site.name, years, once))
        draw_fragility(fit_fragility(years, categories=[1, 2], intensity="time"), ax=ax)
        ax.set_title(f"{kind}, class H2", loc="left")
    print("\n".join(["", *lines]))
    if asked.folder == HERE / "results":
        figure.savefig(HERE / "by_year.png", dpi=110)
        put_in(HERE / "README.md", "\n".join(lines))


if __name__ == "__main__":
    main()
