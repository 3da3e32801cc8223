"""Residuals and energy balance of the solutions, and Monte Carlo error of a study."""

from __future__ import annotations

import numpy as np
import xarray as xr

from damagepred.archive.cautions import work_done
from damagepred.arrays import FloatArray
from damagepred.enumerations import SOLVED
from damagepred.formatting import chance, length, named, number, with_band
from damagepred.report.parts import Part, Table, drawing
from damagepred.uq.capacity import probability_reached
from damagepred.uq.exceedance import category_capacities, exceedance
from damagepred.uq.fragility import movement_measure

_WORK = (
    ("external_work", "work of dead load and movement"),
    ("kinetic_energy", "in motion"),
    ("elastic_energy", "stored in joints and blocks"),
    ("friction_work", "taken by friction"),
    ("fracture_work", "taken by softening bonds"),
    ("crushing_work", "taken by crushing"),
    ("plastic_work", "taken by yielding zones"),
    ("damping_work", "taken by damping"),
    ("released_energy", "set free where bonds broke"),
    ("energy_error", "not balanced"),
)
_SPENT = (("newton_iterations", "Newton iterations spent"), ("cycles", "cycles spent"))


def wall_quality(ds: xr.Dataset) -> list[Part]:
    """Return how well one wall's path was solved.

    Parameters
    ----------
    ds : xarray.Dataset
        Of one wall.
    """
    rows = [["largest unbalanced force", _most(ds["unbalanced_force_ratio"]), "mean block weights"]]
    if "joint_law_violation" in ds and np.isfinite(ds["joint_law_violation"].values).any():
        rows.append(["stress by which a joint exceeds its law, at most", _most(ds["joint_law_violation"]), "Pa"])
    if (share := energy_shares(ds)).size and np.isfinite(share[-1]):
        rows.append(["energy that does not balance, of all work done", number(100 * float(share[-1]), 2), "%"])
    rows += [
        ["times at which bonds broke", _sum(ds, "events"), ""],
        *([what, _sum(ds, name), ""] for name, what in _SPENT if name in ds and (ds[name].values > 0).any()),
    ]
    parts: list[Part] = [
        Table("How well the path is solved: the worst of all increments", ["", "value", "unit"], rows, words=(0, 2))
    ]
    energy = [
        [what, number(float(ds[name].values[-1]), 4)]
        for name, what in _WORK
        if _known(ds, name) and float(ds[name].values[-1]) != 0.0
    ]
    if energy:
        parts.append(Table("Where the energy has gone by the end", ["", "J"], energy, words=(0,)))
    return parts


def energy_shares(ds: xr.Dataset) -> FloatArray:
    """Return energy that does not balance over the work done, at each increment, of each sample if there are any."""
    if not _known(ds, "energy_error"):
        return np.empty(0)
    work = work_done(ds)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(work > 0, np.abs(ds["energy_error"].values) / work, np.nan)


def study_quality(ds: xr.Dataset) -> list[Part]:
    """Return how well the walls of a study were solved, and the worst of them."""
    columns = [
        ("unbalanced_force_ratio", "largest unbalanced force (mean block weights)"),
        ("joint_law_violation", "stress by which a joint exceeds its law (Pa)"),
    ]
    found = [(what, np.asarray(ds[name].values, dtype=np.float64)) for name, what in columns if _known(ds, name)]
    share = energy_shares(ds)
    if share.size:
        found.append(("energy that does not balance, of all work done (%)", 100 * share))
    rows = []
    for what, values in found:
        worst = np.nanmax(np.where(np.isfinite(values), values, -np.inf).reshape(len(values), -1), axis=1)
        known = np.flatnonzero(np.isfinite(worst))
        if known.size:
            most = int(known[np.argmax(worst[known])])
            rows.append([what, number(float(np.median(worst[known])), 2), number(float(worst[most]), 2), str(most)])
    if not rows:
        return []
    head = ["worst of a wall's path", "median wall", "worst wall", "its sample"]
    return [Table("How well the walls are solved", head, rows)]


