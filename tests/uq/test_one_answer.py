"""One estimate of the probability of a category, on walls with lognormal capacities and independent movements."""

import numpy as np
import pytest
import xarray as xr
from scipy import special

from damagepred.errors import InputError
from damagepred.uq.comparison import compare
from damagepred.uq.exceedance import CategoryCapacities, estimate_exceedance, exceedance, pseudo_values
from damagepred.uq.fragility import fit_fragility
from damagepred.uq.movement_distribution import SITE, as_distribution
from damagepred.uq.samplers import unit_points

SCATTER, GROUND, SCATTER_OF_GROUND = 0.4, 0.045, 0.25


def study(
    capacity: np.ndarray,
    ends: np.ndarray,
    increments: int = 10,
    *,
    weight: np.ndarray | None = None,
    failed: np.ndarray | None = None,
    **attributes: object,
) -> xr.Dataset:
    """A study of a soil log: walls (categories 1, 2, ... at given movements) on their own ground, to the end of it."""
    progress = np.arange(increments + 1) / increments
    movement = progress * ends[:, None]
    each = capacity.reshape(len(capacity), -1)
    category = (movement[:, :, None] >= each[:, None, :]).sum(axis=2).astype(np.int8)
    status = np.zeros(len(ends), dtype=np.int8)
    if failed is not None:  # the increment at which each wall fails, 0: never
        status[failed > 0] = 2
        category[(failed > 0)[:, None] & (np.arange(increments + 1) >= failed[:, None])] = -1
    ds = xr.Dataset(
        {
            "damage_category": (("sample", "increment"), category),
            "surface_movement": (("sample", "increment"), movement, {"units": "m"}),
            "status": ("sample", status),
            "joint.tensile_strength": ("sample", np.arange(len(ends)) * 1.0),
        },
        {"sample": np.arange(len(ends))},
        {"seed": 1, "sampler": "random", "highest_category": each.shape[1], "damage_table": "a table"} | attributes,
    )
    return ds if weight is None else ds.assign(weight=("sample", weight))


def median_of(share: float, at: float) -> float:
    return at * float(np.exp(-SCATTER * special.ndtri(share)))


def drawn(normal: np.ndarray, ground: np.ndarray, median: float, increments=10, replicates=1) -> CategoryCapacities:
    ends = GROUND * np.exp(SCATTER_OF_GROUND * ground)
    step = np.ceil(median * np.exp(SCATTER * normal) / ends * increments)
    reached, count = step <= increments, np.arange(len(ends))
    lower = np.where(reached, step - 1, increments) / increments * ends
    upper = np.where(reached, step / increments * ends, np.inf)
    which = count % replicates if replicates > 1 else None
    return CategoryCapacities(count, lower, upper, None, which, np.zeros(len(ends), dtype=bool))


@pytest.mark.parametrize("at", [0.03, 0.06, "H1"])
def test_pseudo_values_are_derivatives_by_the_weights(at: float | str) -> None:
    """The probability is (sum of weights / walls) F; a wall's pseudo-value is walls times its derivative."""
    random = np.random.default_rng(1)
    weight = random.uniform(0.2, 2.0, 40)
    known = drawn(*random.standard_normal((2, 40)), median_of(0.3, 0.05))._replace(weight=weight)
    wanted = as_distribution(at)
    hit = pseudo_values(known, wanted).hit
    value = estimate_exceedance(known, wanted).estimate.value
    assert np.mean(weight * hit) == pytest.approx(value, rel=1e-9)
    for wall in range(0, 40, 3):
        ends = []
        for step in (-1e-5, 1e-5):
            changed = weight.copy()
            changed[wall] += step
            ends.append(estimate_exceedance(known._replace(weight=changed), wanted).estimate.value)
        assert hit[wall] == pytest.approx(40 * (ends[1] - ends[0]) / 2e-5, abs=1e-5)


def test_kaplan_meier_and_greenwood_by_hand() -> None:
    """Known exactly: events at 1, 3, 6, 7; walls lost at 2, 5, 8. Textbook product limit and Greenwood's formula."""
    lower = np.array([1.0, 2.0, 3.0, 5.0, 6.0, 7.0, 8.0])
    event = np.array([1, 0, 1, 0, 1, 1, 0], dtype=bool)
    known = CategoryCapacities(np.arange(7), lower, np.where(event, lower, np.inf), None, None, np.zeros(7, dtype=bool))
    e = estimate_exceedance(known, 7.5).estimate
    survival = 6 / 7 * 4 / 5 * 2 / 3 * 1 / 2
    greenwood = survival**2 * sum(1 / (n * (n - 1)) for n in (7, 5, 3, 2))
    assert e.value == pytest.approx(1 - survival)
    assert e.error**2 == pytest.approx(greenwood * 7 / 6)
    assert np.isnan(estimate_exceedance(known, 9.0).estimate.value)


