"""Stored part of the movement, on mounds and jacks too: the path, its sampled end, or both."""

import tomllib
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from damagepred.campaign.settings import StudySettings
from damagepred.plotting.fragility import draw_fragility
from damagepred.plotting.study import draw_category_shares
from damagepred.study import Study, open_study
from damagepred.uq.fragility import fit_fragility
from tests.conftest import SMALL_STUDY
from tests.synthetic_studies import capacities

WALL = """
[study]
samples = 4
seed = 3
[scene]
wall = { length = 1.92, height = 0.45 }
footing = { width = 0.1, depth = 0.06, elastic_modulus = "7 GPa" }
joint = { tensile_strength = "5 kPa", cohesion = "10 kPa" }
[variables."joint.tensile_strength"]
distribution = "lognormal"
mean = "5 kPa"
cov = 0.3
"""
MOUND = """
[scene.movement]
kind = "doming"
shape = "mound"
increments = 5
[scene.mound]
surface_movement = "50 mm"
edge_distance = 0.8
[scene.soil]
shrinking_stiffness = 2e7
[variables]
"mound.surface_movement" = { distribution = "uniform", lower = "50 mm", upper = "80 mm" }
"""
JACKS = """
[scene.movement]
kind = "dishing"
shape = "jacks"
increments = 6
central_deflection = "30 mm"
[scene.dpc]
course = 1
"""


def run(folder: Path, movement: str, samples: int = 6) -> xr.Dataset:
    text = SMALL_STUDY.replace("stop_at_category = 4", f'stop_at_category = "none"\nmovement = "{movement}"')
    with ThreadPoolExecutor(1) as executor:
        Study(StudySettings.from_dict(tomllib.loads(text))).run(folder, samples=samples, executor=executor)
    return open_study(folder)


@pytest.fixture(scope="module")
def folders(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    place = tmp_path_factory.mktemp("movement")
    for kind in ("path", "sampled", "both"):
        run(place / kind, kind)
    return {kind: place / kind for kind in ("path", "sampled", "both")}


def test_the_end_is_the_last_increment_of_the_path(folders: dict[str, Path]) -> None:
    path, end, both = (open_study(folders[kind]) for kind in ("path", "sampled", "both"))
    assert "increment" not in end.dims
    for name in ("damage_category", "crack_width_max", "dpc_opening_max", "central_deflection", "deflection_ratio"):
        assert end[name].dims == ("sample",)
        last = path[name].values[:, -1]
        np.testing.assert_array_equal(end[name].values, last)
        np.testing.assert_array_equal(both[name].values, path[name].values)
        np.testing.assert_array_equal(both[f"end_{name}"].values, last)
        assert both[f"end_{name}"].attrs.get("units") == path[name].attrs.get("units")
    np.testing.assert_array_equal(end["central_deflection"].values, end["movement.central_deflection"].values)
    assert end["damage_category"].attrs["flag_meanings"] == path["damage_category"].attrs["flag_meanings"]
    assert len(set(end["crack_width_max"].values)) == 6


@pytest.mark.parametrize(("ground", "measure"), [(MOUND, "surface_movement"), (JACKS, "central_deflection")])
def test_ends_on_mounds_and_jacks(ground: str, measure: str) -> None:
    """A mound's movement is the sampled one; unloaded jacks end the movement, and the wall is known there."""
    study = Study(StudySettings.from_dict(tomllib.loads(WALL + ground)))
    outputs = (measure, "damage_category", "crack_width_max", "base_reaction")
    vectors = study.function().from_unit(np.full((1, len(study.design.wall)), 0.3))
    end = study.function(outputs, movement="sampled")(vectors)
    path = study.function(outputs, movement="path")(vectors).isel(sample=0)
    last = int(np.flatnonzero(np.isfinite(path["base_reaction"].values))[-1])
    for name in outputs:
        assert end[name].values[0] == path[name].values[last]
    if ground is MOUND:
        assert end[measure].values[0] == vectors[0, study.design.wall.index("mound.surface_movement")]
    else:
        assert last < study.settings.scene.movement.increments, "jacks that never let go test nothing"


@pytest.fixture(scope="module")
def mound(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("mound") / "mound.dp"
    with ThreadPoolExecutor(1) as executor:
        summary = Study(StudySettings.from_dict(tomllib.loads(WALL + MOUND))).run(folder, executor=executor)
    assert (summary.done, summary.failed) == (4, 0)
    return folder


def test_curves_of_a_mound_s_study_are_against_the_movement_of_its_surface(mound: Path) -> None:
    ds = open_study(mound)
    curves = fit_fragility(ds, bootstrap=0)
    assert curves.attrs["intensity_measure"] == "surface_movement"
    assert float(curves["intensity"][-1]) == pytest.approx(float(ds["mound.surface_movement"].max()))
    assert draw_fragility(curves).get_xlabel() == "surface movement $y_s$ (mm)"
    assert draw_category_shares(ds).get_xlabel() == "surface movement $y_s$ (mm)"
    bounds = capacities(ds, 1, "surface_movement")
    category = ds["damage_category"].values
    for wall in range(4):  # by hand: the first increment in the category, and the one before
        reached = np.flatnonzero(category[wall] >= 1)
        assert reached.size
        assert bounds.upper[wall] == ds["surface_movement"].values[wall, reached[0]]
        assert bounds.lower[wall] == ds["surface_movement"].values[wall, reached[0] - 1]
    # read against the deflection, the same walls make another curve
    assert fit_fragility(ds, intensity="central_deflection", bootstrap=0)["intensity"][-1] < curves["intensity"][-1]
