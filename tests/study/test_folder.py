"""What a study folder promises: one writer, nothing lost, clear words, quick also when it is large."""

import json
import multiprocessing
import os
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from damagepred.archive.folder import StudyFolder, open_study
from damagepred.archive.parts import read_part
from damagepred.errors import ConvergenceError, InputError, StudyError
from damagepred.study import Progress, Study
from damagepred.study.replay import replay
from damagepred.study.settings import StudySettings
from damagepred.study.standing import standing, watching
from tests.conftest import SMALL_STUDY
from tests.study.test_run import settings


def run(folder: Path, study: StudySettings | None = None, **more) -> None:
    with ThreadPoolExecutor(1) as executor:
        Study(study or settings()).run(folder, executor=executor, **more)


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("done") / "study.dp"
    run(folder)
    return folder


def test_the_design_is_there_before_any_part_and_the_folder_reads_while_it_runs(tmp_path: Path) -> None:
    folder, seen = StudyFolder(tmp_path / "study.dp"), []

    def look(state: Progress) -> None:
        assert folder.design().sizes["sample"] == 6
        found = folder.results()
        seen.append((state.done, int((found["status"].values == 0).sum())))
        assert standing(folder.path).total == 6

    run(folder.path, on_progress=look)
    assert seen[0] == (0, 0)
    assert [reported for reported, _ in seen] == list(range(7))
    assert all(there >= reported for reported, there in seen), "what is acknowledged is there"


@pytest.mark.parametrize("moment", ["manifest.json", "design.nc", "study.toml"])
def test_killed_while_the_folder_is_made(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, moment: str) -> None:
    """Whatever was there by then is no hindrance, and no half-made study is taken for one."""
    from damagepred.archive import files
    from damagepred.archive import folder as module

    honest = files.write_whole

    def deadly(path: Path, write) -> None:
        if path.name == moment:
            (path.parent / f".{path.name}.abc.tmp").touch()  # what a kill leaves, with nobody to tidy up
            raise KeyboardInterrupt
        honest(path, write)

    for where in (files, module):
        monkeypatch.setattr(where, "write_whole", deadly)
    folder = StudyFolder(tmp_path / "study.dp")
    with pytest.raises(KeyboardInterrupt):
        run(folder.path, samples=1)
    assert not folder.exists
    with pytest.raises(InputError, match="is not a study folder"):
        open_study(folder.path)
    monkeypatch.undo()
    run(folder.path, samples=1)
    assert open_study(folder.path)["status"].values.tolist() == [0]
    assert not list(folder.path.glob(".*.tmp"))


def test_a_design_records_the_joints_of_as_many_walls_as_is_sensible(monkeypatch: pytest.MonkeyPatch) -> None:
    from damagepred.study import study as module

    study = Study(settings())
    places = set(study.design.joint)
    stored = study.design_dataset(3)
    assert places <= set(stored.data_vars)
    values = sum(stored[place].size for place in places)
    monkeypatch.setattr(module, "MOST_VALUES", values)
    assert places <= set(study.design_dataset(3).data_vars)
    monkeypatch.setattr(module, "MOST_VALUES", values - 1)
    assert not places & set(study.design_dataset(3).data_vars)


def test_the_lock_of_a_killed_writer_is_no_hindrance(done: Path) -> None:
    script = f"""
import time
from damagepred.archive.folder import StudyFolder
lock = StudyFolder({str(done)!r}).lock()
print("mine", flush=True)
time.sleep(60)
"""
    writer = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True)
    assert writer.stdout is not None
    assert writer.stdout.readline() == "mine\n"
    with pytest.raises(
        StudyError, match=rf"another damagepred .*\(process {writer.pid} on .* since 20.*\); wait for it"
    ):
        run(done)
    assert open_study(done).sizes["sample"] == 6, "reading needs no lock"
    os.kill(writer.pid, signal.SIGKILL)
    writer.wait()
    run(done)


def test_the_record_of_a_failure_tells_how_to_replay_it(tmp_path: Path) -> None:
    text = SMALL_STUDY + '\n[scene.solver]\nmethod = "explicit"\ntolerance = 1e-9\nmaximum_cycles = 100\n'
    folder = StudyFolder(tmp_path / "study.dp")
    run(folder.path, settings(text), samples=2)
    record = json.loads(folder.failure_file(1).read_text())
    assert record["reason"] == "not_converged"
    assert record["replay"] == "damagepred replay study.dp 1"
    assert record["inputs"]["joint.friction"] == folder.design()["joint.friction"].values[1]
    assert {"damagepred_version", "damagepred_commit", "schema_version"} <= set(record)
    with pytest.raises(ConvergenceError) as again:  # the dead load already: there is no path to return
        replay(folder.path, 1)
    assert record["message"] == f"ConvergenceError: {again.value}"


