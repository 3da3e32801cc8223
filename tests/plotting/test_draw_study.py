from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray as xr

from damagepred.errors import InputError
from damagepred.plotting import draw_category_shares, draw_comparison, draw_fragility, draw_sensitivity
from damagepred.plotting.study import common_paths
from damagepred.uq.comparison import compare
from tests.analyses.test_variance_shares import crossed_walls
from tests.uq.test_comparison import study


def band(ax, label):
    """Return height of a filled band at each deflection, from its polygon."""
    (found,) = (c for c in ax.collections if c.get_label() == label)
    corners = found.get_paths()[0].vertices
    return {round(x, 6): np.ptp(corners[np.isclose(corners[:, 0], x), 1]) for x in np.unique(corners[:, 0])}


def test_shares_add_up_and_show_what_is_not_known(study):
    ax = draw_category_shares(study)
    paths = common_paths(study)
    unknown = band(ax, "failed, not run, or not followed as far")
    slight = band(ax, "2 slight")
    for i, x in enumerate(paths.movement * 1e3):
        assert unknown[round(x, 6)] == pytest.approx((paths.category[:, i] == -1).mean())
        assert slight[round(x, 6)] == pytest.approx((paths.category[:, i] == 2).mean())
    assert ax.get_ylim() == (0.0, 1.0)
    assert "(mm)" in ax.get_xlabel()


def legend(ax):
    return [text.get_text() for text in ax.get_legend().get_texts()]


def test_shares_of_walls_are_points_at_the_increments_and_bands_are_straight_between_them(curves):
    """Of walls that are known at the increments alone, a step or a rectangle would tell where between them."""
    curves["empirical"] = curves["probability"].fillna(0.0)
    curves.attrs["movements"] = np.array([0.0, 10e-3, 20e-3, 40e-3])
    ax = draw_fragility(curves)
    points = [line for line in ax.lines if line.get_linestyle() == "None"]
    assert len(points) == 3
    at = [0, 5, 10, 20]
    for line, share in zip(points, curves["empirical"].values):
        assert line.get_xdata() == pytest.approx([0.0, 10.0, 20.0, 40.0])
        assert line.get_ydata() == pytest.approx(share[at])
    assert "points: shares of the walls" in ax.get_title(loc="left")
    curves["fit_status"] = "category", ["empirical"] * 3
    ax = draw_fragility(curves)
    assert not [line for line in ax.lines if line.get_drawstyle() != "default"]
    assert ax.lines[0].get_xdata() == pytest.approx(1e3 * curves["intensity"].values[at])
    band = ax.collections[0].get_paths()[0].vertices
    assert sorted(set(band[:, 0].round(6))) == [0.0, 10.0, 20.0, 40.0]


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


def test_bands_and_medians_of_curves_are_drawn_in_their_unit(curves):
    curves["probability_upper"] = np.minimum(1.1 * curves["probability"], 1.0)  # not as far above as below
    ax = draw_fragility(curves)
    for number, filled in enumerate(ax.collections):
        corners = filled.get_paths()[0].vertices
        at = np.isclose(corners[:, 0], 20.0)
        one = curves.isel(category=number, intensity=10)
        assert curves.intensity.values[10] == pytest.approx(20e-3)
        ends = [float(one["probability_lower"]), float(one["probability_upper"])]
        assert [corners[at, 1].min(), corners[at, 1].max()] == pytest.approx(ends)
    assert ax.get_xlim() == pytest.approx((0.0, 40.0))
    bent = curves.assign_coords(intensity=("intensity", curves.intensity.values, {"units": "m-1"}))
    bent.attrs |= {"intensity_measure": "curvature", "model": "common"}
    ax = draw_fragility(bent)
    assert ax.get_xlabel() == "curvature (1/m)"
    assert legend(ax)[0] == "category 1 (very slight): median 0.01 1/m, dispersion 0.40"
    assert "one dispersion for all categories" in ax.get_title(loc="left")


def test_lines_are_probabilities_and_their_differences() -> None:
    common = np.random.default_rng(3).standard_normal(80)
    studies = {"as it is": study(0.5, common, movement=(0.005, 0.01)), "stiffer": study(0.2, common)}
    found = compare(studies, categories=[1], at=[0.005, 0.01])
    upper, lower = draw_comparison(found, 1)
    for k, line in enumerate(upper.get_lines()):
        np.testing.assert_allclose(line.get_xdata(), [5.0, 10.0])
        np.testing.assert_allclose(line.get_ydata(), found["probability"][k, 0])
    np.testing.assert_allclose(lower.get_lines()[0].get_ydata(), found["difference"][1, 0])
    assert upper.get_xlabel() == "central deflection (mm)"
    assert "80 pairs" in lower.get_title(loc="left")
    own = plt.subplots(2)[1]
    assert draw_comparison(found, 1, list(own))[0] is own[0]
    with pytest.raises(InputError, match="a comparison of studies"):
        draw_comparison(studies["stiffer"], 1)


def test_other_datasets_are_refused():
    ds = crossed_walls(30, 0.4, 0.2)
    with pytest.raises(InputError, match="study_sensitivity"):
        draw_sensitivity(ds)
