"""Levels of damage by ascending limits of one measure."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from damagepred.arrays import Int8Array


def level_of(
    values: ArrayLike, limits: Sequence[float], *, limit_is_below: bool = False, tolerance: float = 1e-9
) -> Int8Array:
    """Number of limits (ascending) that each value has reached, element by element; -1 where it is NaN.

    With ``limit_is_below`` a value equal to a limit has the level below it. A relative error up to the tolerance
    counts as equal: 5 mm computed as 4.999999999 mm is 5 mm.
    """
    given = np.asarray(values, dtype=np.float64)
    bounds = np.asarray(limits, dtype=np.float64) * (1.0 + tolerance if limit_is_below else 1.0 - tolerance)
    level = np.searchsorted(bounds, given, side="left" if limit_is_below else "right")
    return np.where(np.isnan(given), -1, level).astype(np.int8)
