"""Probability of damage by year: tables of a study whose movement has a time."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import xarray as xr

from damagepred.enumerations import SOLVED, SampleStatus
from damagepred.formatting import chance, with_band
from damagepred.tables import Column, worst_so_far
from damagepred.uq.capacity import highest_category
from damagepred.uq.estimate import Estimate, probability

if TYPE_CHECKING:
    import pandas as pd

YEARS = (1, 2, 5, 10, 20, 30, 50, 100)
"""Years of a history that have a row, besides its last."""


class YearShare(NamedTuple):
    """Probability of a category or worse by a year, and its interval.

    Attributes
    ----------
    year : float
        End of the year.
    category : int
        The least that counts.
    so_far : Estimate
        By the worst category so far.
    now : Estimate or None
        By the present category; None where some walls were not followed as far.
    """

    year: float
    category: int
    so_far: Estimate
    now: Estimate | None


def year_shares(ds: xr.Dataset, confidence: float = 0.9) -> list[YearShare]:
    """Return the probability of each category by the worst so far, and by now, by category and year.

    That by now is unknown where some walls were not followed as far; that so far counts what these reached before.

    Parameters
    ----------
    ds : xarray.Dataset
        A study of a movement whose stages have times.
    confidence : float
        Of the intervals.
    """
    ds = ds.isel(sample=np.isin(ds["status"].values, SOLVED))
    time, category = np.atleast_2d(ds["time"].values), ds["damage_category"].values
    unknown = (category < 0) | np.isnan(ds["crack_width_max"].values)
    unknown &= (ds["status"].values != SampleStatus.COLLAPSED)[:, None]
    weight = ds["weight"].values if "weight" in ds else None
    so_far, last = worst_so_far(ds), float(time.max())
    walls, shares = np.arange(len(category)), []
    for least in range(1, min(max(int(so_far.max(initial=1)), 1), highest_category(ds)) + 1):
        for year in sorted({year for year in YEARS if year < last} | {last}):
            at = (time <= year + 1e-9).sum(axis=1) - 1
            found = [
                probability(values[walls, at] >= least, weight=weight, confidence=confidence)
                for values in (so_far, category)
            ]
            shares.append(YearShare(year, least, found[0], None if unknown[walls, at].any() else found[1]))
    return shares


def year_columns(ds: xr.Dataset, confidence: float = 0.9) -> list[Column]:
    """Return the probability of each category by the worst so far, and by now, with intervals, a row a year.

    Parameters
    ----------
    ds : xarray.Dataset
        A study of a movement whose stages have times.
    confidence : float
        Of the intervals.
    """
    shares = year_shares(ds, confidence)
    least, columns = shares[0].category, []
    columns.append(Column("year", [f"{s.year:g}" for s in shares if s.category == least], short="year"))

    def cell(found: Estimate | None) -> str:
        if found is None:
            return "–"
        return with_band(*(chance(p) for p in (found.value, found.lower, found.upper)))

    for least in sorted({s.category for s in shares}):
        of_category = [s for s in shares if s.category == least]
        so_far, now = [cell(s.so_far) for s in of_category], [cell(s.now) for s in of_category]
        brief = {"so far": [c.replace(" to ", "-") for c in so_far], "now": [c.split()[0] for c in now]}
        for name, cells in (("so far", so_far), ("now", now)):
            head = f"category {least} or worse {name}"
            columns.append(Column(head, cells, short=f"{least} or worse\n{name}", short_cells=brief[name]))
    return columns


def year_frame(ds: xr.Dataset, confidence: float = 0.9) -> pd.DataFrame:
    """Return the probability of each category by year as a table, a row for each category and year.

    Parameters
    ----------
    ds : xarray.Dataset
        A study of a movement whose stages have times.
    confidence : float
        Of the intervals.
    """
    import pandas as pd

    def named(name: str, found: Estimate | None) -> dict[str, float]:
        values = [np.nan] * 3 if found is None else [found.value, found.lower, found.upper]
        return dict(zip((name, f"{name}_lower", f"{name}_upper"), values))

    rows = [
        {"category": s.category, "year": s.year} | named("so_far", s.so_far) | named("now", s.now)
        for s in year_shares(ds, confidence)
    ]
    return pd.DataFrame(rows).set_index(["category", "year"])
