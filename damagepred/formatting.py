"""Numbers as engineers write them."""

from __future__ import annotations

import math
import re
from typing import Any

_SCALES: dict[str, tuple[tuple[float, str], ...]] = {
    "m": ((1.0, "m"), (1e-3, "mm")),
    "Pa": ((1e9, "GPa"), (1e6, "MPa"), (1e3, "kPa"), (1.0, "Pa")),
    "N": ((1e3, "kN"), (1.0, "N")),
    "N*m": ((1e3, "kN m"), (1.0, "N m")),
    "s": ((1.0, "s"), (1e-3, "ms")),
    "Pa/m": ((1e9, "N/mm³"),),
    "kg/m**3": ((1.0, "kg/m³"),),
    "m/s**2": ((1.0, "m/s²"),),
    "1": ((1.0, "–"),),
}
"""Units by size, the largest first: the first that leaves a number of 0.1 or more is taken, or the last."""


def number(value: float, digits: int = 4) -> str:
    """Number with a few significant figures, without an exponent where that is legible."""
    if not math.isfinite(value):
        return "–" if math.isnan(value) else "∞"
    text = f"{value:.{digits}g}"
    if "e" in text and 1e-4 <= abs(value) < 1e7:
        text = f"{float(text):f}".rstrip("0").rstrip(".")
    return text.replace("-", "−")


def suitable_unit(value: float, unit: str) -> tuple[float, str]:
    """Size in SI and name of the unit in which engineers write a number in SI."""
    scales = _SCALES.get(unit, ((1.0, unit),))
    return next((scale for scale in scales if abs(value) >= 0.1 * scale[0]), scales[-1])


def quantity(value: float, unit: str) -> tuple[str, str]:
    """Number in SI and its unit as engineers write both."""
    size, shown = suitable_unit(value, unit)
    return number(value / size), shown


def length(value: float) -> str:
    """Movement or width (m) in mm with its unit."""
    return f"{number(1e3 * value, 3)} mm" if math.isfinite(value) else "–"


def counted(words: str, houses: bool) -> str:
    """Words about the samples of a study, which are walls or houses."""
    return (
        re.sub(r"\b([Ww])all(?=s?\b(?!\.\w))", lambda w: "House" if w[1] == "W" else "house", words)
        if houses
        else words
    )


def ratio(value: float) -> str:
    """Deflection ratio as engineers write it, such as 1/300."""
    return f"1/{1 / value:.0f}" if math.isfinite(value) and value > 0 else number(value)


def chance(value: float) -> str:
    """Probability as text; "< 0.001" or "> 0.999" where rounding would give 0 or 1."""
    if not math.isfinite(value):
        return "–"
    if 0 < value < 0.001:
        return "< 0.001"
    if 0.999 < value < 1:
        return "> 0.999"
    return f"{value:.3f}" if 0 < value < 0.0995 or 0.9905 < value < 1 else f"{value:.2f}"


def with_band(value: str, low: str, high: str, between: str = " ") -> str:
    """Number with its confidence interval, if there is one that tells more."""
    if "–" in (value, low, high) or value == low == high:
        return value
    band = f"({low} to {high})"
    return f"{value}{between}{band if between == ' ' else band.replace(' ', chr(0xA0))}"


def plain(value: Any) -> str:
    """Setting that is no quantity."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return number(value)
    if isinstance(value, list | tuple):
        return ", ".join(plain(v) for v in value)
    if isinstance(value, dict):
        return ", ".join(f"{key} {plain(v)}" for key, v in value.items())
    return str(value).replace("_", " ")


def named(word: str) -> str:
    """Name of the archive or the scene file in plain words."""
    return word.replace("_", " ")


def duration(seconds: float) -> str:
    """Time (s) with the unit that suits it."""
    if seconds < 90:
        return f"{seconds:.0f} s" if seconds >= 10 else f"{seconds:.1f} s"
    if seconds < 5400:
        return f"{seconds / 60:.0f} min"
    return f"{seconds / 3600:.1f} h"
