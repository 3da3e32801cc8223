"""Nataf model for discrete values and mixtures: closed forms, attainable ranges, and samples."""

import math

import pytest
from scipy import stats

from damagepred.errors import InputError
from damagepred.uq.correlation import NatafCurve, gaussian_correlation
from damagepred.uq.design import Design
from damagepred.uq.marginals import Table
from damagepred.uq.variable import Variable

COIN = Table([0.0, 1.0])


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
