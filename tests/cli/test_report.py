"""Reports that cannot be: one message that says why, and what to do."""

import os
from pathlib import Path

import pytest
import xarray as xr

from damagepred.archive.files import write_dataset
from damagepred.one_wall.solve import solve
from damagepred.scene import Scene
from tests.cli.conftest import Run
from tests.report.conftest import WALL
from tests.synthetic_studies import synthetic_study


@pytest.fixture(scope="module")
def wall() -> xr.Dataset:
    return solve(Scene.from_dict(WALL))


def test_missing_and_unfit_files_are_named(command: Run, wall: xr.Dataset, tmp_path: Path) -> None:
    (tmp_path / "scene.toml").write_text("[wall]\n")
    (tmp_path / "text.nc").write_text("no netCDF")
    (tmp_path / "empty").mkdir()
    write_dataset(wall[["crack_width_max"]].assign_attrs(schema_version=2), tmp_path / "part.nc")
    write_dataset(wall, tmp_path / "wall.nc")
    for arguments, said in (
        (["nowhere.dp"], "no such file or study folder"),
        ([tmp_path / "scene.toml"], "is a description, and a result is needed"),
        ([tmp_path / "text.nc"], "is not a readable netCDF file"),
        ([tmp_path / "part.nc"], "is not the result of solve or replay (it has no contact_opening)"),
        ([tmp_path / "empty"], "is not a study folder"),
        ([tmp_path / "wall.nc", "-o", tmp_path / "empty"], "is a folder; give the name of a file"),
        ([tmp_path / "wall.nc", "-o", tmp_path / "no" / "r.html"], "its folder does not exist"),
    ):
        result = command("report", *arguments)
        assert result.code == 2, arguments
        assert said in result.err
        assert "Traceback" not in result.err
    assert not list(tmp_path.glob("*.html"))


@pytest.mark.skipif(os.geteuid() == 0, reason="nothing is read-only to root")
def test_a_read_only_folder_is_refused(command: Run, wall: xr.Dataset, tmp_path: Path) -> None:
    folder = tmp_path / "locked"
    folder.mkdir()
    write_dataset(wall, folder / "wall.nc")
    folder.chmod(0o555)
    result = command("report", folder / "wall.nc")
    assert result.code == 2
    assert "no permission to write there; choose another place" in result.err


def test_a_study_with_no_wall_done_is_refused(command: Run, tmp_path: Path) -> None:
    folder = synthetic_study(tmp_path / "house.dp", 8, missing=range(8))
    result = command("report", folder)
    assert result.code == 2
    assert "no finished sample yet; run `damagepred study` first" in result.err


def test_the_command_says_where_the_report_is(command: Run, tmp_path: Path) -> None:
    study_folder = synthetic_study(tmp_path / "house.dp", 12)
    result = command("report", study_folder, "--no-replay", "--bootstrap", 10)
    assert result.code == 0, result.err
    assert f"wrote {study_folder.with_name('house_report.html')}" in result.out.replace("\n", "")
