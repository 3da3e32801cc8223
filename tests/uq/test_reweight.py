"""Walls reweighted for other distributions, compared with walls sampled from these."""

import numpy as np
import pytest

from damagepred.errors import InputError
from damagepred.uq.design import Design, density_ratio
from damagepred.uq.variable import Variable

UNITS = {"joint.friction": "1", "dpc.friction": "1"}


def design(cov: float, correlation: float, lower: float = 0.3) -> Design:
    variables = {
        "joint.friction": Variable(distribution="lognormal", mean=0.75, cov=cov),
        "dpc.friction": Variable(distribution="truncated_normal", mean=0.5, cov=0.2, lower=lower, upper=0.7),
    }
    return Design.make(variables, UNITS, {frozenset(UNITS): correlation}, "sobol", 3)


def test_weighted_walls_have_the_other_distribution() -> None:
    stated, other = design(0.2, 0.2), design(0.15, 0.5)
    values = stated.wall_values(8192)
    weight = density_ratio(stated, other, values)
    assert weight.mean() == pytest.approx(1.0, abs=0.01)
    direct = other.wall_values(8192)
    for power in (1, 2):
        for place in UNITS:
            again = np.mean(weight * values[place] ** power)
            assert again == pytest.approx(np.mean(direct[place] ** power), rel=0.01)
    product = np.mean(weight * values["joint.friction"] * values["dpc.friction"])
    assert product == pytest.approx(np.mean(direct["joint.friction"] * direct["dpc.friction"]), rel=0.01)


def test_the_same_distribution_changes_nothing_and_what_cannot_be_counts_nothing() -> None:
    stated = design(0.2, 0.3)
    values = stated.wall_values(256)
    np.testing.assert_allclose(density_ratio(stated, stated, values), 1.0)
    narrower = density_ratio(stated, design(0.2, 0.3, lower=0.4), values)
    assert (narrower[values["dpc.friction"] < 0.4] == 0).all()
    assert (narrower[values["dpc.friction"] > 0.4] > 0).all()


def test_a_distribution_without_density_is_refused() -> None:
    discrete = Design.make(
        {"dpc.friction": Variable(distribution="discrete", values=(0.4, 0.6))}, UNITS, {}, "random", 1
    )
    with pytest.raises(InputError, match="study of its own"):
        density_ratio(discrete, discrete, discrete.wall_values(4))
