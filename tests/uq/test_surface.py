"""Fragility surfaces: true values, a general optimiser, coverage, and cases without a surface."""

import numpy as np
import pytest
import xarray as xr

from damagepred.cli.sentences import surface_lines
from damagepred.errors import InputError
from damagepred.plotting import draw_fragility
from damagepred.uq.fragility import fit_fragility, fit_surface
from tests.uq.test_fragility import study

EXPONENT, SCATTER, AT_ONE = 0.8, 0.3, 8.0


def walls(seed: int, count: int = 200, end: float = 20.0, increments: int = 40) -> xr.Dataset:
    """Capacity 8 mm times (strength / MPa)^0.8, lognormal about it."""
    random = np.random.default_rng(seed)
    strength = np.exp(0.4 * random.standard_normal(count))
    capacity = AT_ONE * strength**EXPONENT * np.exp(SCATTER * random.standard_normal(count))
    ds = study(capacity, end=end, increments=increments)
    words = {"units": "Pa", "long_name": "sampled input joint.tensile_strength", "role": "input"}
    return ds.assign({"joint.tensile_strength": ("sample", 1e6 * strength, words)})


def test_the_share_explained_by_the_second_variable() -> None:
    ds = walls(3, 400)
    found = fit_surface(ds, 1, "joint.tensile_strength", bootstrap=0)
    assert float(found["dispersion"]) == pytest.approx(SCATTER, rel=0.12)
    assert float(found["dispersion_alone"]) == pytest.approx(np.hypot(SCATTER, 0.4 * EXPONENT), rel=0.12)
    assert found.attrs["aic_with"] < found.attrs["aic_without"] - 50
    alone = float(fit_fragility(ds, categories=[1], bootstrap=0)["dispersion"][0])
    assert float(found["dispersion_alone"]) == pytest.approx(alone, rel=1e-9)
    other = np.random.default_rng(4).uniform(4.0, 8.0, 400)
    ds = ds.assign({"wall.length": ("sample", other, {"units": "m"})})
    idle = fit_surface(ds, 1, "wall.length", bootstrap=100)
    assert idle["slope_lower"] < 0 < idle["slope_upper"]
    assert idle.attrs["aic_with"] > idle.attrs["aic_without"] - 4


def test_a_median_beyond_the_movement_is_a_lower_bound() -> None:
    found = fit_surface(walls(11, 200, end=5.0), 1, "joint.tensile_strength", bootstrap=40)
    beyond = np.isfinite(found["median_extrapolated"].values)
    assert 0 < beyond.sum() < beyond.size
    assert np.isnan(found["median"].values[beyond]).all()
    assert (found["median_lower_bound"].values[beyond] == 5.0).all()
    assert (found["median_extrapolated"].values[beyond] > 5.0).all()
    assert np.isinf(found["median_upper"].values[beyond]).all()
    assert (found["median_lower"] <= found["median"].fillna(found["median_lower_bound"])).all()
    assert str(found["fit_status"].values) == "fitted"
    idle = np.random.default_rng(4).uniform(4.0, 8.0, 200)
    short = fit_surface(walls(11, 200, end=4.0).assign({"wall.length": ("sample", idle)}), 1, "wall.length")
    assert str(short["fit_status"].values) == "extrapolated"
    assert (short["median_lower_bound"] == 4.0).all()
    assert "lower bounds" in surface_lines(short)[0]
    assert "power" in draw_fragility(short).get_title(loc="left")


def test_walls_damaged_before_any_movement_leave_the_others_their_surface() -> None:
    ds = walls(12, 300)
    some = ds.copy(deep=True)
    some["damage_category"][:12] = 1
    found = fit_surface(some, 1, "joint.tensile_strength", bootstrap=40)
    rest = fit_surface(ds.isel(sample=slice(12, None)), 1, "joint.tensile_strength", bootstrap=0)
    assert str(found["fit_status"].values) == "fitted"
    assert float(found["share_at_start"]) == pytest.approx(0.04)
    assert 0 < float(found["share_at_start_lower"]) < 0.04 < float(found["share_at_start_upper"]) < 0.08
    assert float(found["slope"]) == pytest.approx(float(rest["slope"]), rel=1e-6)
    assert (found["probability"][:, 0] == found["share_at_start"]).all()
    assert int(found["reached"]) == int(rest["reached"]) + 12
    assert (found["probability_lower"] <= found["probability"]).all()
    assert "0.04 of the samples" in surface_lines(found)[0]


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("joint.tensile", "no such variable with one number per sample; sampled inputs are joint.tensile_strength"),
        ("damage_category", "no such variable"),
        ("same", "does not vary"),
    ],
)
def test_what_is_no_second_variable(name: str, words: str) -> None:
    ds = walls(8, 30).assign(same=("sample", np.ones(30)))
    with pytest.raises(InputError, match=words):
        fit_surface(ds, 1, name)
