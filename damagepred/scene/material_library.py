"""Masonry by name: values, scatter, source and confidence, from the shipped ``data/materials/library.toml``."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from functools import lru_cache
from typing import Any, NamedTuple

from damagepred.errors import InputError, nearest
from damagepred.inputs.data_files import data_file


class MaterialValue(NamedTuple):
    """Value of a material.

    Attributes
    ----------
    mean : float
        In SI units.
    cov : float or None
        Coefficient of variation; None where none is known.
    confidence, cov_confidence : str
        Levels of confidence of both.
    """

    mean: float
    cov: float | None
    confidence: str
    cov_confidence: str


class Material(NamedTuple):
    """Masonry of the library.

    Attributes
    ----------
    name, description, source : str
        In words.
    values : dict of str to MaterialValue
        By their place in the scene, such as "joint.cohesion".
    correlation : dict of (str, str) to float
        Between the values of two places.

    Examples
    --------
    >>> from damagepred import scene
    >>> dutch = scene.masonry_library()["clay brick, Dutch, 1940s"]
    >>> dutch.values["block.density"].mean
    1708.0
    """

    name: str
    description: str
    source: str
    values: dict[str, MaterialValue]
    correlation: dict[tuple[str, str], float]


@lru_cache(maxsize=1)
def masonry_library() -> dict[str, Material]:
    """Return all masonry of the library, by name.

    Examples
    --------
    >>> from damagepred import scene
    >>> list(scene.masonry_library())
    ['clay brick, Dutch, 1940s', 'clay brick, Australian, 1990s']
    >>> scene.masonry_library()["clay brick, Dutch, 1940s"].values["joint.tensile_strength"].cov
    0.3
    """
    found = {}
    for name, table in tomllib.loads(data_file("materials", "library.toml").read_text(encoding="utf-8")).items():
        values = {
            place: MaterialValue(
                value["mean"],
                value.get("cov"),
                value["confidence"],
                value.get("cov_confidence", value["confidence"] if "cov" in value else ""),
            )
            for place, value in table["values"].items()
        }
        pairs = {(pair["places"][0], pair["places"][1]): pair["value"] for pair in table.get("correlation", ())}
        found[name] = Material(name, table["description"], table["source"], values, pairs)
    return found


def material(name: str) -> Material:
    """Return a material by its name.

    Parameters
    ----------
    name : str
        As the library has it.

    Raises
    ------
    InputError
        If there is none.
    """
    known = masonry_library()
    if name not in known:
        raise InputError(f"material = '{name}': the library has {'; '.join(known)}.{nearest(name, list(known))}")
    return known[name]


def with_material(tables: Mapping[str, Any]) -> dict[str, Any]:
    """Return the tables of a scene with the values of the material that they name; what they give themselves wins.

    Parameters
    ----------
    tables : mapping
        Tables of the scene, or objects in their place, which stay as they are.
    """
    found = dict(tables)
    if isinstance(name := found.get("material"), str):
        for place, value in material(name).values.items():
            table, key = place.split(".")
            own = found.get(table, {})
            if isinstance(own, Mapping):
                found[table] = {key: value.mean, **own}
    return found
