"""Grouped interval data: capacities whose intervals and weights are equal, counted once with their number."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from damagepred.arrays import BoolArray, FloatArray, IntArray
from damagepred.errors import InputError
from damagepred.inputs.arguments import checked, require_alike


class GroupedIntervals(NamedTuple):
    """Groups (cells) of walls with equal intervals and weights."""

    # (categories, cells): their intervals
    lower: FloatArray
    upper: FloatArray
    weight: FloatArray  # (cells,): weight of one of their walls
    number: IntArray  # (cells,): number of walls

    @property
    def total(self) -> FloatArray:
        """Total weight of the walls of each cell."""
        return self.weight * self.number

    def of(self, category: int) -> GroupedIntervals:
        """Cells of one category alone, by its place."""
        if len(self.lower) == 1:
            return self
        return group_intervals(
            self.lower[category : category + 1], self.upper[category : category + 1], self.weight, self.number
        )


def group_intervals(
    lower: FloatArray, upper: FloatArray, weight: FloatArray, count: IntArray | None = None
) -> GroupedIntervals:
    """Group walls of equal intervals and weights."""
    if np.isnan(lower).any() or np.isnan(upper).any() or (lower > upper).any():
        raise InputError("capacities must be intervals lower <= upper without NaN.")
    first, which = group_equal(np.vstack((lower, upper, weight)))
    walls = np.bincount(which, weights=count, minlength=len(first)).astype(np.int64)
    return GroupedIntervals(lower[:, first], upper[:, first], weight[first], walls)


def group_equal(columns: FloatArray) -> tuple[IntArray, IntArray]:
    """Find the groups of equal columns."""
    key = np.zeros(columns.shape[1], dtype=np.int64)
    many = 1
    for column in columns:
        if not column.size or (column == column[0]).all():
            continue
        values, rank = np.unique(column, return_inverse=True)
        if many > 1 and many * len(values) > 2**62:  # renumbered before the product overflows
            kinds, key = np.unique(key, return_inverse=True)
            many = len(kinds)
        key = key * len(values) + rank
        many *= len(values)
    _, first, which = np.unique(key, return_index=True, return_inverse=True)
    return first, which


@checked
def normalised_weights(weight: FloatArray, upper: FloatArray, good: BoolArray | None = None) -> FloatArray:
    """Scale weights so that the walls which reached a category have weights that add up to their number.

    Parameters
    ----------
    weight, upper : array (walls,)
        Weights, and capacities' upper bounds, infinite where the category was not reached.
    good : array of bool (walls,), optional
        Walls that did not fail.
    """
    require_alike(weight=weight, upper=upper, good=good)
    weight, upper = np.asarray(weight, dtype=np.float64), np.asarray(upper, dtype=np.float64)
    if not (np.isfinite(weight).all() and (weight >= 0).all() and (weight > 0).any()):
        raise InputError("weight: must be finite, not negative, and not all 0.")
    reached = np.isfinite(upper) & (weight > 0)
    if good is not None:
        reached &= good
    total = float(weight[reached].sum())
    return weight * (reached.sum() / total) if total > 0 else weight
