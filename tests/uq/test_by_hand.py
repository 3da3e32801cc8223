"""Steps of the estimates, compared with hand calculation."""

import math

import numpy as np
import pytest
import xarray as xr

from damagepred.errors import InputError
from damagepred.uq.design import Sampler
from damagepred.uq.estimate import Estimate
from damagepred.uq.fields import JointPlaces, WallFields, stated_correlation
from damagepred.uq.intensity import attributes, chosen_intensity, intensity_values, movement_measure
from damagepred.uq.stopping import StopWhen, interim_confidence, interim_sizes
from damagepred.uq.variable import JointField, Variable


def test_walls_and_fields_of_a_crossed_design() -> None:
    crossed, plain = Sampler(crossed=True), Sampler()
    assert crossed.wall_of(np.arange(8)).tolist() == [0, 0, 1, 1, 2, 2, 3, 3]
    assert [crossed.field_of(i) for i in range(8)] == [0, 1, 0, 1, 2, 3, 2, 3]
    assert plain.wall_of(np.arange(3)).tolist() == [plain.field_of(i) for i in range(3)] == [0, 1, 2]


PLACES = JointPlaces(
    np.array([0, 0, 0, 1, 1]),
    np.zeros(5, dtype=int),
    np.array([0.1, 0.35, 0.9, 0.2, 0.5]),
    np.array([0, 0, 0, 0.3, 0.3]),
    0.25,
)


def test_correlation_of_joints_of_a_course_is_a_power_of_their_distance() -> None:
    found = stated_correlation(JointField(course_correlation=0.4), PLACES, np.arange(5))
    row = [1.0, 0.4, 0.16]
    np.testing.assert_allclose(found[0], [*row, 0, 0])
    np.testing.assert_allclose(found[2], [*row[::-1], 0, 0])
    np.testing.assert_allclose(found[3], [0, 0, 0, 1, 0.4])
    away = stated_correlation(JointField(correlation_length=0.5, nugget=0.2), PLACES, np.arange(5))
    assert away[0, 4] == pytest.approx(0.8 * math.exp(-0.5 / 0.5), rel=1e-12)  # 0.4 m along, 0.3 m up


def test_normals_behind_lognormal_fields_in_closed_form() -> None:
    """Two lognormals of the same cov: rho of the normals is ln(1 + r cov^2) / ln(1 + cov^2); mixed by their factor."""
    cov, strong = 0.8, 0.6
    fields = {name: JointField(correlation_length=length) for name, length in (("a", 0.5), ("b", 0.7))}
    marginal = Variable(distribution="lognormal", mean=1.0, cov=cov).frozen("a", "1")
    factor = np.linalg.cholesky(np.array([[1.0, strong], [strong, 1.0]]))
    made = WallFields(list(fields), fields, dict.fromkeys(fields, marginal), factor)
    # columns of the linear map of independent normals give the covariance of what is drawn
    size = 2 * len(PLACES.x)
    columns = [made.draw(unit.reshape(2, -1).copy(), PLACES).ravel() for unit in np.eye(size)]
    covariance = np.transpose(columns) @ np.array(columns)
    for k, field in enumerate(fields.values()):
        stated = stated_correlation(field, PLACES, np.arange(5))
        expected = np.log1p(stated * cov**2) / np.log1p(cov**2)
        block = covariance[5 * k : 5 * k + 5, 5 * k : 5 * k + 5]
        np.testing.assert_allclose(block, expected, atol=2e-4)
    np.testing.assert_allclose(np.diag(covariance[:5, 5:]), strong, rtol=1e-9)


def test_measures_of_the_movement_by_hand() -> None:
    both = ("sample", "increment")
    ds = xr.Dataset(
        {
            "central_deflection": (both, [[0.0, 4e-3], [0.0, 6e-3]]),
            "deflection_ratio": (both, [[0.0, 1e-3], [0.0, 2e-3]]),
            "section_curvature": ((*both, "section"), [[[0, 0.0], [1e-3, -3e-3]], [[2e-3, 1e-3], [5e-3, 4e-3]]]),
            "surface_movement": (both, np.full((2, 2), np.nan), {"units": "m", "long_name": "of the ground"}),
        }
    )
    np.testing.assert_allclose(intensity_values(ds, "curvature"), [[0, 2e-3], [0, 8 * 4e-6 / 6e-3]], rtol=1e-12)
    np.testing.assert_allclose(intensity_values(ds, "footing_curvature"), [[0, 3e-3], [2e-3, 5e-3]])
    assert (movement_measure(ds), chosen_intensity(ds, None)) == ("central_deflection", "central_deflection")
    assert attributes(ds, "curvature")["units"] == "m-1"
    assert attributes(ds, "surface_movement") == {"units": "m", "long_name": "of the ground"}
    with pytest.raises(InputError, match=r"no variable 'surface_movement' with values; it has .*curvature"):
        chosen_intensity(ds, "surface_movement")
    ds["surface_movement"].values[0, 0] = 0.0
    assert movement_measure(ds) == "surface_movement"


def test_rules_to_stop_by_hand() -> None:
    assert (interim_sizes(8, 100), interim_sizes(8, 8), interim_sizes(64, 20)) == ([8, 16, 32, 64, 100], [8], [20])
    assert interim_confidence([8, 16, 32], 0.9, True) == pytest.approx(0.9 ** (1 / 3))
    assert interim_confidence([8], 0.9, False) == 0.9
    known = Estimate(0.4, 0.1, 0.3, 0.5, 0.9, 24, 24.0)  # value, error, lower, upper
    assert known.half_width == pytest.approx(0.1)
    rules = [
        ({"half_width": 0.1 + 1e-9}, True),
        ({"half_width": 0.099}, False),
        ({"relative_half_width": 0.251}, True),
        ({"relative_half_width": 0.249}, False),
    ]
    for width, met in rules:
        assert StopWhen(category=2, at="6 mm", **width).met(known) == met
    rule = StopWhen(category=2, at="6.5 mm", half_width=0.1)
    assert rule.name() == "P(category >= 2 at 6.5 mm)"
    assert StopWhen(category=3, quantity="median", half_width=0.1).name() == "median movement of category 3"
    assert not rule.met(known._replace(lower=-np.inf, upper=np.inf))
    for wrong in (
        {"at": 1.0},
        {"at": 1.0, "half_width": 0.1, "relative_half_width": 0.1},
        {"half_width": 0.1},
        {"at": 1.0, "half_width": 0.1, "quantity": "median"},
    ):
        with pytest.raises(InputError, match=r"study\.stop_when"):
            StopWhen(category=1, **wrong).check()
