"""Numbers with units: SI inside; strings may have a unit."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated, Any

from pydantic import BeforeValidator, Field, GetCoreSchemaHandler
from pydantic_core import core_schema

_NUMBER_AND_UNIT = re.compile(
    r"\s*(?P<number>[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?)\s*"
    r"(?P<unit>(?!.*[^\W\d_]\s+\d)[^\W\d_][\w\s/*^·()⁻-]*|%)\s*"
)


@lru_cache(maxsize=1)
def _registry() -> Any:
    import pint  # only for strings with a unit: it takes a third of a second

    return pint.UnitRegistry()


COMMON = {
    "m": {"m": 1.0, "mm": 1e-3, "cm": 1e-2},
    "Pa": {"Pa": 1.0, "kPa": 1e3, "MPa": 1e6, "GPa": 1e9, "N/mm2": 1e6},
    "Pa/m": {"Pa/m": 1.0, "N/mm3": 1e-3**-3, "MPa/mm": 1e9, "kPa/m": 1e3, "MPa/m": 1e6},
    "kg/m**3": {"kg/m3": 1.0},
    "N": {"N": 1.0, "kN": 1e3},
    "N/m": {"N/m": 1.0, "kN/m": 1e3},
    "s": {"s": 1.0, "ms": 1e-3},
    "m/s": {"m/s": 1.0, "mm/s": 1e-3, "cm/s": 1e-2},
    "m/s**2": {"m/s2": 1.0, "mm/s2": 1e-3, "cm/s2": 1e-2},
    "1": {"%": 1e-2},
}
"""Frequent units by SI unit, with the factors of pint, which takes half a second to load."""

LARGEST = 1e30  # limit of numbers (SI): products of two are far from overflow


def is_number(text: str) -> bool:
    """Whether a text is a number without a unit."""
    try:
        float(text)
    except ValueError:
        return False
    return True


def to_si(value: Any, unit: str) -> float:
    """Number in SI: a number is SI, a string may have a unit of the right dimension ("8 mm"); otherwise ValueError."""
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        raise ValueError(f"expected a number{_of(unit)} or a string with a unit")
    try:
        number = _parse(value, unit) if isinstance(value, str) else float(value)
    except OverflowError:  # integers have any number of digits
        number = math.inf
    if not math.isfinite(number):
        raise ValueError("must be a finite number")
    if abs(number) > LARGEST:
        raise ValueError(f"must be at most {LARGEST:g}{_of(unit)}, whatever its sign")
    return number


def unit_in(value: Any) -> str:
    """Unit that a user wrote behind a number, empty without one."""
    parts = _NUMBER_AND_UNIT.fullmatch(value) if isinstance(value, str) else None
    return parts["unit"].strip() if parts else ""


def _of(unit: str) -> str:
    return "" if unit == "1" else f" in {unit}"


def _parse(text: str, unit: str) -> float:
    try:
        return float(text)
    except ValueError:
        pass
    # pint would read "8,5 mm" as 85 mm, "1e6" as a power of e, and "mm" as 1 mm
    parts = _NUMBER_AND_UNIT.fullmatch(text)
    if parts is None:
        raise ValueError(f"is not a number with a unit; expected something like {_example(unit)}")
    number = float(parts["number"])
    if (factor := COMMON.get(unit, {}).get(parts["unit"].strip())) is not None:
        return number * factor
    if unit == "m/s**2" and parts["unit"].strip() == "g":  # standard gravity, not gram
        return number * 9.80665
    import pint

    registry = _registry()
    try:
        # "N/mm3" is how engineers write "N/mm**3"
        written = registry.Quantity(1.0, re.sub(r"(?<=[A-Za-z])(\d)", r"**\1", parts["unit"]))
        if unit == "1" and written.to_root_units().units == registry.radian:
            raise ValueError("is an angle, where a pure number is due; a friction is the tangent of its angle")
        return float((number * written).to("dimensionless" if unit == "1" else unit).magnitude)
    except ValueError:
        raise
    except pint.DimensionalityError as error:
        raise ValueError(f"has the wrong kind of unit; expected one like {_example(unit)}") from error
    except Exception as error:  # pint raises tokenizer, syntax, attribute and assertion errors
        raise ValueError(f"is not a number with a unit; expected something like {_example(unit)}") from error


def _example(unit: str) -> str:
    examples = {
        "m": "'8 mm'",
        "Pa": "'0.453 MPa'",
        "Pa/m": "'82 N/mm3'",
        "kg/m**3": "'2000 kg/m3'",
        "N": "'6 kN'",
        "N/m": "'10 N/m'",
        "s": "'20 ms'",
        "year": "'6 months'",
        "Hz": "'5 Hz'",
        "m/s": "'10 mm/s'",
        "m/s**2": "'3 m/s2'",
    }
    return examples.get(unit, "0.5 or '50 %'" if unit == "1" else f"a number in {unit}")


@dataclass(frozen=True)
class Quantity:
    """Mark of a number of a given SI unit ("1" for pure numbers): ``Annotated[float, Quantity("m")]``."""

    unit: str

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> core_schema.CoreSchema:
        """Convert to SI before pydantic checks the bounds of the field."""
        return core_schema.no_info_before_validator_function(lambda value: to_si(value, self.unit), handler(source))


def _whole(value: Any) -> Any:
    if isinstance(value, bool):
        raise ValueError("expected a whole number")
    return value


Count = Annotated[int, BeforeValidator(_whole), Field(ge=-(2**63), le=2**63 - 1)]
# bounds of physical possibility and of solvable equations
Length = Annotated[float, Quantity("m"), Field(ge=-1e4, le=1e4)]
Pressure = Annotated[float, Quantity("Pa"), Field(ge=-1e16, le=1e16)]
Stiffness = Annotated[float, Quantity("Pa/m"), Field(ge=1e-3, le=1e18)]
Density = Annotated[float, Quantity("kg/m**3"), Field(le=1e5)]
Force = Annotated[float, Quantity("N"), Field(ge=-1e12, le=1e12)]
LineLoad = Annotated[float, Quantity("N/m"), Field(ge=-1e12, le=1e12)]
FractureEnergy = Annotated[float, Quantity("N/m"), Field(le=1e12)]
Moment = Annotated[float, Quantity("N*m"), Field(le=1e12)]
SpringStiffness = Annotated[float, Quantity("N/m"), Field(ge=1e-3, le=1e18)]
Pure = Annotated[float, Quantity("1"), Field(ge=-1e15, le=1e15)]
Duration = Annotated[float, Quantity("s"), Field(le=1e9)]
Years = Annotated[float, Quantity("year"), Field(le=1e4)]
Frequency = Annotated[float, Quantity("Hz"), Field(le=1e9)]
Speed = Annotated[float, Quantity("m/s"), Field(ge=-1e4, le=1e4)]
Acceleration = Annotated[float, Quantity("m/s**2"), Field(ge=-1e6, le=1e6)]
