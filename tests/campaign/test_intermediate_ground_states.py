"""Studies on mounds: a path read at a surface movement is what a study to that movement gives."""

import tomllib
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from damagepred.campaign.settings import StudySettings
from damagepred.errors import InputError
from damagepred.study import Study, open_study
from damagepred.uq.fragility import fit_fragility
from tests.synthetic_studies import capacities

pytestmark = pytest.mark.quick_cases()

WALL = """
[study]
samples = 6
seed = 3
stop_at_category = "none"
[scene.wall]
length = 3.84
height = 0.45
[scene.footing]
width = 0.2
depth = 0.15
elastic_modulus = "7 GPa"
[scene.joint]
tensile_strength = "20 kPa"
cohesion = "40 kPa"
[scene.movement]
kind = "KIND"
shape = "mound"
increments = COUNT
[scene.mound]
suction_depth = 2.0
surface_movement = MOVED
dishing_edge_base = 0.1
dishing_movement_divisor = 40
[scene.soil]
shrinking_stiffness = 2e7
swelling_stiffness = 2e7
[variables."joint.tensile_strength"]
distribution = "lognormal"
mean = "20 kPa"
cov = 0.5
"""
STEP = 0.01
NEAR = 5e-6
"""Agreement (m). Both paths locate the breaking of a bond to 1 % of its strength, by different steps. The distribution
of an opening over neighbouring joints then differs by as much, also with a mound that only grows in size."""


def run(folder: Path, kind: str, increments: int) -> Path:
    text = WALL.replace("KIND", kind).replace("COUNT", str(increments)).replace("MOVED", str(STEP * increments))
    with ThreadPoolExecutor(1) as executor:
        summary = Study(StudySettings.from_dict(tomllib.loads(text))).run(folder, executor=executor)
    assert (summary.done, summary.failed) == (6, 0)
    return folder


@pytest.fixture(scope="module", params=["doming", "dishing"])
def long_and_short(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    folder = tmp_path_factory.mktemp(request.param)
    return run(folder / "long.dp", request.param, 10), run(folder / "short.dp", request.param, 4)


def test_paths_to_different_surface_movements_agree_where_both_are_known(long_and_short: tuple[Path, Path]) -> None:
    long, short = (open_study(folder) for folder in long_and_short)
    moved = [ds["surface_movement"].values[:, : short.sizes["increment"]] for ds in (long, short)]
    np.testing.assert_allclose(*moved, rtol=1e-12)
    for name in ("damage_category", "crack_width_max", "central_deflection"):
        values = [ds[name].values[:, : short.sizes["increment"]] for ds in (long, short)]
        np.testing.assert_allclose(*values, rtol=0, atol=NEAR, err_msg=name)
    assert short["crack_width_max"].values.max() > 1e-5


def test_paths_of_versions_that_scaled_the_final_mound_are_not_read_in_between(long_and_short: tuple[Path, Path]):
    ds = open_study(long_and_short[0])
    fit_fragility(ds, bootstrap=0, categories=[1])
    del ds["surface_movement"].attrs["ground_states"]
    with pytest.raises(InputError, match="scaled the Walsh mound of the final surface movement"):
        fit_fragility(ds, bootstrap=0, categories=[1])
    # at its end each wall is that of its movement
    ends = ds.isel(increment=-1)
    capacities(ends, 1, "surface_movement")
    # and where nothing grows but the size, all states on the way are
    ds.attrs["scene"] = ds.attrs["scene"].replace('shape = "walsh"', 'shape = "mitchell"')
    fit_fragility(ds, bootstrap=0, categories=[1])
