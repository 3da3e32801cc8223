"""Limits of the simple methods, from data files with sources: tensile strains and ground movements."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from damagepred.arrays import FloatArray, Int8Array
from damagepred.inputs.data_files import data_tables
from damagepred.inputs.documentation import documented

ROUNDING = 1e-9  # relative rounding of values at a limit (1)


def level_of(values: ArrayLike, limits: Sequence[float], *, limit_is_below: bool = False) -> Int8Array:
    """Number of limits (ascending) that each value has reached, element by element; -1 where it is NaN."""
    given = np.asarray(values, dtype=np.float64)
    bounds = np.asarray(limits, dtype=np.float64) * (1.0 + ROUNDING if limit_is_below else 1.0 - ROUNDING)
    level = np.searchsorted(bounds, given, side="left" if limit_is_below else "right")
    return np.where(np.isnan(given), -1, level).astype(np.int8)


def highest_level(levels: Iterable[Int8Array]) -> Int8Array:
    """Highest of several levels, element by element; -1 where one is unknown."""
    every = np.array(list(levels))
    return np.where((every < 0).any(axis=0), -1, every.max(axis=0)).astype(np.int8)


@documented
@dataclass(frozen=True)
class StrainTable:
    """Categories of damage by tensile strain.

    Examples
    --------
    >>> from damagepred import damage
    >>> damage.load_strain_table().limits
    (0.0005, 0.00075, 0.0015, 0.003)
    """

    name: str
    source: str
    confidence: str
    """Source of the limits, and the level of confidence."""
    limits: tuple[float, ...]
    """Largest strain of category 0, 1, ... (1); a strain equal to a limit belongs to the lower category."""

    def by_strain(self, strain: ArrayLike) -> Int8Array:
        """Category of a tensile strain (1), element by element; -1 where it is NaN."""
        return level_of(strain, self.limits, limit_is_below=True)


@documented
@dataclass(frozen=True)
class MovementLimit:
    """Limit of a movement of the ground under a wall.

    Examples
    --------
    >>> from damagepred import damage
    >>> first = damage.load_movement_limits()[0]
    >>> first.author, first.measure, first.one_in
    ('Polshin and Tokar 1957', 'deflection_ratio', (2500.0,))
    """

    author: str
    about: str
    """Author, and the damage above the limit."""
    measure: str
    """Measure of the ground under the wall."""
    one_in: tuple[float, ...]
    """Reciprocal of the limit (1), at each length over height."""
    length_over_height: tuple[float, ...] = ()
    """Length over height (1); empty if the limit is constant."""
    kind: str | None = None
    """Movement, dishing or doming; None: both."""
    deflection: float | None = None
    """Additional limit of the central deflection (m)."""
    confidence: str = "assumed"
    """Level of confidence (``data_files.CONFIDENCE``)."""

    def value(self, length: float, height: float) -> float:
        """Limit (1) for a wall of given size (m).

        Parameters
        ----------
        length, height : float
            Size of the wall (m).
        """
        limit = 1 / self.one_in[0]
        if self.length_over_height:
            limit = float(np.interp(length / height, self.length_over_height, 1 / np.array(self.one_in)))
        return limit if self.deflection is None else min(limit, self.deflection / length)


class Scale(NamedTuple):
    """Levels of damage by one measure of a wall, from a file of ``data/damage``."""

    name: str
    source: str
    confidence: str  # (``data_files.CONFIDENCE``)
    measure: str  # variable of an archive
    limits: tuple[float, ...]  # smallest value of levels 1, 2, ..., in the unit of the variable
    gauge: float = np.nan  # length on which a slope is measured (m)

    def level(self, *values: ArrayLike) -> Int8Array:
        """Level of the largest of some values, element by element; -1 where one is NaN."""
        return level_of(np.max(np.broadcast_arrays(*values), axis=0), self.limits)


def load_scale(name: str) -> Scale:
    """Scale by the name of its file, such as ``"psi"`` or ``"tilt"``."""
    content = data_tables("damage", f"{name}.toml")
    keys = ("name", "source", "confidence", "measure")
    name, source, confidence, measure = (" ".join(content[key].split()) for key in keys)
    return Scale(name, source, confidence, measure, tuple(content["limits"]))


@lru_cache(maxsize=1)
def deviation_limits() -> Scale:
    """Limits of slope, out of level and out of plumb.

    Examples
    --------
    >>> from damagepred import damage
    >>> [f"1 in {1 / slope:.0f}" for slope in damage.deviation_limits().limits]
    ['1 in 150', '1 in 100']
    """
    content = data_tables("damage", "deviation.toml")
    limits = tuple(float(level["from"]) for level in _limited(content))
    gauge = float(content["gauge"]["length"])
    return Scale(content["name"], content["source"], content["confidence"], "tilt_max", limits, gauge)


class StickingLimits(NamedTuple):
    """Limits of distortion at which doors and windows stick; from ``data/damage/opening_distortion.toml``."""

    name: str
    source: str
    confidence: str  # (``data_files.CONFIDENCE``)
    # smallest distortion (rad), loss of width (m) and shortening of a diagonal (m) of levels 1, 2, ...
    angle: tuple[float, ...]
    narrowing: tuple[float, ...]
    diagonal: tuple[float, ...]

    def level(self, distortion: FloatArray, width_change: FloatArray, diagonal_change: FloatArray) -> Int8Array:
        """Level of openings, element by element: the highest of the three measures; -1 where unknown."""
        measured = (distortion, -np.asarray(width_change), -np.asarray(diagonal_change))
        return highest_level(map(level_of, measured, (self.angle, self.narrowing, self.diagonal)))


@lru_cache(maxsize=1)
def sticking_limits() -> StickingLimits:
    """Limits of distortion at which doors and windows stick.

    Examples
    --------
    >>> from damagepred import damage
    >>> damage.sticking_limits().narrowing
    (0.003, 0.006)
    """
    content = data_tables("damage", "opening_distortion.toml")
    limits = (tuple(float(level[name]) for level in _limited(content)) for name in ("angle", "narrowing", "diagonal"))
    return StickingLimits(content["name"], " ".join(content["source"].split()), content["confidence"], *limits)


def _limited(content: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Levels of a data file, rising; level 0 has no limit."""
    return sorted(content["level"], key=lambda level: int(level["number"]))[1:]


