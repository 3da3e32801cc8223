"""Nataf model for discrete values and mixtures: closed forms, attainable ranges, and samples."""

import math

import numpy as np
import pytest
from scipy import special, stats

from damagepred.errors import InputError
from damagepred.uq.correlation import NatafCurve, gaussian_correlation
from damagepred.uq.design import Design
from damagepred.uq.marginals import Mixture, Table
from damagepred.uq.variable import Component, Variable

COIN = Table([0.0, 1.0])


def binormal(a: float, b: float, rho: float) -> float:
    """P(Z1 <= a, Z2 <= b)."""
    return float(stats.multivariate_normal([0, 0], [[1, rho], [rho, 1]]).cdf([a, b]))


@pytest.mark.parametrize("rho", [-0.9, -0.3, 0.2, 0.7, 0.95, 0.995])
def test_two_coins_in_closed_form(rho: float):
    """Sheppard 1898: the correlation of two medians' signs is 2/pi arcsin(rho_z)."""
    assert gaussian_correlation(COIN, COIN, rho) == pytest.approx(math.sin(math.pi * rho / 2), abs=1e-5)


@pytest.mark.parametrize("rho", [-0.7, 0.4, 0.79])
def test_a_coin_and_a_normal_in_closed_form(rho: float):
    """Biserial: sqrt(2/pi) rho_z, so not even full dependence gets beyond 0.798."""
    expected = rho / math.sqrt(2 / math.pi)
    assert gaussian_correlation(COIN, stats.norm(3, 2), rho) == pytest.approx(expected, abs=1e-8)
    assert gaussian_correlation(stats.norm(3, 2), COIN, rho) == pytest.approx(expected, abs=1e-8)


@pytest.mark.parametrize("rho", [-0.6, 0.3, 0.8])
def test_two_tables_by_the_binormal_distribution(rho: float):
    first, second = Table([1.0, 2.0, 7.0], [2, 5, 3]), Table([0.0, 1.0], [9, 1])
    a, b = special.ndtri([0.2, 0.7]), special.ndtri(0.9)
    # 1 - P(first <= a) ... : E[XY] from the tails of both
    steps = [(1.0, -math.inf), (1.0, a[0]), (5.0, a[1])]
    joint = sum(
        height * (1.0 - (0 if np.isinf(t) else special.ndtr(t)) - 0.9 + (0 if np.isinf(t) else binormal(t, b, rho)))
        for height, t in steps
    )
    expected = (joint - first.mean() * 0.1) / (first.std() * 0.3)
    assert float(NatafCurve(first, second)(rho)) == pytest.approx(expected, abs=2e-4)


def test_the_attainable_range_of_tables_is_reported():
    rare = Table([0.0, 1.0], [9, 1])
    # comonotone: both 1 with probability 0.1; countermonotone: never both
    high, low = (0.1 - 0.05) / (0.5 * 0.3), (0 - 0.05) / (0.5 * 0.3)
    curve = NatafCurve(COIN, rare)
    assert (curve.low, curve.high) == pytest.approx((low, high), abs=1e-9)
    with pytest.raises(ValueError, match=r"between -0\.3333 and 0\.3333"):
        gaussian_correlation(COIN, rare, 0.4)
    variables = {
        "a": Variable(distribution="discrete", values=(0, 1)),
        "b": Variable(distribution="discrete", values=(0, 1), weights=(9, 1)),
    }
    with pytest.raises(InputError, match=r'"a" with "b" = 0.4: .* between -0\.3333 and 0\.3333'):
        Design.make(variables, dict.fromkeys(variables, "1"), {frozenset("ab"): 0.4}, "random", 1)


def test_curves_rise_from_end_to_end():
    pairs = [(COIN, stats.lognorm(0.5)), (Table(np.arange(50.0) ** 2), COIN), (COIN, COIN)]
    for first, second in pairs:
        curve = NatafCurve(first, second)
        values = curve(np.linspace(-1, 1, 401))
        assert (np.diff(values) > 0).all()
        assert values[[0, 200, -1]] == pytest.approx([curve.low, 0.0, curve.high], abs=1e-9)


def test_a_mixture_of_two_equal_parts_is_that_part():
    part = stats.lognorm(0.4)
    both = Mixture([part, part], [1, 3])
    assert both.quantile(np.array([-2.0, 0.5])) == pytest.approx(np.exp([-0.8, 0.2]), rel=1e-9)
    assert gaussian_correlation(both, stats.norm(), 0.5) == pytest.approx(gaussian_correlation(part, stats.norm(), 0.5))


def test_no_correlation_without_scatter():
    for without in (Table([3.0]), stats.cauchy()):
        with pytest.raises(ValueError, match="has no correlation"):
            gaussian_correlation(without, COIN, 0.1)


WEAK = tuple(
    Component(weight=w, distribution="lognormal", mean=m, cov=0.3) for w, m in ((0.95, 0.453e6), (0.05, 0.2265e6))
)
VARIABLES = {
    "weibull": Variable(distribution="weibull", mean=1.0, cov=0.4),
    "gamma": Variable(distribution="gamma", mean=1.0, cov=0.8),
    "beta": Variable(distribution="beta", alpha=0.7, beta=2.0, lower=0.0, upper=1.0),
    "discrete": Variable(distribution="discrete", values=(1, 2, 5), weights=(5, 3, 2)),
    "empirical": Variable(distribution="empirical", values=(0.41, 0.52, 0.38, 0.75, 0.44, 0.61, 0.52)),
    "scipy": Variable(distribution="scipy", name="gumbel_r", mean=1.0, cov=0.3),
    "mixture": Variable(distribution="mixture", components=WEAK),
}


@pytest.mark.parametrize(
    ("a", "b", "wanted"),
    [
        ("weibull", "gamma", 0.7),
        ("gamma", "beta", -0.5),
        ("discrete", "empirical", 0.6),
        ("discrete", "beta", -0.4),
        ("empirical", "mixture", 0.8),
        ("mixture", "scipy", -0.7),
        ("discrete", "scipy", 0.5),
    ],
)
def test_samples_have_the_stated_correlation_within_its_confidence_limits(a: str, b: str, wanted: float):
    count = 40_000
    variables = {name: VARIABLES[name] for name in (a, b)}
    design = Design.make(variables, dict.fromkeys(variables, "1"), {frozenset((a, b)): wanted}, "random", 17)
    values = design.wall_values(count)
    x, y = ((v - v.mean()) / v.std() for v in values.values())
    found = (x * y).mean()
    # standard error of a correlation, whatever the distributions (delta method)
    error = np.std(x * y - 0.5 * found * (x**2 + y**2)) / math.sqrt(count)
    assert found == pytest.approx(wanted, abs=3.5 * error)
    assert error < 0.008


def test_probabilities_of_a_table_on_and_between_its_values() -> None:
    table = Table([1.0, 2.0, 7.0], [2, 5, 3])
    at = [0.5, 1.0, 1.5, 2.0, 6.9, 7.0, 8.0]
    assert table.cdf(at) == pytest.approx([0.0, 0.2, 0.2, 0.7, 0.7, 1.0, 1.0])
    assert table.sf(at) == pytest.approx([1.0, 0.8, 0.8, 0.3, 0.3, 0.0, 0.0])
    assert table.ppf([0.1, 0.2, 0.3, 0.7, 0.8]).tolist() == [1.0, 1.0, 2.0, 2.0, 7.0]
