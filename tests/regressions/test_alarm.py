"""What has become slow is caught, and a slow machine is not taken for it."""

import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from damagepred.solvers import explicit
from tests.regressions import cases
from tests.regressions.cases import GATE, Case
from tests.regressions.conftest import BASELINE
from tests.regressions.measure import TRIES, Rounds, slow
from tests.regressions.yardsticks import yardstick

BASE = {name: kept["ratio"] for name, kept in json.loads(BASELINE.read_text(encoding="utf-8"))["cases"].items()}
BY_NAME = {case.name: case for case in GATE}


def judged(case: Case, work: Callable[[], object]) -> tuple[bool, Rounds]:
    """Return whether work in place of a case's own counts as slow, and what was measured."""
    beside, found = yardstick(case.beside), Rounds()
    found.add(work, beside, case.rounds)
    return slow(found, work, beside, case.rounds, case.bound * BASE[case.name], pause=0.1), found


@pytest.mark.parametrize("name", ["explicit cycle, cracked", "factorisation", "archive read"])
def test_work_done_twice_is_caught(name: str, tmp_path: Path) -> None:
    work, _ = BY_NAME[name].prepare(tmp_path)

    def twice() -> None:
        work()
        work()

    was_slow, found = judged(BY_NAME[name], twice)
    assert was_slow, found.ratio / BASE[name]
    assert len(found.case) == TRIES * BY_NAME[name].rounds


def test_a_kernel_run_twice_inside_is_caught(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    case = BY_NAME["explicit cycle, cracked"]
    work, _ = case.prepare(tmp_path)
    kernel = explicit.run_cycles

    def slower(*arguments: object) -> object:
        kernel(*arguments)
        return kernel(*arguments)

    monkeypatch.setattr(explicit, "run_cycles", slower)
    assert judged(case, work)[0]


def test_a_machine_that_is_slow_as_a_whole_is_not_taken_for_it() -> None:
    """All takes four times as long, and that hits case and yardstick alike."""
    case = BY_NAME["explicit cycle, cracked"]
    beside = yardstick(case.beside)
    found = Rounds()

    def all_slow() -> None:
        for _ in range(4):
            beside()

    found.add(all_slow, all_slow, 10)
    assert 0.8 < found.ratio < 1.25


def test_what_disturbs_for_a_moment_is_measured_again() -> None:
    burst = iter([5, 5, 5, 1, 1, 1])
    work = yardstick({"interpreter": 1})

    def disturbed() -> None:
        for _ in range(next(burst)):
            work()

    found = Rounds()
    found.add(disturbed, work, 3)
    assert found.ratio > 3.0
    assert not slow(found, disturbed, work, 3, 1.7, pause=0.0)
    assert len(found.case) == 6


def test_busy_neighbours_do_not_make_it_slow(tmp_path: Path) -> None:
    case = BY_NAME["factorisation"]
    work, _ = case.prepare(tmp_path)
    busy = [subprocess.Popen([sys.executable, "-c", "while True: sum(range(1000))"]) for _ in range(3)]
    try:
        assert not judged(case, work)[0]
    finally:
        for process in busy:
            process.kill()
            process.wait()


def test_each_case_has_a_baseline_and_a_name_of_its_own() -> None:
    names = [case.name for case in (*GATE, *cases.LONG)]
    assert len(set(names)) == len(names)
    assert {case.name for case in GATE} <= set(BASE) <= set(names)
    assert all(np.isfinite(ratio) and ratio > 0.0 for ratio in BASE.values())
    assert all(case.bound < 2.0 for case in GATE)  # so that work done twice is caught
