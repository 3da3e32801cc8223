"""Capacity: the movement at which a wall reaches a damage category. This is the one definition of it.

- The movement of a state is the largest up to then: a footing may rise again while the ground moves further.
- A wall reaches a category at its first increment in that category or a worse one. Its capacity lies in the interval
  (lower, upper] between the last movement at which the wall is known to be below the category, and that increment's
  (interval censoring). Fragility curves, medians and ranks take the interval as it is.
- ``upper`` is infinite where the path ends before the category is reached: at the full movement, where no equilibrium
  exists (collapse), or where the wall failed (right censoring at ``lower``). ``upper`` is 0 where the wall is in the
  category before any movement (share at start).
- In the interval the capacity counts as evenly distributed: ``probability_reached``. Beyond the movement to which a
  censored wall was followed it is unknown: ``censored_before``.
- The limit state of rare events takes the crack width in proportion to the movement: ``interpolated_capacity``.
"""

from __future__ import annotations

import unicodedata
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
import xarray as xr

from damagepred.arrays import BoolArray, FloatArray, Int8Array, IntArray
from damagepred.enumerations import SOLVED, SampleStatus
from damagepred.errors import InputError, nearest
from damagepred.inputs.arguments import checked
from damagepred.uq.intensity import check_states, intensity_values

WALLS_AT_ONCE = 50_000  # walls read at a time: a million need no other arrays of their own size than the capacities
ROUNDING = 1e-9  # movements that differ by this share of themselves are equal: increments are multiples that round


class Capacities(NamedTuple):
    """Movement at which each wall first reached a category lies in (lower, upper]; infinite upper: not yet."""

    lower: FloatArray  # (walls,) or (categories, walls)
    upper: FloatArray
    failed: BoolArray  # walls whose path ended too early, without the category
    end: FloatArray  # (walls,): movement to which each wall was to be followed


class StudyCapacities(NamedTuple):
    """Capacities of a study's walls, with the design of the study that fits need."""

    capacities: Capacities  # on (categories, walls)
    weight: FloatArray  # (walls,): 1, or of importance sampling
    single: bool  # whether each wall is known at one movement alone
    marks: FloatArray | None  # (increments,): movements of the increments, if all walls have the same
    largest: float  # largest movement
    increments: int  # increments of a path after the first state; 1 where each wall is known at one movement alone
    sample: IntArray  # (walls,): numbers of the walls in the study


def sampled(ds: xr.Dataset) -> dict[str, str]:
    """Attribute of results that are fitted to a study of houses."""
    return {"sampled": "house"} if "wall" in ds.dims else {}


def category_number(ds: xr.Dataset, category: int | str) -> int:
    """Return the number of a damage category that is given by its number or its name, such as "slight"."""
    if not isinstance(category, str):
        return category
    if "category_name" in ds:
        numbers = dict(zip(map(str, ds["category_name"].values), map(int, ds["category"].values)))
    else:
        flags = next((ds[name].attrs for name in ("damage_category", "category") if name in ds.variables), {})
        numbers = {word: i for i, word in enumerate(str(flags.get("flag_meanings", "")).split())}
    if not numbers:
        raise InputError(
            f"category = {category!r}: no sample is solved yet, so categories have no names; give a number."
        )
    return numbered_category(category, numbers)


def numbered_category(name: str, numbers: Mapping[str, int]) -> int:
    """Number of a category by its name; neither case nor underscores count."""
    plain = {flat_name(word): number for word, number in numbers.items()}
    if flat_name(name) not in plain:
        words = [word.replace("_", " ") for word, number in numbers.items() if number]
        raise InputError(
            f"category = {name!r}: must be a number from 1, or one of {', '.join(words)}."
            + nearest(flat_name(name), words)
        )
    return plain[flat_name(name)]


def flat_name(name: str) -> str:
    """Name of a category as names are compared."""
    return unicodedata.normalize("NFC", name).replace("_", " ").casefold()


def require_categories(ds: xr.Dataset, categories: Sequence[int]) -> None:
    """Refuse categories that the study's damage table lacks."""
    highest = highest_category(ds)
    if wrong := [c for c in categories if not 1 <= c <= highest]:
        given = f"category = {wrong[0]}" if len(categories) == 1 else f"categories = {list(categories)}"
        raise InputError(f"{given}: the study's damage table has categories 1 to {highest}.")


def sample_weights(ds: xr.Dataset) -> FloatArray:
    """Weight of each sample of a study, array (samples,): 1, or of importance sampling."""
    if "weight" in ds:
        return np.asarray(ds["weight"].values, dtype=np.float64)
    return np.ones(ds.sizes["sample"])


def highest_category(ds: xr.Dataset) -> int:
    """Highest category of the damage table that a study was judged by."""
    names = str(ds["damage_category"].attrs.get("flag_meanings", "")).split() if "damage_category" in ds else []
    return int(ds.attrs.get("highest_category", len(names) - 1 if names else 4))


