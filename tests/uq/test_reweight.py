"""Weights of walls: reweighting for other distributions, and importance sampling."""

import numpy as np
import pytest
from scipy import special

from damagepred.errors import InputError
from damagepred.uq.design import Design, Sampler, density_ratio
from damagepred.uq.estimate import probability
from damagepred.uq.importance import Proposal, cross_entropy_shift
from damagepred.uq.variable import Variable
from tests.cli.conftest import Run, command  # noqa: F401

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


NORMALS = {place: Variable(distribution="normal", mean=0.0, std=1.0) for place in ("a", "b")}


def scatter_of(correlation: float) -> float:
    """Coefficient of variation of one wall's part in P(a > 3), a shifted and b correlated with it."""
    design = Design.make(
        NORMALS,
        dict.fromkeys(NORMALS, "1"),
        {frozenset("ab"): correlation},
        Sampler("random", 1, {"a": Proposal(shift=3.0)}),
        1,
    )
    part = (design.wall_values(4000)["a"] > 3.0) * design.weights(4000)
    assert probability(part > 0, weight=design.weights(4000)).value == pytest.approx(special.ndtr(-3.0), rel=0.15)
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
        design = Design.make(
            NORMALS, dict.fromkeys(NORMALS, "1"), {frozenset("ab"): 0.6}, Sampler("random", 1, proposals), 3
        )
        drawn = design.draw(8000)
        hit = drawn.normal[:, 0] > 2
        found = cross_entropy_shift(drawn.normal[hit], drawn.weight[hit])
        assert (abs(found.mean - exact * np.array([1.0, 0.6])) < 4 * found.error).all()
        assert found.error.max() < 0.15
