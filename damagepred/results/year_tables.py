"""Probability of damage by year: tables of a study whose movement has a time."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from damagepred.enumerations import SOLVED, SampleStatus
from damagepred.formatting import chance, with_band
from damagepred.results.tables import Column, worst_so_far
from damagepred.uq.capacity import highest_category
from damagepred.uq.estimate import probability

if TYPE_CHECKING:
    import pandas as pd

YEARS = (1, 2, 5, 10, 20, 30, 50, 100)
"""Years of a history that have a row, in addition to its last."""


def year_frame(ds: xr.Dataset, confidence: float = 0.9) -> pd.DataFrame:
    """Probability of each category by the worst up to a year, and by the present one, for each category and year.

    The present one is NaN where some walls were not followed as far; the worst counts their earlier increments.
    """
    import pandas as pd

    ds = ds.isel(sample=np.isin(ds["status"].values, SOLVED))
    time, category = np.atleast_2d(ds["time"].values), ds["damage_category"].values
    unknown = (category < 0) | np.isnan(ds["crack_width_max"].values)
    unknown &= (ds["status"].values != SampleStatus.COLLAPSED)[:, None]
    weight = ds["weight"].values if "weight" in ds else None
    so_far, last = worst_so_far(ds), float(time.max())
    walls, rows = np.arange(len(category)), []
    for least in range(1, min(max(int(so_far.max(initial=1)), 1), highest_category(ds)) + 1):
        for year in sorted({year for year in YEARS if year < last} | {last}):
            at = (time <= year + 1e-9).sum(axis=1) - 1
            row = {"category": least, "year": float(year)}
            for name, values in (("so_far", so_far), ("now", category)):
                estimate = probability(values[walls, at] >= least, weight=weight, confidence=confidence)
                complete = name == "so_far" or not unknown[walls, at].any()
                for end, value in (("", estimate.value), ("_lower", estimate.lower), ("_upper", estimate.upper)):
                    row[name + end] = value if complete else np.nan
            rows.append(row)
    return pd.DataFrame(rows).set_index(["category", "year"])


def year_columns(ds: xr.Dataset, confidence: float = 0.9) -> list[Column]:
    """Table of ``year_frame`` as columns of text, one row per year."""
    frame = year_frame(ds, confidence)
    years = frame.index.unique("year")
    columns = [Column("year", [f"{year:g}" for year in years], short="year")]
    for least, rows in frame.groupby(level="category"):
        for key, name in (("so_far", "so far"), ("now", "now")):
            values = rows[[key, f"{key}_lower", f"{key}_upper"]].to_numpy()
            cells = ["–" if np.isnan(row[0]) else with_band(*map(chance, row)) for row in values]
            brief = [cell.replace(" to ", "-") if key == "so_far" else cell.split()[0] for cell in cells]
            head, short = f"category {least} or worse {name}", f"{least} or worse\n{name}"
            columns.append(Column(head, cells, short=short, short_cells=brief))
    return columns
