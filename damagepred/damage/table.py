"""Damage tables: limits of crack width for each category. The limits are data, with their source."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from damagepred.arrays import FloatArray, Int8Array
from damagepred.damage.limits import highest_level, level_of
from damagepred.errors import InputError, nearest, require_count, require_number
from damagepred.inputs.arguments import checked
from damagepred.inputs.data_files import data_file
from damagepred.inputs.documentation import documented
from damagepred.inputs.input_files import read_toml
from damagepred.inputs.text import category_names, check_title

TABLES = ("as2870", "bre251")  # damage tables that come with the package
OWN_MEASURES = {"width": "crack_width_max", "band": "crack_band_width_max", "count": "crack_count"}
OWN_MEASURES |= {"length": "crack_length_total", "psi": "psi", "distortion": "opening_distortion", "value": ""}
"""Measures of own states, and their archive variables; ``value`` is a result of the function."""
STATE_TAKES = (
    *("crack_width_max", "crack_band_width_max", "crack_count", "crack_length_total", "psi", "opening_distortion"),
    *("base_crack_width_max", "dpc_opening_max", "dpc_separation_length", "dpc_slip_max", "footing_opening_max"),
)
"""Archive variables that own states and their functions take."""
VISIBLE = 1e-4  # smallest width of a crack that own states count (m): the first limit of the damage tables


@documented
@dataclass(frozen=True)
class DamageTable:
    """Categories of damage by crack width.

    Examples
    --------
    >>> from damagepred import damage
    >>> table = damage.load_table("as2870")
    >>> dict(zip(table.category_names[1:], table.limits))
    {'very slight': 0.0001, 'slight': 0.001, 'moderate': 0.005, 'severe': 0.015}
    """

    name: str
    source: str
    confidence: str
    """Source of the limits, and the level of confidence (``data_files.CONFIDENCE``)."""
    category_names: tuple[str, ...]
    """Names of category 0, 1, ..."""
    limits: tuple[float, ...]
    """Smallest crack width of category 1, 2, ... (m); a width equal to a limit belongs to the higher category."""
    group_category: int
    """Least category of a group of wide cracks."""
    group_width: float
    """Smallest width of a crack in a group (m)."""
    plasterboard_factor: float | None
    """Factor on all widths behind plasterboard, if the table has this allowance."""
    measures: tuple[tuple[str, tuple[float, ...]], ...] = ()
    """For own states: measures of ``OWN_MEASURES``, and the smallest value of state 1, 2, ...; infinite where no state
    has one. Then groups of cracks do not count."""
    function: str | None = None
    """Function of the measure ``value``, as ``module:function``."""

    @property
    def rules(self) -> tuple[Any, ...]:
        """Limits that determine a category, without names and groups."""
        return self.limits, self.measures, self.function

    @property
    def counted_width(self) -> float:
        """Smallest width of a crack that ``crack_count`` counts (m)."""
        return VISIBLE if self.measures else self.limits[0]

    @classmethod
    def from_json(cls, text: str) -> DamageTable:
        """Table from its fields in JSON."""
        fields = json.loads(text)
        lists = {key: tuple(value) for key, value in fields.items() if isinstance(value, list)}
        measures = tuple((measure, tuple(limits)) for measure, limits in fields.get("measures", ()))
        return cls(**{**fields, **lists, "measures": measures})

    @property
    def draws_widths(self) -> bool:
        """Whether widths alone have limits, which drawings show: of all tables, and of own states by one width."""
        rising = all(a < b < np.inf for a, b in zip((0.0, *self.limits), self.limits))
        return not self.measures or ([name for name, _ in self.measures] in (["width"], ["band"]) and rising)

    def quantities(self, stored: Mapping[str, Any]) -> dict[str, FloatArray]:
        """Values of each measure of own states, from values under the names of archive variables."""
        values = {m: np.asarray(stored[OWN_MEASURES[m]], dtype=np.float64) for m, _ in self.measures if m != "value"}
        if self.function is not None:
            values["value"] = own_measure(self.function, {n: stored[n] for n in STATE_TAKES if n in stored})
        return values

    def by_measures(self, stored: Mapping[str, Any]) -> Int8Array:
        """Own state: the highest that any measure reaches, element by element; -1 where one is NaN."""
        if not self.measures:
            return self.by_width(stored["crack_width_max"])
        values = self.quantities(stored)
        return highest_level(level_of(values[measure], limits) for measure, limits in self.measures)

    @property
    def highest(self) -> int:
        """Number of the highest category."""
        return len(self.limits)

    def with_plasterboard(self) -> DamageTable:
        """Table with the plasterboard allowance; a table without one raises InputError."""
        factor = self.plasterboard_factor
        if factor is None:
            raise InputError(f"damage.plasterboard = true: {self.name} has no such allowance; use table = 'as2870'.")
        return replace(
            self,
            name=f"{self.name}, limits times {factor:g} for plasterboard",
            limits=tuple(v * factor for v in self.limits),
            group_width=self.group_width * factor,
            plasterboard_factor=None,
        )

    def by_width(self, width: FloatArray | float) -> Int8Array:
        """Category of a crack of given width (m), element by element; -1 if NaN."""
        return level_of(width, self.limits)

    def by_width_and_group(self, width: FloatArray | float, group_width: FloatArray | float) -> Int8Array:
        """Category by the widest crack and by a group of cracks, element by element.

        Parameters
        ----------
        width : array or float
            Width of the widest crack (m).
        group_width : array or float
            Width of the narrowest crack in the widest group (m), see ``group_widths``; 0 or NaN without group.
        """
        category = self.by_width(width)
        grouped = level_of(group_width, (self.group_width,)) > 0
        return np.where(grouped, np.maximum(category, self.group_category), category).astype(np.int8)


@lru_cache(maxsize=8)
def _function(name: str) -> Callable[[Mapping[str, FloatArray]], Any]:
    """Function by ``module:function``, of an installed module or of one in the working folder."""
    module, _, word = name.partition(":")
    try:
        if (folder := str(Path.cwd())) not in sys.path:
            sys.path.append(folder)
        function = getattr(import_module(module), word)
    except Exception as error:
        why = f"{type(error).__name__}: {error}"
        raise InputError(f"damage.function = '{name}': cannot be imported from the working folder ({why}).") from None
    if not callable(function):
        raise InputError(f"damage.function = '{name}': is no function.")
    return function


def own_measure(name: str, stored: Mapping[str, Any]) -> FloatArray:
    """Value of a function of archive variables, element by element; NaN where these are unknown."""
    given = {key: np.array(value, dtype=np.float64) for key, value in stored.items()}
    shape = np.broadcast_shapes(*(value.shape for value in given.values()))
    try:
        values = np.asarray(_function(name)({key: np.atleast_1d(value) for key, value in given.items()}), np.float64)
    except InputError:
        raise
    except Exception as error:
        why = f"raises {type(error).__name__}: {error}"
        raise InputError(f"damage.function = '{name}': {why}. It takes a dictionary of arrays.") from None
    if values.shape != (shape or (1,)):
        raise InputError(
            f"damage.function = '{name}': returns an array of shape {values.shape} for arrays of {shape or (1,)}; it "
            "must return one value per element."
        )
    return values.reshape(shape)


def share_of_limit(table: DamageTable, stored: Mapping[str, Any], category: int) -> float:
    """Largest ratio of a measure of own states to its limit for a category: 1 or more where it is reached."""
    values, limits = table.quantities(stored), dict(table.measures)
    return max(float(values[m]) / limits[m][category - 1] for m in values)


def own_table(states: Sequence[Mapping[str, Any]], function: str | None = None) -> DamageTable:
    """Table of own states, from the plain values of ``damagepred.scene.DamageState``."""
    measures = []
    for measure in OWN_MEASURES:
        limits = [np.inf if (limit := state.get(measure)) is None else float(limit) for state in states[1:]]
        if np.isfinite(limits).any():  # a state is reached where a higher one is
            measures.append((measure, tuple(np.minimum.accumulate(limits[::-1])[::-1].tolist())))
    said = (" or ".join(f"{m} {s[m]:g}" for m in OWN_MEASURES if s.get(m) is not None) or "below" for s in states)
    own = "; ".join(f"{state['name']} ({limits})" for state, limits in zip(states, said))
    widths = dict(measures).get("width") or dict(measures).get("band") or (np.inf,) * (len(states) - 1)
    return DamageTable(
        name=f"own states: {own}" + (f"; value of {function}" if function else ""),
        source="[damage] of the scene",
        confidence="given",
        category_names=category_names(state["name"] for state in states),
        limits=widths,
        group_category=0,
        group_width=np.inf,
        plasterboard_factor=None,
        measures=tuple(measures),
        function=function,
    )


@checked
@lru_cache(maxsize=8)
def load_table(name: str, *, plasterboard: bool = False) -> DamageTable:
    """Shipped damage table.

    Parameters
    ----------
    name : {"as2870", "bre251"}
        Name of the file in ``data/damage``.
    plasterboard : bool
        Whether its limits are raised for plasterboard.

    Raises
    ------
    InputError
        If there is no such table, or it has no allowance for plasterboard.

    Examples
    --------
    >>> from damagepred import damage
    >>> damage.load_table("as2870").limits
    (0.0001, 0.001, 0.005, 0.015)
    """
    if name not in TABLES:
        allowed = f"take {' or '.join(TABLES)}, or a file (*.toml) written like theirs."
        raise InputError(f"table = {name!r}: {allowed}{nearest(name, TABLES)}")
    table = read_table(data_file("damage", f"{name}.toml"))
    return table.with_plasterboard() if plasterboard else table


@checked
def read_table(path: str | Path) -> DamageTable:
    """Damage table from a file in the format of ``data/damage``.

    Raises
    ------
    InputError
        If it is missing or is no such table.

    Examples
    --------
    >>> import damagepred
    >>> from damagepred.inputs.data_files import data_file
    >>> table = damagepred.damage.read_table(data_file("damage", "as2870.toml"))
    >>> table.name, table.limits
    ('AS 2870-2011 Table C1', (0.0001, 0.001, 0.005, 0.015))
    """
    content = read_toml(path)
    try:
        return _table(content)
    except KeyError as error:
        raise InputError(f"{path}: is no damage table, it lacks {error}; see data/damage/as2870.toml.") from None
    except (ValueError, TypeError, OverflowError) as error:
        raise InputError(f"{path}: is no damage table ({error}); see data/damage/as2870.toml.") from None


def _table(content: dict[str, Any]) -> DamageTable:
    categories = sorted(content["category"], key=lambda c: int(c["number"]))
    limits = [require_number("from", c["from"], 0.0, unit="m", open_low=True) for c in categories[1:]]
    if [c["number"] for c in categories] != list(range(len(categories))) or len(categories) < 2:
        raise ValueError("categories must be numbered 0, 1, ...")
    if any(a >= b for a, b in zip([0.0, *limits], limits)):
        raise ValueError("the limits must grow from category to category")
    require_count("group.category", group := content["group"]["category"], 0)
    return DamageTable(
        name=check_title(content["name"]),
        source=str(content["source"]),
        confidence=str(content["confidence"]),
        category_names=category_names(c["name"] for c in categories),
        limits=tuple(limits),
        group_category=int(require_number("group.category", group, 0, len(limits))),
        group_width=require_number("group.crack_width", content["group"]["crack_width"], 0.0, unit="m"),
        plasterboard_factor=require_number("plasterboard.factor", content["plasterboard"]["factor"], 0.0, open_low=True)
        if "plasterboard" in content
        else None,
    )
