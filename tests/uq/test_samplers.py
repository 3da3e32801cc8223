"""Points in the unit cube by (seed, i) alone, and weights of walls: reweighting and importance sampling."""

import numpy as np
import pytest
from scipy import special
from scipy.stats import qmc

from damagepred.errors import InputError
from damagepred.uq.design import Design, Sampler, density_ratio
from damagepred.uq.estimate import probability
from damagepred.uq.fields import JointPlaces
from damagepred.uq.importance import Proposal, cross_entropy_shift
from damagepred.uq.samplers import unit_points
from damagepred.uq.variable import JointField, Variable
from tests.cli.conftest import Run, command  # noqa: F401


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
PLACES = JointPlaces(np.repeat(np.arange(4), 10), np.zeros(40, int), np.tile(np.arange(10) / 4, 4), np.zeros(40), 0.25)


def design(sampler: str = "sobol", seed: int = 7) -> Design:
    return Design.make(VARIABLES, UNITS, {}, sampler, seed)


@pytest.mark.parametrize("sampler", ["sobol", "random"])
def test_walls_do_not_change_when_a_study_grows(sampler: str):
    few, many = design(sampler).wall_values(13), design(sampler).wall_values(200)
    assert set(few) == {"joint.friction", "movement.central_deflection"}
    for place in few:
        np.testing.assert_array_equal(few[place], many[place][:13])


def test_joints_of_a_sample_depend_on_seed_and_number_alone():
    first = design().joint_values(5, PLACES)["joint.cohesion"]
    again = design()
    for other in (0, 3, 9):  # after any earlier draws
        again.joint_values(other, PLACES)
    np.testing.assert_array_equal(again.joint_values(5, PLACES)["joint.cohesion"], first)
    np.testing.assert_array_equal(design("random").joint_values(5, PLACES)["joint.cohesion"], first)
    for other in (design().joint_values(6, PLACES), design(seed=8).joint_values(5, PLACES)):
        assert not (other["joint.cohesion"] == first).any()


UNITS_OF_REWEIGHT = {"joint.friction": "1", "dpc.friction": "1"}


def design_of_reweight(cov: float, correlation: float, lower: float = 0.3) -> Design:
    variables = {
        "joint.friction": Variable(distribution="lognormal", mean=0.75, cov=cov),
        "dpc.friction": Variable(distribution="truncated_normal", mean=0.5, cov=0.2, lower=lower, upper=0.7),
    }
    return Design.make(variables, UNITS_OF_REWEIGHT, {frozenset(UNITS_OF_REWEIGHT): correlation}, "sobol", 3)


def test_weighted_walls_have_the_other_distribution() -> None:
    stated, other = design_of_reweight(0.2, 0.2), design_of_reweight(0.15, 0.5)
    values = stated.wall_values(8192)
    weight = density_ratio(stated, other, values)
    assert weight.mean() == pytest.approx(1.0, abs=0.01)
    direct = other.wall_values(8192)
    for power in (1, 2):
        for place in UNITS_OF_REWEIGHT:
            again = np.mean(weight * values[place] ** power)
            assert again == pytest.approx(np.mean(direct[place] ** power), rel=0.01)
    product = np.mean(weight * values["joint.friction"] * values["dpc.friction"])
    assert product == pytest.approx(np.mean(direct["joint.friction"] * direct["dpc.friction"]), rel=0.01)


def test_the_same_distribution_changes_nothing_and_what_cannot_be_counts_nothing() -> None:
    stated = design_of_reweight(0.2, 0.3)
    values = stated.wall_values(256)
    np.testing.assert_allclose(density_ratio(stated, stated, values), 1.0)
    narrower = density_ratio(stated, design_of_reweight(0.2, 0.3, lower=0.4), values)
    assert (narrower[values["dpc.friction"] < 0.4] == 0).all()
    assert (narrower[values["dpc.friction"] > 0.4] > 0).all()


def test_a_distribution_without_density_is_refused() -> None:
    discrete = Design.make(
        {"dpc.friction": Variable(distribution="discrete", values=(0.4, 0.6))}, UNITS_OF_REWEIGHT, {}, "random", 1
    )
    with pytest.raises(InputError, match="study of its own"):
        density_ratio(discrete, discrete, discrete.wall_values(4))


NORMALS = {place: Variable(distribution="normal", mean=0.0, std=1.0) for place in ("a", "b")}


def scatter_of(correlation: float) -> float:
    """Coefficient of variation of one wall's part in P(a > 3), a shifted and b correlated with it."""
    design_of_reweight = Design.make(
        NORMALS,
        dict.fromkeys(NORMALS, "1"),
        {frozenset("ab"): correlation},
        Sampler("random", 1, {"a": Proposal(shift=3.0)}),
        1,
    )
    part = (design_of_reweight.wall_values(4000)["a"] > 3.0) * design_of_reweight.weights(4000)
    assert probability(part > 0, weight=design_of_reweight.weights(4000)).value == pytest.approx(
        special.ndtr(-3), rel=0.15
    )
    return float(part.std() / part.mean())


@pytest.mark.quick_cases
@pytest.mark.parametrize("correlation", [0.6, -0.6, 0.9])
def test_a_shift_includes_the_correlation(correlation: float) -> None:
    """A shift against it increases the standard error five times."""
    assert scatter_of(correlation) == pytest.approx(scatter_of(0.0), rel=0.1)


def test_the_proposed_shift_is_the_mean_beyond_the_limit() -> None:
    """Of a > 2: phi(2) / Phi(-2) in a, its correlation times that in b; weighted walls say the same."""
    exact = np.exp(-2.0) / np.sqrt(2 * np.pi) / special.ndtr(-2.0)
    for shift in (0.0, 1.5):
        proposals = {"a": Proposal(shift=shift)} if shift else {}
        design_of_reweight = Design.make(
            NORMALS, dict.fromkeys(NORMALS, "1"), {frozenset("ab"): 0.6}, Sampler("random", 1, proposals), 3
        )
        drawn = design_of_reweight.draw(8000)
        hit = drawn.normal[:, 0] > 2
        normal, weight = drawn.normal[hit], drawn.weight[hit]
        found = cross_entropy_shift(normal, weight)
        error = np.sqrt((weight**2) @ (normal - found) ** 2) / weight.sum()
        assert (abs(found - exact * np.array([1.0, 0.6])) < 4 * error).all()
        assert error.max() < 0.15
