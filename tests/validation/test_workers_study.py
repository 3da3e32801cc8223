"""The model of studies on many workers: what it says where the answer is known, and its small form."""

import runpy
import subprocess
import sys
from pathlib import Path

import pandas as pd
import pytest

from damagepred.study.campaign.dispatch import Batches
from tests.conftest import ROOT

ROOM = ROOT / "studies" / "benchmarks" / "workers"


def test_the_model_where_the_answer_is_known() -> None:
    model = runpy.run_path(str(ROOM / "model.py"))
    Costs, predicted = model["Costs"], model["predicted"]
    free = Costs(wall=0.1, start=0, drawing=0, parent=0, merging=0, bytes=0)
    assert predicted(free, 1000, 1).total == pytest.approx(100)
    # on two workers the last batch of two seconds keeps one waiting for one on average
    assert predicted(free, 1000, 2).total == pytest.approx(51)
    costs = free._replace(start=5, drawing=1e-3, parent=2e-3, merging=4e-3)
    assert predicted(costs, 1000, 1).total == pytest.approx(5 + 1 + 100 + 4)
    assert model["most_workers"](costs) == pytest.approx(50)
    assert not predicted(costs, 10_000, 49).bound
    many = predicted(costs, 10_000, 1000)
    assert many.bound
    assert many.solving - many.waiting == pytest.approx(20)
    assert many.efficiency < 0.05


def test_the_model_hands_out_as_much_as_the_program() -> None:
    model = runpy.run_path(str(ROOM / "model.py"))
    for wall, samples in ((0.03, 1000), (0.25, 1_000_000), (10.0, 100)):
        batches = Batches(((i, {}) for i in range(samples)), samples)
        for _ in range(10):
            batches.note(wall)
        costs = model["Costs"](wall, 0, 0, 0, 0, 0)
        assert model["batch_seconds"](costs, samples) == pytest.approx(batches.size() * wall, rel=0.05)


@pytest.mark.slow
def test_the_small_form_runs(tmp_path: Path) -> None:
    call = [sys.executable, str(ROOM / "run.py"), "--quick", "--wall", "window", "--into", str(tmp_path)]
    done = subprocess.run(call, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    (parts,) = pd.read_csv(tmp_path / "parts.csv").to_dict("records")
    assert 0.001 < parts["wall"] < 2
    assert 0 < parts["parent"] < 0.1 * parts["wall"]
    (run,) = pd.read_csv(tmp_path / "runs.csv").to_dict("records")
    assert run["walls"] == 24
    assert run["workers"] == 2
