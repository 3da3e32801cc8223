"""The walls of the study."""

from __future__ import annotations

import itertools
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

from damagepred import Scene

SETTINGS = Path(__file__).with_name("settings.toml")


class Case(NamedTuple):
    """A wall of the grid."""

    length: float
    height: float
    dpc: bool
    movement: str
    opening: str
    bond: float


def read_settings(quick: bool = False) -> dict[str, Any]:
    """Read settings.toml."""
    settings = tomllib.loads(SETTINGS.read_text(encoding="utf-8"))
    return settings | settings["quick"] if quick else settings


def cases(settings: dict[str, Any]) -> Iterator[Case]:
    """List the walls, short ones first."""
    names = ("lengths", "heights", "dpc", "movements", "openings", "bond")
    grid = (Case(*values) for values in itertools.product(*(settings[name] for name in names)))
    return (case for case in grid if case.length * case.height <= settings["largest_area"])


def scene_of(case: Case, settings: dict[str, Any]) -> Scene:
    """Return the wall for the distinct element model."""
    joint = Scene().joint
    tables: dict[str, Any] = {
        "title": f"{case.length:g} m x {case.height:g} m, {case.opening}, {'dpc' if case.dpc else 'no dpc'}, "
        f"{case.movement}, bond x {case.bond:.2g}",
        "wall": {"length": case.length, "height": case.height},
        "joint": {
            "tensile_strength": case.bond * joint.tensile_strength,
            "cohesion": case.bond * joint.cohesion,
        },
        "movement": {
            "kind": case.movement,
            "shape": settings["shape"],
            "increments": settings["increments"],
            "central_deflection": case.length / settings["largest_one_in"],
        },
    }
    if case.dpc:
        tables["dpc"] = {}
    if case.opening != "none":
        hole = settings[case.opening]
        tables["opening"] = [hole | {"kind": case.opening, "x": (case.length - hole["width"]) / 2}]
    return Scene.from_dict(tables)
