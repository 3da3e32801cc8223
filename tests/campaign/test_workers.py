"""A worker that dies or hangs costs only time, and finds kernels compiled; a sample that always kills has failed."""

import math
import os
import signal
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from damagepred import Study, StudyError, open_study
from damagepred.campaign import campaign, dispatch
from damagepred.campaign.dispatch import Batches, Engine, LostSample, run_all
from damagepred.campaign.sample import Outcome
from damagepred.campaign.workers import START_LIMIT, LocalPool

Batch = Sequence[tuple[int, Mapping[str, float]]]


def troubled(folder: str, batch: Batch) -> list[Outcome]:
    """Die, hang, fail or succeed, by number."""
    found = []
    for sample, values in batch:
        if sample % 10 == 3:
            os._exit(9)
        if sample % 10 == 6:
            time.sleep(3600)  # longer than this test may take
        if sample % 10 == 8:
            raise RuntimeError("no memory for this one")
        found.append(Outcome(sample, 0, values["x"], os.environ["OPENBLAS_NUM_THREADS"]))
    return found


def moody(folder: str, batch: Batch) -> list[Outcome]:
    """Die, hang or fail at the first attempt only; a file in the folder records the attempt."""
    for sample, _ in batch:
        note = Path(folder) / str(sample)
        if not note.exists():
            note.touch()
            if sample % 4 == 1:
                os.kill(os.getpid(), signal.SIGKILL)
            if sample % 4 == 2:
                os.kill(os.getpid(), signal.SIGSTOP)
            if sample % 4 == 3:
                raise RuntimeError("once")
    return [Outcome(sample, 0, 1e-3) for sample, _ in batch]


def stillborn() -> None:
    os._exit(7)


def tasks(count: int) -> list[tuple[int, dict[str, float]]]:
    return [(i, {"x": float(i)}) for i in range(count)]


def never() -> int:
    return 0


