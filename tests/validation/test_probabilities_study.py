"""The benchmark of probabilities: its errors for known answers, and its small form."""

import math
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pandas as pd
import pytest
from scipy import special

from damagepred.uq.samplers import unit_points
from studies.benchmarks.probabilities import errors, summary, walls
from tests.conftest import ROOT

ROOM = ROOT / "studies" / "benchmarks" / "probabilities"
STEP = 0.05e-3


@pytest.fixture
def room() -> dict[str, ModuleType]:
    return {"errors": errors, "summary": summary, "walls": walls}


def effective_reached(room: dict[str, ModuleType], normal: np.ndarray, factor: float = 1.0) -> object:
    """Return walls whose capacities are lognormal, median 1 mm times a factor, dispersion 0.4; known within steps."""
    capacity = factor * 1e-3 * np.exp(0.4 * normal)
    upper = STEP * np.ceil(capacity / STEP)
    return room["walls"].Bank(upper - STEP, upper, np.ones_like(upper))


@pytest.mark.thorough
def test_errors_of_walls_with_a_known_answer(room: dict[str, ModuleType], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(room["errors"], "DRAWS", 120)
    monkeypatch.setattr(room["errors"], "powers", lambda a, b: [n for n in (64, 256, 1024) if n <= b])
    random = np.random.default_rng(1).standard_normal((1, 8192))
    points = np.array([unit_points("sobol", 1, 256, seed)[:, 0] for seed in range(16)])
    banks = {
        "random": effective_reached(room, random),
        "sobol": effective_reached(room, special.ndtri(points)),
        "two contacts": effective_reached(room, random, 1.08),
    }
    cost = pd.Series({"random": 0.02})
    rows = pd.DataFrame(room["errors"].curve_rows(banks, cost))
    median = rows[rows["question"] == "median"].set_index(["method", "walls"])
    assert median.loc[("random", 64), "truth"] == pytest.approx(1e-3, rel=0.01)
    # of a lognormal's median: dispersion over the root of the number of walls
    for n in (64, 256, 1024):
        assert median.loc[("random", n), "error"] == pytest.approx(0.4 / math.sqrt(n), rel=0.2)
    assert median.loc[("Sobol", 256), "error"] < 0.2 * median.loc[("random", 256), "error"]
    gains = room["summary"].with_gain(rows.assign(wall="joints")).set_index(["method", "walls"])["gain"]
    assert gains["random", 1024] == pytest.approx(1.0, rel=0.3)
    assert gains["Sobol", 256] > 10.0
    floors = pd.DataFrame(room["errors"].floors_of("joints", banks)).set_index("what")
    assert floors.loc["two contacts", "difference"] == pytest.approx(0.08, abs=0.005)
    assert abs(floors.loc["lognormal form", "difference"]) < 4 * floors.loc["lognormal form", "error"] + 1e-3


@pytest.mark.slow
def test_the_small_form_runs(tmp_path: Path) -> None:
    call = [sys.executable, str(ROOM / "run.py"), "--quick", "--output", str(tmp_path)]
    done = subprocess.run(call, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    rows = pd.read_csv(tmp_path / "data.csv")
    assert {"random", "Sobol", "Latin hypercube"} <= set(rows["method"])
    sets = pd.read_csv(tmp_path / "results" / "sets.csv").set_index("set")["walls"]
    assert sets.to_dict() == {"random": 24, "sobol": 16, "lhs 8": 16, "rare random": 24, "importance": 16}
    # of the order of the small probability that many random walls find
    assert 1e-4 < pd.read_csv(tmp_path / "results" / "subset.csv")["probability"][0] < 0.1
    again = subprocess.run(call, capture_output=True, text=True)  # nothing is solved twice
    assert again.returncode == 0
    assert " of " not in again.stderr
    assert list(pd.read_csv(tmp_path / "data.csv")["error"]) == list(rows["error"])
