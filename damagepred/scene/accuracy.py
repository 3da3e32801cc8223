"""Presets of ``[solver]``: what a wanted accuracy sets, and the errors that were measured with it.

They come from errors over computing time: ``studies/benchmarks/work_precision`` measures them and writes
``data/accuracy.csv``. Increments are no part of them: the quasi-static path hardly depends on their number, which says
at how many movements results are kept.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Mapping
from typing import Any, Literal, NamedTuple

from damagepred.inputs.data_files import data_file

Accuracy = Literal["draft", "standard", "fine", "reference"]
"""Names of the presets."""

STANDARD: dict[str, Any] = {
    "blocks": "rigid",
    "zone_size": None,
    "quadrature": "lobatto",
    "contacts_per_interface": 3,
    "tolerance": None,
    "ramp_cycles": 10_000,
}
"""The defaults of all keys that a preset sets."""

PRESETS: dict[str, dict[str, dict[str, Any]]] = {
    "draft": {
        "quasi_static": {"quadrature": "midpoint", "contacts_per_interface": 2},
        "explicit": {"quadrature": "midpoint", "contacts_per_interface": 2, "tolerance": 1e-2, "ramp_cycles": 1000},
    },
    "standard": {"quasi_static": {}, "explicit": {}},
    "fine": {"quasi_static": {"blocks": "elastic"}, "explicit": {"blocks": "elastic"}},
    "reference": {
        "quasi_static": {"blocks": "deformable", "zone_size": 0.04, "contacts_per_interface": 5},
        "explicit": {"blocks": "deformable", "zone_size": 0.04, "tolerance": 1e-4},
    },
}
"""What each preset sets by method, beyond ``STANDARD``."""


def preset(accuracy: str, method: str) -> dict[str, Any]:
    """Return the keys of ``[solver]`` that a preset sets, and their values.

    Parameters
    ----------
    accuracy : {"draft", "standard", "fine", "reference"}
        The preset.
    method : {"quasi_static", "explicit"}
        The solver.
    """
    return {**STANDARD, **PRESETS[accuracy][method]}


def filled_in(given: Mapping[str, Any]) -> dict[str, Any]:
    """Return a ``[solver]`` table with what its preset sets; what is given, and not None, stays.

    Parameters
    ----------
    given : mapping
        As the user wrote it, and not checked yet.
    """
    accuracy, method = given.get("accuracy", "standard"), given.get("method", "quasi_static")
    if not (isinstance(accuracy, str) and isinstance(method, str)):
        return dict(given)
    more = PRESETS.get(accuracy, {}).get(method, {})
    return {**given, **{key: value for key, value in more.items() if given.get(key) is None}}


class Measured(NamedTuple):
    """An error that was measured.

    Attributes
    ----------
    accuracy, method : str
        Preset and solver.
    wall : str
        Which wall of the benchmark.
    dpc, opening : bool
        Whether it has a damp-proof course, an opening.
    quantity : str
        What was read off it, in words.
    error : float
        As a share of the value; of the damage category, categories.
    floor : float
        Own error of the reference: below this an error cannot be told.
    times : float
        Time of the path over that of the standard.
    """

    accuracy: str
    method: str
    wall: str
    dpc: bool
    opening: bool
    quantity: str
    error: float
    floor: float
    times: float


def measured() -> list[Measured]:
    """Return all errors that were measured, as shipped in ``data/accuracy.csv``."""
    with data_file("accuracy.csv").open(newline="", encoding="utf-8") as file:
        return [
            Measured(
                row["accuracy"],
                row["method"],
                row["wall"],
                row["dpc"] == "1",
                row["opening"] == "1",
                row["quantity"],
                *(float(row[name] or math.nan) for name in ("error", "floor", "times")),
            )
            for row in csv.DictReader(file)
        ]
