"""The given correlation is that of the variables, not of the underlying normals, also of tables and mixtures."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from damagepred.errors import InputError
from damagepred.uq.correlation import NatafCurve, gaussian_correlation
from damagepred.uq.design import Design, Sampler
from damagepred.uq.fields import JointPlaces
from damagepred.uq.marginals import Table
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
def test_a_normal_and_a_lognormal_in_closed_form(rho: float):
    c = 0.7
    expected = rho * c / math.sqrt(math.log(1 + c**2))
    assert gaussian_correlation(stats.norm(3, 2), lognormal(c), rho) == pytest.approx(expected, abs=1e-8)
    assert gaussian_correlation(lognormal(c), stats.norm(3, 2), rho) == pytest.approx(expected, abs=1e-8)


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


VARIABLES = {
    "joint.tensile_strength": Variable(distribution="lognormal", mean=0.453e6, cov=0.3),
    "joint.cohesion": Variable(distribution="lognormal", mean=0.375e6, cov=0.35),
    "joint.friction": Variable(distribution="lognormal", mean=0.75, cov=0.15),
    "dpc.friction": Variable(distribution="truncated_normal", mean=0.5, cov=0.2, lower=0.3, upper=0.7),
    "movement.central_deflection": Variable(distribution="uniform", lower=0.04, upper=0.06),
}
UNITS = dict.fromkeys(VARIABLES, "1") | {"joint.tensile_strength": "Pa", "joint.cohesion": "Pa"}


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
    with pytest.raises(InputError, match="contradict each other") as caught:
        Design.make(VARIABLES, UNITS, wanted, "random", 1)
    assert '"joint.tensile_strength" with "joint.cohesion" = 0.9' in str(caught.value)


NORMAL = Variable(distribution="normal", mean=0.7, std=0.02)


def normals(**pairs: float) -> tuple[dict[str, Variable], dict[str, str], dict[frozenset[str], float]]:
    """Variables a, b, ... with normal distributions, their units, and the correlations of pairs such as ab."""
    names = sorted(set("".join(pairs)))
    return dict.fromkeys(names, NORMAL), dict.fromkeys(names, "1"), {frozenset(k): v for k, v in pairs.items()}


@pytest.mark.parametrize("rho", [1.0, -1.0])
@pytest.mark.parametrize("sampler", ["sobol", "lhs", "random"])
def test_fully_correlated(rho: float, sampler: str):
    values = Design.make(*normals(ab=rho), sampler, 3).wall_values(64)
    np.testing.assert_allclose(values["b"] - 0.7, rho * (values["a"] - 0.7), rtol=0, atol=1e-15)
    assert np.std(values["a"]) == pytest.approx(0.02, rel=0.2)


def test_one_variable_follows_from_two_others():
    """Cosines of a right angle: c = 0.6 a + 0.8 b."""
    values = Design.make(*normals(ab=0.0, ac=0.6, bc=0.8), "random", 3).wall_values(50)
    a, b, c = (values[name] - 0.7 for name in "abc")
    np.testing.assert_allclose(c, 0.6 * a + 0.8 * b, rtol=0, atol=1e-9)


def test_the_three_that_contradict_and_what_the_third_can_be():
    with pytest.raises(InputError) as caught:
        Design.make(*normals(ab=0.9, ac=0.9, bc=-0.9), "random", 1)
    for words in ('"a" with "b" = 0.9', '"b" with "c" = -0.9 contradict', "between 0.62 and 1."):
        assert words in str(caught.value)
    with pytest.raises(InputError, match=r'"b" with "c" \(not given, thus 0\)'):
        Design.make(*normals(ab=0.9, ac=0.9), "random", 1)


def test_fields_fully_correlated():
    for field in (JointField(course_correlation=0.4), JointField(correlation_length=0.5, nugget=0.1)):
        fields = {name: Variable(distribution="normal", mean=m, std=0.02, field=field) for name, m in zip("ab", (1, 2))}
        design = Design.make(fields, {"a": "1", "b": "1"}, {frozenset("ab"): 1.0}, "random", 1)
        x = np.arange(6) * 0.24
        places = JointPlaces(np.zeros(6, int), np.zeros(6, np.int8), x, 0.0 * x, 0.24)
        values = design.joint_values(0, places)
        np.testing.assert_allclose(values["b"] - 2.0, values["a"] - 1.0, rtol=0, atol=1e-9)
        assert np.ptp(values["a"]) > 0.01
    rough = {**fields, "b": Variable(distribution="normal", mean=1, std=0.02, field=JointField(correlation_length=5.0))}
    with pytest.raises(InputError, match="change so differently"):
        Design.make(rough, {"a": "1", "b": "1"}, {frozenset("ab"): 1.0}, "random", 1).joint_values(0, places)
    rough = {n: replace(v, field=JointField(course_correlation=0.3 * k)) for k, (n, v) in enumerate(fields.items(), 1)}
    with pytest.raises(InputError, match=r"by 0\.3 and 0\.6 from joint to joint"):
        Design.make(rough, {"a": "1", "b": "1"}, {frozenset("ab"): 1.0}, "random", 1)


def test_importance_of_fully_correlated_variables():
    """The weights are those of the first variable alone, whose shift the second follows."""
    from damagepred.uq.importance import Proposal

    variables, units, pairs = normals(ab=-1.0)
    shifted = Sampler("random", proposals={"a": Proposal(shift=1.5)}, nominal_share=0.1)
    both = Design.make(variables, units, pairs, shifted, 2)
    values, weight = both.wall_values(40), both.weights(40)
    z = (values["a"] - 0.7) / 0.02
    np.testing.assert_allclose(values["b"] - 0.7, 0.7 - values["a"], atol=1e-12)
    np.testing.assert_allclose(weight, 1 / (0.1 + 0.9 * np.exp(1.5 * z - 1.125)), rtol=1e-9)
    for proposals in ({"a": Proposal(shift=1, scale=2)}, {"a": Proposal(shift=1), "b": Proposal(shift=1)}):
        with pytest.raises(InputError, match="follow from others"):
            Design.make(variables, units, pairs, Sampler("random", proposals=proposals), 2).weights(40)
    same = Sampler("random", proposals={"a": Proposal(shift=1, scale=2), "b": Proposal(shift=-1, scale=2)})
    z = (Design.make(variables, units, pairs, same, 2).wall_values(40)["a"] - 0.7) / 0.02
    expected = stats.norm.pdf(z) / stats.norm.pdf(z, 1, 2)
    np.testing.assert_allclose(Design.make(variables, units, pairs, same, 2).weights(40), expected, rtol=1e-9)


def test_reweighting_of_fully_correlated_variables():
    from damagepred.uq.design import density_ratio

    variables, units, pairs = normals(ab=1.0)
    stated = Design.make(variables, units, pairs, "random", 2)
    other = Variable(distribution="normal", mean=0.71, std=0.02)
    values = stated.wall_values(40)
    ratio = density_ratio(stated, Design.make(dict.fromkeys("ab", other), units, pairs, "random", 2), values)
    expected = stats.norm.pdf(values["a"], 0.71, 0.02) / stats.norm.pdf(values["a"], 0.7, 0.02)
    np.testing.assert_allclose(ratio, expected, rtol=1e-9)
    with pytest.raises(InputError, match="run the alternative as a study"):
        density_ratio(stated, Design.make(variables | {"b": other}, units, pairs, "random", 2), values)


def test_a_wall_s_value_and_a_joint_s_cannot_be_correlated():
    variables = VARIABLES | {
        "joint.cohesion": Variable(distribution="lognormal", mean=0.375e6, cov=0.35, field=JointField())
    }
    with pytest.raises(InputError, match=r'"joint.tensile_strength" with "joint.cohesion": one has a value per sample'):
        Design.make(variables, UNITS, {frozenset(("joint.tensile_strength", "joint.cohesion")): 0.7}, "random", 1)


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
