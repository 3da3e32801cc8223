"""A worker that dies or hangs costs its own sample and no other."""

import os
import time
from collections.abc import Mapping

from damagepred.study.sample import Outcome
from damagepred.study.workers import LocalPool, Lost, run_all


def troubled(folder: str, sample: int, values: Mapping[str, float]) -> Outcome:
    """Die, hang, fail or succeed, by number."""
    if sample % 10 == 3:
        os._exit(9)
    if sample % 10 == 6:
        time.sleep(60)
    if sample % 10 == 8:
        raise RuntimeError("no memory for this one")
    return Outcome(sample, 0, os.environ["OPENBLAS_NUM_THREADS"], values["x"])


def test_the_others_survive() -> None:
    pool = LocalPool("nowhere", workers=2, timeout=1.0, task=troubled)
    began = time.monotonic()
    try:
        results = list(run_all(pool.submit, ((i, {"x": float(i)}) for i in range(20)), 4, lambda: False))
    finally:
        pool.kill()
    assert time.monotonic() - began < 50
    lost = {r.sample: r.reason for r in results if isinstance(r, Lost)}
    assert lost == {3: "worker_died", 13: "worker_died", 6: "timeout", 16: "timeout", 8: "error", 18: "error"}
    good = [r for r in results if isinstance(r, Outcome)]
    assert sorted(r.sample for r in good) == [i for i in range(20) if i not in lost]
    assert all(r.seconds == r.sample and r.message == "1" for r in good), "one BLAS thread a worker"


def test_draining_waits_for_what_runs_and_starts_nothing_new() -> None:
    from concurrent.futures import ThreadPoolExecutor

    started: list[int] = []

    def slow(folder: str, sample: int, values: Mapping[str, float]) -> Outcome:
        started.append(sample)
        time.sleep(0.2)
        return Outcome(sample, 0, "", 0.0)

    with ThreadPoolExecutor(2) as executor:
        seen: list[int] = []

        def submit(sample: int, values: Mapping[str, float]):
            return executor.submit(slow, "", sample, values)

        results = run_all(submit, ((i, {}) for i in range(50)), 4, lambda: len(seen) >= 2)
        seen.extend(result.sample for result in results)
    assert len(started) < 10
    assert len(seen) >= 2
    assert sorted(seen) == sorted(started)
