"""Shares of the walls that have reached a category by a given deflection, with confidence intervals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
import xarray as xr

from damagepred.archive.files import write_whole
from damagepred.damage.limits import MovementLimit
from damagepred.uq.estimate import wilson

FAILED, ONE_SIDED_95 = 2, 1.6448536
CATEGORIES = (1, 2, 3)
BEGIN = "<!-- table: written by run.py -->"
MEASURES = ("control_joint_opening_max", "control_joint_closing_max")


class Case(NamedTuple):
    """The walls of one variant in one direction."""

    variant: str
    kind: str
    walls: xr.Dataset


def rows_of(cases: Sequence[Case], limits: Mapping[str, MovementLimit]) -> pd.DataFrame:
    """Return a table with a row for each variant, way of movement, limit of AS 2870 Table 4.1, and category.

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
    """Return the number of walls that have reached a category by an increment, and the share with its interval."""
    worst = ds["damage_category"].values[:, : at + 1].max(axis=1)
    reached = worst >= category
    unknown = (ds["status"].values == FAILED) & ~reached & (ds["damage_category"].values[:, at] < 0)
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
    """Return median and quartiles of the deflections (mm) of the first increment in a category.

    A wall that has not reached it, or failed before, has an infinite one.
    """
    reached = ds["damage_category"].values >= category
    deflection = ds["central_deflection"].values
    first = np.where(reached.any(axis=1), 1e3 * deflection[np.arange(len(reached)), reached.argmax(axis=1)], np.inf)
    # of sorted walls, without interpolation towards infinite values
    low, middle, high = (float(np.quantile(first, q, method="inverted_cdf")) for q in (0.25, 0.5, 0.75))
    return {"median capacity (mm)": middle, "lower quartile (mm)": low, "upper quartile (mm)": high}


def medians(ds: xr.Dataset, at: int) -> dict[str, float]:
    """Return the medians of openings (mm), of the walls followed to this deflection."""
    found = {}
    for name in MEASURES:
        values = ds[name].values[:, at] if name in ds else np.array([np.nan])
        known = values[np.isfinite(values)]
        found[f"median {name.replace('_', ' ')} (mm)"] = 1e3 * float(np.median(known)) if known.size else np.nan
    return found


def write_table(rows: pd.DataFrame, path: Path) -> None:
    """Write a table as CSV."""
    path.parent.mkdir(parents=True, exist_ok=True)
    write_whole(path, lambda p: rows.to_csv(p, index=False, float_format="%.4g"))


def markdown(rows: pd.DataFrame) -> str:
    """Return a table for a README, a row for each variant and movement.

    Shares of the walls in category 1, 2, 3 or worse (%), and the deflections by which half of the walls are.
    """
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