def monte_carlo(ds: xr.Dataset, moved: float, confidence: float = 0.9) -> list[Part]:
    """Return how surely shares of walls are known, and how they settled.

    Parameters
    ----------
    ds : xarray.Dataset
        A study with paths.
    moved : float
        Movement (m), of the study's own measure, to which every wall was moved.
    confidence : float
        Of the intervals.
    """
    from damagepred.plotting import draw_convergence

    measure, telling = named(movement_measure(ds)), telling_movement(ds, moved)
    rows = []
    for at in dict.fromkeys((telling, moved)):
        for category, name in categories(ds):
            found = exceedance(ds, category, at, confidence=confidence)
            e = found.estimate
            value = with_band(chance(e.value), chance(e.lower), chance(e.upper))
            bounds = f"{chance(found.failed_undamaged)} to {chance(found.failed_damaged)}" if found.failed else "–"
            rows.append(
                [
                    length(at),
                    name.replace(" ", "\u00a0"),
                    value,
                    number(e.error, 2),
                    str(e.samples),
                    number(e.effective_samples, 3),
                    bounds,
                ]
            )
    table = Table(
        f"Probability of each category or worse at a {measure}, and its Monte Carlo error",
        [
            measure,
            "category",
            f"probability ({confidence:.0%} interval)",
            "standard error",
            "walls",
            "effective walls",
            "failed walls counted",
        ],
        rows,
        words=(1,),
        note="At the movement where it is least sure what share of the walls is damaged, and at the largest to which "
        "all walls were moved. The error is that of having sampled so many walls and no more; what the model leaves "
        "out is not in it. “Failed walls counted”: if none of them had reached the category, and if all had.",
    )
    figure = drawing(
        "convergence",
        f"How the probabilities at {length(telling)} settled as walls were added, with {confidence:.0%} intervals of "
        "that many walls.",
        "Estimated probability of each category against the number of walls counted, with confidence bands that narrow",
        draw_convergence(ds, telling, confidence=confidence),
    )
    return [table, figure]


def telling_movement(ds: xr.Dataset, moved: float, points: int = 60) -> float:
    """Return the movement (m) at which it is least sure in which category a wall is, to two figures.

    Parameters
    ----------
    ds : xarray.Dataset
        A study with paths.
    moved : float
        The largest to look at (m).
    points : int
        Movements to look at.
    """
    grid = np.linspace(0.0, moved, points + 1)[1:]
    unsure = np.zeros(points)
    for category, _ in categories(ds):
        known = category_capacities(ds, category)
        if len(known.lower):
            share = np.array(
                [np.average(probability_reached(known.lower, known.upper, at), weights=known.weight) for at in grid]
            )
            unsure += share * (1 - share)
    if not unsure.any():
        return moved
    return min(float(f"{grid[np.argmax(unsure)]:.2g}"), moved)


def categories(ds: xr.Dataset) -> list[tuple[int, str]]:
    """Return the categories of damage of a study or a wall from 1, with number and name."""
    names = str(ds["damage_category"].attrs.get("flag_meanings", "")).split()
    highest = int(ds.attrs.get("highest_category", len(names) - 1))
    return [(c, f"{c} {category_name(ds, c)}".strip()) for c in range(1, highest + 1)]


def category_name(ds: xr.Dataset, category: int) -> str:
    """Return the name of a category of damage of a study or a wall, empty if it has none.

    Parameters
    ----------
    ds : xarray.Dataset
        Of a wall or a study.
    category : int
        Its number.
    """
    names = str(ds["damage_category"].attrs.get("flag_meanings", "")).split()
    return named(names[category]) if 0 <= category < len(names) else ""


def common_movement(ds: xr.Dataset) -> float:
    """Return the movement (m) to which every wall of a study was moved; NaN if none was solved."""
    movement = np.asarray(ds[movement_measure(ds)].values, dtype=np.float64)
    run = np.isin(ds["status"].values, SOLVED)
    if movement.ndim != 2 or not run.any():
        return float("nan")
    return float(np.nanmax(movement[run], axis=1).min())


def _known(ds: xr.Dataset, name: str) -> bool:
    return name in ds and bool(np.isfinite(np.asarray(ds[name].values, dtype=np.float64)).any())


def _most(values: xr.DataArray) -> str:
    return number(float(np.nanmax(values.values)), 2)


def _sum(ds: xr.Dataset, name: str) -> str:
    values = ds[name].values if name in ds else np.empty(0)
    return str(int(values[values > 0].sum())) if values.size else "–"
