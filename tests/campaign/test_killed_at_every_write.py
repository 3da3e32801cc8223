"""A kill at any write of any command loses no result: after the same command all is as if undisturbed."""

import itertools
import json
import os
import shutil
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import SimpleNamespace

import pytest
import xarray as xr

from damagepred import Scene, Study, solve
from damagepred.analyses.rare_event import rare_event
from damagepred.archive.files import read_dataset, write_dataset
from damagepred.archive.folder import StudyFolder
from damagepred.archive.parts import read_part, write_part
from damagepred.campaign import sample
from damagepred.campaign.status import study_status
from damagepred.campaign.verify import repair
from damagepred.cli import main
from damagepred.enumerations import SampleStatus
from tests.analyses.test_rare import ASKED
from tests.analyses.test_rare import TINY as RARE
from tests.campaign.test_run import settings
from tests.killed import KILLED, run_killed
from tests.synthetic_studies import synthetic_study

pytestmark = [pytest.mark.skipif(not hasattr(os, "fork"), reason="needs a fork"), pytest.mark.slow]

SAMPLES = 2


def run(folder: Path, samples: int = SAMPLES, **more: bool) -> None:
    with ThreadPoolExecutor(1) as executor:
        Study(settings()).run(folder, samples=samples, executor=executor, **more)


def fail(folder: Path, sample: int) -> None:
    """Turn a sample into a failed one with a part, as after a solver error."""
    place = StudyFolder(folder)
    part = read_part(place.part_file(sample))
    part["status"].values[:] = SampleStatus.FAILED
    write_part(place.part_file(sample), part, place.study_hash)
    place.record_failure(sample, "not_converged", "made up", {})
    place.consolidate()


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("done") / "study.dp"
    run(folder)
    return folder


def content(folder: Path) -> xr.Dataset:
    """Return the results without times."""
    place = StudyFolder(folder)
    ds = place.results()
    xr.testing.assert_identical(ds["status"], read_dataset(place.results_file)["status"])
    for number in range(ds.sizes["sample"]):
        assert int(read_part(place.part_of(number))["status"].values[0]) == int(ds["status"][number])
    assert not list(folder.rglob(".*.tmp"))
    return ds.drop_vars("run_time").drop_attrs()


def one_study(begin: Callable[[Path], None], go_on: Callable[[Path], object], place: Path, damaged=False) -> None:
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
        if StudyFolder(folder).exists and not damaged:  # readable in between, and never more than is true
            report = study_status(folder)
            assert report.done + report.remaining == report.total
            assert report.failed <= int((wanted["status"] == SampleStatus.FAILED).sum()) + 1
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


def damage(done: Path) -> Callable[[Path], None]:
    def begin(folder: Path) -> None:
        shutil.copytree(done, folder)
        place = StudyFolder(folder)
        for file in (place.design_file, place.results_file, place.part_of(1)):
            os.truncate(file, 300)

    return begin


@pytest.mark.filterwarnings("ignore::damagepred.errors.ArchiveWarning")
def test_a_damaged_study_that_is_repaired(done: Path, tmp_path: Path) -> None:
    one_study(damage(done), lambda folder: (repair(folder), run(folder)), tmp_path, damaged=True)
    assert len(list((tmp_path / "killed.dp" / "damaged").iterdir())) == 3


@pytest.mark.filterwarnings("ignore::damagepred.errors.ArchiveWarning")
def test_damage_that_the_study_itself_sets_aside(done: Path, tmp_path: Path) -> None:
    def begin(folder: Path) -> None:
        shutil.copytree(done, folder)
        place = StudyFolder(folder)
        for file in (place.manifest_file, place.results_file, place.part_of(1)):
            os.truncate(file, 300)

    one_study(begin, run, tmp_path, damaged=True)


def rare(folder: Path) -> None:
    with ThreadPoolExecutor(1) as executor:
        rare_event(settings(RARE), ASKED, folder, samples=10, level_share=0.5, executor=executor)


