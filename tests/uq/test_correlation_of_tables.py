"""Nataf model for discrete values and mixtures: closed forms, attainable ranges, and samples."""

import math

import numpy as np
import pytest
from scipy import special, stats

from damagepred.errors import InputError
from damagepred.uq.correlation import NatafCurve, gaussian_correlation
from damagepred.uq.design import Design
from damagepred.uq.marginals import Table
from damagepred.uq.variable import Variable

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


def test_probabilities_of_a_table_on_and_between_its_values() -> None:
    table = Table([1.0, 2.0, 7.0], [2, 5, 3])
    at = [0.5, 1.0, 1.5, 2.0, 6.9, 7.0, 8.0]
    assert table.cdf(at) == pytest.approx([0.0, 0.2, 0.2, 0.7, 0.7, 1.0, 1.0])
    assert table.sf(at) == pytest.approx([1.0, 0.8, 0.8, 0.3, 0.3, 0.0, 0.0])
    assert table.ppf([0.1, 0.2, 0.3, 0.7, 0.8]).tolist() == [1.0, 1.0, 2.0, 2.0, 7.0]
