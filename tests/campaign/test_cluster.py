"""External executors: lost or repeated tasks do not change samples, and no sample is recorded as failed."""

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest

from damagepred.archive.folder import StudyFolder
from damagepred.campaign.dispatch import connect_dask_scheduler
from damagepred.errors import InputError, StudyError
from damagepred.study import Study, open_study
from tests.campaign.test_run import same, settings


@pytest.fixture(scope="module")
def serial(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("serial") / "study.dp"
    with ThreadPoolExecutor(1) as executor:
        Study(settings()).run(folder, samples=12, executor=executor)
    return folder


def test_workers_without_access_to_the_folder(tmp_path: Path) -> None:
    from damagepred.campaign.sample import run_batch

    with pytest.raises(StudyError, match="need a shared file system"):
        run_batch(str(tmp_path / "elsewhere.dp"), [(0, {})])


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:9", "nonsense", "nowhere.json"])
def test_no_scheduler_there(address: str) -> None:
    pytest.importorskip("distributed")
    with pytest.raises(InputError, match=f"--scheduler {address}: no Dask scheduler answers there"):
        connect_dask_scheduler(address, timeout=0.5)


def test_without_distributed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(InputError, match=r"pip install 'damagepred\[dask\]'"):
        connect_dask_scheduler("tcp://127.0.0.1:8786")


@pytest.fixture(scope="module")
def dask() -> Iterator[Any]:
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None, silence_logs=50
    ) as cluster:
        yield cluster


@pytest.mark.thorough
def test_a_dask_worker_that_is_killed_costs_nothing(serial: Path, tmp_path: Path, dask: Any) -> None:
    client, folder = connect_dask_scheduler(dask.scheduler_address), StudyFolder(tmp_path / "study.dp")

    def kill_one() -> None:
        while not folder.finished():
            time.sleep(0.01)
        process = next(iter(client.run(os.getpid).values()))
        os.kill(process, signal.SIGKILL)

    killer = threading.Thread(target=kill_one)
    killer.start()
    with client:
        summary = Study(settings()).run(folder.path, samples=12, executor=client)
        killer.join()
    assert (summary.done, summary.failed) == (12, 0)
    same(open_study(serial), open_study(folder.path))


@pytest.mark.thorough
def test_the_command_runs_on_a_scheduler(serial: Path, tmp_path: Path, dask: Any, small_study_file: Path) -> None:
    small_study_file.write_text(small_study_file.read_text() + '\n[scene.solver]\nblocks = "rigid"\n')
    command = [sys.executable, "-m", "damagepred", "study", str(small_study_file), "-n", "12"]
    run = subprocess.run([*command, "--scheduler", dask.scheduler_address], capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr
    assert "12 of 12 walls done, 0 failed" in run.stdout
    same(open_study(serial), open_study(small_study_file.with_suffix(".dp")))
