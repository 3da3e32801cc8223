"""Studies of walls on a flexible footing: on a mound, and on jacks up to the limit of the rig."""

import tomllib
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from damagepred.campaign.settings import StudySettings
from damagepred.plotting.fragility import draw_fragility
from damagepred.plotting.study import draw_category_shares
from damagepred.study import Study, open_study
from damagepred.uq.fragility import capacities, fit_fragility

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


def run(tables: str, folder: Path) -> Path:
    settings = StudySettings.from_dict(tomllib.loads(WALL + tables))
    with ThreadPoolExecutor(1) as executor:
        summary = Study(settings).run(folder, executor=executor)
    assert (summary.done, summary.failed) == (4, 0)
    return folder


@pytest.fixture(scope="module")
def mound(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return run(MOUND, tmp_path_factory.mktemp("mound") / "mound.dp")


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
