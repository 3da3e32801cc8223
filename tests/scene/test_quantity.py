"""Numbers with units."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from damagepred.scene.quantity import to_si

READ = {
    ("Pa", 453e3): "0.453 MPa; 0.453 N/mm2; 0.453 N/mm^2; 0.453 N/mm**2; 0.453 N/mm²",
    ("Pa/m", 82e9): "82 N/mm3; 82 MPa/mm",
    ("m", 8e-3): "8 mm; 8mm;   8   mm ; +8 mm",
    ("m", -8e-3): "-8 mm",
    ("m", 0.5): ".5 m",
    ("m", 5.0): "5. m",
    ("m", 1.0): "1e3 mm; 1E3 mm",
    ("m", 1e-3): "1e-3 m",
    ("Pa", 9e9): "9e9 Pa; 9E3MPa",
    ("N", 6000.0): "6 kN",
    ("N/m", 10.0): "10 N/m; 0.01 N/mm; 10 J/m2; 10 J/m^2; 0.01 kJ/m²",
    ("1", 0.3): "30 %; 30%",
    ("kg/m**3", 2000.0): "2000 kg/m3; 2 t/m3; 2 g/cm3",
    ("m", 0.3048): "1 ft",
    ("m", 0.0254): "1 inch",
    ("Pa", 0.45359237 * 9.80665 / 0.0254**2): "1 psi",
    ("1", 0.75): "0.75",  # no unit: SI
    ("Pa", 1e6): "1e6",
    ("m", 6.0): "6",
}


@pytest.mark.parametrize(("text", "unit", "value"), [(t, *of) for of, texts in READ.items() for t in texts.split("; ")])
def test_value_in_si(text: str, unit: str, value: float):
    assert to_si(text, unit) == pytest.approx(value, rel=1e-14, abs=0)


GARBAGE = (  # a unit is no number: not 1 mm; a decimal comma must not become 85 mm
    "| |abc|mm|m|8 banana|8,5 mm|1,000 mm|8 mm 3|8 3 mm|3 m + 2 mm|3 + 2 mm|8 mm # about|--8 mm|8 mm;|1 m = 1|"
    "__import__('os')|lambda: 1|()|±|8 e3 mm|\N{SNOWMAN}"
)


@pytest.mark.parametrize("text", GARBAGE.split("|"))
def test_garbage_is_refused_with_an_example(text: str):
    with pytest.raises(ValueError, match=r"expected .*'8 mm'"):
        to_si(text, "m")


@pytest.mark.parametrize(
    "value", [math.nan, math.inf, -math.inf, "nan", "inf", "-inf", "infinity", "1e999", "1e999 m", 10**400, -(10**400)]
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
