"""Residuals and energy balance of the solutions, and Monte Carlo error of a study."""

from __future__ import annotations

import numpy as np
import xarray as xr

from damagepred.archive.schema import category_label
from damagepred.diagnostics import Residuals, described
from damagepred.enumerations import SOLVED
from damagepred.formatting import counted, length, number
from damagepred.report.parts import Part
from damagepred.results.house import is_house
from damagepred.results.tables import Table, energy_rows, energy_shares, known, probability_columns, quality_rows
from damagepred.uq.capacity import highest_category
from damagepred.uq.exceedance import exceedance
from damagepred.uq.intensity import movement_measure, movement_words


def wall_quality(ds: xr.Dataset) -> list[Part]:
    """Quality of the solution of one wall."""
    caption = "How well the path is solved: the worst of all increments"
    parts: list[Part] = [Table(caption, ["", "value", "unit"], quality_rows(ds), words=(0, 2))]
    if energy := energy_rows(ds):
        parts.append(Table("Where the energy has gone by the end", ["", "J"], energy, words=(0,)))
    return parts


def study_quality(ds: xr.Dataset) -> list[Part]:
    """Quality of the solutions of a study, and its worst walls."""
    residuals = [
        (f"{residual.label} ({residual.shown_unit})", np.asarray(ds[name].values, dtype=np.float64))
        for name, residual in described(Residuals).items()
        if known(ds, name)
    ]
    share = energy_shares(ds)
    if share.size:
        residuals.append(("energy that does not balance, of all work done (%)", 100 * share))
    rows = []
    for what, values in residuals:
        worst = np.nanmax(np.where(np.isfinite(values), values, -np.inf).reshape(len(values), -1), axis=1)
        solved = np.flatnonzero(np.isfinite(worst))
        if solved.size:
            most = int(solved[np.argmax(worst[solved])])
            rows.append([what, number(float(np.median(worst[solved])), 2), number(float(worst[most]), 2), str(most)])
    if not rows:
        return []
    head = ["worst of a wall's path", "median wall", "worst wall", "its sample"]
    caption, *head = (counted(words, is_house(ds)) for words in ("How well the walls are solved", *head))
    return [Table(caption, head, rows)]


def monte_carlo(ds: xr.Dataset, moved: float, confidence: float = 0.9) -> list[Part]:
    """Probabilities with their Monte Carlo error."""
    found = {category: exceedance(ds, category, moved, confidence=confidence) for category, _ in categories(ds)}
    at = f"a {movement_words(ds)} of {length(moved)}"
    caption = f"Probability of each category or worse at {at}, and its Monte Carlo error"
    note = "The error of the number of walls; errors of the model add to it. "
    note += "“Failed walls counted”: if none of them had reached the category, and if all had."
    return [Table.of(caption, probability_columns(ds, found), counted(note, is_house(ds)))]


def categories(ds: xr.Dataset) -> list[tuple[int, str]]:
    """Return the categories of damage of a study or a wall from 1, with number and name."""
    return [(c, category_label(ds, c)) for c in range(1, highest_category(ds) + 1)]


def common_movement(ds: xr.Dataset) -> float:
    """Return the movement (m) to which every wall of a study was moved; NaN if none was solved."""
    movement = np.asarray(ds[movement_measure(ds)].values, dtype=np.float64)
    run = np.isin(ds["status"].values, SOLVED)
    if movement.ndim != 2 or not run.any():
        return float("nan")
    return float(np.nanmax(movement[run], axis=1).min())