@checked
def read_capacities(
    ds: xr.Dataset, categories: Sequence[int], intensity: str, *, between: bool = True
) -> StudyCapacities:
    """Capacity of each wall for several categories; ``between``: states on the way count, not only ends of paths."""
    if ds["damage_category"].ndim > 1 and between:
        check_states(ds, intensity)
    status = np.asarray(ds["status"].values)
    counts = np.isin(status, (*SOLVED, SampleStatus.FAILED))
    count, kinds = int(counts.sum()), len(categories)
    lower, upper = np.empty((kinds, count)), np.empty((kinds, count))
    end = np.empty(count)
    marks: FloatArray | None = None
    alike, largest, done = True, 0.0, 0
    single = ds["damage_category"].ndim == 1
    by_sample = ds[[n for n in ds.variables if ds[n].dims[:1] == ("sample",)]]
    for first in range(0, len(status), WALLS_AT_ONCE):
        chosen = counts[first : first + WALLS_AT_ONCE]
        if not chosen.any():
            continue
        some = by_sample.isel(sample=slice(first, first + WALLS_AT_ONCE))
        reached = np.asarray(some["damage_category"].values)[chosen]
        if not single and "crack_width_max" in some:
            # a path that ended at the last category of interest has no information on worse ones
            stopped = (status[first : first + WALLS_AT_ONCE][chosen] == SampleStatus.COMPLETE)[:, None]
            reached = np.where(stopped & np.isnan(some["crack_width_max"].values[chosen]), -1, reached)
        movement = intensity_values(some, intensity)[chosen]
        if single:
            reached, movement = reached[:, None], movement[:, None]
        to = slice(done, done + len(reached))
        for k, category in enumerate(categories):
            lower[k, to], upper[k, to] = _capacity_intervals(reached, movement, category)
        end[to] = np.where(np.isfinite(movement), movement, 0.0).max(axis=1)
        largest = max(largest, float(end[to].max(initial=0.0)))
        marks = movement[0].copy() if marks is None else marks
        alike = alike and not single and bool((movement == marks).all())
        done = to.stop
    end = np.where(end > 0, end, largest)  # a wall without a known state was to be followed as far as any
    failed = (status[counts] == SampleStatus.FAILED)[None, :] & np.isinf(upper)
    return StudyCapacities(
        Capacities(lower, upper, failed, end),
        weight=sample_weights(ds)[counts],
        single=single,
        marks=np.fmax.accumulate(marks) if alike and marks is not None else None,
        largest=largest,
        increments=1 if single else ds.sizes["increment"] - 1,
        sample=np.flatnonzero(counts),
    )


def _capacity_intervals(reached: Int8Array, given: FloatArray, category: int) -> tuple[FloatArray, FloatArray]:
    """Intervals (lower, upper] from categories (-1: unknown) and movements (NaN) of (walls, increments)."""
    movement = np.where(np.isfinite(given), np.fmax.accumulate(given, axis=1), np.nan)
    hit = reached >= category
    ever = hit.any(axis=1)
    first = hit.argmax(axis=1)
    # the last movement at which the wall is known to have been below the category
    before = np.arange(reached.shape[1]) < np.where(ever, first, reached.shape[1])[:, None]
    before &= (reached >= 0) & np.isfinite(movement)
    lower = np.where(before, movement, 0.0).max(axis=1, initial=0.0)
    return lower, np.where(ever, movement[np.arange(len(first)), first], np.inf)


def probability_reached(lower: FloatArray, upper: FloatArray, movement: float) -> FloatArray:
    """Probability that each wall has reached the category, array (walls,); 0 for censored walls."""
    with np.errstate(invalid="ignore", divide="ignore"):
        inside = (movement - lower) / (upper - lower)
    reached = upper <= movement * (1 + ROUNDING)
    return np.where(reached, 1.0, np.where(np.isinf(upper), 0.0, np.clip(inside, 0.0, 1.0)))


def censored_before(lower: FloatArray, upper: FloatArray, movement: float) -> BoolArray:
    """Whether walls had not reached the category where they were last followed, short of a movement."""
    return np.isinf(upper) & (lower < movement * (1 - ROUNDING))


def interpolated_capacity(ends: tuple[float, float], widths: tuple[float, float], limit: float) -> float:
    """Movement at which the crack width reaches its limit, linear between the ends; otherwise the upper end."""
    (lower, upper), (before, after) = ends, widths
    share = (limit - before) / (after - before) if after >= limit > before else 1.0
    return lower + share * (upper - lower)


def without_damaged_at_start(read: Capacities) -> Capacities:
    """Capacities with walls that are damaged before any movement censored at 0: no information."""
    before = read.upper <= 0
    return read._replace(upper=np.where(before, np.inf, read.upper), failed=read.failed & ~before)
