"""Failed walls: capacities if all of them are undamaged beyond their failure, and if all are damaged there."""

from __future__ import annotations

import numpy as np

from damagepred.arrays import BoolArray, FloatArray
from damagepred.uq.capacity import StudyCapacities

Intervals = tuple[FloatArray, FloatArray]  # lower and upper bounds


def failure_bounds(
    lower: FloatArray, upper: FloatArray, failed: BoolArray, undamaged_to: FloatArray | float, damaged_by: FloatArray
) -> tuple[Intervals, Intervals]:
    """Intervals with the failed walls undamaged to one movement, and with them damaged by another."""
    return (np.where(failed, undamaged_to, lower), upper), (lower, np.where(failed, damaged_by, upper))


def failure_bounds_of(walls: StudyCapacities) -> tuple[Intervals, Intervals]:
    """Intervals with all failed walls undamaged to the end, and with all damaged in the increment where they failed."""
    read = walls.capacities
    if walls.single:
        following = np.broadcast_to(read.end, read.lower.shape)
    elif walls.marks is not None:
        following = walls.marks[np.minimum(np.searchsorted(walls.marks, read.lower, side="right"), walls.increments)]
    else:
        following = read.lower + read.end / walls.increments
    return failure_bounds(read.lower, read.upper, read.failed, read.end, np.maximum(following, read.lower))
