"""Stored part of the movement: the path, its sampled end, or both."""

import tomllib
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from damagepred.campaign.settings import StudySettings
from damagepred.study import Study, open_study
from tests.campaign.test_ground import JACKS, MOUND, WALL
from tests.conftest import SMALL_STUDY


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
