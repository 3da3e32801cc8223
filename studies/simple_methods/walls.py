"""The walls of the study: for the distinct element model, and as elastic walls."""

from __future__ import annotations

import itertools
import tomllib
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from damagepred import Scene
from damagepred.assembly import wall_geometry
from damagepred.enumerations import ContactKind

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


def elastic(scene: Scene, settings: dict[str, Any], lifts: bool) -> tuple[Scene, dict[str, np.ndarray]]:
    """Return a wall whose joints never break, and fields for its solution."""
    strength = settings["elastic"]["strength"]
    joint = replace(scene.joint, tensile_strength=strength, cohesion=2 * strength)
    if not lifts:
        return replace(scene, joint=joint, dpc=None), {}
    scene = replace(scene, joint=joint)
    if scene.dpc is not None:
        return scene, {}
    base = wall_geometry(scene).joints.kind == ContactKind.FOOTING_INTERFACE
    return scene, {
        "joint.tensile_strength": np.where(base, 0.0, strength),
        "joint.cohesion": np.where(base, 0.0, 2 * strength),
    }
