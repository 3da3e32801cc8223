"""Slower code is detected, and a slow machine is not mistaken for it."""

import json
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from damagepred.solvers.explicit import scheme as explicit
from tests.regressions.cases import GATE, Case
from tests.regressions.conftest import BASELINE, OTHER_PROCESSOR, reference
from tests.regressions.measure import TRIES, Rounds, Work, slow
from tests.regressions.yardsticks import yardstick

PROCESSORS = json.loads(BASELINE.read_text(encoding="utf-8"))["processors"]
BY_NAME = {case.name: case for case in GATE}


def judged(case: Case, usual: Work, now: Work) -> tuple[bool, Rounds]:
    """Return whether work counts as slow where it usually takes what the usual takes here, and what was measured.

    Both are measured in turn and over several tries: the ratio of either changes from one try to the next.
    """
    beside, before, found = yardstick(case.beside), Rounds(), Rounds()
    for _ in range(TRIES):
        for _ in range(case.rounds):
            before.add(usual, beside, 1)
            found.add(now, beside, 1)
        time.sleep(0.1)
    return slow(found, now, beside, case.rounds, case.bound * before.ratio, pause=0.1), found


@pytest.mark.parametrize("name", ["explicit cycle, cracked", "factorisation", "archive read"])
def test_work_done_twice_is_caught(name: str, tmp_path: Path) -> None:
    case = BY_NAME[name]
    work, _ = case.prepare(tmp_path)

    def twice() -> None:
        work()
        work()

    was_slow, found = judged(case, work, twice)
    assert was_slow, found
    assert len(found.case) == (2 * TRIES - 1) * case.rounds


def test_a_kernel_run_twice_inside_is_caught(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    case = BY_NAME["explicit cycle, cracked"]
    work, _ = case.prepare(tmp_path)
    kernel = explicit.run_cycles

    def slower(*arguments: object) -> object:
        kernel(*arguments)
        return kernel(*arguments)

    def work_slowly() -> None:
        with monkeypatch.context() as patch:
            patch.setattr(explicit, "run_cycles", slower)
            work()

    assert judged(case, work, work_slowly)[0]


def test_a_machine_that_is_slow_as_a_whole_does_not_fail() -> None:
    """All times are four times as long, of case and yardstick alike."""
    case = BY_NAME["explicit cycle, cracked"]
    beside = yardstick(case.beside)
    found = Rounds()

    def all_slow() -> None:
        for _ in range(4):
            beside()

    found.add(all_slow, all_slow, 10)
    assert 0.8 < found.ratio < 1.25


def test_after_a_short_disturbance_a_case_is_measured_again() -> None:
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
    beside, before, found = yardstick(case.beside), Rounds(), Rounds()
    before.add(work, beside, 2 * case.rounds)
    busy = [subprocess.Popen([sys.executable, "-c", "while True: sum(range(1000))"]) for _ in range(3)]
    try:
        found.add(work, beside, case.rounds)
        assert not slow(found, work, beside, case.rounds, case.bound * before.ratio, pause=0.1)
    finally:
        for process in busy:
            process.kill()
            process.wait()


def test_each_case_has_a_baseline_and_a_unique_name() -> None:
    names = [case.name for case in GATE]
    assert len(set(names)) == len(names)
    for processor in PROCESSORS.values():
        ratios = {name: kept["ratio"] for name, kept in processor["cases"].items()}
        assert set(ratios) == set(names)
        assert all(np.isfinite(ratio) and ratio > 0.0 for ratio in ratios.values())
    assert all(case.bound < 2.0 for case in GATE)  # so that work done twice is caught


def test_a_processor_without_a_baseline_is_compared_with_the_largest_ratio() -> None:
    one, other = ({"cases": {"a": {"ratio": 1.0}, "b": {"ratio": 3.0}}}, {"cases": {"a": {"ratio": 2.0}}})
    known = {"one": one, "other": other}
    assert reference(known, "one") == (one["cases"], 1.0)
    assert reference(known, "a third") == ({"a": {"ratio": 2.0}, "b": {"ratio": 3.0}}, OTHER_PROCESSOR)
