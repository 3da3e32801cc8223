"""One definition of the movement at which a category is reached, common to all analyses."""

from collections.abc import Iterator
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr

from damagepred.analyses import limit_state
from damagepred.analyses.limit_state import Question, margin
from damagepred.analyses.variance_shares import _output_of
from damagepred.enumerations import SampleStatus
from damagepred.uq.capacity import censored_before, probability_reached
from damagepred.uq.exceedance import category_capacities, exceedance, known_hits, pseudo_values
from damagepred.uq.fragility import fit_fragility
from damagepred.uq.movement_distribution import as_distribution
from damagepred.uq.stopping import StopWhen
from tests.analyses.test_rare import settings
from tests.synthetic_studies import capacities
from tests.uq.test_fragility import study

pytestmark = pytest.mark.quick_cases()

MARKS = np.arange(9) * 1e-3


def paths(seed: int, ended: bool) -> tuple[xr.Dataset, np.ndarray]:
    """Randomly growing crack widths (m), array (walls, increments); some walls fail or collapse."""
    random = np.random.default_rng(seed)
    limits = settings().damage_table.limits
    width = np.cumsum(np.append(np.zeros((40, 1)), random.exponential(1e-3, (40, 8)), axis=1), axis=1)
    width[:3] += 6e-3  # damaged before any movement
    ds = study(np.full((40, len(limits)), np.inf), end=8e-3, increments=8, highest_category=len(limits))
    ds["damage_category"].values[:] = (width[:, :, None] >= np.array(limits)).sum(axis=2)
    if ended:
        failed, collapsed = SampleStatus.FAILED, SampleStatus.COLLAPSED
        for wall, (at, status) in {5: (4, failed), 6: (5, collapsed), 7: (1, failed)}.items():
            ds["status"].values[wall] = status
            ds["damage_category"].values[wall, at:] = -1
            ds["central_deflection"].values[wall, at:] = np.nan
    return ds, width


def reached(ds: xr.Dataset, category: int, at: float) -> np.ndarray:
    """Read off each path: 1 or 0 at an increment, NaN where it ended before without the category."""
    found = []
    for path, moved in zip(ds["damage_category"].values, ds["central_deflection"].values):
        upto = moved <= at * (1 + 1e-12)
        ever, followed = bool((path[upto] >= category).any()), bool((upto & (path >= 0) & np.isclose(moved, at)).any())
        found.append(1.0 if ever else 0.0 if followed else np.nan)
    return np.array(found)


@pytest.mark.parametrize("category", [1, 2, 3, 4])
@pytest.mark.parametrize("mark", [1, 3, 4, 8])
@pytest.mark.parametrize("ended", [False, True])
def test_all_agree_at_an_increment(category: int, mark: int, ended: bool) -> None:
    ds, _ = paths(category, ended)
    at = float(MARKS[mark])
    truth = reached(ds, category, at)
    known = capacities(ds, category)
    hit = probability_reached(known.lower, known.upper, at)
    hit[censored_before(known.lower, known.upper, at)] = np.nan
    np.testing.assert_array_equal(hit, truth)
    solved = ds["status"].values != SampleStatus.FAILED
    walls = category_capacities(ds, category)
    for unknown in (0.0, 1.0):
        bound = known_hits(walls, as_distribution(at), unknown)
        np.testing.assert_array_equal(bound[solved], np.nan_to_num(truth[solved], nan=unknown))
    found = exceedance(ds, category, at)
    assert pseudo_values(walls, as_distribution(at)).hit.mean() == pytest.approx(found.estimate.value, abs=1e-9)
    assert found.failed + found.not_followed == np.isnan(truth).sum()
    # walls that ended before take the share of the others, failed ones among them
    assert found.failed_damaged - found.failed_undamaged >= found.failed / 40 - 1e-9
    assert found.not_followed or found.failed_damaged - found.failed_undamaged == pytest.approx(found.failed / 40)
    rule = StopWhen(category=category, at=at, half_width=0.1)
    assert rule.estimate(ds, 0.9) == found.estimate
    assert _output_of(ds, category=category).censored == np.isinf(known.upper).mean()
    if not ended:
        assert found.estimate.value == pytest.approx(truth.mean())
        curve = fit_fragility(ds, model="empirical", categories=[category], bootstrap=0, points=9)
        assert float(curve["probability"][0, mark]) == pytest.approx(truth.mean())


@pytest.mark.parametrize("wall", [0, 1, *range(8, 20)])
def test_the_limit_state_has_the_sign_of_the_others(wall: int, monkeypatch: pytest.MonkeyPatch) -> None:
    ds, width = paths(2, False)
    scene = settings().scene

    def made_up(*given: object) -> Iterator[object]:
        for k, (one, category) in enumerate(zip(width[wall], ds["damage_category"].values[wall])):
            verdict = SimpleNamespace(
                crack_width_max=one, crack_band_width_max=one, footing_opening_max=0.0, damage_category=int(category)
            )
            yield model, SimpleNamespace(increment=SimpleNamespace(load_factor=k / 8, number=k), verdict=verdict)

    model = SimpleNamespace(central_deflection=8e-3, surface_movement=None, deflection=None)
    monkeypatch.setattr(limit_state, "follow_scene", made_up)
    for category in (1, 2, 3, 4):
        known = capacities(ds, category)
        lower, upper = known.lower[wall], known.upper[wall]
        for at in MARKS[1:]:
            found = margin(scene, {}, Question(category, float(at)))
            assert (found.least <= 1e-9) == (probability_reached(lower, upper, at) == 1.0)
            if np.isfinite(upper):
                assert lower * (1 - 1e-9) <= (found.least + 1) * at <= upper * (1 + 1e-9)
