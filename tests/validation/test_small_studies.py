"""Studies of coverage, exports, throughput and work-precision: a few of their cases."""

from pathlib import Path

import numpy as np
import pytest

from damagepred.exports import pelicun_frame
from studies.benchmarks.work_precision import errors, run
from tests.validation.test_validation_cases import ROOT, module

STUDIES = ROOT / "studies"


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("interval", "samples"),
    [
        ("curve", "5 damaged, all of the walls"),
        ("curve", "5 damaged, half of the walls"),
        ("surface", "8 walls"),
        ("median", "8 walls"),
        ("estimate, random walls", "200 walls, probability 0.2"),
    ],
)
def test_intervals_have_the_stated_coverage(interval: str, samples: str) -> None:
    """Of 60 repetitions 54 expected; 46 or fewer come in 0.3 % of binomial draws of 0.9."""
    coverage = module("coverage_run", STUDIES / "coverage" / "run.py")
    rows = coverage.measure(interval, samples, coverage.cases()[interval, samples], 60, 2)
    assert rows
    for row in rows:
        assert row["given"] > 0.9, row
        assert row["coverage"] >= 46 / 60, row


def test_the_page_of_coverage_has_its_table() -> None:
    coverage = module("coverage_run", STUDIES / "coverage" / "run.py")
    assert coverage.table(coverage.HERE) in (coverage.HERE / "README.md").read_text(encoding="utf-8")


def test_the_study_of_exports_compares_its_curves() -> None:
    exports = module("exports_run", STUDIES / "exports" / "run.py")
    for measure, (_, unit, _, medians, dispersion) in exports.CASES.items():
        row = pelicun_frame(exports.known_curves(measure)).iloc[0]
        assert row["Demand-Unit"] == unit
        assert [row[f"LS{i}-Theta_0"] for i in range(1, 5)] == list(medians)
        assert np.allclose([row[f"LS{i}-Theta_1"] for i in range(1, 5)], dispersion, rtol=0)


@pytest.mark.slow
def test_figures_of_throughput_are_consistent(tmp_path: Path) -> None:
    row = module("throughput_run", STUDIES / "throughput" / "run.py").measure(12, 1, tmp_path / "one.dp")
    assert 0.0 < row["walls_solved_in_s"] < row["total_s"]
    assert 50.0 < row["processor_ms_a_wall"] < 1e3 * row["worker_processor_s"]
    assert 100.0 < row["peak_MB_a_worker"] < 1000.0
    assert row["bytes_a_wall"]["parts"] < 10_000


@pytest.mark.thorough
def test_defaults_solve_their_equations_to_one_percent():
    """What the page of work-precision concludes, of walls with one answer: compared with its data."""
    lines = errors.with_errors(errors.load(run.DATA))
    for scene in ("dishing", "doming", "window, strong", "stack", "large"):
        own = lines[(lines["scene"] == scene) & (lines["axis"] == "default") & (lines["solution_floor"] < 0.01)]
        assert len(own) >= 4, scene
        assert own["solution"].max() < 0.01, scene