@lru_cache(maxsize=1)
def load_strain_table() -> StrainTable:
    """Limiting tensile strains of Boscardin and Cording (1989).

    Examples
    --------
    >>> from damagepred import damage
    >>> damage.load_strain_table().source
    'Boscardin and Cording 1989'
    """
    content = data_tables("damage", "limiting_tensile_strain.toml")
    categories = sorted(content["category"], key=lambda c: c["number"])
    limits = tuple(float(c["from"]) for c in categories[1:])
    return StrainTable(content["name"], content["source"], content["confidence"], limits)


@lru_cache(maxsize=1)
def load_movement_limits() -> tuple[MovementLimit, ...]:
    """All limits of movement: deflection ratios, angular distortions, and AS 2870 by construction.

    Examples
    --------
    >>> from damagepred import damage
    >>> sorted({limit.measure for limit in damage.load_movement_limits()})
    ['angular_distortion', 'deflection_ratio']
    """
    limits = []
    for content in (data_tables("damage", f"{name}.toml") for name in ("deflection_ratio", "angular_distortion")):
        for row in content["limit"]:
            lists = {
                key: tuple(np.ravel(row[key]).astype(float).tolist())
                for key in ("one_in", "length_over_height")
                if key in row
            }
            limits.append(MovementLimit(**row | lists, measure=content["measure"]))
    return (*limits, *construction_limits().values())


@lru_cache(maxsize=1)
def construction_limits() -> dict[str, MovementLimit]:
    """Design deflection of a footing by construction, such as ``"full_masonry"`` (AS 2870 Table 4.1).

    Examples
    --------
    >>> import damagepred
    >>> limits = damagepred.construction_limits()
    >>> sorted(limits)[:2]
    ['articulated_full_masonry', 'articulated_masonry_veneer']
    """
    content = data_tables("damage", "as2870_deflection_limits.toml")
    return {
        name: MovementLimit(
            author=content["name"],
            about=name.replace("_", " "),
            measure="deflection_ratio",
            one_in=(float(row["span_over_deflection"]),),
            deflection=float(row["deflection"]),
            confidence=content["confidence"],
        )
        for name, row in content.items()
        if isinstance(row, dict)
    }
