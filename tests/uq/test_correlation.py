"""The given correlation is that of the variables, not of the underlying normals."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from damagepred.errors import InputError
from damagepred.uq.correlation import cholesky, gaussian_correlation
from damagepred.uq.design import Design
from damagepred.uq.marginals import from_normal
from damagepred.uq.variable import JointField, Variable


def lognormal(cov: float, mean: float = 1.0):
    s2 = math.log(1 + cov**2)
    return stats.lognorm(s=math.sqrt(s2), scale=mean * math.exp(-s2 / 2))


@settings(max_examples=60, deadline=None, derandomize=True)
@given(st.floats(0.05, 0.8), st.floats(0.05, 0.8), st.floats(-0.6, 0.9))
def test_two_lognormals_in_closed_form(c1: float, c2: float, rho: float):
    scale = math.sqrt(math.log(1 + c1**2) * math.log(1 + c2**2))
    low, high = ((math.exp(sign * scale) - 1) / (c1 * c2) for sign in (-1, 1))
    if not low + 1e-3 < rho < high - 1e-3 or abs(rho) < 1e-6:
        return
    expected = math.log(1 + rho * c1 * c2) / scale
    assert gaussian_correlation(lognormal(c1, 3e5), lognormal(c2, 82e9), rho) == pytest.approx(expected, abs=1e-8)


@pytest.mark.parametrize("rho", [-0.95, -0.3, 0.2, 0.7, 0.99])
def test_two_uniforms_in_closed_form(rho: float):
    """Pearson 1907: rho_z = 2 sin(pi rho / 6)."""
    found = gaussian_correlation(stats.uniform(2, 3), stats.uniform(-1, 5), rho)
    assert found == pytest.approx(2 * math.sin(math.pi * rho / 6), abs=2e-4)


@pytest.mark.parametrize("rho", [-0.8, 0.1, 0.6])
def test_normals_keep_theirs(rho: float):
    assert gaussian_correlation(stats.norm(3, 2), stats.norm(-1, 0.1), rho) == pytest.approx(rho, abs=1e-9)


@pytest.mark.parametrize("rho", [-0.8, 0.1, 0.6])
def test_a_normal_and_a_lognormal_in_closed_form(rho: float):
    c = 0.7
    expected = rho * c / math.sqrt(math.log(1 + c**2))
    assert gaussian_correlation(stats.norm(3, 2), lognormal(c), rho) == pytest.approx(expected, abs=1e-8)
    assert gaussian_correlation(lognormal(c), stats.norm(3, 2), rho) == pytest.approx(expected, abs=1e-8)


def test_no_correlation_is_none():
    assert gaussian_correlation(lognormal(0.5), stats.uniform(), 0.0) == 0.0


@pytest.mark.parametrize("sign", [-1, 1])
def test_impossible_correlation_of_two_lognormals(sign: int):
    c1, c2 = 2.0, 1.5
    scale = math.sqrt(math.log(1 + c1**2) * math.log(1 + c2**2))
    low, high = ((math.exp(s * scale) - 1) / (c1 * c2) for s in (-1, 1))
    assert high < 0.999  # not even full dependence makes two different lognormals fully correlated
    beyond = low - 0.01 if sign < 0 else high + 0.005
    with pytest.raises(ValueError, match="can only be correlated between") as caught:
        gaussian_correlation(lognormal(c1), lognormal(c2), beyond)
    assert f"{low:.3f}" in str(caught.value)
    inside = low + 0.01 if sign < 0 else high - 0.005
    assert abs(gaussian_correlation(lognormal(c1), lognormal(c2), inside)) < 1


def test_identical_variables_may_be_fully_correlated():
    assert gaussian_correlation(lognormal(0.3), lognormal(0.3), 1.0) == pytest.approx(1.0, abs=1e-6)
    assert gaussian_correlation(stats.norm(), stats.norm(), -1.0) == pytest.approx(-1.0, abs=1e-6)


def test_from_normal_keeps_both_tails():
    marginal = stats.lognorm(s=0.3)
    z = np.array([-9.0, -3.0, 0.0, 3.0, 9.0, 12.0])
    np.testing.assert_allclose(from_normal(marginal, z), np.exp(0.3 * z), rtol=1e-10)


VARIABLES = {
    "joint.tensile_strength": Variable(distribution="lognormal", mean=0.453e6, cov=0.3),
    "joint.cohesion": Variable(distribution="lognormal", mean=0.375e6, cov=0.35),
    "joint.friction": Variable(distribution="lognormal", mean=0.75, cov=0.15),
    "dpc.friction": Variable(distribution="truncated_normal", mean=0.5, cov=0.2, lower=0.3, upper=0.7),
    "movement.central_deflection": Variable(distribution="uniform", lower=0.04, upper=0.06),
}
UNITS = dict.fromkeys(VARIABLES, "1") | {"joint.tensile_strength": "Pa", "joint.cohesion": "Pa"}
WANTED = {
    frozenset(("joint.tensile_strength", "joint.cohesion")): 0.7,
    frozenset(("joint.tensile_strength", "joint.friction")): -0.3,
    frozenset(("dpc.friction", "movement.central_deflection")): 0.5,
}


@pytest.mark.parametrize("sampler", ["random", "sobol", "lhs"])
def test_twenty_thousand_samples_have_the_given_correlations(sampler: str):
    values = Design.make(VARIABLES, {p: UNITS.get(p, "1") for p in VARIABLES}, WANTED, sampler, 5).wall_values(20000)
    for a, b in itertools.combinations(VARIABLES, 2):
        found = np.corrcoef(values[a], values[b])[0, 1]
        assert found == pytest.approx(WANTED.get(frozenset((a, b)), 0.0), abs=0.025), (a, b)


def test_correlating_does_not_change_the_marginals():
    values = Design.make(VARIABLES, UNITS, WANTED, "random", 5).wall_values(5000)
    for place, variable in VARIABLES.items():
        assert stats.kstest(values[place], variable.frozen(place, UNITS[place]).cdf).pvalue > 1e-3


def test_impossible_correlation_of_a_study_names_the_pair():
    with pytest.raises(InputError) as caught:
        Design.make(VARIABLES, UNITS, {frozenset(("joint.tensile_strength", "joint.cohesion")): -0.99}, "random", 1)
    message = str(caught.value)
    for word in ('[correlation] "joint.tensile_strength" with "joint.cohesion" = -0.99', "between -0.9"):
        assert word in message


def test_contradicting_correlations():
    wanted = {
        frozenset(("joint.tensile_strength", "joint.cohesion")): 0.9,
        frozenset(("joint.tensile_strength", "joint.friction")): 0.9,
        frozenset(("joint.cohesion", "joint.friction")): -0.5,
    }
    with pytest.raises(InputError, match="contradict each other"):
        Design.make(VARIABLES, UNITS, wanted, "random", 1)


def test_a_wall_s_value_and_a_joint_s_cannot_be_correlated():
    variables = VARIABLES | {
        "joint.cohesion": Variable(distribution="lognormal", mean=0.375e6, cov=0.35, field=JointField())
    }
    with pytest.raises(InputError, match=r'"joint.tensile_strength" with "joint.cohesion": one has a value a wall'):
        Design.make(variables, UNITS, {frozenset(("joint.tensile_strength", "joint.cohesion")): 0.7}, "random", 1)


def test_factor_gives_back_the_correlation_of_the_normals():
    names = list(VARIABLES)
    marginals = {p: v.frozen(p, UNITS[p]) for p, v in VARIABLES.items()}
    factor = cholesky(names, marginals, WANTED)
    matrix = factor @ factor.T
    np.testing.assert_allclose(np.diag(matrix), 1.0)
    c1, c2 = 0.3, 0.35
    expected = math.log(1 + 0.7 * c1 * c2) / math.sqrt(math.log(1 + c1**2) * math.log(1 + c2**2))
    assert matrix[0, 1] == pytest.approx(expected, abs=1e-8)
    assert matrix[2, 3] == 0.0
    assert (np.triu(factor, 1) == 0).all()