@pytest.mark.quick_cases
@pytest.mark.parametrize("replicates", [1, 8])
@pytest.mark.parametrize(("before", "after"), [(0.3, 0.15), (0.0626, 0.0626), (0.2, 0.02)])
def test_paired_differences_hold_on_own_ground(before: float, after: float, replicates: int) -> None:
    """A measure that protects: common strengths and grounds, capacities of another median."""
    random, held, repetitions, widths = np.random.default_rng(3), 0, 120, []
    for seed in range(repetitions):
        if replicates > 1:
            points = special.ndtri(unit_points("sobol", 3, 128, seed, replicates))
        else:
            points = random.standard_normal((100, 3))
        common, own, ground = points.T
        ends = GROUND * np.exp(SCATTER_OF_GROUND * ground)
        normals = (common, 0.8 * common + 0.6 * own)
        studies = {
            name: study(median_of(share, 0.05) * np.exp(SCATTER * z), ends, replicates=replicates)
            for name, share, z in zip("ab", (before, after), normals)
        }
        found = compare(studies, categories=[1], at=[0.05]).isel(study=1, category=0, movement=0)
        limits = float(found["difference_lower"]), float(found["difference_upper"])
        held += limits[0] <= after - before <= limits[1]
        widths.append(limits[1] - limits[0])
    assert 0.83 <= held / repetitions <= 0.995
    assert np.max(widths) < 0.6


def test_each_walls_own_ground_is_its_state_at_the_end() -> None:
    """By hand: reached or not at the end; a wall that failed half way takes the share of those that went on."""
    ends = np.array([0.02, 0.04, 0.03, 0.05])
    capacity = np.array([0.015, 0.06, 0.028, 0.9])
    ds = study(capacity, ends)
    found = exceedance(ds, 1, "site")
    assert (found.estimate.value, found.failed, found.not_followed) == (0.5, 0, 0)
    assert found == exceedance(ds, 1, SITE)
    failed = study(capacity, ends, failed=np.array([0, 6, 0, 0]))  # known up to half of its 40 mm
    one = exceedance(failed, 1, "site")
    assert (one.failed, one.failed_undamaged, one.failed_damaged) == (1, 0.5, 0.75)
    assert one.estimate.value == pytest.approx((2 + 2 / 3) / 4)  # two of three went on and were damaged
    alone = ds.isel(increment=-1)
    assert exceedance(alone, 1, "site").estimate == found.estimate
    with pytest.raises(InputError, match=r"same surface movement, 40 mm, and no ground of their own; give a movement"):
        exceedance(study(capacity, np.full(4, 0.04)), 1, "site")


def test_studies_that_know_the_ends_alone_are_compared_at_the_site() -> None:
    random = np.random.default_rng(6)
    ends = GROUND * np.exp(SCATTER_OF_GROUND * random.standard_normal(60))
    strength = np.exp(SCATTER * random.standard_normal(60))[:, None] * np.array([1.0, 1.7])
    medians = {"as it is": 0.04, "stiffer": 0.06}
    studies = {name: study(median * strength, ends).isel(increment=-1) for name, median in medians.items()}
    found = compare(studies)
    assert found["movement_name"].values.tolist() == ["site"]
    for ds, value in zip(studies.values(), found["probability"][:, 0, 0].values):
        assert value == float((ds["damage_category"] >= 1).mean())
    with pytest.raises(InputError, match="at its own movement alone; compare them at"):
        compare(studies, at=[0.04])
    one = exceedance(studies["as it is"], 1, 0.04)
    curve = fit_fragility(studies["as it is"], categories=[1])
    place = float(np.interp(0.04, curve["intensity"], curve["probability"][0]))
    assert one.estimate.value == pytest.approx(place, abs=1e-3)
    largest = f"{1e3 * ends.max():.4g} mm"
    with pytest.raises(InputError, match=rf"at = 500 mm: no sample was moved as far \({largest} at most\)"):
        exceedance(studies["as it is"], 1, 0.5)
    with pytest.raises(InputError, match=r"P\(category >= 1\) at 4 mm: .* its samples give no curve"):
        exceedance(study(np.full(3, 9.0), ends[:3]).isel(increment=-1), 1, 0.004)


@pytest.mark.quick_cases
@pytest.mark.parametrize("walls", range(1, 9))
@pytest.mark.parametrize("replicates", [1, 4])
def test_a_few_walls_give_an_interval_or_nothing(walls: int, replicates: int) -> None:
    """No walls too few, no state of them too odd: value within bounds within 0 and 1, or unknown."""
    for seed in range(30):
        random = np.random.default_rng(seed)
        ends = random.uniform(0.01, 0.05, walls)
        failed = random.integers(0, 4, walls)
        one = study(random.uniform(0.0, 0.06, walls), ends, 3, failed=failed, replicates=replicates)
        if not (one["status"].values == 0).any():
            continue
        for at in (0.005, 0.03):
            e, *_, low, high, _ = exceedance(one, 1, at)
            assert 0 <= e.lower <= e.upper <= 1
            assert np.isnan(e.value) or e.lower - 1e-9 <= e.value <= e.upper + 1e-9
            assert 0 <= low <= high <= 1
        found = compare({"a": one, "b": one}, categories=[1], at=[0.02])
        assert not found["difference"].values.any() or np.isnan(found["probability"]).any()
