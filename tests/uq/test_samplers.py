"""Points in the unit cube: sample i depends on (seed, i) alone, and Sobol points are stratified."""

import numpy as np
import pytest
from scipy.stats import qmc

from damagepred.errors import InputError
from damagepred.uq.design import Design
from damagepred.uq.samplers import unit_points
from damagepred.uq.variable import JointField, Variable


@pytest.mark.parametrize("sampler", ["sobol", "random"])
def test_more_samples_keep_the_first_ones(sampler: str):
    long = unit_points(sampler, 5, 300, 7)
    for samples in (1, 2, 3, 4, 5, 31, 32, 33, 64, 65, 256, 257):
        np.testing.assert_array_equal(unit_points(sampler, 5, samples, 7), long[:samples])


def test_a_latin_hypercube_does_not_extend():
    assert not np.array_equal(unit_points("lhs", 5, 32, 7)[:16], unit_points("lhs", 5, 16, 7))


@pytest.mark.parametrize("sampler", ["sobol", "random", "lhs"])
def test_the_same_seed_gives_the_same_points_and_another_others(sampler: str):
    np.testing.assert_array_equal(unit_points(sampler, 3, 20, 7), unit_points(sampler, 3, 20, 7))
    assert not (unit_points(sampler, 3, 20, 7) == unit_points(sampler, 3, 20, 8)).any()


def test_sobol_points_are_spread_more_evenly_than_random_ones():
    for dimensions in (2, 6):
        sobol = [qmc.discrepancy(unit_points("sobol", dimensions, 256, seed)) for seed in range(5)]
        random = [qmc.discrepancy(unit_points("random", dimensions, 256, seed)) for seed in range(5)]
        assert max(sobol) < 0.5 * min(random)


@pytest.mark.parametrize("sampler", ["sobol", "lhs"])
def test_one_point_in_every_stratum(sampler: str):
    points = unit_points(sampler, 6, 64, 3)
    for column in points.T:
        assert sorted((column * 64).astype(int)) == list(range(64))


def test_unknown_sampler():
    with pytest.raises(InputError, match=r"study.sampler = 'sobl': must be 'sobol', 'lhs' or 'random'"):
        unit_points("sobl", 2, 5, 1)


VARIABLES = {
    "joint.friction": Variable(distribution="lognormal", mean=0.75, cov=0.15),
    "movement.central_deflection": Variable(distribution="uniform", lower=0.04, upper=0.06),
    "joint.cohesion": Variable(distribution="lognormal", mean=1.0, cov=0.3, field=JointField(course_correlation=0.4)),
}
UNITS = {"joint.friction": "1", "movement.central_deflection": "m", "joint.cohesion": "Pa"}
SEQUENCE = np.repeat(np.arange(4), 10)


def design(sampler: str = "sobol", seed: int = 7) -> Design:
    return Design.make(VARIABLES, UNITS, {}, sampler, seed)


@pytest.mark.parametrize("sampler", ["sobol", "random"])
def test_walls_do_not_change_when_a_study_grows(sampler: str):
    few, many = design(sampler).wall_values(13), design(sampler).wall_values(200)
    assert set(few) == {"joint.friction", "movement.central_deflection"}
    for place in few:
        np.testing.assert_array_equal(few[place], many[place][:13])


def test_joints_of_a_sample_depend_on_seed_and_number_alone():
    first = design().joint_values(5, SEQUENCE)["joint.cohesion"]
    again = design()
    for other in (0, 3, 9):  # after any earlier draws
        again.joint_values(other, SEQUENCE)
    np.testing.assert_array_equal(again.joint_values(5, SEQUENCE)["joint.cohesion"], first)
    np.testing.assert_array_equal(design("random").joint_values(5, SEQUENCE)["joint.cohesion"], first)
    for other in (design().joint_values(6, SEQUENCE), design(seed=8).joint_values(5, SEQUENCE)):
        assert not (other["joint.cohesion"] == first).any()
