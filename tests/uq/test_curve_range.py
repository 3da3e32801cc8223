"""Range of a curve, walls damaged before any movement, and counts of walls: each wall is counted once."""

from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from scipy import special

from damagepred.enumerations import SampleStatus
from damagepred.errors import InputError
from damagepred.exports import export_curves
from damagepred.exports.frames import curves_frame
from damagepred.plotting.fragility import draw_fragility
from damagepred.uq.exceedance import exceedance
from damagepred.uq.fragility import fit_fragility, fit_surface
from tests.uq.test_fragility import fail, lognormal, study


def few() -> xr.Dataset:
    """Five of 60 walls damaged by 10: what was exported with a median of metres."""
    random = np.random.default_rng(5)
    return study(np.append(random.uniform(0.5, 10.0, 5), np.full(55, 99.0)), end=10.0, increments=20)


def test_a_median_beyond_the_movement_is_a_lower_bound(tmp_path: Path) -> None:
    curves = fit_fragility(few(), categories=[1], bootstrap=50)
    one = curves.isel(category=0)
    assert str(one["fit_status"].values) == "extrapolated"
    assert np.isnan(one["median"])
    assert float(one["median_lower_bound"]) == float(curves["intensity"][-1]) == 10.0
    assert float(one["median_lower"]) <= 10.0 < float(one["median_extrapolated"])
    assert float(one["median_upper"]) == np.inf
    assert 0 < float(one["probability"][-1]) < 0.5
    for kind in ("pelicun", "openquake", "openquake-discrete"):
        with pytest.raises(InputError, match=r"its median lies beyond the largest movement"):
            export_curves(curves, kind, tmp_path / "c.nc")
        assert export_curves(curves, kind, tmp_path / "c.nc", extrapolated=True)
    assert set(curves_frame(curves)["fit_status"]) == {"extrapolated"}
    (handle,) = draw_fragility(curves.assign_coords(category_name=("category", ["slight"]))).get_legend().get_texts()
    assert "median beyond" in handle.get_text()
    inside = fit_fragility(study(lognormal(np.random.default_rng(1), 5.0, 0.4, 60), end=10.0), categories=[1])
    assert str(inside["fit_status"].values[0]) == "fitted"
    assert np.isnan(inside["median_extrapolated"].values).all()
    assert np.isnan(inside["median_lower_bound"].values).all()


def test_older_curves_beyond_the_movement_are_refused_too(tmp_path: Path) -> None:
    older = fit_fragility(few(), categories=[1], bootstrap=0)
    older["median"] = older["median_extrapolated"]
    older = older.drop_vars(["median_extrapolated", "median_lower_bound", "share_at_start"]).assign(
        fit_status=("category", ["fitted"])
    )
    with pytest.raises(InputError, match=r"its median lies beyond"):
        export_curves(older, "pelicun", tmp_path / "c.nc")


@pytest.mark.parametrize("model", ["separate", "common"])
def test_a_wall_damaged_before_any_movement_does_not_prevent_a_curve(model: str, tmp_path: Path) -> None:
    random = np.random.default_rng(2)
    others = lognormal(random, 8.0, 0.4, 99)[:, None] * np.array([1.0, 1.5])
    two, rest = (study(values, end=30.0, increments=30) for values in (np.vstack((others, [0.0, 5.0])), others))
    curves = fit_fragility(two, categories=[1, 2], model=model, bootstrap=50)
    alone = fit_fragility(rest, categories=[1, 2], model=model, bootstrap=50)
    one = curves.isel(category=0)
    assert str(one["fit_status"].values) == "fitted"
    assert float(one["share_at_start"]) == 0.01
    assert 0 < float(one["share_at_start_lower"]) < 0.01 < float(one["share_at_start_upper"]) < 0.06
    if model == "separate":
        assert float(one["median"]) == pytest.approx(float(alone["median"][0]), rel=1e-6)
    phi = special.ndtr(np.log(curves["intensity"].values[1:] / float(one["median"])) / float(one["dispersion"]))
    np.testing.assert_allclose(one["probability"][1:], 0.01 + 0.99 * phi, rtol=1e-12)
    assert float(one["probability"][0]) == 0.01
    assert float(curves["share_at_start"][1]) == 0.0
    assert "1 wall reached it before any movement" in str(one["fit_note"].values)
    assert (one["probability_lower"] <= one["probability"]).all()
    with pytest.raises(InputError, match=r"0\.01 of the walls are in it before any movement"):
        export_curves(curves, "openquake", tmp_path / "c.nc")


@pytest.mark.parametrize("model", ["separate", "common", "empirical"])
@pytest.mark.parametrize("walls", [30, 20])
def test_walls_damaged_before_any_movement_are_no_reason_of_never(model: str, walls: int) -> None:
    """All of 30 walls, or 20 of 30 of which none of the others follows: the curve is flat, and the reason is said."""
    ds = study(np.where(np.arange(30) < walls, 0.0, 99.0), end=10.0)
    one = fit_fragility(ds, categories=[1], model=model, bootstrap=20).isel(category=0)
    assert int(one["reached"]) == walls
    if model == "empirical":
        assert str(one["fit_status"].values) == "empirical"
    else:
        assert str(one["fit_status"].values).startswith("all walls that reached it had before any movement")
        assert float(one["share_at_start"]) == walls / 30
    if walls == 30 or model == "empirical":
        np.testing.assert_allclose(one["probability"], walls / 30)
        assert exceedance(ds, 1, 5.0).estimate.value == pytest.approx(walls / 30)


WALLS = 60


def fitted(ds: xr.Dataset) -> list[xr.Dataset]:
    return [
        fit_fragility(ds, bootstrap=0, categories=[1]).isel(category=0),
        fit_fragility(ds, bootstrap=0, categories=[1, 2]).isel(category=0),
        fit_surface(ds, 1, "joint.friction", bootstrap=0, points=(5, 3)),
    ]


@pytest.mark.parametrize("weighted", [False, True])
@pytest.mark.parametrize(
    ("failing", "missing", "at_start", "expected"),
    [
        ((), (), 0, (40, 20, 0)),
        ((5, 45, 50), (), 0, (39, 18, 3)),  # a wall that failed before its category, two that had not reached it
        ((), (2, 59), 0, (39, 19, 0)),
        ((5, 45), (2, 59), 3, (38, 18, 2)),
        ((0,), (), 3, (40, 20, 0)),  # it failed after it had reached the category
    ],
)
def test_each_wall_is_counted_once(weighted, failing, missing, at_start, expected) -> None:
    """Capacities of 1 to 60 mm, movement to 40 mm: 40 walls reach category 1."""
    ds = study(np.column_stack((np.arange(1.0, WALLS + 1), 50 + np.arange(WALLS))), end=40.0, increments=40)
    ds["joint.friction"] = "sample", np.random.default_rng(1).uniform(0.5, 1.0, WALLS)
    ds["damage_category"][:at_start] = 1
    for wall in failing:
        fail(ds, wall, 4)
    for wall in missing:
        ds["damage_category"][wall] = -1
        ds["status"][wall] = SampleStatus.MISSING
    if weighted:
        ds["weight"] = "sample", 1.0 + np.arange(WALLS) % 3
    for found in fitted(ds):
        counts = tuple(int(found[name]) for name in ("reached", "not_reached", "failed"))
        assert counts == expected
        assert sum(counts) == WALLS - len(missing)
