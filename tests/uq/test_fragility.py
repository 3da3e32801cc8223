"""Fragility curves compared with true values and scipy, and all cases without a curve."""

import math

import numpy as np
import pytest
import xarray as xr
from scipy import optimize, stats

from damagepred.enumerations import SampleStatus
from damagepred.errors import InputError
from damagepred.uq.fragility import fit_fragility, fit_lognormal

COMPLETE, COLLAPSED, FAILED, MISSING = SampleStatus
NAMES = "negligible very_slight slight moderate severe"


def study(capacity: np.ndarray, end: float | np.ndarray = 60.0, increments: int = 60, **attrs: object) -> xr.Dataset:
    """A study whose walls reach category k at the movement ``capacity[wall, k - 1]`` (mm); movement ends at ``end``."""
    capacity = np.asarray(capacity, dtype=float).reshape(len(capacity), -1)
    movement = np.arange(increments + 1) * np.broadcast_to(end, len(capacity))[:, None] / increments
    category = (movement[:, :, None] >= capacity[:, None, :]).sum(axis=2).astype(np.int8)
    both = ("sample", "increment")
    return xr.Dataset(
        {
            "damage_category": (both, category, {"flag_meanings": NAMES}),
            "status": ("sample", np.full(len(capacity), COMPLETE, dtype=np.int8)),
            "central_deflection": (both, movement, {"units": "mm", "long_name": "movement"}),
            "deflection_ratio": (both, movement / 6000.0, {"units": "1"}),
        },
        attrs={"title": "made up", **attrs},
    )


def lognormal(random: np.random.Generator, median: float, dispersion: float, size: int) -> np.ndarray:
    return median * np.exp(dispersion * random.standard_normal(size))


