"""Numbers with units."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from damagepred.scene.quantity import to_si


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
