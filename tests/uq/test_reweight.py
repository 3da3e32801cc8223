"""Walls reweighted for other distributions, compared with walls sampled from these."""

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


def test_a_distribution_without_density_is_refused() -> None:
    discrete = Design.make(
        {"dpc.friction": Variable(distribution="discrete", values=(0.4, 0.6))}, UNITS, {}, "random", 1
    )
    with pytest.raises(InputError, match="study of its own"):
        density_ratio(discrete, discrete, discrete.wall_values(4))
