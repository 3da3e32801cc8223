"""Sequential stopping with simultaneous coverage, and probabilities that are unknown."""

import numpy as np
import pytest
import xarray as xr
from scipy import special, stats

from damagepred.analyses.epistemic import Alternative
from damagepred.cli.sentences import estimate_lines
from damagepred.errors import InputError
from damagepred.uq.estimate import probability
from damagepred.uq.exceedance import exceedance
from damagepred.uq.fragility import fit_surface
from damagepred.uq.stopping import StopWhen, interim_confidence, interim_sizes


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


@pytest.mark.parametrize("share", [0.1, 0.4])
def test_intervals_hold_where_a_study_stopped_early(share: float) -> None:
    """Simultaneous coverage as stated; intervals of 90 % at each analysis would not have it."""
    random = np.random.default_rng(5)
    rule = StopWhen(category=1, at=0.01, half_width=0.05)
    at = interim_sizes(32, 1024)
    each = interim_confidence(at, 0.9, replicated=False)
    stopped, everywhere, naive = 0, 0, 0
    for _ in range(400):
        hit = random.random(1024) < share
        found = [probability(hit[:n], confidence=each) for n in at]
        last = next((f for f in found if rule.met(f)), found[-1])
        stopped += last.lower <= share <= last.upper
        everywhere += all(f.lower <= share <= f.upper for f in found)
        plain = [probability(hit[:n]) for n in at]
        naive += all(f.lower <= share <= f.upper for f in plain)
    assert stats.binom.cdf(everywhere, 400, 0.9) > 1e-3
    assert stats.binom.cdf(stopped, 400, 0.9) > 1e-3
    assert stats.binom.cdf(naive, 400, 0.9) < 1e-3


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


def test_exceedance_counts_walls() -> None:
    capacity = np.array([0.0035, 0.0065, 0.0125, 0.03])
    ds = study(capacity)
    assert exceedance(ds, 1, 0.007).estimate.value == 0.5
    assert exceedance(ds, 1, 0.02).estimate.value == 0.75
    assert exceedance(ds, 1, 0.0125).estimate.value == pytest.approx(0.625)  # half of a step for one wall
    assert exceedance(ds, 1, 0.02).not_followed == 0
    assert exceedance(ds, 1, 0.021).not_followed == 1
    assert exceedance(study(capacity, weight=np.array([2.0, 1, 1, 0])), 1, 0.007).estimate.value == 0.75
    with pytest.raises(InputError, match="greater than 0"):
        exceedance(ds, 1, 0.0)


CAPACITY = np.array([0.0035, 0.0065, 0.0125, 0.03])


def test_no_estimate_beyond_the_largest_movement() -> None:
    found = exceedance(study(np.full(20, 0.5)), 1, 0.5)
    assert np.isnan(found.estimate.value)
    assert (found.estimate.lower, found.estimate.upper) == (0.0, 1.0)
    assert (found.failed_undamaged, found.failed_damaged, found.not_followed) == (0.0, 1.0, 20)
    (said,) = estimate_lines([Alternative("", found, 20.0)], 1, "500 mm")
    assert "Category 1 or worse at 500 mm: unknown, between 0.00 and 1.00" in said


@pytest.mark.parametrize("single", [False, True])
@pytest.mark.parametrize("begun", [False, True])
def test_unknown_names_are_refused_in_all_branches(single: bool, begun: bool) -> None:
    ds = study(np.linspace(0.001, 0.03, 30))
    ds["surface_movement"] = 1.5 * ds["central_deflection"]  # on a mound another measure was read without a message
    if single:
        ds = ds.isel(increment=-1)
    if not begun:
        ds = ds.drop_vars("damage_category")
    with pytest.raises(InputError, match="no variable 'typo'"):
        exceedance(ds, 1, 0.007, intensity="typo")


def test_categories_beyond_the_table_are_refused() -> None:
    ds = study(CAPACITY)
    for category in (0, 2, 9):
        message = f"category = {category}: .* categories 1 to 1"
        with pytest.raises(InputError, match=message):
            exceedance(ds, category, 0.007)
        with pytest.raises(InputError, match=message):
            exceedance(ds.isel(increment=-1), category, 0.007)
        with pytest.raises(InputError, match=message):
            fit_surface(ds, category, "weight")
