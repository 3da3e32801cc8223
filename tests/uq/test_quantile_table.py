"""Quantiles from a table, compared with those computed one by one."""

import numpy as np
import pytest
from scipy import stats

from damagepred.uq.marginals import Mixture, Table, from_normal
from damagepred.uq.quantile_table import JointQuantile

MARGINALS = {
    "truncated normal": stats.truncnorm(-2, 2, loc=0.5, scale=0.1),
    "gamma": stats.gamma(11.0, scale=4e4),
    "beta": stats.beta(3.0, 2.0, loc=0.3, scale=0.4),
    "beta with a peak at an end": stats.beta(0.4, 5.0),
    "skewed normal": stats.skewnorm(2.0, loc=0.4, scale=0.05),
    "about zero": stats.t(5),
    "sound and weak": Mixture([stats.lognorm(s=0.3, scale=0.45e6), stats.lognorm(s=0.3, scale=0.2e6)], [95, 5]),
    "far apart": Mixture([stats.norm(1, 0.01), stats.norm(2, 0.01)], [3, 1]),
    "with a gap": Mixture([stats.uniform(0, 1), stats.uniform(2, 1)], [3, 1]),
    "some without any": Mixture([Table([0.0]), stats.lognorm(s=0.3, scale=0.45e6)], [5, 95]),
    "many kinks": Mixture([stats.uniform(a, 1.0) for a in (0.0, 0.3, 0.7)], [1, 2, 3]),
}


@pytest.mark.parametrize("name", MARGINALS)
def test_the_values_are_those_found_one_by_one(name: str) -> None:
    marginal = MARGINALS[name]
    z = np.concatenate((np.random.default_rng(1).standard_normal(3000), np.linspace(-7, 7, 701)))
    exact = from_normal(marginal, z)
    quick = JointQuantile(marginal)
    found = quick(z)
    np.testing.assert_allclose(found, exact, rtol=1e-9, atol=1e-10 * float(marginal.std()))
    low, high = marginal.support()
    assert (found >= low - 1e-9).all()
    assert (found <= high + 1e-9).all()
    np.testing.assert_array_equal(found, JointQuantile(marginal)(z))  # another process makes the same table
    np.testing.assert_array_equal(found[:7], quick(z[:7]))  # and a value does not depend on its company


def test_atoms_are_exact() -> None:
    marginal = MARGINALS["some without any"]
    found = JointQuantile(marginal)(np.random.default_rng(1).standard_normal(20_000))
    assert (found == 0.0).mean() == pytest.approx(0.05, abs=0.006)
    assert found[found > 0].min() > 1e4