@pytest.mark.thorough
def test_the_others_survive(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(dispatch, "run_batch", troubled)
    with LocalPool(workers=2, timeout=1.0) as pool:
        results = list(run_all(Engine("nowhere", pool), Batches(tasks(10), 10), never))
    lost = {r.sample: r for r in results if isinstance(r, LostSample)}
    reasons = {3: "worker_died", 6: "timeout", 8: "error"}
    assert {sample: r.reason for sample, r in lost.items()} == reasons
    assert "exit code 9" in lost[3].message
    assert "1 s" in lost[6].message
    assert "no memory for this one" in lost[8].message
    good = [r for r in results if isinstance(r, Outcome)]
    assert sorted(r.sample for r in good) == [i for i in range(10) if i not in lost]
    assert all(r.seconds == r.sample and r.message == "1" for r in good), "one BLAS thread a worker"


@pytest.mark.thorough
def test_lost_samples_are_tried_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Killed workers, stopped workers, lost answers: each sample has its result."""
    monkeypatch.setattr(dispatch, "run_batch", moody)
    with LocalPool(workers=2, timeout=0.5) as pool:
        results = list(run_all(Engine(str(tmp_path), pool), Batches(tasks(4), 4), never))
    assert sorted(r.sample for r in results if isinstance(r, Outcome)) == list(range(4))


@pytest.mark.thorough
def test_workers_ignore_interrupts_while_they_load_the_program() -> None:
    with LocalPool(workers=1, timeout=None, preload=True) as pool:
        time.sleep(0.4)
        first = pool.processes
        for process, number in zip(2 * first, (signal.SIGINT, signal.SIGTERM)):
            os.kill(process, number)
        assert pool.submit(troubled, "", [(1, {"x": 1.0})]).result(timeout=60)[0].sample == 1
        assert pool.processes == first


def test_workers_end_if_the_design_cannot_be_drawn(small_study_file, tmp_path, monkeypatch) -> None:
    pools: list[LocalPool] = []

    def pool(*arguments: Any, **how: Any) -> LocalPool:
        pools.append(LocalPool(*arguments, **how))
        return pools[-1]

    def refuse(*_: Any) -> None:
        assert not pools[0]._over(), "workers load the program meanwhile"
        raise StudyError("no such design")

    monkeypatch.setattr(campaign, "LocalPool", pool)
    monkeypatch.setattr(campaign.Campaign, "_prepare", refuse)
    with pytest.raises(StudyError, match="no such design"):
        Study.from_toml(small_study_file).run(tmp_path / "a.dp", workers=2)
    assert pools[0]._over()
    assert not pools[0].processes


def test_a_worker_has_a_time_to_start_to_begin_a_batch_and_to_solve_it() -> None:
    def deadline(timeout: float | None = 5.0, **changes: Any) -> float:
        idle = {"began": None, "is_ready": True, "is_told": True, "future": None, "asked": 100.0}
        pool: Any = SimpleNamespace(timeout=timeout, answer_limit=60.0)
        worker: Any = SimpleNamespace(**idle | changes)
        return LocalPool._deadline(pool, worker)

    assert deadline() == deadline(is_ready=False, is_told=False) == deadline(None, began=110.0) == math.inf
    assert deadline(is_ready=False) == 100.0 + START_LIMIT
    assert deadline(future=Future()) == 160.0
    assert deadline(future=Future(), began=110.0) == 115.0


@pytest.mark.thorough
def test_idle_workers_that_hang_are_replaced() -> None:
    """A worker that is stopped between two batches never says that the next has begun."""
    with LocalPool(workers=1, timeout=None, answer_limit=0.5) as pool:
        pool.submit(troubled, "", [(0, {"x": 0.0})]).result(timeout=60)
        (first,) = pool.processes
        os.kill(first, signal.SIGSTOP)
        assert pool.submit(troubled, "", [(1, {"x": 1.0})]).result(timeout=60)[0].sample == 1
        assert first not in pool.processes


@pytest.mark.thorough
def test_workers_that_cannot_start_end_the_run() -> None:
    died = r"3 worker processes in a row died before they began \(exit code 7\)"
    with LocalPool(workers=1, timeout=None, prepare=stillborn) as pool, pytest.raises(StudyError, match=died):
        list(run_all(Engine("", pool), Batches(tasks(2), 2), never))


@pytest.mark.thorough
def test_workers_end_with_their_parent(tmp_path: Path) -> None:
    import subprocess
    import sys

    script = """
import sys, time
from damagepred.campaign.workers import LocalPool
from tests.campaign.test_workers import troubled
pool = LocalPool(2, None)
pool.submit(troubled, "", [(6, {"x": 1.0})]); pool.submit(troubled, "", [(16, {"x": 1.0})])
time.sleep(0.5)
print(*pool.processes, flush=True)
time.sleep(60)
"""
    parent = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True)
    workers = [int(number) for number in parent.stdout.readline().split()]
    assert len(workers) == 2
    parent.kill()  # the parent alone
    parent.wait()
    while any(Path(f"/proc/{worker}").exists() for worker in workers):
        time.sleep(0.1)  # until the test takes too long


@pytest.mark.worker_processes
@pytest.mark.thorough
def test_one_pool_runs_one_study_after_the_other_as_each_alone(small_study_file: Path, tmp_path: Path) -> None:
    """Its workers stay; one that is killed in between is replaced."""
    study, pids = Study.from_toml(small_study_file), []
    with ThreadPoolExecutor(1) as executor:
        study.run(tmp_path / "alone.dp", samples=3, executor=executor)
    with LocalPool(1, timeout=600.0) as pool:
        for name in ("first.dp", "second.dp", "third.dp"):
            study.run(tmp_path / name, samples=3, executor=pool)
            pids += pool.processes
            if name == "second.dp":
                os.kill(pids[-1], signal.SIGKILL)
    assert pids[0] == pids[1] != pids[2]
    alone = open_study(tmp_path / "alone.dp")
    for name in ("first.dp", "second.dp", "third.dp"):
        found = open_study(tmp_path / name)
        for variable in ("crack_width_max", "damage_category", "joint.tensile_strength"):
            if variable in alone:
                assert found[variable].values.tobytes() == alone[variable].values.tobytes()


SCRIPT = """
import gc, sys

from numba.core.dispatcher import Dispatcher

from damagepred.kernels.jit import Phase
from damagepred.one_wall.solve import solve
from damagepred.scene import Scene
from damagepred.campaign.warm_up import warm_up


def compiled():
    kernels = [kernel for kernel in gc.get_objects() if isinstance(kernel, (Dispatcher, Phase))]
    phases = {(f.function.__qualname__, id(f)) for f in kernels if isinstance(f, Phase) and f._compiled}
    functions = [function for function in kernels if isinstance(function, Dispatcher)]
    return phases | {(f.py_func.__qualname__, str(s)) for f in functions for s in f.signatures}


scene = Scene.from_toml(sys.argv[1])
warm_up(scene)
before = compiled()
assert len(before) > 20
solve(scene, increments=4)
print(sorted(compiled() - before))
"""


@pytest.mark.thorough
@pytest.mark.parametrize("name", ["bryant_window_dishing", "bryant_doming"])
def test_solving_a_wall_compiles_nothing_more(data_folder: Path, name: str) -> None:
    script = [sys.executable, "-c", SCRIPT, str(data_folder / f"{name}.toml")]
    found = subprocess.run(script, capture_output=True, text=True, check=True)
    assert found.stdout.strip() == "[]"


CRACKED_FOOTING_ON_A_MOUND = """
wall = { length = 2.4, height = 0.6 }
dpc = { course = 2 }
footing = { width = 0.2, depth = 0.15, concrete = {} }
movement = { kind = "doming", shape = "mound" }
mound = { surface_movement = 0.05 }
soil = { shrinking_stiffness = 2e7 }
"""


@pytest.mark.thorough
def test_a_footing_on_a_mound_compiles_nothing_more(tmp_path: Path) -> None:
    file = tmp_path / "mound.toml"
    file.write_text(CRACKED_FOOTING_ON_A_MOUND)
    found = subprocess.run([sys.executable, "-c", SCRIPT, str(file)], capture_output=True, text=True, check=True)
    assert found.stdout.strip() == "[]"
