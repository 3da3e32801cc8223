"""Points in the unit cube: sample i depends on (seed, i) alone, and Sobol points are stratified."""

import numpy as np
import pytest

from damagepred.errors import InputError
from damagepred.uq.design import Design
from damagepred.uq.samplers import unit_points
from damagepred.uq.variable import JointField, Variable


def test_a_latin_hypercube_does_not_extend():
    assert not np.array_equal(unit_points("lhs", 5, 32, 7)[:16], unit_points("lhs", 5, 16, 7))


@pytest.mark.parametrize("sampler", ["sobol", "random", "lhs"])
def test_the_same_seed_gives_the_same_points_and_another_others(sampler: str):
    np.testing.assert_array_equal(unit_points(sampler, 3, 20, 7), unit_points(sampler, 3, 20, 7))
    assert not (unit_points(sampler, 3, 20, 7) == unit_points(sampler, 3, 20, 8)).any()


def test_unknown_sampler():
    with pytest.raises(InputError, match=r"study.sampler = 'sobl': must be 'sobol', 'lhs' or 'random'"):
        unit_points("sobl", 2, 5, 1)


# -- the design of a study --------------------------------------------------------------------------------------------

VARIABLES = {
    "joint.friction": Variable(distribution="lognormal", mean=0.75, cov=0.15),
    "movement.central_deflection": Variable(distribution="uniform", lower=0.04, upper=0.06),
    "joint.cohesion": Variable(distribution="lognormal", mean=1.0, cov=0.3, field=JointField(course_correlation=0.4)),
}
UNITS = {"joint.friction": "1", "movement.central_deflection": "m", "joint.cohesion": "Pa"}


def design(sampler: str = "sobol", seed: int = 7) -> Design:
    return Design.make(VARIABLES, UNITS, {}, sampler, seed)