def brackets(capacity: np.ndarray, marks: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Interval between the marks in which each capacity lies, open beyond the last."""
    place = np.searchsorted(marks, capacity, side="left")
    return np.append(marks, marks[-1])[place - 1], np.append(marks, np.inf)[place]


def scipy_fit(lower: np.ndarray, upper: np.ndarray) -> tuple[float, float]:
    """Median and dispersion by scipy's own censored fit, taken to its digits."""
    exact, right, left = lower == upper, np.isinf(upper), (lower == 0) & np.isfinite(upper)
    between = ~(exact | right | left)
    interval = np.column_stack((lower[between], upper[between]))
    uncensored = upper[exact]
    data = stats.CensoredData(uncensored=uncensored, right=lower[right], left=upper[left], interval=interval)

    def precisely(function, start, args=(), disp=0):
        return optimize.fmin(function, start, args, xtol=1e-10, ftol=1e-12, maxiter=4000, maxfun=4000, disp=disp)

    with np.errstate(divide="ignore"):
        dispersion, _, median = stats.lognorm.fit(data, floc=0, optimizer=precisely)
    return float(median), float(dispersion)


@pytest.mark.quick_cases
@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("end", [30.0, 8.0])  # hardly any censored; half
@pytest.mark.parametrize("exactly", [0.0, 0.3])
def test_likelihood_is_scipy_s(seed: int, end: float, exactly: float):
    random = np.random.default_rng(seed)
    capacity = lognormal(random, 8.0, 0.45, 60)
    lower, upper = brackets(capacity, np.arange(0.0, end + 1e-9, 2.0))
    known = (random.random(60) < exactly) & np.isfinite(upper)
    lower, upper = np.where(known, capacity, lower), np.where(known, capacity, upper)
    fit = fit_lognormal(lower, upper)
    median, dispersion = scipy_fit(lower, upper)
    assert fit.status == "fitted"
    assert fit.median == pytest.approx(median, rel=1e-6)
    assert fit.dispersion == pytest.approx(dispersion, rel=1e-5)


def test_exactly_known_capacities_in_closed_form():
    values = lognormal(np.random.default_rng(2), 3.0, 0.7, 40)
    fit = fit_lognormal(values, values)
    assert fit.median == pytest.approx(np.exp(np.log(values).mean()), rel=1e-9)
    assert fit.dispersion == pytest.approx(np.log(values).std(), rel=1e-9)


@pytest.mark.parametrize(
    ("lower", "upper"), [([np.nan, 1, 2], [1, 2, 3]), ([0, 1, 2], [1, np.nan, 3]), ([2, 1, 2], [1, 2, 3])]
)
def test_an_invalid_interval_is_refused(lower: list, upper: list):
    with pytest.raises(InputError, match="lower <= upper without NaN"):
        fit_lognormal(np.array(lower, dtype=float), np.array(upper, dtype=float))


@pytest.mark.parametrize(
    ("lower", "upper", "status"),
    [
        ([9, 9, 9], [np.inf] * 3, "never reached"),
        ([], [], "never reached"),
        ([1, 2, 9, 9], [2, 3, np.inf, np.inf], "reached by fewer than 3 walls"),
        ([0, 1, 2], [0, 2, 3], "reached by some walls before any movement"),
        ([2, 2, 2, 2], [3, 3, 3, 3], "all walls within one increment: refine the increments"),
        ([2, 2, 2, 2.5], [3, 3, 3, np.inf], "all walls within one increment: refine the increments"),
        ([0, 0, 0, 9, 9, 9], [1, 1, 1, np.inf, np.inf, np.inf], "no finite dispersion explains the walls"),
    ],
)
def test_a_curve_that_cannot_be_fitted_has_a_reason(lower: list, upper: list, status: str):
    fit = fit_lognormal(np.array(lower, dtype=float), np.array(upper, dtype=float))
    assert fit.status.startswith(status)
    assert math.isnan(fit.median)
    assert math.isnan(fit.dispersion)


WIDTHS, RATE, BETA = np.array([0.1, 1.0, 5.0, 15.0]), 0.3, 0.5  # w = c d LN(0, beta)


def known(random: np.random.Generator, size: int, rate: float = RATE) -> np.ndarray:
    """Capacities for all categories: a crack of rate times the movement, times a lognormal factor."""
    return WIDTHS / (rate * np.exp(BETA * random.standard_normal(size)))[:, None]


TRUTH, SCATTER = 8.0, 0.45


def fail(ds: xr.Dataset, wall: int, increment: int) -> None:
    """The wall's path ends before this increment; what is planned of the movement stays known."""
    ds["status"].values[wall] = FAILED
    ds["damage_category"].values[wall, increment:] = -1


def test_nan_at_the_movement_of_a_reached_category_is_refused():
    ds = study([[3.5], [4.5], [5.5], [6.5]], end=10.0, increments=10)
    ds["central_deflection"].values[1, 5] = np.nan  # the increment in which it is reached
    with pytest.raises(InputError, match="without NaN"):
        fit_fragility(ds, bootstrap=0)


def test_crossing_curves_are_flagged():
    random = np.random.default_rng(3)
    first = lognormal(random, 10.0, 0.05, 200)
    second = first * np.exp(np.abs(0.8 * random.standard_normal(200)) + 0.01)
    curves = fit_fragility(
        study(np.column_stack((first, second)), end=60.0, increments=600), categories=[1, 2], bootstrap=0
    )
    assert curves.attrs["curves_cross"] == 1


@pytest.mark.parametrize(
    ("spoil", "options", "words"),
    [
        (lambda ds: ds.drop_vars("damage_category"), {}, "no variable 'damage_category'"),
        (lambda ds: ds.drop_vars("status"), {}, "no variable 'status'"),
        (lambda ds: ds, {"intensity": "slope"}, "no variable 'slope'"),
        (lambda ds: ds, {"confidence": 0.0}, "confidence = 0.0: must lie between 0 and 1"),
        (lambda ds: ds, {"confidence": 90}, "confidence = 90"),
        (lambda ds: ds, {"confidence": float("nan")}, "confidence = nan"),
        (lambda ds: ds.assign(status=ds["status"] * 0 + MISSING), {}, "no finished sample yet"),
        (lambda ds: ds.assign(status=ds["status"] * 0 + FAILED), {}, "no finished sample yet"),
    ],
)
def test_invalid_input_is_refused(spoil, options: dict, words: str):
    with pytest.raises(InputError, match=words):
        fit_fragility(spoil(study(known(np.random.default_rng(1), 10))), **options)


def test_weighted_walls_give_the_curve_of_the_stated_distribution() -> None:
    """Walls drawn weaker than they are, with weights: the same curve; without them another one."""
    random = np.random.default_rng(2)
    z = random.standard_normal(3000)
    drawn = z - 0.7
    weight = np.exp(0.5 * z**2 - 0.5 * drawn**2)
    movement = np.linspace(0, 0.02, 81)
    capacity = 0.008 * np.exp(0.3 * drawn)
    ds = xr.Dataset(
        {
            "damage_category": (("sample", "increment"), (movement >= capacity[:, None]).astype(np.int8)),
            "central_deflection": (("sample", "increment"), np.tile(movement, (len(z), 1)), {"units": "m"}),
            "status": ("sample", np.zeros(len(z), dtype=np.int8)),
            "weight": ("sample", weight),
        },
        attrs={"highest_category": 1},
    )
    curve = fit_fragility(ds, bootstrap=20).isel(category=0)
    assert float(curve["median"]) == pytest.approx(0.008, rel=0.03)
    assert float(curve["dispersion"]) == pytest.approx(0.3, rel=0.06)
    # a band like that of 3000 walls which count alike: weights tell the weak side better, the strong one worse
    width = float(np.log(curve["median_upper"] / curve["median_lower"]))
    assert 0.7 < width / (2 * 1.645 * 0.3 / np.sqrt(3000)) < 3
    np.testing.assert_allclose(curve["empirical"], curve["probability"], atol=0.05)
    plain = fit_fragility(ds.drop_vars("weight"), bootstrap=0).isel(category=0)
    assert float(plain["median"]) == pytest.approx(0.008 * np.exp(-0.21), rel=0.03)
    # walls of little weight do not count as too few
    rare = ds.isel(sample=slice(0, 200)).assign(weight=("sample", weight[:200] * 1e-3))
    assert str(fit_fragility(rare, bootstrap=0)["fit_status"].values[0]) == "fitted"
