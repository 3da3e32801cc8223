"""Presets of ``[solver]``: keys for an accuracy, and the errors measured with them.

``studies/benchmarks/work_precision`` measures errors over computing time and writes ``data/accuracy.csv``. Increments
are no part of a preset: the quasi-static path depends little on their number, which is the number of stored movements.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Mapping
from typing import Any, Literal, NamedTuple

from damagepred.inputs.data_files import data_file

Accuracy = Literal["draft", "standard", "fine", "reference"]  # names of the presets
DEFAULTS: dict[str, Any] = {
    "blocks": "elastic",
    "zone_size": None,
    "quadrature": "lobatto",
    "contacts_per_interface": 3,
    "tolerance": None,
    "ramp_cycles": 10_000,
}
"""Defaults of all keys of presets."""

_DRAFT = {"blocks": "rigid", "quadrature": "midpoint", "contacts_per_interface": 2}
PRESETS: dict[str, dict[str, dict[str, Any]]] = {
    "draft": {"quasi_static": _DRAFT, "explicit": {**_DRAFT, "tolerance": 1e-2, "ramp_cycles": 1000}},
    "standard": {"quasi_static": {"blocks": "rigid"}, "explicit": {"blocks": "rigid"}},
    "fine": {"quasi_static": {}, "explicit": {}},
    "reference": {
        "quasi_static": {"blocks": "deformable", "zone_size": 0.04, "contacts_per_interface": 5},
        "explicit": {"blocks": "deformable", "zone_size": 0.04, "tolerance": 1e-4},
    },
}
"""Keys of each preset by method, in addition to ``DEFAULTS``."""


def preset(accuracy: str, method: str) -> dict[str, Any]:
    """Keys of ``[solver]`` in a preset, with their values."""
    return {**DEFAULTS, **PRESETS[accuracy][method]}


def _default(given: Mapping[str, Any]) -> Accuracy:
    """Accuracy of a table without one: ``standard`` where other keys need rigid bricks, such as zones in a part."""
    parts = (given.get(key) for key in ("above_dpc", "below_dpc", "footing"))
    rigid = "deformable" in parts or given.get("lump_block_elasticity") is False
    return "standard" if given.get("blocks", "rigid" if rigid else "elastic") != "elastic" else "fine"


def filled_in(given: Mapping[str, Any]) -> dict[str, Any]:
    """Table ``[solver]`` as the user wrote it, unchecked, completed by its preset; given values stay."""
    accuracy, method = given.get("accuracy", _default(given)), given.get("method", "quasi_static")
    if not (isinstance(accuracy, str) and isinstance(method, str)):
        return dict(given)
    more = PRESETS.get(accuracy, {}).get(method, {})
    return {**given, "accuracy": accuracy, **{key: v for key, v in more.items() if given.get(key) is None}}


class Measured(NamedTuple):
    """Measured error of one quantity of a benchmark wall."""

    accuracy: str  # preset and solver
    method: str
    wall: str
    dpc: bool
    opening: bool
    quantity: str
    error: float  # relative, or in categories
    floor: float  # error of the reference itself
    times: float  # time of the path over the time of the standard


def measured() -> list[Measured]:
    """All measured errors, from ``data/accuracy.csv``."""
    with data_file("accuracy.csv").open(newline="", encoding="utf-8") as file:
        rows: list[dict[str, Any]] = list(csv.DictReader(file))
    flags, numbers = ("dpc", "opening"), ("error", "floor", "times")
    return [
        Measured(**row | {name: row[name] == "1" for name in flags} | {n: float(row[n] or math.nan) for n in numbers})
        for row in rows
    ]
