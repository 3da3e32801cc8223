import numpy as np
import pytest
import xarray as xr
from scipy import special

NAMES = ("very_slight", "slight", "moderate", "severe")


def curves_of(median: list[float], dispersion: list[float], measure: str = "deflection_ratio") -> xr.Dataset:
    """Curves as fit_fragility returns them, with given parameters; a NaN median is a category without a curve."""
    m, b, count = np.array(median), np.array(dispersion), len(median)
    grid = np.linspace(0.0, 1.5 * np.nanmax(m, initial=0.0), 31)
    with np.errstate(divide="ignore"):
        probability = special.ndtr((np.log(grid) - np.log(m)[:, None]) / b[:, None])
    status = np.where(np.isfinite(m), "fitted", "never reached")
    each, both = ("category",), ("category", "intensity")
    return xr.Dataset(
        {
            "probability": (both, probability),
            "probability_lower": (both, probability * 0.9),
            "probability_upper": (both, np.minimum(probability * 1.1, 1.0)),
            "empirical": (both, np.round(probability, 1)),
            "median": (each, m),
            "dispersion": (each, b),
            "fit_status": (each, status),
        },
        coords={
            "category": np.arange(1, count + 1),
            "category_name": (each, np.array(NAMES[:count])),
            "intensity": ("intensity", grid, {"units": "1" if measure == "deflection_ratio" else "m"}),
        },
        attrs={"title": "fragility of a wall", "intensity_measure": measure},
    )


@pytest.fixture
def ratios() -> xr.Dataset:
    return curves_of([1 / 900, 1 / 500, 1 / 320, 1 / 220], [0.42] * 4)


@pytest.fixture
def deflections() -> xr.Dataset:
    return curves_of([6.5e-3, 12e-3, 18.5e-3], [0.35] * 3, "central_deflection")
