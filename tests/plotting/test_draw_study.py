import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray as xr

from damagepred.errors import InputError
from damagepred.plotting import draw_comparison, draw_fragility, draw_sensitivity
from tests.plotting.test_whole_pictures import comparison


def legend(ax):
    return [text.get_text() for text in ax.get_legend().get_texts()]


@pytest.mark.parametrize(
    ("units", "factor", "shown"),
    [("Pa", 1e-6, "MPa"), ("m", 1.0, "m"), ("Pa m-1", 1e-9, "GPa/m"), ("1", 1.0, ""), ("kg m-3", 1.0, "kg m-3")],
)
def test_a_surface_is_drawn_with_its_units(units, factor, shown):
    second, x = np.array([2.0, 3.5, 7.0]), np.array([1e-3, 4e-3, 9e-3, 20e-3])
    surface = xr.Dataset(
        (
            {"probability": (("second", "intensity"), np.linspace(0.0, 0.95, 12).reshape(3, 4))}
            | {"median": ("second", 1e-3 * second), "median_lower": ("second", 0.8e-3 * second)}
            | {"median_upper": ("second", 1.3e-3 * second), "slope": 1.25, "slope_lower": 0.75, "slope_upper": 1.5}
            | {"dispersion": 0.35, "dispersion_alone": 0.45, "fit_status": "fitted"}
        ),
        {"second": ("second", second, {"units": units}), "intensity": ("intensity", x, {"units": "m"})},
        (
            {"category": 2, "category_name": "very_slight", "second_variable": "joint.normal_stiffness"}
            | {"samples": 60, "samples_failed": 4, "confidence": 0.8, "scale": "log"}
            | {"intensity_measure": "central_deflection", "title": "soft mortar"}
        ),
    )
    ax = draw_fragility(surface)
    lower, upper = ax.lines
    assert lower.get_xdata() == pytest.approx(0.8 * second)
    assert upper.get_xdata() == pytest.approx(1.3 * second)
    assert lower.get_ydata() == pytest.approx(factor * second)
    assert ax.get_xlim() == pytest.approx((1.0, 20.0))
    assert ax.get_ylim() == pytest.approx((2.0 * factor, 7.0 * factor))
    assert ax.get_xlabel() == "central deflection (mm)"
    assert ax.get_ylabel() == "joint, normal stiffness" + (f" ({shown})" if shown else "")
    assert legend(ax) == ["probability 0.5", "0.1 and 0.9", "80% band of the median"]
    words = ax.get_title(loc="left").replace("\n", " ")
    assert words == (
        "Soft mortar category 2 (very slight) or worse; 60 walls, 4 of them failed; median goes with its power 1.25 "
        "(0.75 to 1.50); dispersion 0.35, 0.45 without it"
    )
    surface.attrs["scale"] = "linear"
    words = draw_fragility(surface).get_title(loc="left").replace("\n", " ")
    assert "ln(median) changes by 1.25 per unit" in words


def test_medians_of_curves_have_the_unit_of_the_measure(curves):
    bent = curves.assign_coords(intensity=("intensity", curves.intensity.values, {"units": "m-1"}))
    bent.attrs |= {"intensity_measure": "curvature", "model": "common"}
    ax = draw_fragility(bent)
    assert ax.get_xlabel() == "curvature (1/m)"
    assert legend(ax)[0] == "category 1 (very slight): median 0.01 1/m, dispersion 0.40"


def test_a_comparison_is_drawn_on_axes_that_are_given() -> None:
    own = plt.subplots(2)[1]
    assert draw_comparison(comparison(), 1, list(own))[0] is own[0]


def test_other_datasets_are_refused(curves):
    with pytest.raises(InputError, match="a comparison of studies"):
        draw_comparison(curves, 1)
    with pytest.raises(InputError, match="study_sensitivity"):
        draw_sensitivity(curves)
