"""Each wall's capacity: the interval of the movement in which it first reached a category, read from a study."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import xarray as xr

from damagepred.arguments import checked, require_alike, require_weights
from damagepred.arrays import BoolArray, FloatArray, Int8Array, IntArray
from damagepred.errors import InputError
from damagepred.uq.fragility.intensity import check_states, intensity_values

COMPLETE, COLLAPSED, FAILED = 0, 1, 2
"""Values of a sample's status that the fit uses; what is missing is left out."""

CHUNK = 50_000
"""Walls read at a time, so that a million of them need no arrays of their own size but the capacities."""


class Capacities(NamedTuple):
    """Movement at which each wall first reached a category lies in (lower, upper]; infinite upper: not yet.

    Attributes
    ----------
    lower, upper : array (walls,) or (categories, walls)
        In the unit of the movement.
    failed : array of bool, of the same shape
        Walls whose path could not be followed to its end, and had not reached the category before. Their lower bound
        is as far as they were followed.
    end : array (walls,)
        Movement to which each wall was to be followed.
    """

    lower: FloatArray
    upper: FloatArray
    failed: BoolArray
    end: FloatArray


class Walls(NamedTuple):
    """All that fits read of a study.

    Attributes
    ----------
    capacities : Capacities
        On (categories, walls).
    weight : array (walls,)
        1, or of importance sampling.
    single : bool
        Whether each wall is known at one movement alone.
    marks : array (increments,) or None
        Movements of the increments, if all walls have the same.
    largest : float
        Largest movement.
    increments : int
        Increments of a path after the first state; 1 where each wall is known at one movement alone.
    sample : array of int (walls,)
        Numbers of the walls in the study.
    crossed : bool
        Whether walls share fields, and fields walls (see ``damagepred.uq.crossed``).
    """

    capacities: Capacities
    weight: FloatArray
    single: bool
    marks: FloatArray | None
    largest: float
    increments: int
    sample: IntArray
    crossed: bool


def require_categories(ds: xr.Dataset, categories: Sequence[int]) -> None:
    """Check that the damage table of a study has the categories asked for.

    Raises
    ------
    InputError
        If it has not; the message says which there are.
    """
    highest = highest_category(ds)
    if wrong := [c for c in categories if not 1 <= c <= highest]:
        asked = f"category = {wrong[0]}" if len(categories) == 1 else f"categories = {list(categories)}"
        raise InputError(f"{asked}: the study's damage table has categories 1 to {highest}.")


def sample_weights(ds: xr.Dataset) -> FloatArray:
    """Return what each sample of a study counts for, array (samples,): 1, or of importance sampling."""
    if "weight" in ds:
        return np.asarray(ds["weight"].values, dtype=np.float64)
    return np.ones(ds.sizes["sample"])


def highest_category(ds: xr.Dataset) -> int:
    """Return the highest category of the damage table a study was judged by."""
    names = str(ds["damage_category"].attrs.get("flag_meanings", "")).split() if "damage_category" in ds else []
    return int(ds.attrs.get("highest_category", len(names) - 1 if names else 4))


@checked
def capacities(ds: xr.Dataset, category: int, intensity: str = "central_deflection") -> Capacities:
    """Read each wall's capacity for a category from a study.

    Parameters
    ----------
    ds : xarray.Dataset
        See ``read_capacities``.
    category : int
        Category that counts as reached from here upwards.
    intensity : str
        Name of the movement's measure.
    """
    found = read_capacities(ds, [category], intensity).capacities
    return Capacities(found.lower[0], found.upper[0], found.failed[0], found.end)


@checked
def read_capacities(ds: xr.Dataset, categories: Sequence[int], intensity: str) -> Walls:
    """Read each wall's capacity for several categories from a study.

    A footing that finds its own form may rise again while the ground goes on: then its intensity is the largest
    deflection so far. Where a path ended before the full movement, because the jacks or supports carried nothing any
    more, category and deflection are not known beyond: such a wall is censored at that limit. Where a study keeps the
    end of each wall's movement alone, its capacity lies below that or above.

    Parameters
    ----------
    ds : xarray.Dataset
        With ``damage_category`` and the intensity on (sample, increment) or on (sample,), and ``status`` on (sample,).
        It is read ``CHUNK`` walls at a time, so it may be one that is still on disk.
    categories : sequence of int
        Each counts as reached from itself upwards.
    intensity : str
        Name of the movement's measure.

    Raises
    ------
    InputError
        If paths cannot be read in between, see ``check_states``.
    """
    if ds["damage_category"].ndim > 1:
        check_states(ds, intensity)
    status = np.asarray(ds["status"].values)
    known = np.isin(status, (COMPLETE, COLLAPSED, FAILED))
    count, kinds = int(known.sum()), len(categories)
    lower, upper = np.empty((kinds, count)), np.empty((kinds, count))
    end = np.empty(count)
    marks: FloatArray | None = None
    alike, largest, done = True, 0.0, 0
    single = ds["damage_category"].ndim == 1
    names = [n for n in ds.variables if ds[n].dims[:1] == ("sample",)]
    light = ds[names]
    for first in range(0, len(status), CHUNK):
        here = known[first : first + CHUNK]
        if not here.any():
            continue
        some = light.isel(sample=slice(first, first + CHUNK))
        reached = np.asarray(some["damage_category"].values)[here]
        movement = intensity_values(some, intensity)[here]
        if single:
            reached, movement = reached[:, None], movement[:, None]
        to = slice(done, done + len(reached))
        for k, category in enumerate(categories):
            lower[k, to], upper[k, to] = _intervals(reached, movement, category)
        end[to] = np.where(np.isfinite(movement), movement, 0.0).max(axis=1)
        largest = max(largest, float(end[to].max(initial=0.0)))
        marks = movement[0].copy() if marks is None else marks
        alike = alike and not single and bool((movement == marks).all())
        done = to.stop
    end = np.where(end > 0, end, largest)  # a wall of which nothing is known was to go as far as any
    failed = (status[known] == FAILED)[None, :] & np.isinf(upper)
    weight = sample_weights(ds)[known]
    increments = 1 if single else ds.sizes["increment"] - 1
    return Walls(
        Capacities(lower, upper, failed, end),
        weight,
        single,
        marks if alike else None,
        largest,
        increments,
        np.flatnonzero(known),
        bool(int(ds.attrs.get("crossed", 0))),
    )


