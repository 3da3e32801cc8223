"""Sources of values in the shipped tables; other values are given or defaults."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Collection
from typing import Any, NamedTuple

from damagepred.errors import InputError
from damagepred.inputs.data_files import data_tables
from damagepred.scene import Scene, masonry_library
from damagepred.scene.quantity import to_si
from damagepred.uq.variable import Variable

PAPER = "The Prediction of Damage to Masonry Houses Caused by Foundation Movements"
"""Title of the paper that the model follows: named once, not in every row."""

GIVEN = "as given"
DEFAULT = "default"

_MATERIALS = {"block": "clay_brick_masonry", "joint": "mortar_joint", "dpc": "dpc", "footing": "concrete_footing"}
"""Tables of a scene that have the same keys in data/materials/zhuge.toml."""

_PHYSICAL = (*_MATERIALS, "head_joint", "soil", "mound", "loads")
"""Tables whose numbers someone could measure: their defaults are assumed."""


class Source(NamedTuple):
    """Source of a value, and its level of confidence (``data_files.CONFIDENCE``), empty if unknown."""

    name: str
    confidence: str = ""

    def __str__(self) -> str:
        return f"{self.name} ({self.confidence})" if self.confidence else self.name


def source_of_value(
    table: str, key: str, value: Any, given: Collection[str] | None = None, material: str | None = None
) -> Source:
    """Source of a value of a scene."""
    place = f"{table}.{key}"
    library = {} if material is None else masonry_library()[material].values
    if place in library and _same(value, library[place].mean) and place not in (given or ()):
        return Source(f"{material}, {masonry_library()[str(material)].source}", library[place].confidence)
    shipped = data_tables("materials", "zhuge.toml").get(_MATERIALS.get(table, ""), {})
    if key in shipped and _same(value, shipped[key]):
        name = shipped["source"].replace(f"{PAPER}, ", "")
        if given is not None:
            name = f"{GIVEN}, the value of {name}" if f"{table}.{key}" in given else f"{DEFAULT}, {name}"
        return Source(name, shipped["confidence"])
    defaults = Scene().to_dict().get(table, {}) if given is None else {}
    was_given = not (key in defaults and _same(value, defaults[key])) if given is None else f"{table}.{key}" in given
    if was_given:
        return Source(GIVEN)
    measured = table.partition(".")[0] in _PHYSICAL and isinstance(value, int | float) and not isinstance(value, bool)
    return Source(DEFAULT, "assumed" if measured else "")


def sources_of_variable(place: str, variable: Variable) -> list[Source]:
    """List the sources of a variable's mean and scatter."""
    if variable.source:
        return [Source(variable.source)]
    shipped = data_tables("statistics", "masonry.toml").get(place, {})
    if not shipped or variable.distribution != shipped["distribution"]:
        return [Source(GIVEN)]
    sources = []
    for what, keys in (("mean", ("mean",)), ("cov", ("cov", "lower"))):
        if (key := next((key for key in keys if key in shipped), None)) is None:
            continue
        source, value = Source(f"{what}: {GIVEN}"), getattr(variable, key, None)
        with contextlib.suppress(ValueError, InputError):  # of a text that is no number with this unit
            if value is not None and _same(to_si(value, "1" if key == "cov" else Scene.unit_of(place)), shipped[key]):
                source = Source(f"{what}: {shipped[f'{what}_source']}", shipped[f"{what}_confidence"])
        sources.append(source)
    return sources or [Source(GIVEN)]


def field_source(place: str, correlation: float) -> Source:
    """Source of the correlation from one unit of a course to the next."""
    shipped = data_tables("statistics", "masonry.toml").get(place, {}).get("field", {})
    if shipped and _same(correlation, shipped["course_correlation"]):
        return Source(shipped["source"], shipped["confidence"])
    return Source(GIVEN)


def _same(a: Any, b: Any) -> bool:
    if isinstance(a, int | float) and isinstance(b, int | float) and not isinstance(a, bool):
        return math.isclose(a, b, rel_tol=1e-9, abs_tol=0.0)
    return bool(a == b)