def what_is_found(folder: Path) -> dict[str, object]:
    """Results of a folder without times: of files of JSON, logs and studies."""
    found: dict[str, object] = {f.name: json.loads(f.read_text()) for f in folder.glob("*.json")}
    for log in folder.glob("*.jsonl"):
        lines = [json.loads(line) for line in log.read_text().splitlines()]
        found[log.name] = sorted(([line[0], line[1], *line[3:5]] for line in lines), key=str)
    for study in folder.glob("*.dp"):
        found[study.name] = {n: v.values.tobytes() for n, v in StudyFolder(study).results().variables.items()}
    return found


@pytest.mark.parametrize(("go_on", "at_each"), [(rare, 9)])
def test_estimates_that_solve_walls(go_on, at_each, tmp_path, monkeypatch) -> None:
    """The cost of walls determines their number, so the clock ticks once a wall here."""
    ticks = itertools.count()
    monkeypatch.setattr(sample, "time", SimpleNamespace(perf_counter=lambda: float(next(ticks))))
    go_on(tmp_path / "undisturbed")
    wanted = what_is_found(tmp_path / "undisturbed")
    folder, at = tmp_path / "killed", 0
    while True:
        shutil.rmtree(folder, ignore_errors=True)
        code, _ = run_killed(lambda: go_on(folder), folder, at)
        if code != KILLED:
            assert code == 0
            assert at > 10
            break
        go_on(folder)
        assert what_is_found(folder) == wanted
        at += at_each


def test_a_stale_summary_is_not_used(done: Path, tmp_path: Path) -> None:
    """A failed wall that has been solved since counts as solved, despite the earlier summary."""
    with_failure(done)(tmp_path / "study.dp")
    folder = StudyFolder(tmp_path / "study.dp")
    shutil.copy(folder.results_file, tmp_path / "stale.nc")
    run(folder.path, retry_failed=True)
    shutil.copy(tmp_path / "stale.nc", folder.results_file)
    assert folder.results()["status"].values.tolist() == [0] * SAMPLES


SCENE = """
wall = { length = 0.96, height = 0.45 }
movement = { central_deflection = "1 mm", increments = 2 }
"""
COMMANDS = {
    "fragility": "fragility study.dp -o new/c.nc --csv new/c.csv --plot new/c.png --bootstrap 0 --goodness 0",
    "judge": "judge study.dp --table bre251 -o new/j.nc",
    "replay": "replay study.dp 0 -o new/w.nc",
    "report": "report study.dp -o new/r.html --no-replay --bootstrap 0",
    "new": "new new/house.toml",
    "solve": "solve scene.toml -o new/w.nc",
    "sensitivity": "sensitivity many.dp -o new/s.nc",
    "cracks": "cracks wall.nc --csv new/k.csv -o new/k.nc",
    "plot": "plot wall.nc -o new",
    "export": "fragility many.dp -o new/f.nc --bootstrap 0 --goodness 0 --categories 1,2 --export openquake",
}


@pytest.mark.parametrize("command", COMMANDS)
def test_commands_write_files_atomically(command: str, done: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    shutil.copytree(done, tmp_path / "study.dp")
    (tmp_path / "scene.toml").write_text(SCENE, encoding="utf-8")
    if "many.dp" in COMMANDS[command]:
        synthetic_study(tmp_path / "many.dp")
    if "wall.nc" in COMMANDS[command]:
        write_dataset(solve(Scene.from_toml(tmp_path / "scene.toml")), tmp_path / "wall.nc")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", ["damagepred", *COMMANDS[command].split()])
    place = tmp_path / "new"

    def ended() -> dict[str, bytes]:
        return {file.name: file.read_bytes() for file in place.iterdir() if not file.name.startswith(".")}

    place.mkdir()
    code, writes = run_killed(main, place, 10**6)
    assert (code, writes > 0) == (0, True)
    wanted = ended()
    for at in range(0, writes, max(1, writes // 4)):  # the same function writes all files
        shutil.rmtree(place)
        place.mkdir()
        assert run_killed(main, place, at)[0] == KILLED
        for name, found in ended().items():
            assert len(found) == len(wanted[name]), f"{name} is half written"
        assert content(tmp_path / "study.dp").equals(content(done)), "the study is as before"
