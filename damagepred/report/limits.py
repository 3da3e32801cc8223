"""Design deflections of a code, and the damage at them."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from damagepred.archive.schema import category_label
from damagepred.damage import construction_limits
from damagepred.formatting import chance, length, with_band
from damagepred.report.parts import Section, Text
from damagepred.report.quality import categories
from damagepred.results.tables import Table
from damagepred.uq.exceedance import Exceedance, exceedance

BEYOND = "not moved as far"  # entry where no wall was moved as far as the limit


def limit_measure(ds: xr.Dataset) -> str:
    """Differential deflection of a footing: over its middle, of settling ground between any two places."""
    return "differential_settlement" if "differential_settlement" in ds else "central_deflection"


def code_limits(span: float) -> tuple[str, list[tuple[float, list[str]]]]:
    """Source of the limits, and deflection (m) and cells of each limit for a footing of a length (m)."""
    rules = sorted(construction_limits().values(), key=lambda rule: rule.value(span, span))
    limits = [(span * rule.value(span, span), rule) for rule in rules]
    cells = [
        (most, [rule.about, f"L/{rule.one_in[0]:.0f}, {length(float(rule.deflection or np.inf))}", length(most)])
        for most, rule in limits
    ]
    return "; ".join(dict.fromkeys(f"{rule.author} ({rule.confidence})" for rule in rules)), cells


def wall_limits(ds: xr.Dataset) -> Section | None:
    """Return in which category one wall is at each limit."""
    source, limits = code_limits(float(ds.attrs["span"]))
    deflection = ds[limit_measure(ds)].values
    rows = []
    for limit, cells in limits:
        damage = [BEYOND, "–"]
        if (reached := np.flatnonzero(deflection >= limit * (1 - 1e-9))).size:
            category, width = (ds[name].values[reached[0]] for name in ("damage_category", "crack_width_max"))
            damage = [category_label(ds, int(category)), length(float(width))]
        rows.append([*cells, *damage])
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


def study_limits(ds: xr.Dataset, confidence: float = 0.9) -> Section | None:
    """Probability of each category at each limit; None without any entry."""
    # walls that are known at their own movement alone cannot be counted at another; a house has many deflections
    if ds["damage_category"].ndim == 1 or limit_measure(ds) not in ds.variables:
        return None
    source, limits = code_limits(float(ds.attrs["span"]))
    of = categories(ds)
    asked: dict[str, Any] = {"confidence": confidence, "intensity": limit_measure(ds)}
    rows = [[*cells, *(_counted(exceedance(ds, c, limit, **asked)) for c, _ in of)] for limit, cells in limits]
    if all(cell == BEYOND for row in rows for cell in row[3:]):
        return None
    about = (
        f"{source} limits the deflection of a footing under a design movement of the site, by construction. The "
        "figures are the probabilities of damage to this wall if its footing deflects by just as much; the wall itself "
        "is of one construction, and the other limits are there to compare."
    )
    head = ["construction", "limit, the lesser of", "for this length", *(f"{name} or worse" for _, name in of)]
    note = (
        "A wall known to have reached the category between two increments counts for the share of that step, and a "
        "wall that was not followed as far counts as those followed further."
    )
    table = Table(f"Counted among the walls ({confidence:.0%} interval)", head, rows, (0, 1), note)
    return Section("limits", "Probabilities at code limits", [Text([about]), table])


def _counted(estimated: Exceedance) -> str:
    """Probability with its interval; ``BEYOND`` if fewer than half of the walls were followed to the limit.

    Walls with damage bend their footings most, so the few with the largest deflections do not stand for all walls.
    """
    e = estimated.estimate
    few = np.isnan(e.value) or 2 * estimated.not_followed > e.samples
    return BEYOND if few else with_band(chance(e.value), chance(e.lower), chance(e.upper), "\n")
