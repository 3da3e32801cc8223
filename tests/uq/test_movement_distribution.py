"""The probability for a site class or a distribution of the movement is the mean over movements."""

import numpy as np
import pytest
import xarray as xr
from scipy import stats

from damagepred.errors import InputError
from damagepred.uq.exceedance import exceedance
from damagepred.uq.movement_distribution import movement_distribution


def lognormal_study(walls: int = 2000, end: float = 0.1, increments: int = 50, failed: int = 0) -> xr.Dataset:
    """Walls on a mound whose capacities are quantiles of a lognormal of median 50 mm and dispersion 0.4."""
    capacity = stats.lognorm(0.4, scale=0.05).ppf((np.arange(walls) + 0.5) / walls)
    movement = np.linspace(0.0, end, increments + 1)
    category = (movement >= capacity[:, None]).astype(np.int8)
    status = np.zeros(walls, dtype=np.int8)
    status[:failed], category[:failed, 5:] = 2, -1
    return xr.Dataset(
        {
            "damage_category": (("sample", "increment"), category),
            "surface_movement": (("sample", "increment"), np.tile(movement, (walls, 1)), {"units": "m"}),
            "status": ("sample", status),
        },
        {"sample": np.arange(walls)},
        {"highest_category": 2},
    )


@pytest.mark.parametrize(("median", "dispersion"), [(0.03, 0.2), (0.045, 0.3)])
def test_a_distribution_of_the_movement_is_the_reliability_integral(median: float, dispersion: float) -> None:
    """Lognormal movement against lognormal capacity: the closed form of stress and strength."""
    text = f'distribution = "lognormal", median = "{1e3 * median} mm", dispersion = {dispersion}'
    expected = stats.norm.cdf(np.log(median / 0.05) / np.hypot(0.4, dispersion))
    assert exceedance(lognormal_study(end=0.2, increments=200), 1, text).estimate.value == pytest.approx(
        expected, abs=4e-3
    )


def test_movements_beyond_the_walls_are_refused() -> None:
    with pytest.raises(InputError, match=r"50% of it lies beyond 0\.05"):
        exceedance(lognormal_study(20, end=0.05), 1, "H1")
    moved = lognormal_study(20).rename(surface_movement="central_deflection")
    with pytest.raises(InputError, match="is of the surface movement"):
        exceedance(moved, 1, "H1")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("E", "class E has no two limits"),
        ("60", "give the unit with the number"),
        ("60 kPa", "must be a movement such as"),
        ("H3", "a site class \\(A, S, M, H1, H2, E\\)"),
        ("-3 mm", "must be greater than 0"),
        ('distribution = "lognorma", mean = 3', "Did you mean 'lognormal'"),
        ('distribution = "lognormal", mean =', "is no table of a distribution"),
        ('distribution = "normal", mean = "10 mm", cov = 5', "must be greater than 0"),
    ],
)
def test_a_wrong_text_is_answered_by_a_sentence(text: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        movement_distribution(text)
