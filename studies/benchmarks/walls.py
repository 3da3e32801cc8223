"""Walls and changes as data: tables of a scene over those of a file of the repository's ``data``."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from damagepred.scene import Loads, Scene

DATA = Path(__file__).resolve().parents[2] / "data"
Tables = Mapping[str, Any]


def read(file: Path) -> dict[str, Any]:
    """Return the tables of a TOML file."""
    return tomllib.loads(file.read_text(encoding="utf-8"))


def scene(tables: Tables) -> Scene:
    """Return a scene: its tables over those of the file in ``data`` named ``base``, without those named ``without``."""
    own = read(DATA / f"{tables['base']}.toml") if "base" in tables else {}
    for name, table in tables.items():
        if name not in ("base", "without"):
            own[name] = {**own.get(name, {}), **table} if isinstance(table, dict) else table
    return Scene.from_dict({name: table for name, table in own.items() if name not in tables.get("without", ())})


def changed(scene: Scene, tables: Tables) -> Scene:
    """Return a scene with other values of some keys, which are given as tables."""
    return replace(scene, **{name: replace(getattr(scene, name), **table) for name, table in tables.items()})


def part_of_test(scene: Scene, length: float, height: float) -> Scene:
    """Return a wall of another size, of the same bricks, at the same deflection ratio and load on every metre."""
    scale = length / scene.wall.length
    deflection = scale * scene.movement.central_deflection
    tables = {"wall": {"length": length, "height": height}, "movement": {"central_deflection": deflection}}
    return replace(changed(scene, tables), loads=Loads(roof=scale * scene.loads.roof))
