"""Common part of the guidance studies: read variants of one wall, run them with the same samples, tabulate, draw."""

from __future__ import annotations

import argparse
import hashlib
import json
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr
from curves import BEGIN as CURVES
from curves import draw_curves, fits_of, markdown_of_curves, rows_of_curves
from drawing import draw
from tables import BEGIN as TABLE
from tables import Case, markdown, rows_of, write_table

from damagepred import open_study
from damagepred.campaign.settings import StudySettings
from damagepred.damage.limits import construction_limits
from damagepred.enumerations import SampleStatus
from damagepred.inputs.input_files import read_toml
from damagepred.study import RunSummary, Study
from studies.pages import put_in

ROOM = Path(__file__).resolve().parent
KINDS = ("dishing", "doming")


@dataclass(frozen=True)
class Variant:
    """A variant of the wall.

    Attributes
    ----------
    name : str
        Description.
    settings : StudySettings
        Of the study.
    """

    name: str
    settings: StudySettings


def read_variants(folder: Path) -> tuple[str, list[Variant]]:
    """Return the title and the variants of a study."""
    tables, found = read_toml(folder / "settings.toml"), []
    for variant in tables["variant"]:
        base = read_toml(ROOM / "wall.toml")
        for place in variant.get("remove", ()):
            *way, last = place
            target: Any = base
            for key in way:
                target = target[key]
            del target[last]
        changes = {key: value for key, value in variant.items() if key not in ("name", "remove")}
        merged = overlaid(base, changes)
        found.append(Variant(variant["name"], StudySettings.from_dict(merged, f"{folder.name}: {variant['name']}")))
    return tables["title"], found


def overlaid(base: Any, change: Any) -> Any:
    """Return a table with some of its values changed; lists are replaced as a whole."""
    if not (isinstance(base, Mapping) and isinstance(change, Mapping)):
        return change
    return {**base, **{key: overlaid(base.get(key), value) for key, value in change.items()}}


def study_of(settings: StudySettings, kind: str, increments: int | None, reach: float) -> StudySettings:
    """Return the study of a variant in dishing or doming."""
    movement = settings.scene.movement
    return replace(
        settings,
        scene=replace(
            settings.scene,
            movement=replace(
                movement,
                kind=kind,
                increments=increments or movement.increments,
                central_deflection=reach * movement.central_deflection,
            ),
        ),
    )


def archive_of(output: Path, study: StudySettings) -> Path:
    """Return the folder of a study: equal variants of different studies share one."""
    text = json.dumps(study.to_dict(), sort_keys=True, default=str)
    return output / f"{study.scene.movement.kind}_{hashlib.sha256(text.encode()).hexdigest()[:12]}.dp"


def run_walls(study: StudySettings, place: Path, samples: int | None, workers: int) -> RunSummary:
    """Run the missing samples; a single worker is this process, which compiles only once for all studies."""
    if workers > 1:
        return Study(study).run(place, samples, workers=workers)
    with ThreadPoolExecutor(1) as executor:
        return Study(study).run(place, samples, executor=executor)


def walls_of(place: Path, samples: int | None) -> xr.Dataset:
    """Return the stored walls of a study, or the first ``samples``: other studies may have run more."""
    ds = open_study(place)
    ds = ds.isel(sample=slice(0, samples))
    return ds.isel(sample=np.flatnonzero(ds["status"].values != SampleStatus.MISSING))


def run_study(folder: Path, arguments: Sequence[str] | None = None) -> int:
    """Run one guidance study and write its table and picture; return the exit code."""
    parser = argparse.ArgumentParser(description=folder.name)
    parser.add_argument("--samples", type=int, help="walls for each variant and direction; by default as in wall.toml")
    parser.add_argument("--workers", type=int, default=2, help="processes")
    parser.add_argument("--increments", type=int, help="of the movement; by default as in wall.toml")
    parser.add_argument("--reach", type=float, default=1.0, help="share of the movement to follow")
    parser.add_argument("--archives", type=Path, default=ROOM / "results", help="folder for the walls")
    parser.add_argument("--output", type=Path, default=folder, help="folder for table and picture")
    parser.add_argument("--tables-only", action="store_true", help="write table and picture from the stored walls")
    options = parser.parse_args(arguments)
    title, variants = read_variants(folder)
    cases, failed = [], False
    for variant in variants:
        for kind in KINDS:
            study = study_of(variant.settings, kind, options.increments, options.reach)
            place = archive_of(options.archives, study)
            if not options.tables_only:
                summary = run_walls(study, place, options.samples, options.workers)
                print(f"{variant.name}, {kind}: {summary.done} walls, {summary.failed} failed", flush=True)
                if summary.interrupted:
                    return 130
                failed |= summary.failed > 0
            cases.append(Case(variant.name, kind, walls_of(place, options.samples)))
    rows = rows_of(cases, construction_limits())
    write_table(rows, options.output / "table.csv")
    draw(title, rows, options.output / "damage.png")
    fitted = fits_of(cases)
    write_table(rows_of_curves(fitted, construction_limits()), options.output / "curves.csv")
    draw_curves(title, fitted, options.output / "fragility.png")
    if options.output == folder:  # from the tables as they are written
        put_in(folder / "README.md", markdown(pd.read_csv(options.output / "table.csv")), TABLE)
        put_in(folder / "README.md", markdown_of_curves(pd.read_csv(options.output / "curves.csv")), CURVES)
    return 3 * failed
