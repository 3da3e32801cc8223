"""A kill at any write of any command loses nothing: the same command once more, and all is as if undisturbed."""

import os
import shutil
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
import xarray as xr

from damagepred.archive.files import read_dataset
from damagepred.archive.folder import FAILED, StudyFolder
from damagepred.archive.parts import read_part
from damagepred.cli import main
from damagepred.study import Study
from damagepred.study.standing import standing
from tests.killed import KILLED, run_killed
from tests.study.test_run import settings

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="needs a fork")

SAMPLES = 3


def run(folder: Path, samples: int = SAMPLES, **more: bool) -> None:
    with ThreadPoolExecutor(1) as executor:
        Study(settings()).run(folder, samples=samples, executor=executor, **more)


def fail(folder: Path, sample: int) -> None:
    """Make a sample one that failed and left a part, as a solver does that gives up."""
    place = StudyFolder(folder)
    part = xr.load_dataset(place.part_file(sample), engine="scipy")
    part["status"].values[:] = FAILED
    part.to_netcdf(place.part_file(sample), engine="scipy", format="NETCDF3_64BIT")
    place.record_failure(sample, "not_converged", "made up", {})
    place.consolidate()


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("done") / "study.dp"
    run(folder)
    return folder


def content(folder: Path) -> xr.Dataset:
    """What the results are, without how long they took."""
    place = StudyFolder(folder)
    ds = place.results()
    xr.testing.assert_identical(ds["status"], read_dataset(place.results_file)["status"])
    for sample in range(ds.sizes["sample"]):
        assert int(read_part(place.part_of(sample))["status"].values[0]) == int(ds["status"][sample])
    assert not list(folder.rglob(".*.tmp"))
    return ds.drop_vars("run_time").drop_attrs()


def one_study(begin: Callable[[Path], None], go_on: Callable[[Path], None], place: Path) -> None:
    """Kill ``go_on`` at each write in turn, run it again, and compare with one that was not killed."""
    begin(place / "undisturbed.dp")
    go_on(place / "undisturbed.dp")
    wanted = content(place / "undisturbed.dp")
    for at in range(1000):
        folder = place / "killed.dp"
        shutil.rmtree(folder, ignore_errors=True)
        begin(folder)
        code, _ = run_killed(lambda f=folder: go_on(f), folder, at)
        if code != KILLED:
            assert code == 0
            assert at > 5
            return
        if StudyFolder(folder).exists:  # readable in between, and never more than is true
            report = standing(folder)
            assert report.done + report.remaining == report.total
            assert report.failed <= int((wanted["status"] == FAILED).sum()) + 1
        go_on(folder)
        xr.testing.assert_identical(content(folder), wanted)
    raise AssertionError("did not come to an end")


def copy(done: Path) -> Callable[[Path], None]:
    return lambda folder: shutil.copytree(done, folder) and None


def with_failure(done: Path) -> Callable[[Path], None]:
    def begin(folder: Path) -> None:
        shutil.copytree(done, folder)
        fail(folder, 1)

    return begin


def test_a_new_study(tmp_path: Path) -> None:
    one_study(lambda folder: None, lambda folder: run(folder, 1), tmp_path)


def test_a_study_that_is_extended(done: Path, tmp_path: Path) -> None:
    one_study(copy(done), lambda folder: run(folder, SAMPLES + 1), tmp_path)


def test_failed_walls_that_are_run_again(done: Path, tmp_path: Path) -> None:
    one_study(with_failure(done), lambda folder: run(folder, retry_failed=True), tmp_path)


def test_a_stale_summary_is_not_believed(done: Path, tmp_path: Path) -> None:
    """A failed wall that has been solved since is solved, whatever the summary of before says."""
    with_failure(done)(tmp_path / "study.dp")
    folder = StudyFolder(tmp_path / "study.dp")
    shutil.copy(folder.results_file, tmp_path / "stale.nc")
    run(folder.path, retry_failed=True)
    shutil.copy(tmp_path / "stale.nc", folder.results_file)
    assert folder.results()["status"].values.tolist() == [0] * SAMPLES


COMMANDS = {
    "fragility": "fragility study.dp -o new/c.nc --csv new/c.csv --plot new/c.png --bootstrap 0 --goodness 0",
    "judge": "judge study.dp --table bre251 -o new/j.nc",
    "replay": "replay study.dp 0 -o new/w.nc",
    "report": "report study.dp -o new/r.html --no-replay --bootstrap 0",
    "new": "new new/house.toml",
}


@pytest.mark.parametrize("command", COMMANDS)
def test_what_commands_write_is_whole_or_not_there(
    command: str, done: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.copytree(done, tmp_path / "study.dp")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", ["damagepred", *COMMANDS[command].split()])
    place = tmp_path / "new"

    def ended() -> dict[str, bytes]:
        return {file.name: file.read_bytes() for file in place.iterdir() if not file.name.startswith(".")}

    place.mkdir()
    code, writes = run_killed(main, place, 10**6)
    assert (code, writes > 0) == (0, True)
    wanted = ended()
    for at in range(writes):
        shutil.rmtree(place)
        place.mkdir()
        assert run_killed(main, place, at)[0] == KILLED
        for name, found in ended().items():
            assert len(found) == len(wanted[name]), f"{name} is half written"
        assert content(tmp_path / "study.dp").equals(content(done)), "the study is as before"
