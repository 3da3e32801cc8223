"""Prescribed profiles of a footing: deflection over that in the middle, along the span."""

from __future__ import annotations

import csv
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from damagepred.arrays import FloatArray
from damagepred.errors import InputError
from damagepred.input_files import read_text


def three_loads(xi: FloatArray) -> FloatArray:
    """Simply supported elastic beam under equal loads at the quarter points, 1 at mid-span.

    Parameters
    ----------
    xi : array of float
        Position as a fraction of the span.

    Notes
    -----
    s = (384/19) [5 xi/32 - xi^3/4 + <xi - 1/4>^3/6] for xi <= 1/2, symmetric; the quarter points are at 27/38
    (Euler-Bernoulli).
    """
    near = np.minimum(xi, 1.0 - xi)
    return (384.0 / 19.0) * (5.0 * near / 32.0 - near**3 / 4.0 + np.maximum(near - 0.25, 0.0) ** 3 / 6.0)


def arc(xi: FloatArray, ratio: float) -> FloatArray:
    """Circular arc through both ends, rising 1 at mid-span.

    Parameters
    ----------
    xi : array of float
        Position as a fraction of the chord.
    ratio : float
        Rise of the arc over its chord, below 1/2.
    """
    if ratio < 1e-6:  # the circle's radius loses all digits; its limit is the parabola
        return 4.0 * xi * (1.0 - xi)
    radius = 1.0 / (8.0 * ratio) + ratio / 2.0
    offset = xi - 0.5
    # radius - sqrt(radius^2 - offset^2), written so that nothing cancels
    drop = offset**2 / (radius + np.sqrt(radius**2 - offset**2))
    return 1.0 - drop / ratio


def through_points(table: tuple[tuple[float, float], ...], xi: FloatArray) -> FloatArray:
    """Monotone cubic through given points (PCHIP).

    Parameters
    ----------
    table : sequence of (position, value)
        Positions rise from 0 to 1.
    xi : array of float
        Where to read it.
    """
    from scipy.interpolate import PchipInterpolator

    position, fraction = np.array(table).T
    return np.asarray(PchipInterpolator(position, fraction)(xi), dtype=np.float64)


def with_profile_files(tables: Any, folder: Path) -> Any:
    """Return the tables of a scene with the points of profiles in place of the CSV files that they name.

    Parameters
    ----------
    tables : mapping, or what stands in its place
        The scene; ``movement.table``, ``movement.history`` and ``mound.table`` may be names of files.
    folder : Path
        In which the files are.
    """
    if not isinstance(tables, Mapping):  # refused by the scene, in its own words
        return tables
    found = dict(tables)
    for key in ("movement", "mound"):
        part = tables.get(key)
        if isinstance(part, Mapping) and isinstance(name := part.get("table"), str):
            found[key] = {**part, "table": read_profile(folder / name)}
    movement = found.get("movement")
    if isinstance(movement, Mapping) and isinstance(name := movement.get("history"), str) and "stage" not in movement:
        found["movement"] = _with_history({k: v for k, v in movement.items() if k != "history"}, folder / name)
        size = "surface_movement"
        if movement.get("shape") == "mound" and isinstance(mound := found.get("mound", {}), Mapping):
            found["mound"] = {size: max(stage[size] for stage in found["movement"]["stage"]), **mound}
    return found


def _with_history(movement: dict[str, Any], path: Path) -> dict[str, Any]:
    """Return the table of a movement with the stages of a CSV file, and by default their largest deflection."""
    lines = [line for line in read_text(path).splitlines() if line.strip() and not line.lstrip().startswith("#")]
    names = [name.strip() for name in next(csv.reader(lines[:1]), [])]
    if not {"time", "movement"} <= set(names) <= {"time", "movement", "increments", "strain"} or len(lines) < 2:
        raise InputError(f"{path}: needs the columns time (years) and movement (m, doming positive), and a line each.")
    size = "surface_movement" if movement.get("shape") == "mound" else "central_deflection"
    stages: list[dict[str, Any]] = []
    for number, row in enumerate(csv.reader(lines[1:]), start=2):
        try:
            line = dict(zip(names, map(float, row), strict=True))
            stage = {"time": line["time"], size: abs(line["movement"])}
            stage |= {"increments": int(line["increments"])} if "increments" in line else {}
            stage |= {"strain": line["strain"]} if "strain" in line else {}
        except (ValueError, OverflowError):
            raise InputError(f"{path}, line {number} of the table: must have {len(names)} finite numbers.") from None
        stages.append({"kind": "doming" if line["movement"] > 0 else "dishing", **stage})
    largest = max(stage[size] for stage in stages)
    return {**({} if size == "surface_movement" else {size: largest}), **movement, "stage": stages}


def read_profile(path: str | Path) -> list[list[float]]:
    """Read points of a profile, with positions as fractions of the distance from the first to the last.

    Parameters
    ----------
    path : str or Path
        CSV file of two columns, position and value; a first line of names and lines that begin with # do not count.

    Raises
    ------
    InputError
        If the file is missing, or a line does not have two numbers.
    """
    rows = [
        (number, row)
        for number, row in enumerate(csv.reader(read_text(path).splitlines()), start=1)
        if any(map(str.strip, row)) and not row[0].lstrip().startswith("#")
    ]
    points: list[list[float]] = []
    for number, row in rows:
        try:
            x, value = (float(cell) for cell in row)
        except ValueError:
            if number == rows[0][0]:
                continue  # names
            raise InputError(f"{path}, line {number}: must have two numbers, position and value.") from None
        points.append([x, value])
    if len(points) < 2 or not points[-1][0] > points[0][0]:
        raise InputError(f"{path}: must have at least two points, with positions that rise.")
    first, reach = points[0][0], points[-1][0] - points[0][0]
    return [[(x - first) / reach, value] for x, value in points]
