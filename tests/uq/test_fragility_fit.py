"""Goodness of fit of curves, and their measures of movement."""

import numpy as np
import pytest
import xarray as xr
from scipy import stats

from damagepred.errors import InputError
from damagepred.uq.fragility import fit_fragility, fit_lognormal, turnbull
from damagepred.uq.fragility.fit import group_intervals
from damagepred.uq.fragility.goodness import akaike_criterion, distance
from damagepred.uq.intensity import intensity_values
from tests.uq.test_fragility import lognormal, study
from tests.uq.test_fragility_single import study as single_study


def test_distance_is_kolmogorov_s_of_exactly_known_capacities() -> None:
    values = lognormal(np.random.default_rng(1), 8.0, 0.5, 60)
    fit = fit_lognormal(values, values)
    expected = stats.kstest(values, stats.lognorm(s=fit.dispersion, scale=fit.median).cdf).statistic
    found = distance(fit, turnbull(values, values))
    assert found == pytest.approx(expected, abs=2e-3)  # masses are known to the bound on the likelihood


@pytest.mark.parametrize("kind", ["shared increments", "own increments", "one movement a wall"])
def test_lognormal_walls_are_not_refused_and_others_are(kind: str) -> None:
    chances = []
    for shape in ("lognormal", "two kinds"):
        random = np.random.default_rng(5)
        capacity = lognormal(random, 8.0, 0.3, 150)
        if shape == "two kinds":  # weak and strong, nothing between
            capacity = np.where(random.random(150) < 0.5, 3.0, 15.0) * np.exp(0.1 * random.standard_normal(150))
        if kind == "one movement a wall":
            movement = random.uniform(1, 25, 150)
            ds = single_study(movement, movement >= capacity)
        else:
            end = 25.0 if kind == "shared increments" else random.uniform(20, 30, 150)
            ds = study(capacity, end=end, increments=25)
        curve = fit_fragility(ds, categories=[1], bootstrap=0, goodness=19).isel(category=0)
        chances.append(float(curve["p_value"]))
    assert chances[0] > 0.1
    assert chances[1] == pytest.approx(1 / 20)


def test_the_criterion_counts_parameters_where_the_likelihood_is_right() -> None:
    """One category, many walls: minus twice the log-likelihood and nearly 2 x 2."""
    values = lognormal(np.random.default_rng(2), 8.0, 0.5, 4000)
    cells = group_intervals(values[None], values[None], np.ones(4000))
    x = np.log(values)
    least = -2 * stats.norm.logpdf(x, x.mean(), x.std()).sum()
    assert akaike_criterion(cells, False) == pytest.approx(least + 4, abs=0.5)
    assert akaike_criterion(cells, True) == pytest.approx(akaike_criterion(cells, False), rel=1e-9)


# -- what they are drawn against ---------------------------------------------------------------------------------------


def arched(length: np.ndarray) -> xr.Dataset:
    """Walls of other lengths, all damaged at a curvature of the footing of 1/1000 m, more or less."""
    random = np.random.default_rng(3)
    critical = 1e-3 * np.exp(0.2 * random.standard_normal(len(length)))
    deflection = np.linspace(0.0, 0.02, 41) * np.ones((len(length), 1))
    curvature = 8 * deflection / length[:, None] ** 2
    both = ("sample", "increment")
    return xr.Dataset(
        {
            "damage_category": (both, (curvature >= critical[:, None]).astype(np.int8)),
            "status": ("sample", np.zeros(len(length), dtype=np.int8)),
            "central_deflection": (both, deflection, {"units": "m"}),
            "deflection_ratio": (both, deflection / length[:, None], {"units": "1"}),
        },
        attrs={"highest_category": 1},
    )


def test_curvature_is_that_of_the_arc() -> None:
    length = np.random.default_rng(1).uniform(4.0, 9.0, 200)
    ds = arched(length)
    np.testing.assert_allclose(
        intensity_values(ds, "curvature"), 8 * ds["central_deflection"].values / length[:, None] ** 2, rtol=1e-12
    )
    assert (intensity_values(ds, "curvature")[:, 0] == 0).all()
    curves = fit_fragility(ds, intensity="curvature", bootstrap=0)
    assert curves["intensity"].attrs["units"] == "m-1"
    assert float(curves["median"][0]) == pytest.approx(1e-3, rel=0.05)
    assert float(curves["dispersion"][0]) == pytest.approx(0.2, rel=0.15)
    # against the deflection the walls' lengths scatter, too
    assert float(fit_fragility(ds, bootstrap=0)["dispersion"][0]) > 0.35


def test_the_footing_s_largest_curvature_is_read_where_there_are_sections() -> None:
    ds = arched(np.full(20, 6.0))
    section = np.zeros((20, 41, 3))
    section[:, :, 1] = -3.0 * intensity_values(ds, "curvature")
    with pytest.raises(InputError, match="no variable 'footing_curvature' with values; it has central_deflection"):
        fit_fragility(ds, intensity="footing_curvature")
    ds = ds.assign(section_curvature=(("sample", "increment", "section"), section, {"units": "m-1"}))
    curves = [fit_fragility(ds, intensity=m, bootstrap=0) for m in ("footing_curvature", "curvature")]
    assert float(curves[0]["median"][0]) == pytest.approx(3 * float(curves[1]["median"][0]), rel=1e-9)


@pytest.mark.parametrize(
    ("kind", "mound", "share"),
    [
        ("doming", 'shape = "walsh"', 0.7),
        ("dishing", 'shape = "walsh"', 0.5),
        ("doming", "movement_ratio = 0.6", 0.6),
        ("doming", 'shape = "tree"', 1.0),
    ],
)
def test_differential_movement_is_its_share_of_the_surface_movement(kind: str, mound: str, share: float) -> None:
    ds = arched(np.full(20, 6.0)).rename(central_deflection="surface_movement").drop_vars("deflection_ratio")
    ds.attrs["scene"] = f'[movement]\nkind = "{kind}"\n[mound]\n{mound}\n'
    both = [fit_fragility(ds, intensity=m, bootstrap=0) for m in ("differential_movement", "surface_movement")]
    assert float(both[0]["median"][0]) == pytest.approx(share * float(both[1]["median"][0]), rel=1e-9)
    sampled = np.linspace(0.4, 0.8, 20)
    ds["mound.movement_ratio"] = ("sample", sampled)
    found = intensity_values(ds, "differential_movement")
    np.testing.assert_allclose(found[:, -1], sampled * 0.02)
