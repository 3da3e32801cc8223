"""Inputs as tables: the scene, its uncertain variables, and the source of each value."""

from __future__ import annotations

import contextlib
import json
import math
import re
from collections.abc import Collection, Iterator, Mapping
from functools import partial
from typing import Any, NamedTuple

from damagepred.archive.provenance import GIVEN as GIVEN_PLACES
from damagepred.archive.provenance import UNITS
from damagepred.assembly.brick_cracks import bricks_break
from damagepred.campaign.settings import StudySettings
from damagepred.errors import InputError
from damagepred.formatting import named, number, plain, quantity, suitable_unit
from damagepred.inputs.data_files import CONFIDENCE, data_tables
from damagepred.report.parts import Part, Section, Text
from damagepred.results.tables import Table
from damagepred.scene import House, Scene, masonry_library
from damagepred.scene.keys import step_names
from damagepred.scene.quantity import to_si, unit_in
from damagepred.uq.variable import Variable

HEADS = {
    "block": "Blocks",
    "joint": "Mortar joints",
    "head_joint": "Head joints",
    "dpc": "Damp-proof course",
    "rig": "Test rig",
    "dynamics": "Run in time",
}
"""Heads of the tables that are not called by their name."""

_EXPLICIT = ("damping", "ramp_cycles", "maximum_cycles", "time_step_safety")
_OPTIONS = ("solver", "damage")  # the page lists few defaults of these tables
_LISTED = ("solver.method", "solver.accuracy", "solver.blocks", "damage.table", "damage.measure")
_OF_ZONES = ("cohesion", "friction", "dilation", "tensile_strength", "fracture_energy")


def input_section(
    scene: Scene, settings: StudySettings | None = None, attributes: Mapping[str, Any] | None = None
) -> Section:
    """Section of inputs, in the units that the user wrote; attributes of older archives do not have these."""
    record, uncertain = attributes or {}, set(settings.variables) if settings is not None else set()
    given = str(record[GIVEN_PLACES]).split() if GIVEN_PLACES in record else None
    units = dict(json.loads(record.get(UNITS, "{}")))
    shown = partial(_rows, uncertain=uncertain, given=given, material=scene.material, units=units)
    rows = [row for table, values in _tables(scene) for row in shown(table, values)]
    house = isinstance(scene, House)
    what = "The house" if house else "The wall"
    what += "; what varies from sample to sample is in the next table" if uncertain else ""
    sources = {name for row in rows for name in CONFIDENCE if row[4].endswith(f"({name})")}
    parts: list[Part] = [
        Text(
            [
                "The calculation used these values. A source is named where a value agrees with a table shipped with "
                f"the program. “{GIVEN}”: written by the user; “default”: set by the program"
                + (", or by the user to the same value." if given is None else ".")
            ]
        ),
        Table(
            what,
            ["quantity", "value", "unit", "source"],
            [row[1:] for row in rows],
            words=(0, 2, 3),
            groups=[row[0] for row in rows],
            note="Other keys of solver and damage have their defaults.",
        ),
    ]
    if settings is not None and settings.variables:
        between = "house to house" if house else "wall to wall"
        variables = [_variable_row(place, v, between) for place, v in settings.variables.items()]
        sources |= {name for row in variables for name in CONFIDENCE if f"({name})" in row[4]}
        pairs = [(a, b, value) for a, row in settings.correlation.items() for b, value in row.items()]
        correlated = [f"{place_in_words(a)} with {place_in_words(b)}, {number(value)}" for a, b, value in pairs]
        note = "COV is the coefficient of variation, standard deviation over mean."
        note += f" Correlations: {'; '.join(correlated)}." if correlated else ""
        head = ["quantity", "distribution", "varies from", "unit", "source"]
        parts.append(Table("What is uncertain", head, variables, words=range(5), note=note))
    if any("Zhuge" in row[-1] for row in rows):
        parts.append(Text([f"Zhuge et al.: {PAPER}."]))
    if sources:
        levels = [f"({name}): {meaning}" for name, meaning in CONFIDENCE.items() if name in sources]
        parts.append(Text([f"Levels of confidence: {'; '.join(levels)}."]))
    return Section("inputs", "Inputs and their sources", parts)


def unsure(settings: StudySettings) -> list[str]:
    """Variables whose mean or scatter is assumed."""
    return [
        place_in_words(place)
        for place, variable in settings.variables.items()
        if any(source.confidence == "assumed" for source in sources_of_variable(place, variable))
    ]


