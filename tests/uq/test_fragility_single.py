"""Fragility from walls observed at one movement each: 0 or 1 at the sample's movement."""

import numpy as np
import pytest
import xarray as xr
from scipy import optimize, special

from damagepred.uq.exceedance import exceedance
from damagepred.uq.fragility import fit_fragility
from tests.synthetic_studies import capacities
from tests.uq.test_fragility import COMPLETE, FAILED, NAMES


def study(movement: np.ndarray, category: np.ndarray, status: np.ndarray | None = None) -> xr.Dataset:
    status = np.full(len(movement), COMPLETE, dtype=np.int8) if status is None else status
    return xr.Dataset(
        {
            "damage_category": ("sample", category.astype(np.int8), {"flag_meanings": NAMES}),
            "status": ("sample", status),
            "central_deflection": ("sample", movement, {"units": "mm"}),
        }
    )


def walls(random: np.random.Generator, count: int, median: float = 8.0, dispersion: float = 0.45) -> xr.Dataset:
    capacity = median * np.exp(dispersion * random.standard_normal(count))
    movement = random.uniform(1.0, 25.0, count)
    return study(movement, movement >= capacity)


@pytest.mark.parametrize("seed", range(4))
def test_the_fit_is_that_of_a_probit_by_another_way(seed: int) -> None:
    ds = walls(np.random.default_rng(seed), 300)
    x, hit = np.log(ds["central_deflection"].values), ds["damage_category"].values == 1

    def unlikely(at: np.ndarray) -> float:
        z = at[0] + at[1] * x
        return -float(special.log_ndtr(np.where(hit, z, -z)).sum())

    a, b = optimize.minimize(unlikely, [-3.0, 1.5], method="Nelder-Mead", options={"xatol": 1e-9, "fatol": 1e-12}).x
    fit = fit_fragility(ds, categories=[1], bootstrap=0)
    assert float(fit["median"][0]) == pytest.approx(np.exp(-a / b), rel=1e-6)
    assert float(fit["dispersion"][0]) == pytest.approx(1 / b, rel=1e-6)


def test_a_wall_s_capacity_lies_below_its_movement_or_above() -> None:
    status = np.array([COMPLETE, COMPLETE, FAILED], dtype=np.int8)
    found = capacities(study(np.array([3.0, 4.0, 5.0]), np.array([2, 1, -1]), status), 2)
    assert found.lower.tolist() == [0.0, 4.0, 0.0]
    assert found.upper.tolist() == [3.0, np.inf, np.inf]
    assert found.failed.tolist() == [False, False, True]
    assert found.end.tolist() == [3.0, 4.0, 5.0]


def test_the_probability_at_a_movement_comes_from_the_curve_with_its_band() -> None:
    held, repetitions = 0, 20
    truth = float(special.ndtr(np.log(6.0 / 8.0) / 0.45))
    for seed in range(repetitions):
        found = exceedance(walls(np.random.default_rng([9, seed]), 150), 1, 6.0).estimate
        held += bool(found.lower <= truth <= found.upper)
        assert found.samples == 150
        assert 0.2 < found.half_width / (1.645 * found.error) < 5
    assert 14 <= held <= 20  # 18 expected


def test_failed_walls_bound_that_probability() -> None:
    ds = walls(np.random.default_rng(4), 300)
    ds["status"].values[:30], ds["damage_category"].values[:30] = FAILED, -1
    found = exceedance(ds, 1, 8.0)
    assert (found.failed, found.estimate.samples) == (30, 270)
    assert found.estimate.effective_samples == pytest.approx(270)  # all weigh the same
    assert found.failed_undamaged < found.estimate.value < found.failed_damaged
