"""The validation of distributions: its scores by hand, its published figures, and a small run of a case."""

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pandas as pd
import pytest

from damagepred.inputs.data_files import data_file
from damagepred.uq.discrepancy import Discrepancy

ROOT = Path(__file__).resolve().parents[2]
CASES = ROOT / "studies" / "validation"
JUDGED = ("spandrels", "shear_wall", "window_wall", "ramsgate", "bryant", "shear_panel")


def module(name: str, file: Path) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, file)
    found = importlib.util.module_from_spec(spec)
    sys.modules[name] = found
    spec.loader.exec_module(found)
    return found


@pytest.fixture
def paths(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the cases find what they share; modules of that name of other studies are put aside."""
    for name in ("cases", "measures", "solving", "table", "judging", "crossing"):
        monkeypatch.delitem(sys.modules, name, raising=False)
    monkeypatch.setattr(sys, "path", [str(CASES), str(ROOT / "studies" / "bryant_1993"), *sys.path])


def test_a_prediction_is_judged_by_hand(paths: None) -> None:
    judging = module("judging", CASES / "judging.py")
    row = judging.judged("force", "kN", np.array([1.0, 2.0, 3.0, np.nan]), np.array([2.0, 9.0, 1.0, 4.0]))
    assert (row["walls"], row["observations"], row["observed_mean"], row["predicted_mean"]) == (3, 4, 4.0, 2.0)
    assert row["pit"] == "0.500 1.000 0.167 1.000"
    assert row["coverage_90"] == 0.25
    assert row["observed_cov"] == pytest.approx(np.std([2, 9, 1, 4], ddof=1) / 4.0)
    assert row["observed_cov_low"] < row["observed_cov"] < row["observed_cov_high"]
    assert "force, kN | 4 (4), 0.89 | 2 (3)" in judging.table([row])


def test_the_page_over_all_is_that_of_the_scores(paths: None) -> None:
    """The published table is what the cases' scores say, and each case says where it stands."""
    run = module("validation_run", CASES / "run.py")
    scores = {case: pd.read_csv(CASES / case / "scores.csv") for case in run.CASES if case in JUDGED}
    page = (CASES / "README.md").read_text(encoding="utf-8")
    assert run.over_all(scores) in page
    for case, rows in scores.items():
        text = (CASES / case / "README.md").read_text(encoding="utf-8")
        for row in rows.itertuples():  # scores have four digits
            near = [f"| {row.predicted_mean * (1.0 + e):.3g} ({row.walls})" for e in (-5e-4, 0.0, 5e-4)]
            assert any(said in text for said in near), (case, row.quantity)


def test_observations_of_the_spandrels_have_the_reported_moments() -> None:
    seen = pd.read_csv(CASES / "spandrels" / "observed.csv").query("quantity == 'peak'")["value"]
    assert len(seen) == 27
    assert seen.mean() == pytest.approx(21.3, abs=0.05)
    assert seen.std() / seen.mean() == pytest.approx(0.22, abs=0.005)


@pytest.mark.thorough
def test_a_case_runs_and_goes_on(paths: None, tmp_path: Path) -> None:
    """Three panels of the shear test, twice: the second time nothing is solved again."""
    case = module("validation_panel", CASES / "shear_panel" / "run.py")
    rows, _ = case.run(tmp_path, 3, 1)
    again, _ = case.run(tmp_path, 3, 1)
    assert rows[0]["walls"] == 3
    assert 35.0 < rows[0]["predicted_mean"] < 90.0
    assert again[0]["predicted_mean"] == rows[0]["predicted_mean"]


@pytest.mark.parametrize("case", [*JUDGED, "facades"])
def test_every_case_can_be_read(paths: None, case: str) -> None:
    """Scenes of all cases are valid, and their pages name the command that makes them."""
    found = module(f"validation_{case}", CASES / case / "run.py")
    assert callable(found.run)
    text = (CASES / case / "README.md").read_text(encoding="utf-8")
    assert f"python studies/validation/{case}/run.py" in text
    assert "COMMIT" not in text


@pytest.mark.thorough
def test_the_discrepancy_of_widths_is_what_the_cases_say(paths: None) -> None:
    """The shipped data, the page and the defaults are those of a new fit."""
    fitting = module("validation_discrepancy", CASES / "discrepancy.py")
    seen = fitting.widths(fitting.Prior())
    found = fitting.fit(seen, fitting.Prior())
    assert fitting.data_text(found) == data_file("statistics", "discrepancy.toml").read_text(encoding="utf-8")
    assert fitting.page_text(seen, found) in (CASES / "README.md").read_text(encoding="utf-8")
    assert Discrepancy().width == pytest.approx(found.width[1], rel=0.05)
    assert Discrepancy().width_share == pytest.approx(found.share[1], rel=0.05)
    origins = Discrepancy(width_share=0.1).origins()
    assert origins["width_share"] == ("-", "given")
    assert origins["level"] == ("-", "assumed")
    assert origins["width"][1] == "derived"
    assert " to " in origins["width"][0]


@pytest.mark.thorough
def test_the_fit_finds_a_known_discrepancy(paths: None) -> None:
    fitting = module("validation_discrepancy", CASES / "discrepancy.py")
    random = np.random.default_rng(4)
    true = np.concatenate((np.full(60, 5e-5), np.geomspace(2e-3, 9e-3, 60)))
    spread = np.hypot(3e-4, 0.4 * true)
    seen = [
        fitting.Width(str(k), "", value, 0.0, np.array([w]))
        for k, (w, value) in enumerate(zip(true, np.abs(true + spread * random.standard_normal(120))))
    ]
    found = fitting.fit(seen, fitting.Prior(points=15))
    assert found.width[0] < 3e-4 < found.width[2]
    assert found.share[0] < 0.4 < found.share[2]
    assert found.share[2] < 0.6
    half = fitting.fit(seen + seen, fitting.Prior(points=15))  # twice the same widths of a case count once
    assert half.share == pytest.approx(found.share)