def _tables(scene: Scene) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield the tables of a scene with the keys that the calculation reads."""
    unread = scene.unread()
    if scene.solver.method != "explicit":
        unread |= {f"solver.{key}" for key in _EXPLICIT}
    if scene.solver.blocks in ("rigid", "elastic"):
        idle = ("dilation",) if bricks_break(scene) else _OF_ZONES
        unread |= {"solver.plane", *(f"block.{key}" for key in idle)}
    if scene.joint.compressive_strength is None:
        unread.add("joint.cap_shear")
    for name, values in scene.to_dict().items():
        if isinstance(values, dict) and name != "report":
            yield name, {key: value for key, value in values.items() if f"{name}.{key}" not in unread}
        elif isinstance(values, list):
            for step, item in zip(step_names(values), values):
                yield f"{name}.{step}", item


def _rows(
    table: str,
    values: dict[str, Any],
    uncertain: set[str],
    given: Collection[str] | None,
    material: str | None,
    units: Mapping[str, str],
) -> Iterator[list[str]]:
    kind, _, which = table.partition(".")
    head = f"{HEADS.get(kind, named(kind).capitalize())} {which}".strip()
    for key, value in values.items():
        place = f"{table}.{key}"
        parts = {"": value} if isinstance(value, dict) else {}
        if (
            kind == "wall" and isinstance(value, list) and value and isinstance(value[0], dict)
        ):  # openings of a wall of a house
            parts = {f".{step}": part for step, part in zip(step_names(value), value)}
        for step, part in parts.items():
            for row in _rows(f"{place}{step}", part, uncertain, given, material, units):
                name = named(f"{key}{step.replace('.', ' ')}")
                yield [head if kind == "wall" else row[0], f"{name}: {row[1]}", *row[2:]]
        if parts:
            continue
        if isinstance(value, int | float) and not isinstance(value, bool) and Scene.takes_number(place):
            shown, unit = _in_unit(float(value), Scene.unit_of(place), units.get(place, ""))
        else:
            shown, unit = plain(value), ""
        origin = source_of_value(table, key, value, given, material)
        if table in _OPTIONS and place not in _LISTED and str(origin) == DEFAULT:
            continue
        source = Source("varies, see below") if place in uncertain else origin
        source = Source("from start to end") if key == "length" and "start" in values else source
        yield [head, named(key), shown, unit, str(source)]


def _in_unit(value: float, unit: str, written: str) -> tuple[str, str]:
    """Number in SI with the unit that the user wrote, otherwise with the unit of engineers."""
    try:
        return (number(value / to_si(f"1 {written}", unit)), _pretty(written)) if written else quantity(value, unit)
    except ValueError:  # such as the line load of a roof
        return quantity(value, unit)


def _pretty(unit: str) -> str:
    """Unit with raised powers."""
    return re.sub(r"(?<=[^\W\d_])\*{0,2}([23])\b", lambda power: "²³"[int(power[1]) - 2], unit)


def _variable_row(place: str, variable: Variable, varies: str) -> list[str]:
    unit = Scene.unit_of(place)
    sources = [str(source) for source in sources_of_variable(place, variable)]
    if variable.field is not None:
        varies = "joint to joint"
        if variable.field.by_course:
            along = variable.field.course_correlation
            varies += f", correlation {number(along)} to the next of a course"
            sources.append(f"field: {field_source(place, along)}")
        elif variable.field.correlation_length is not None:
            varies += f", correlation length {number(variable.field.correlation_length)} m"
    scale, shown = _scale_of(variable, unit)
    return [place_in_words(place), _words(variable, unit, scale), varies, shown, "; ".join(sources)]


def _scale_of(variable: Variable, unit: str) -> tuple[float, str]:
    """Size in SI and name of the unit of a variable's values: as written, otherwise the one that suits them."""
    stated = (getattr(variable, name) for name in ("mean", "median", "upper", "scale", "std"))
    given = next(filter(None, stated), next(iter(variable.values), 1.0))
    if written := unit_in(given):
        return to_si(f"1 {written}", unit), _pretty(written)
    return suitable_unit(to_si(given, unit), unit)


def _words(variable: Variable, unit: str, scale: float) -> str:
    """Distribution with its parameters in the shown unit."""
    with_unit = ((n, getattr(variable, n)) for n in ("mean", "median", "std", "lower", "upper", "scale"))
    pure = ((n, getattr(variable, n)) for n in ("cov", "dispersion", "shape", "alpha", "beta"))
    parameters = [f"{n} {number(to_si(value, unit) / scale)}" for n, value in with_unit if value is not None]
    parameters += [f"{'COV' if n == 'cov' else n} {number(float(value))}" for n, value in pure if value is not None]
    parameters += [f"{len(variable.values)} values"] if variable.values else []
    parameters += [f"{variable.name} of scipy.stats"] if variable.name else []
    parameters += [f"{len(variable.components)} components"] if variable.components else []
    return f"{named(variable.distribution)}: {', '.join(parameters)}" if parameters else named(variable.distribution)


def place_in_words(place: str) -> str:
    """Return the place of a value in a scene in words, such as "mortar joints: tensile strength"."""
    table, *which, key = place.split(".")
    return " ".join([HEADS.get(table, named(table)).lower(), *map(named, which)]) + f": {named(key)}"


# -- sources ---------------------------------------------------------------------------------------------------------

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
