"""Walls that reached a category, did not, or failed before: each wall is counted once, in curves and in surfaces."""

import numpy as np
import pytest
import xarray as xr

from damagepred.enumerations import SampleStatus
from damagepred.uq.fragility import fit_fragility, fit_surface
from tests.uq.test_fragility import fail, study

WALLS = 60


def fitted(ds: xr.Dataset) -> list[xr.Dataset]:
    return [
        fit_fragility(ds, bootstrap=0, categories=[1]).isel(category=0),
        fit_fragility(ds, bootstrap=0, categories=[1, 2]).isel(category=0),
        fit_surface(ds, 1, "joint.friction", bootstrap=0, points=(5, 3)),
    ]


@pytest.mark.parametrize("weighted", [False, True])
@pytest.mark.parametrize(
    ("failing", "missing", "at_start", "expected"),
    [
        ((), (), 0, (40, 20, 0)),
        ((5, 45, 50), (), 0, (39, 18, 3)),  # a wall that failed before its category, two that had not reached it
        ((), (2, 59), 0, (39, 19, 0)),
        ((5, 45), (2, 59), 3, (38, 18, 2)),
        ((0,), (), 3, (40, 20, 0)),  # it failed after it had reached the category
    ],
)
def test_each_wall_is_counted_once(
    weighted: bool, failing: tuple[int, ...], missing: tuple[int, ...], at_start: int, expected: tuple[int, ...]
) -> None:
    """Capacities of 1 to 60 mm, movement to 40 mm: 40 walls reach category 1."""
    ds = study(np.column_stack((np.arange(1.0, WALLS + 1), 50 + np.arange(WALLS))), end=40.0, increments=40)
    ds["joint.friction"] = "sample", np.random.default_rng(1).uniform(0.5, 1.0, WALLS)
    ds["damage_category"][:at_start] = 1
    for wall in failing:
        fail(ds, wall, 4)
    for wall in missing:
        ds["damage_category"][wall] = -1
        ds["status"][wall] = SampleStatus.MISSING
    if weighted:
        ds["weight"] = "sample", 1.0 + np.arange(WALLS) % 3
    for found in fitted(ds):
        counts = tuple(int(found[name]) for name in ("reached", "not_reached", "failed"))
        assert counts == expected
        assert sum(counts) == WALLS - len(missing)
