"""Design deflections of a code, and the damage at them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import xarray as xr

from damagepred.archive.schema import category_label
from damagepred.damage import construction_limits
from damagepred.formatting import chance, length, with_band
from damagepred.report.parts import Part, Section, Text
from damagepred.report.quality import categories
from damagepred.results.tables import Table
from damagepred.uq.exceedance import Exceedance, exceedance
from damagepred.uq.fragility.describe import lognormal_of, probability_at


class Limit(NamedTuple):
    """Largest design deflection of a footing under one kind of construction.

    Attributes
    ----------
    construction : str
        Kind of construction.
    ratio : int
        n of the limit length / n.
    absolute : float
        The limit that holds where it is the lesser (m).
    deflection : float
        What holds for the length asked for (m).
    """

    construction: str
    ratio: int
    absolute: float
    deflection: float


def limit_measure(ds: xr.Dataset) -> str:
    """Differential deflection of a footing: over its middle, of settling ground between any two places."""
    return "differential_settlement" if "differential_settlement" in ds else "central_deflection"


def code_limits(span: float) -> tuple[str, list[Limit]]:
    """Source of the limits, and each limit for a footing of a length between its ends (m)."""
    rules = construction_limits().values()
    limits = [
        Limit(k.about, round(k.one_in[0]), float(k.deflection or np.inf), span * k.value(span, span)) for k in rules
    ]
    source = "; ".join(dict.fromkeys(f"{k.author} ({k.confidence})" for k in rules))
    return source, sorted(limits, key=lambda limit: limit.deflection)


def wall_limits(ds: xr.Dataset) -> Section | None:
    """Return in which category one wall is at each limit."""
    source, limits = code_limits(float(ds.attrs["span"]))
    deflection = ds[limit_measure(ds)].values
    rows = []
    for limit in limits:
        reached = np.flatnonzero(deflection >= limit.deflection * (1 - 1e-9))
        if reached.size:
            category, width = (
                int(ds["damage_category"].values[reached[0]]),
                float(ds["crack_width_max"].values[reached[0]]),
            )
            cells = [category_label(ds, category), length(width)]
        else:
            cells = ["not moved as far", "–"]
        rows.append([*_limit(limit), *cells])
    if all(row[-1] == "–" for row in rows):
        return None
    table = Table(
        "This wall at the design deflections of a code, by construction",
        ["construction", "limit, the lesser of", "for this length", "category of damage", "widest crack"],
        rows,
        words=(0, 1, 3),
        note=f"{source}. At the first increment that reaches the limit.",
    )
    return Section("limits", "At code limits", [table])


def study_limits(ds: xr.Dataset, curves: xr.Dataset | None, moved: float, confidence: float = 0.9) -> Section | None:
    """Probability of each category at each limit, from curves and counted; None without any entry.

    ``moved`` is the movement (m) to which every wall was moved; ``curves`` are fitted against the central deflection.
    """
    source, found = code_limits(float(ds.attrs["span"]))
    of = categories(ds)
    head = ["construction", "limit, the lesser of", "for this length", *(f"{name} or worse" for _, name in of)]
    beyond = [limit.deflection > moved * (1 + 1e-9) for limit in found]
    parts: list[Part] = [
        Text(
            [
                f"{source} limits the deflection of a footing under a design movement of the site, by construction. "
                "The figures are the probabilities of damage to this wall if its footing deflects by just as much; the "
                "wall itself is of one construction, and the other limits are there to compare."
            ]
        )
    ]
    if curves is not None:
        rows = [
            [*_limit(limit), *(_from_curve(curves, category, limit.deflection) for category, _ in of)]
            for limit in found
        ]
        note = "A dash: no curve was fitted." if any("–" in row[3:] for row in rows) else ""
        for row, extrapolated in zip(rows, beyond):
            row[2] += " †" * extrapolated
        if any(beyond):
            note = f"† beyond {length(moved)}, to which all walls were moved: extrapolated. {note}".strip()
        if _has_entries(rows):
            title = f"Probability from the fitted curves ({confidence:.0%} band)"
            parts.append(Table(title, head, rows, (0, 1), note))
    if (
        ds["damage_category"].ndim == 2
    ):  # walls that are each known at their own movement alone cannot be counted at one
        rows = []
        for limit in found:
            counted = [
                exceedance(ds, c, limit.deflection, confidence=confidence, intensity=limit_measure(ds)) for c, _ in of
            ]
            rows.append([*_limit(limit), *map(_counted, counted)])
        note = (
            "A wall known to have reached the category between two increments counts for the share of that step, and a "
            "wall that was not followed as far counts as those followed further."
        )
        if _has_entries(rows):
            parts.append(Table(f"Counted among the walls ({confidence:.0%} interval)", head, rows, (0, 1), note))
    return Section("limits", "Probabilities at code limits", parts) if len(parts) > 1 else None


def _has_entries(rows: list[list[str]]) -> bool:
    """Whether any limit has a probability."""
    return any(cell not in ("–", "not moved as far") for row in rows for cell in row[3:])


def _counted(estimated: Exceedance) -> str:
    e = estimated.estimate
    if np.isnan(e.value):
        return "not moved as far"
    return with_band(chance(e.value), chance(e.lower), chance(e.upper), "\n")


def _limit(limit: Limit) -> list[str]:
    return [limit.construction, f"L/{limit.ratio}, {length(limit.absolute)}", length(limit.deflection)]


def _from_curve(curves: xr.Dataset, category: int, at: float) -> str:
    if category not in curves["category"].values:
        return "–"
    form = lognormal_of(curves.sel(category=[category]))
    if not np.isfinite(form.median * form.dispersion).all():
        return "–"
    if at > float(curves["intensity"][-1]) * (1 + 1e-9):
        return "not moved as far"
    # a curve is never quite at 0 or 1, whatever it is rounded to
    interval = [chance(float(np.clip(p, 1e-12, 1 - 1e-12))) for p in probability_at(curves, category, at)]
    return with_band(interval[0], interval[1], interval[2], "\n")
