"""Sequential stopping: intervals with simultaneous coverage over all interim analyses."""

import numpy as np
import pytest
import xarray as xr
from scipy import special, stats

from damagepred.uq.exceedance import median_movement
from damagepred.uq.stopping import interim_confidence, interim_sizes


def test_the_factor_is_that_of_the_tables() -> None:
    """Pocock's constants for equal steps and two-sided 5 % (Jennison and Turnbull 2000, table 2.1)."""
    for count, factor in ((2, 2.178), (3, 2.289), (5, 2.413), (10, 2.555)):
        each = interim_confidence([100 * (k + 1) for k in range(count)], 0.95, replicated=False)
        assert special.ndtri(0.5 + each / 2) == pytest.approx(factor, abs=1e-3)
    assert interim_confidence([64], 0.9, replicated=True) == 0.9
    sidak = interim_confidence(interim_sizes(64, 1024), 0.9, replicated=True)
    assert (
        0.9
        < interim_confidence(interim_sizes(64, 1024), 0.9, replicated=False)
        < sidak
        == pytest.approx(0.9 ** (1 / 5))
    )


# -- reading a study --------------------------------------------------------------------------------------------------


def study(capacity: np.ndarray, end: float = 0.02, increments: int = 20, **extra: object) -> xr.Dataset:
    """A study whose walls reach category 1 at given movements."""
    movement = np.linspace(0, end, increments + 1)
    count = len(capacity)
    ds = xr.Dataset(
        {
            "damage_category": (("sample", "increment"), (movement >= capacity[:, None]).astype(np.int8)),
            "central_deflection": (("sample", "increment"), np.tile(movement, (count, 1))),
            "status": ("sample", np.zeros(count, dtype=np.int8)),
        },
        attrs={"highest_category": 1, **{k: v for k, v in extra.items() if isinstance(v, int)}},
    )
    if "weight" in extra:
        ds["weight"] = ("sample", extra["weight"])
    return ds


def test_the_error_of_a_median_is_that_of_the_jackknife() -> None:
    """From the medians without one scramble after the other, by their own fits."""
    random = np.random.default_rng(2)
    shared = 0.1 * random.standard_normal(5)[np.arange(60) % 5]
    capacity = 0.008 * np.exp(0.3 * random.standard_normal(60) + shared)
    found = median_movement(study(capacity, replicates=5), 1)
    others = np.log([median_movement(study(capacity[np.arange(60) % 5 != k]), 1).value for k in range(5)])
    error = np.sqrt(4 / 5 * ((others - others.mean()) ** 2).sum())
    assert found.error == pytest.approx(found.value * error, rel=1e-6)
    assert found.upper == pytest.approx(found.value * np.exp(stats.t.ppf(0.95, 4) * error), rel=1e-6)
