"""Datasets as people use them: with plain xarray and pandas, from memory and from files."""

import subprocess
import sys
import tomllib
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import damagepred
from damagepred.archive.files import write_dataset
from damagepred.archive.folder import StudyFolder
from damagepred.archive.schema import VARIABLES, with_shared_movement
from damagepred.campaign.settings import StudySettings
from tests.conftest import SMALL_STUDY
from tests.synthetic_studies import synthetic_study


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two walls on the same movement."""
    tables = tomllib.loads(SMALL_STUDY)
    del tables["variables"]["movement.central_deflection"]
    place = tmp_path_factory.mktemp("study") / "house.dp"
    with ThreadPoolExecutor(1) as executor:
        damagepred.Study(StudySettings.from_dict(tables)).run(place, samples=2, executor=executor)
    return place


def test_samples_share_their_movement(folder: Path) -> None:
    study = damagepred.open_study(folder)
    assert study["movement"].dims == ("increment",)
    np.testing.assert_allclose(study["movement"], np.linspace(0.0, 6e-3, 7), rtol=1e-12)
    assert study["increment"].values.tolist() == list(range(7))
    assert study["crack_width_max"].sel(increment=3).coords["movement"] == pytest.approx(3e-3)
    with xr.open_dataset(folder / "results.nc") as plain:
        np.testing.assert_array_equal(plain["movement"], study["movement"])
        assert "movement" in plain.coords


def test_the_surface_of_the_ground_is_the_movement_where_it_is_known() -> None:
    path = ("sample", "increment")
    own = np.array([[0.0, 1e-3], [0.0, 2e-3], [np.nan, np.nan]])
    ds = xr.Dataset({"central_deflection": (path, own), "surface_movement": (path, [[0.0, 2e-2]] * 2 + [[np.nan] * 2])})
    assert with_shared_movement(ds)["movement"].values.tolist() == [0.0, 2e-2]
    assert "movement" not in with_shared_movement(ds.drop_vars("surface_movement"))
    nowhere = xr.full_like(ds, np.nan)
    assert "movement" not in with_shared_movement(nowhere)


def test_a_study_and_a_wall_have_no_dimension_without_length(folder: Path, wall: xr.Dataset) -> None:
    study = damagepred.open_study(folder)
    assert len(study.to_dataframe()) == np.prod(list(study.sizes.values())) > 0
    assert 0 not in wall.sizes.values()
    assert len(wall[["crack_width_max", "damage_category"]].to_dataframe()) == 3
    assert not any(b"opening_width_change" in part.read_bytes() for part in (folder / "parts").iterdir())


@pytest.fixture(scope="module")
def wall() -> xr.Dataset:
    scene = {"wall": {"length": 1.2, "height": 0.3}, "movement": {"increments": 2}}
    return damagepred.solve(damagepred.Scene.from_dict(scene))


def test_flags_are_whole_numbers_in_memory_and_in_files(folder: Path, wall: xr.Dataset, tmp_path: Path) -> None:
    study = damagepred.open_study(folder)
    file = tmp_path / "wall.nc"
    write_dataset(wall, file)
    with xr.open_dataset(file) as plain_wall, xr.open_dataset(folder / "results.nc") as plain_study:
        for ds in (wall, study, plain_wall, plain_study):
            flags = [name for name in ds.variables if "flag_meanings" in ds[name].attrs]
            assert "damage_category" in flags
            for name in flags:
                attrs = ds[name].attrs
                assert ds[name].dtype == attrs["flag_values"].dtype == attrs["valid_range"].dtype == np.int8, name
                assert len(attrs["flag_values"]) == len(attrs["flag_meanings"].split())
                assert attrs["valid_range"].tolist() == [0, len(attrs["flag_values"]) - 1]


@pytest.mark.thorough
def test_probabilities_are_those_of_the_archive_when_plain_xarray_opens_it(tmp_path: Path) -> None:
    place = synthetic_study(tmp_path / "house.dp", 40, medians=(2e-3, 4e-3), failed=[3], missing=[5])
    StudyFolder(place).consolidate()
    code = """if True:
        import sys
        {order}
        found = xr.open_dataset(sys.argv[1]).damagepred.exceedance("very slight", at=3e-3)
        print(found.estimate.value, found.failed)"""
    known = damagepred.open_study(place).damagepred.exceedance("very slight", at=3e-3)
    for order in ("import damagepred, xarray as xr", "import xarray as xr, damagepred"):
        command = [sys.executable, "-c", code.format(order=order), str(place / "results.nc")]
        done = subprocess.run(command, check=True, capture_output=True, text=True)
        assert done.stdout.split() == [str(known.estimate.value), "1"]


def test_variables_named_like_methods_are_attributes_of_the_accessor(tmp_path: Path) -> None:
    study = damagepred.open_study(synthetic_study(tmp_path / "house.dp", 40, medians=(2e-3, 4e-3)))
    curves = damagepred.fit_fragility(study, categories=[1, 2], bootstrap=0, goodness=0)
    methods = set(dir(xr.Dataset))
    assert [name for name in {**VARIABLES, **curves.variables} if name in methods] == ["median"]
    assert curves.damagepred.median.identical(curves["median"])
    assert "median" in dir(curves.damagepred)
    with pytest.raises(AttributeError, match=r"no variable 'medain'\. Did you mean 'median'"):
        _ = curves.damagepred.medain
