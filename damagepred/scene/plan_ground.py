"""Free-field movement of the ground under a house: a surface over the plan."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np
from pydantic import model_validator

from damagepred.arrays import FloatArray
from damagepred.errors import InputError
from damagepred.scene.described import described, require_name
from damagepred.scene.mound import REACTIVE, Mound, clay_form, local_form
from damagepred.scene.movement import Movement
from damagepred.scene.movement_stage import UP, Kind
from damagepred.scene.number_table import read_number_table
from damagepred.scene.quantity import Length, Pure
from damagepred.scene.survey_tables import LEVELS, POSITION, heights, moved

Shape = Literal["walsh", "mitchell", "tree", "pipe", "corner", "tunnel", "tilt", "levels"]
AT_A_POINT = ("tree", "pipe", "corner", "tunnel")  # shapes that need a point of the plan


class Outline(NamedTuple):
    """Rectangle around the axes of all walls (m)."""

    low: tuple[float, float]
    high: tuple[float, float]

    @property
    def size(self) -> tuple[float, float]:
        """Extent along x and y (m)."""
        return self.high[0] - self.low[0], self.high[1] - self.low[1]


@described
class PlanMound(Mound):
    """Free-field movement of the ground under a house (``[mound]`` of a file with ``[[wall]]``).

    It has the keys of ``[mound]`` of one wall, with places in plan instead of positions along the wall.

    Examples
    --------
    >>> from damagepred.scene import PlanMound
    >>> PlanMound(shape="tree", point=("-2 m", "3 m"), reach="8 m", surface_movement="40 mm").point
    (-2.0, 3.0)
    """

    shape: Shape = "walsh"  # type: ignore[assignment]
    """``walsh`` and ``mitchell``: mounds of AS 2870 over the rectangular outline of the house, with L its length in
    each direction. ``tree``: largest at ``point``, 0 at its reach. ``pipe`` (a leak or drain) and ``corner`` (which
    settles): a bell about ``point``. ``tunnel``: Gaussian trough across an axis through ``point``. ``tilt``: a plane, 0
    at its upper end. ``levels``: as given on a grid."""
    in_plan: Literal["each_direction", "nearest_edge"] = "each_direction"
    """Form of walsh and mitchell in plan. ``each_direction``: the mounds of both directions are added, so that every
    wall has the standard's mound of its direction, and corners move twice as far as the middles of edges.
    ``nearest_edge``: the larger of the two, by the nearest edge of the outline; then the ground is level along the
    outer walls."""
    point: tuple[Length, Length] | None = None
    """Tree, leak, corner that settles, or a point of the tunnel's axis (m)."""
    direction: Pure = 0.0
    """Direction of the tunnel's axis, or in which a tilt grows (degrees, from x to y)."""
    levels: tuple[tuple[Length, Length, Pure], ...] = ()
    """For ``shape = "levels"``: movements on all points of a grid, over ``surface_movement``; linear between. In a
    scene file it may be the name of a CSV or xlsx file with three columns: x, y and level (up positive), each with its
    unit. ``surface_movement`` and ``movement.kind`` then follow."""

    @model_validator(mode="after")
    def _in_plan(self) -> PlanMound:
        for key in ("position", "table"):
            if getattr(self, key):
                other = "point" if key == "position" else "levels"
                raise ValueError(f"{key}: goes along one wall; in plan take {other}")
        if (self.point is None) == (self.shape in AT_A_POINT):
            raise ValueError(
                f"point: is missing; shape = '{self.shape}' needs its place in plan, such as [-2.0, 3.0]"
                if self.point is None
                else f"point: only read with shape = {' or '.join(map(repr, AT_A_POINT))}; here it is '{self.shape}'"
            )
        if bool(self.levels) != (self.shape == "levels"):
            raise ValueError(f"levels: go with shape = 'levels'; here shape = '{self.shape}'")
        if self.levels:
            _ = self.grid
        return self

    @cached_property
    def grid(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Coordinates x, y (m) and levels (x, y) of the grid."""
        points = np.array(self.levels)
        x, y = np.unique(points[:, 0]), np.unique(points[:, 1])
        level = np.full((len(x), len(y)), np.nan)
        level[np.searchsorted(x, points[:, 0]), np.searchsorted(y, points[:, 1])] = points[:, 2]
        if min(level.shape) < 2 or np.isnan(level).any() or level.size != len(points):
            raise ValueError(
                f"levels: {len(points)} points are no grid of {len(x)} x and {len(y)} y; give each pair of two or more "
                "x and y once"
            )
        return x, y, level

    def read_keys(self, movement: Movement) -> set[str]:
        """Keys that the shape reads."""
        keys = {"in_plan"} if self.shape in REACTIVE else {"point"} if self.shape in AT_A_POINT else set()
        keys |= {"direction"} if self.shape in ("tunnel", "tilt") else {"levels"} if self.shape == "levels" else set()
        return super().read_keys(movement) | keys

    def largest(self, kind: Kind) -> float:
        """Largest movement of the free surface in one direction (m): y_m for walsh and mitchell."""
        return super().largest(kind) if self.shape in REACTIVE else self.surface_movement


@described
class GroundSource(PlanMound):
    """Further movement of the ground under a house (``[[source]]``), such as a tree beside a mound of clay.

    Its surface is added to the surface of ``[mound]``, has the same keys, and grows and reverses with it.

    Examples
    --------
    >>> from damagepred.scene import GroundSource
    >>> GroundSource(shape="pipe", point=("2 m", 0), kind="heave", surface_movement="15 mm").kind
    'heave'
    """

    name: str | None = None
    """Name in keys; without it the number of the source."""
    kind: Kind = "settle"
    """Movement of the ground, as ``movement.kind``."""

    @model_validator(mode="after")
    def _named(self) -> GroundSource:
        require_name(self, "source", "oak")
        return self


def check_grid(mound: PlanMound, outline: Outline) -> None:
    """Refuse levels that do not cover the house (ValueError)."""
    for axis, name in enumerate("xy" if mound.levels else ""):
        first, *_, last = mound.grid[axis]
        low, high = outline.low[axis], outline.high[axis]
        if first > low + 1e-9 or last < high - 1e-9:
            raise ValueError(
                f"levels: go from {name} = {first:g} to {last:g} m, the house from {low:g} to {high:g} m; give levels "
                "all around it"
            )


def rise(mound: PlanMound, points: FloatArray, outline: Outline, kind: Kind) -> FloatArray:
    """Vertical displacement (m, upwards) of the free surface at points (..., 2), at full movement."""
    size = mound.largest(kind) if kind in UP else -mound.largest(kind)
    if size == 0.0:
        return np.zeros(points.shape[:-1])
    if mound.shape not in REACTIVE:
        return size * _form(mound, points, outline)
    forms = [
        clay_form(mound, x, length, kind)
        for x, length in zip(np.moveaxis(points - np.array(outline.low), -1, 0), outline.size)
        if length > 0.0
    ]
    return -size * (np.sum if mound.in_plan == "each_direction" else np.max)(forms, axis=0)


def _form(mound: PlanMound, points: FloatArray, outline: Outline) -> FloatArray:
    """Surface over its largest movement."""
    if mound.shape == "tunnel":
        return local_form(mound, _off_axis(mound, points)[0], max(outline.size))
    if mound.shape == "tilt":
        ends = np.array([[x, y] for x in (outline.low[0], outline.high[0]) for y in (outline.low[1], outline.high[1])])
        along, corners = points @ _unit(mound), ends @ _unit(mound)
        return np.asarray((along - corners.min()) / np.ptp(corners))
    if mound.shape == "levels":
        x, y, level = mound.grid
        rows = np.stack([np.interp(points[..., 1], y, row) for row in level], axis=-1)
        i = np.clip(np.searchsorted(x, points[..., 0]) - 1, 0, len(x) - 2)
        low, high = (np.take_along_axis(rows, k[..., None], axis=-1)[..., 0] for k in (i, i + 1))
        return low + (points[..., 0] - x[i]) / (x[i + 1] - x[i]) * (high - low)
    away = np.hypot(*np.moveaxis(points - np.array(mound.point), -1, 0))
    return local_form(mound, away, max(outline.size))


def _unit(mound: PlanMound) -> FloatArray:
    """Unit vector in the direction of a mound (2,)."""
    angle = np.radians(mound.direction)
    return np.array([np.cos(angle), np.sin(angle)])


def _off_axis(mound: PlanMound, points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Distance from the tunnel's axis (m), and the unit vector across it."""
    across = np.array([-1.0, 1.0]) * _unit(mound)[::-1]
    return (points - np.array(mound.point)) @ across, across


def drift(mound: PlanMound, points: FloatArray, outline: Outline, kind: Kind) -> FloatArray:
    """Horizontal displacement (m) of the free surface (..., 2): 0 except over a tunnel of known depth."""
    if mound.shape != "tunnel" or mound.tunnel_depth is None:
        return np.zeros(points.shape)
    away, across = _off_axis(mound, points)
    return (rise(mound, points, outline, kind) * away / mound.tunnel_depth)[..., None] * across


def with_levels(tables: Mapping[str, Any], folder: Path) -> Mapping[str, Any]:
    """Tables of a house with the levels of their file, from which size and kind of the movement follow."""
    mound, movement = tables.get("mound"), tables.get("movement", {})
    if not (isinstance(mound, Mapping) and isinstance(mound.get("levels"), str) and isinstance(movement, Mapping)):
        return tables
    path = folder / mound["levels"]
    table = read_number_table(path)
    expected = {key: column for key, column in LEVELS.items() if key != "error"}
    columns = table.columns({**expected, "y": POSITION._replace(others=())})
    place, rise = np.column_stack([table.numbers(columns[key], "m") for key in "xy"]), heights(table, columns)
    if not table.unit(columns.get("level", columns.get("settlement", 0)), "m"):
        raise InputError(f"{path}: its levels have no unit; name the column with its unit, such as 'level (mm)'.")
    rows, change = moved(table, columns, place, rise[:, None])
    (x, y), level = place[rows].T, change[:, 0]
    largest = float(level[np.abs(level).argmax()])
    if largest == 0.0:
        raise InputError(f"{path}: all levels are 0; nothing moves.")
    kind, size = "heave" if largest > 0 else "settle", mound.get("surface_movement", abs(largest))
    points = np.column_stack((x, y, level / abs(largest) * (1.0 if largest > 0 else -1.0))).tolist()
    moved_mound = {**mound, "surface_movement": size, "levels": points}
    return {**tables, "mound": moved_mound, "movement": {"kind": kind, **movement}}
