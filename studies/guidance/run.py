"""Shares of walls in each damage category by the deflection limits of AS 2870, variant by variant of one wall.

    python studies/guidance/run.py [NAME ...] [--samples 32] [--workers 2]

Each study is a folder with settings; all variants have the same samples, and equal variants of two studies run once.
Writes table.csv, damage.png and the table of the page of each study. The same command resumes.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import sys
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
import xarray as xr

from damagepred import open_study
from damagepred.archive.files import write_whole
from damagepred.campaign.settings import StudySettings
from damagepred.damage.limits import MovementLimit, construction_limits
from damagepred.enumerations import SampleStatus
from damagepred.inputs.input_files import read_toml
from damagepred.plotting.colours import CATEGORY_COLOURS
from damagepred.plotting.sheet import DPI, new_figure, set_title, small, text_size
from damagepred.study import RunSummary, Study
from damagepred.uq.estimate import wilson
from studies.pages import put_in

HERE = Path(__file__).resolve().parent
NAMES = ("construction", "dpc", "openings", "joints", "size", "bond")
KINDS = ("dishing", "doming")
CATEGORIES = {1: "very slight or worse", 2: "slight or worse", 3: "moderate or worse"}
ONE_SIDED_95 = 1.6448536
BEGIN = "<!-- table: written by run.py -->"


class Case(NamedTuple):
    """The walls of one variant in one direction."""

    variant: str
    kind: str
    walls: xr.Dataset


def read_variants(folder: Path) -> tuple[str, dict[str, StudySettings]]:
    """Title of a study, and the settings of its variants by name."""
    tables, found = read_toml(folder / "settings.toml"), {}
    for variant in tables["variant"]:
        base = read_toml(HERE / "wall.toml")
        for place in variant.get("remove", ()):
            *way, last = place
            target: Any = base
            for key in way:
                target = target[key]
            del target[last]
        changes = {key: value for key, value in variant.items() if key not in ("name", "remove")}
        merged = overlaid(base, changes)
        found[variant["name"]] = StudySettings.from_dict(merged, f"{folder.name}: {variant['name']}")
    return tables["title"], found


def overlaid(base: Any, change: Any) -> Any:
    """Table with some of its values changed; lists are replaced as a whole."""
    if not (isinstance(base, Mapping) and isinstance(change, Mapping)):
        return change
    return {**base, **{key: overlaid(base.get(key), value) for key, value in change.items()}}


def study_of(settings: StudySettings, kind: str, increments: int | None, reach: float) -> StudySettings:
    """Study of a variant in dishing or doming."""
    movement = settings.scene.movement
    moved = replace(
        movement,
        kind=kind,
        increments=increments or movement.increments,
        central_deflection=reach * movement.central_deflection,
    )
    return replace(settings, scene=replace(settings.scene, movement=moved))


def archive_of(output: Path, study: StudySettings) -> Path:
    """Folder of a study: equal variants of different studies share one."""
    text = json.dumps(study.to_dict(), sort_keys=True, default=str)
    return output / f"{study.scene.movement.kind}_{hashlib.sha256(text.encode()).hexdigest()[:12]}.dp"


def run_walls(study: StudySettings, place: Path, samples: int | None, workers: int) -> RunSummary:
    """Run the missing samples; a single worker is this process, which compiles only once for all studies."""
    if workers > 1:
        return Study(study).run(place, samples, workers=workers)
    with ThreadPoolExecutor(1) as executor:
        return Study(study).run(place, samples, executor=executor)


def walls_of(place: Path, samples: int | None) -> xr.Dataset:
    """Stored walls of a study, or the first ``samples``: other studies may have run more."""
    ds = open_study(place)
    ds = ds.isel(sample=slice(0, samples))
    return ds.isel(sample=np.flatnonzero(ds["status"].values != SampleStatus.MISSING))


def rows_of(cases: Sequence[Case], limits: Mapping[str, MovementLimit]) -> pd.DataFrame:
    """Table with one row per variant, kind of movement, limit of AS 2870 Table 4.1, and category.

    ``share`` counts walls known at that deflection. ``lower`` and ``upper`` hold the share of all walls with 90 %
    confidence (Wilson), walls that failed before counted as undamaged in the one and damaged in the other.
    ``median capacity`` is the deflection by which half of the walls have reached the category, infinite if they have
    not. Openings and closures of control joints are medians of the walls that were followed to this deflection; a path
    ends at the category at which the study stops.
    """
    rows: list[dict[str, Any]] = []
    for case in cases:
        ds, length = case.walls, float(case.walls["central_deflection"][0, -1] / case.walls["deflection_ratio"][0, -1])
        farthest = float(ds["central_deflection"].max())
        for limit in sorted(limits.values(), key=lambda one: one.value(length, 1.0)):
            ratio = limit.value(length, 1.0)
            deflection = ratio * length
            if deflection > farthest * (1 + 1e-9):
                continue
            at = int(np.abs(ds["central_deflection"].values[0] - deflection).argmin())
            if ds["central_deflection"].values[0, at] > deflection * (1 + 1e-6):
                at -= 1
            here = {
                "variant": case.variant,
                "movement": case.kind,
                "limit of": limit.about,
                "limit": f"L/{1.0 / ratio:.0f}",
                "deflection (mm)": 1e3 * deflection,
            }
            rows += [
                here | counts(ds, at, category) | capacity(ds, category) | medians(ds, at) for category in CATEGORIES
            ]
    return pd.DataFrame(rows)


def counts(ds: xr.Dataset, at: int, category: int) -> dict[str, Any]:
    """Number of walls that have reached a category by an increment, and the share with its interval."""
    worst = ds["damage_category"].values[:, : at + 1].max(axis=1)
    reached = worst >= category
    unknown = (ds["status"].values == SampleStatus.FAILED) & ~reached & (ds["damage_category"].values[:, at] < 0)
    walls, count, lost = len(reached), int(reached.sum()), int(unknown.sum())
    return {
        "category": category,
        "walls": walls,
        "failed": lost,
        "reached": count,
        "share": count / max(walls - lost, 1),
        "lower": wilson(count / walls, walls, ONE_SIDED_95)[0],
        "upper": wilson((count + lost) / walls, walls, ONE_SIDED_95)[1],
    }


def capacity(ds: xr.Dataset, category: int) -> dict[str, float]:
    """Median and quartiles of the deflections (mm) at a category; infinite for a wall that did not reach it."""
    reached = ds["damage_category"].values >= category
    deflection = ds["central_deflection"].values
    first = np.where(reached.any(axis=1), 1e3 * deflection[np.arange(len(reached)), reached.argmax(axis=1)], np.inf)
    # of sorted walls, without interpolation towards infinite values
    low, middle, high = (float(np.quantile(first, q, method="inverted_cdf")) for q in (0.25, 0.5, 0.75))
    return {"median capacity (mm)": middle, "lower quartile (mm)": low, "upper quartile (mm)": high}


def medians(ds: xr.Dataset, at: int) -> dict[str, float]:
    """Medians of the openings of control joints (mm), of the walls followed to this deflection."""
    found = {}
    for name in ("control_joint_opening_max", "control_joint_closing_max"):
        values = ds[name].values[:, at] if name in ds else np.array([np.nan])
        known = values[np.isfinite(values)]
        found[f"median {name.replace('_', ' ')} (mm)"] = 1e3 * float(np.median(known)) if known.size else np.nan
    return found


def markdown(rows: pd.DataFrame) -> str:
    """Table of a page: shares of the walls in category 1, 2, 3 or worse (%), and the median deflections."""
    limits = rows.drop_duplicates("limit of")
    lines = [
        "| wall | movement | "
        + " | ".join(f"{a}, {b}" for a, b in zip(limits["limit"], limits["limit of"]))
        + " | median deflection (mm) |",
        "|" + "---|" * (3 + len(limits)),
    ]
    for (variant, kind), own in rows.groupby(["variant", "movement"], sort=False):
        cells = [
            " / ".join(f"{100 * share:.0f}" for share in own.loc[own["limit of"] == limit, "share"])
            for limit in limits["limit of"]
        ]
        half = own.drop_duplicates("category")["median capacity (mm)"]
        farthest = float(own["deflection (mm)"].max())
        cells.append(" / ".join(f"{value:.3g}" if np.isfinite(value) else f"> {farthest:.3g}" for value in half))
        lines.append(f"| {variant} | {kind} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def draw(title: str, rows: pd.DataFrame, path: Path) -> None:
    """Draw the shares: one row of panels per kind of movement, one panel per limit."""
    kinds, variants = list(dict.fromkeys(rows["movement"])), list(dict.fromkeys(rows["variant"]))
    limits = list(dict.fromkeys(rows["limit of"]))
    figure = new_figure(3.1 + 2.9 * len(limits), 1.9 + (0.42 * len(variants) + 0.9) * len(kinds))
    panels = figure.subplots(len(kinds), len(limits), squeeze=False, sharex=True, sharey=True)
    for (kind, limit), part in rows.groupby(["movement", "limit of"], sort=False):
        ax = panels[kinds.index(kind)][limits.index(limit)]
        for category, own in part.groupby("category"):
            at = [variants.index(v) + 0.24 * (category - 2) for v in own["variant"]]
            ax.barh(at, own["share"], height=0.22, color=CATEGORY_COLOURS[category], label=CATEGORIES[category])
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


def run_study(name: str, options: argparse.Namespace) -> bool:
    """Run a study, write its table and picture; return whether a wall failed."""
    title, variants = read_variants(HERE / name)
    cases, failed = [], False
    for variant, settings in variants.items():
        for kind in KINDS:
            study = study_of(settings, kind, options.increments, options.reach)
            place = archive_of(options.output / "results", study)
            summary = run_walls(study, place, options.samples, options.workers)
            print(f"{name}: {variant}, {kind}: {summary.done} walls, {summary.failed} failed", flush=True)
            if summary.interrupted:
                raise SystemExit(130)
            failed |= summary.failed > 0
            cases.append(Case(variant, kind, walls_of(place, options.samples)))
    rows, folder = rows_of(cases, construction_limits()), options.output / name
    folder.mkdir(exist_ok=True)
    write_whole(folder / "table.csv", lambda p: rows.to_csv(p, index=False, float_format="%.4g"))
    draw(title, rows, folder / "damage.png")
    if options.output == HERE:  # from the table as it is written
        put_in(folder / "README.md", markdown(pd.read_csv(folder / "table.csv")), BEGIN)
    return failed


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the studies of the command line; return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", default=NAMES, metavar="NAME", help=", ".join(NAMES))
    parser.add_argument("--samples", type=int, default=32, help="walls per variant and kind of movement (32)")
    parser.add_argument("--workers", type=int, default=2, help="processes (2)")
    parser.add_argument("--increments", type=int, help="of the movement; by default as in wall.toml")
    parser.add_argument("--reach", type=float, default=1.0, help="share of the movement to follow")
    parser.add_argument("--output", type=Path, default=HERE, help="folder for walls, tables and pictures")
    options = parser.parse_args(arguments)
    failed = sum(run_study(name, options) for name in options.names)
    return 3 * (failed > 0)


if __name__ == "__main__":
    sys.exit(main())
