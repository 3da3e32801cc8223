"""Guarantees of a study folder: one writer, no lost result, clear messages, fast also when large."""

import multiprocessing
import os
import signal
import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from damagepred.archive.folder import StudyFolder, open_study
from damagepred.archive.parts import read_part
from damagepred.archive.provenance import environment
from damagepred.archive.schema import Columns
from damagepred.campaign.replay import replay
from damagepred.campaign.settings import StudySettings
from damagepred.campaign.status import study_status
from damagepred.errors import InputError, StudyError
from damagepred.study import Progress, Study
from tests.campaign.test_run import settings
from tests.conftest import SMALL_STUDY

pytestmark = pytest.mark.quick_cases()


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
        assert study_status(folder.path).total == 6

    run(folder.path, on_progress=look)
    assert seen[0] == (0, 0)
    assert [reported for reported, _ in seen] == list(range(7))
    assert all(there >= reported for reported, there in seen), "what is acknowledged is there"


def test_the_lock_of_a_killed_writer_is_no_hindrance(done: Path) -> None:
    script = f"""
import time
from damagepred.archive.folder import StudyFolder
lock = StudyFolder({str(done)!r}).lock()
print("mine", flush=True)
time.sleep(60)
"""
    writer = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True)
    assert writer.stdout.readline() == "mine\n"
    with pytest.raises(
        StudyError, match=rf"another damagepred .*\(process {writer.pid} on .* since 20.*\); wait for it"
    ):
        run(done)
    assert open_study(done).sizes["sample"] == 6, "reading needs no lock"
    os.kill(writer.pid, signal.SIGKILL)
    writer.wait()
    run(done)


EXPLICIT = '[scene.solver]\nmethod = "explicit"\ntolerance = 1e-2\n'
DEFORMABLE = '[scene.solver]\nblocks = "deformable"\n'
SOFTENING = '[variables."joint.fracture_energy"]\ndistribution = "uniform"\nlower = 5\nupper = 20\n'
SOFTENING += "field = { course_correlation = 0.2 }\n"


@pytest.mark.parametrize("kind", ["explicit", "deformable", "softening"])
def test_replay_is_bit_for_bit_with_any_solver_and_fields(tmp_path: Path, kind: str) -> None:
    text = SMALL_STUDY.replace("increments = 6", "increments = 2")
    if kind == "softening":
        text = text.replace("joint = {", "joint = { fracture_energy = 10.0,").replace(
            "[correlation]", SOFTENING + "[correlation]"
        )
    else:
        text += EXPLICIT if kind == "explicit" else DEFORMABLE
    folder = tmp_path / "study.dp"
    run(folder, settings(text), samples=2)
    for sample in range(2):
        ds, comparison = replay(folder, sample)
        assert comparison == f"bit for bit equal to sample {sample} of the archive"
        file = StudyFolder(folder).part_of(sample)
        part = read_part(file)
        row = part["sample"].values.tolist().index(sample)
        for name in ("crack_width_max", "external_work", "newton_iterations", "unbalanced_force_ratio"):
            np.testing.assert_array_equal(ds[name].values, part[name].values[row][: ds.sizes["increment"]])


@pytest.mark.parametrize("beside", [-1, 0])
def test_a_sample_beside_the_last_or_first_is_refused(done: Path, beside: int) -> None:
    count = StudyFolder(done).design().sizes["sample"]
    with pytest.raises(InputError, match=rf"has samples 0 to {count - 1}\.$"):
        replay(done, beside if beside < 0 else count)


COMMITTED = environment() | {"damagepred_commit": "0123456789ab"}


@pytest.mark.parametrize(
    ("recorded", "here", "says"),
    [
        ({}, {}, "kernel hash, libraries and BLAS core are the same: this is a bug in damagepred."),
        ({"machine": "Zen 5"}, {"machine": "Skylake"}, "another machine (Zen 5, here Skylake)."),
        ({"blas": "Haswell"}, {"blas": "SkylakeX"}, "another BLAS core (Haswell, here SkylakeX)."),
        ({"kernel_hash": "ab"}, {"kernel_hash": "cd"}, "another kernel hash (ab, here cd)."),
        ({"damagepred_commit": "ab"}, {"damagepred_commit": "cd"}, "another commit (ab, here cd)."),
        ({"damagepred_version": "1"}, {"damagepred_version": "2"}, "another version (1, here 2)."),
        (
            {"machine": "A", "blas": "B"},
            {"machine": "C", "blas": "D"},
            "machine (A, here C); another BLAS core (B, here",
        ),
        ({"damagepred_commit": "ab+"}, {"damagepred_commit": "ab+"}, "changes that are not committed"),
        (None, {}, "older version, which did not record where"),
    ],
)
def test_a_replay_that_differs_names_other_differences(recorded, here, says, tmp_path, monkeypatch) -> None:
    from damagepred.campaign import replay as module
    from damagepred.campaign import sample

    monkeypatch.setattr(sample, "environment", lambda: COMMITTED | (recorded or {}))
    if recorded is None:
        monkeypatch.setattr(sample, "_row", without_environment(sample._row))
    study = Study(settings())
    with ThreadPoolExecutor(1) as executor:
        study.run(tmp_path / "study.dp", samples=1, executor=executor)
    monkeypatch.setattr(module, "environment", lambda: COMMITTED | here)

    honest = module.solve

    def other(*arguments, **more):
        ds = honest(*arguments, **more)
        ds["base_reaction"].values[1] *= 1 + 1e-15
        return ds

    monkeypatch.setattr(module, "solve", other)
    comparison = replay(tmp_path / "study.dp", 0)[1]
    assert comparison.startswith("differs from the archive in base_reaction. ")
    assert says in comparison
    assert "other machines" not in comparison
    assert comparison.count("another") == len([key for key in recorded or {} if recorded[key] != here[key]])


def without_environment(row: Callable[..., Columns]) -> Callable[..., Columns]:
    """Return rows as versions wrote them that did not record where a sample was solved."""

    def older(*arguments: Any) -> Columns:
        columns = row(*arguments)
        del columns["environment"]
        return columns

    return older


def without_rights(folder: str, answer) -> None:
    """Try to resume a study without permission to write."""
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