def _intervals(reached: Int8Array, given: FloatArray, category: int) -> tuple[FloatArray, FloatArray]:
    movement = np.where(np.isfinite(given), np.fmax.accumulate(given, axis=1), np.nan)
    hit = reached >= category
    ever = hit.any(axis=1)
    first = hit.argmax(axis=1)
    # the last movement at which the wall is known to have been below the category
    before = np.arange(reached.shape[1]) < np.where(ever, first, reached.shape[1])[:, None]
    before &= (reached >= 0) & np.isfinite(movement)
    lower = np.where(before, movement, 0.0).max(axis=1, initial=0.0)
    return lower, np.where(ever, movement[np.arange(len(first)), first], np.inf)


@checked
def fair_weights(weight: FloatArray, upper: FloatArray, good: BoolArray | None = None) -> FloatArray:
    """Scale weights so that walls which reached a category count as many as they are: fits need a few of them.

    Parameters
    ----------
    weight, upper : array (walls,)
        Weights, and capacities' upper bounds, infinite where the category was not reached.
    good : array of bool (walls,), optional
        Walls that did not fail.
    """
    require_alike(weight=weight, upper=upper, good=good)
    require_weights("weight", weight)
    weight, upper = np.asarray(weight, dtype=np.float64), np.asarray(upper, dtype=np.float64)
    reached = np.isfinite(upper) & (weight > 0)
    if good is not None:
        reached &= good
    total = float(weight[reached].sum())
    return weight * (reached.sum() / total) if total > 0 else weight


def others_alone(found: Capacities) -> Capacities:
    """Return capacities in which those reached before any movement say nothing: what is left is of the other walls."""
    before = found.upper <= 0
    return found._replace(upper=np.where(before, np.inf, found.upper), failed=found.failed & ~before)


class Cells(NamedTuple):
    """Walls put together that say the same: only how many there are of each matters.

    Attributes
    ----------
    lower, upper : array (categories, cells)
        Their intervals.
    weight : array (cells,)
        What one of their walls counts for.
    number : array of int (cells,)
        How many walls there are.
    """

    lower: FloatArray
    upper: FloatArray
    weight: FloatArray
    number: IntArray

    @property
    def total(self) -> FloatArray:
        """What the walls of each cell count for together."""
        return self.weight * self.number

    def of(self, category: int) -> Cells:
        """Return the cells of one category alone, by its place."""
        if len(self.lower) == 1:
            return self
        return tally(self.lower[category : category + 1], self.upper[category : category + 1], self.weight, self.number)


def tally(lower: FloatArray, upper: FloatArray, weight: FloatArray, count: IntArray | None = None) -> Cells:
    """Count walls of the same intervals and weight.

    Parameters
    ----------
    lower, upper : array (categories, walls)
        Intervals.
    weight : array (walls,)
        What each counts for.
    count : array of int (walls,), optional
        How many walls each stands for.

    Raises
    ------
    InputError
        If a bound is NaN or an interval is empty.
    """
    if np.isnan(lower).any() or np.isnan(upper).any() or (lower > upper).any():
        raise InputError("capacities must be intervals lower <= upper without NaN.")
    first, which = alike(np.vstack((lower, upper, weight)))
    walls = np.bincount(which, weights=count, minlength=len(first)).astype(np.int64)
    return Cells(lower[:, first], upper[:, first], weight[first], walls)


def alike(columns: FloatArray) -> tuple[IntArray, IntArray]:
    """Find what has the same values in all columns.

    Parameters
    ----------
    columns : array (columns, n)
        Values.

    Returns
    -------
    first : array of int (groups,)
        Place of the first of each group.
    which : array of int (n,)
        Group of each.
    """
    key = np.zeros(columns.shape[1], dtype=np.int64)
    many = 1
    for column in columns:
        if not column.size or (column == column[0]).all():
            continue
        values, place = np.unique(column, return_inverse=True)
        if many > 1 and many * len(values) > 2**62:  # numbered anew before the product overflows
            kinds, key = np.unique(key, return_inverse=True)
            many = len(kinds)
        key = key * len(values) + place
        many *= len(values)
    _, first, which = np.unique(key, return_index=True, return_inverse=True)
    return first, which
