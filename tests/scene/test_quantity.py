"""Numbers with units."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from damagepred.scene.quantity import to_si


@pytest.mark.parametrize(
    "text",
    [
        "",
        " ",
        "abc",
        "mm",  # a unit is no number: not 1 mm
        "m",
        "8 banana",
        "8,5 mm",  # a decimal comma must not become 85 mm
        "1,000 mm",
        "8 mm 3",
        "8 3 mm",
        "3 m + 2 mm",
        "3 + 2 mm",
        "8 mm # about",
        "--8 mm",
        "8 mm;",
        "1 m = 1",
        "__import__('os')",
        "lambda: 1",
        "()",
        "±",
        "8 e3 mm",
        "\N{SNOWMAN}",
    ],
)
def test_garbage_is_refused_with_an_example(text: str):
    with pytest.raises(ValueError, match=r"expected .*'8 mm'"):
        to_si(text, "m")


@pytest.mark.parametrize(
    "value",
    [math.nan, math.inf, -math.inf, "nan", "inf", "-inf", "infinity", "1e999", "1e999 m", 10**400, -(10**400)],
)
def test_must_be_finite(value: object):
    with pytest.raises(ValueError, match="finite"):
        to_si(value, "m")


@pytest.mark.parametrize("value", [True, False, None, [1.0], {"value": 1.0}, b"8 mm", 1j])
def test_other_types_are_refused(value: object):
    with pytest.raises(ValueError, match="expected a number in m"):
        to_si(value, "m")


@given(st.floats(min_value=-1e30, max_value=1e30))
def test_numbers_are_taken_as_they_are(value: float):
    assert to_si(value, "Pa") == value
    assert to_si(repr(value), "Pa") == value


@pytest.mark.parametrize("value", [1e300, -1e31, "1e40 MPa", 10**40])
def test_numbers_beyond_any_size_are_refused(value: object) -> None:
    with pytest.raises(ValueError, match="must be at most 1e"):
        to_si(value, "Pa")