EXPLICIT = '[scene.solver]\nmethod = "explicit"\ntolerance = 1e-2\n'
DEFORMABLE = '[scene.solver]\nblocks = "deformable"\n'
SOFTENING = """
[variables."joint.fracture_energy"]
distribution = "uniform"
lower = 5
upper = 20
field = { course_correlation = 0.2 }
"""


@pytest.mark.parametrize("kind", ["explicit", "deformable", "softening"])
def test_replay_is_bit_for_bit_whatever_the_solver_and_the_fields(tmp_path: Path, kind: str) -> None:
    text = SMALL_STUDY.replace("increments = 6", "increments = 2")
    if kind == "softening":
        text = text.replace("[scene.joint]", "[scene.joint]\nfracture_energy = 10.0").replace(
            "[correlation]", SOFTENING + "[correlation]"
        )
    else:
        text += EXPLICIT if kind == "explicit" else DEFORMABLE
    folder = tmp_path / "study.dp"
    run(folder, settings(text), samples=2)
    for sample in range(2):
        ds, comparison = replay(folder, sample)
        assert comparison == f"bit for bit what the archive holds for sample {sample}"
        file = StudyFolder(folder).part_of(sample)
        assert file is not None
        part = read_part(file)
        row = part["sample"].values.tolist().index(sample)
        for name in ("crack_width_max", "external_work", "cycles", "unbalanced_force_ratio"):
            np.testing.assert_array_equal(ds[name].values, part[name].values[row][: ds.sizes["increment"]])


def test_a_replay_that_differs_says_so(done: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from damagepred.study import replay as module

    honest = module.solve

    def other(*arguments, **more):
        ds = honest(*arguments, **more)
        ds["base_reaction"].values[1] *= 1 + 1e-15
        return ds

    monkeypatch.setattr(module, "solve", other)
    assert replay(done, 2)[1].startswith("differs from the archive in base_reaction")


def test_a_damaged_part_is_named_and_solved_again_once_it_is_deleted(done: Path, tmp_path: Path) -> None:
    import shutil

    folder = StudyFolder(shutil.copytree(done, tmp_path / "study.dp"))
    folder.results_file.unlink()
    part = folder.part_of(2)
    assert part is not None
    part.write_bytes(part.read_bytes()[:100])
    with pytest.raises(InputError, match=rf"{part.name}: is damaged .*delete it"):
        folder.results()
    part.unlink()
    run(folder.path)
    np.testing.assert_array_equal(
        open_study(folder.path)["crack_width_max"].values, open_study(done)["crack_width_max"].values
    )


def test_failures_that_came_to_a_result_after_all_count_as_solved(done: Path, tmp_path: Path) -> None:
    """A worker given up too early may have written its part all the same."""
    import shutil

    folder = StudyFolder(shutil.copytree(done, tmp_path / "study.dp"))
    folder.results_file.unlink()
    folder.record_failure(1, "timeout", "took long", {})
    assert folder.results()["status"].values.tolist() == [0] * 6


def test_watching_ends_when_nothing_is_left(done: Path) -> None:
    (report,) = watching(done, 60.0)
    assert report.remaining == 0


def without_rights(folder: str, answer) -> None:
    """Try to go on with a study as somebody who may not write there."""
    if os.getuid() == 0:
        os.setgid(65534)
        os.setuid(65534)
    try:
        Study.from_folder(folder).run(folder, samples=8)
    except StudyError as error:
        answer.put(str(error))
    answer.put(str(open_study(folder).sizes["sample"]))


def test_a_folder_that_may_only_be_read(done: Path, tmp_path_factory: pytest.TempPathFactory) -> None:
    import shutil
    import tempfile

    with tempfile.TemporaryDirectory() as place:  # pytest's own folders are closed to others
        Path(place).chmod(0o755)
        folder = Path(shutil.copytree(done, Path(place) / "study.dp"))
        (folder / ".lock").unlink(missing_ok=True)
        folder.chmod(0o555)
        context = multiprocessing.get_context("fork")
        answer = context.Queue()
        process = context.Process(target=without_rights, args=(str(folder), answer))
        process.start()
        said = [answer.get(timeout=60), answer.get(timeout=60)]
        process.join()
        folder.chmod(0o755)
    assert "study.dp: cannot be written" in said[0]
    assert "choose another with -o" in said[0]
    assert said[1] == "6", "reading it is no matter"


def test_a_hundred_thousand_samples_are_listed_in_no_time(done: Path, tmp_path: Path) -> None:
    """As many parts as a study of that size makes; their names alone tell what is done."""
    import shutil

    folder = StudyFolder(shutil.copytree(done, tmp_path / "study.dp"))
    for first in range(10, 100_010, 10):
        folder.part_file(first, first + 9).touch()
    began = time.perf_counter()
    assert len(folder.finished()) == 100_006
    assert time.perf_counter() - began < 2.0
