"""Masonry by name: values, scatter, source and confidence, from the shipped ``data/materials/library.toml``."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import Any, NamedTuple

from damagepred.errors import InputError, nearest
from damagepred.inputs.data_files import data_tables
from damagepred.inputs.documentation import documented

REMOVED = "none"  # word of a scene that takes away a value or table of its material
OPTIONAL = {
    *(f"joint.{key}" for key in ("fracture_energy", "shear_fracture_energy", "compressive_strength")),
    "block.tensile_strength",
    "block.fracture_energy",
}
"""Values that a scene can do without."""


class MaterialValue(NamedTuple):
    """Value of a material (SI) and its coefficient of variation, with the levels of confidence of both."""

    mean: float
    cov: float | None
    confidence: str
    cov_confidence: str


@documented
class Material(NamedTuple):
    """Masonry of the library.

    Examples
    --------
    >>> from damagepred import scene
    >>> dutch = scene.masonry_library()["clay brick, Dutch, 1940s"]
    >>> dutch.values["block.density"].mean
    1708.0
    """

    name: str
    description: str
    calibrated_on: str
    source: str
    """In words; ``calibrated_on`` is the test that the values fit together."""
    values: dict[str, MaterialValue]
    """By their place in the scene, such as "joint.cohesion"."""
    correlation: dict[tuple[str, str], float]
    """Between the values of two places."""


@lru_cache(maxsize=1)
def masonry_library() -> dict[str, Material]:
    """All masonry of the library, by name.

    Examples
    --------
    >>> from damagepred import scene
    >>> [name for name in scene.masonry_library() if "Dutch" not in name]
    ['clay brick, Australian, 1990s']
    >>> scene.masonry_library()["clay brick, Dutch, 1940s"].values["joint.tensile_strength"].cov
    0.3
    """
    found = {}
    for name, table in data_tables("materials", "library.toml").items():
        values = {}
        for place, value in table["values"].items():
            confidence = value["confidence"]
            of_cov = value.get("cov_confidence", confidence if "cov" in value else "")
            values[place] = MaterialValue(value["mean"], value.get("cov"), confidence, of_cov)
        pairs = {(pair["places"][0], pair["places"][1]): pair["value"] for pair in table.get("correlation", ())}
        found[name] = Material(name, table["description"], table["calibrated_on"], table["source"], values, pairs)
    return found


def material(name: str) -> Material:
    """Material of a name; others are refused with the names of the library."""
    known = masonry_library()
    if name not in known:
        raise InputError(f"material = '{name}': the library has {'; '.join(known)}.{nearest(name, list(known))}")
    return known[name]


def with_material(tables: Mapping[str, Any]) -> dict[str, Any]:
    """Tables of a scene with the values of their material; own values win, and ``"none"`` takes a value away."""
    found = dict(tables)
    name = found.get("material")
    for place, value in material(name).values.items() if isinstance(name, str) else ():
        *way, key = place.split(".")
        table: Any = found
        for step in way:
            own = table.get(step, {})
            table[step] = dict(own) if isinstance(own, Mapping) else None if own == REMOVED else own
            if not isinstance(table := table[step], dict):
                break
        else:
            table.setdefault(key, value.mean)
    for place in OPTIONAL:
        table, key = place.split(".")
        if isinstance(own := found.get(table), Mapping) and own.get(key) == REMOVED:
            found[table] = {**own, key: None}
    return found


def with_removals(tables: dict[str, Any]) -> dict[str, Any]:
    """Plain tables of a scene that say ``"none"`` where it lacks a value or table of its material."""
    for place in material(tables["material"]).values if "material" in tables else ():
        *way, key = place.split(".")
        table: Any = tables
        for step in way:
            table = table.setdefault(step, REMOVED)
            if table == REMOVED:
                break
        else:
            table.setdefault(key, REMOVED)
    return tables
