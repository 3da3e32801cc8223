"""Studies of coverage, exports, throughput, work-precision, other solvers and undetermined outputs: a few cases."""

import runpy
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from damagepred.exports.programs import pelicun_frame
from damagepred.scene import Solver
from studies.benchmarks.beside_others import run as beside_others
from studies.benchmarks.beside_others import summary
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
@pytest.mark.worker_processes
def test_figures_of_throughput_are_consistent(tmp_path: Path) -> None:
    row = module("throughput_run", STUDIES / "throughput" / "run.py").measure(40, 1, tmp_path / "one.dp")
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


ROOM = Path(__file__).resolve().parents[2] / "studies" / "benchmarks" / "beside_others"
WEIGHT = 5 * 6 * 0.24 * 0.075 * 0.11 * 2000 * 9.81


@pytest.mark.thorough
def test_damagepred_in_the_comparison(tmp_path: Path) -> None:
    beside_others.main(["--quick", "--output", str(tmp_path)])
    runs = pd.read_csv(tmp_path / "runs.csv").set_index(["case", "solver", "settings"])
    for solver in beside_others.OURS:
        assert runs.loc[("settling", solver, "default"), "residual"] < Solver(method=solver).tolerance_used
    np.testing.assert_allclose(runs["weight on the ground"], 1.0, atol=1e-4)
    settled, dropped = (beside_others.solved(case, "5x6", "quasi_static", "default") for case in ("settling", "gap"))
    # uniform under its own weight: perpends carry nothing, and half bricks stand at the ends of every other course
    np.testing.assert_allclose(settled["base"], WEIGHT / 5, rtol=1e-3)
    # over the dropped ground the lowest course goes down with it, and leaves most of the weight to its neighbours
    np.testing.assert_allclose(dropped["displacement"][1:4, 1], -8e-3, atol=1e-4)
    carried = runs.loc["gap", "weight on what dropped"]
    assert ((carried > 0.09) & (carried < 0.25)).all()


def test_the_committed_data() -> None:
    runs = pd.read_csv(ROOM / "runs.csv")
    assert not runs.duplicated(summary.KEY).any()
    assert runs["version"].str.startswith("0.").all()
    settled = runs[(runs["case"] == "settling") & (runs["residual"] < 1e-3)]
    assert {"quasi_static", "explicit", "pymunk", "lmgc90"} <= set(settled["solver"])
    np.testing.assert_allclose(settled["weight on the ground"], 1.0, atol=1e-3)


RUN = runpy.run_path(str(Path(__file__).resolve().parents[2] / "studies" / "determined" / "run.py"))
SMALL = "1.2 x 0.45 m on a dpc, 2 increments"


def test_spread_and_row_by_hand() -> None:
    assert RUN["spread"]([4.0, 3.0, 5.0], 1.0) == pytest.approx(0.4)
    assert RUN["spread"]([0.0, 2e-6], 1e-5) == pytest.approx(0.2)
    assert np.isnan(RUN["spread"]([1.0, np.nan], 1.0))
    assert [RUN["percent"](s) for s in (0.0, 1e-9, 0.0123, 1.0, np.nan)] == ["0", "< 1e-4 %", "1.2 %", "100 %", "-"]
    widths = dict.fromkeys(RUN["WIDTHS"], 2e-3)
    one = RUN["Outputs"](widths, 1.0, 1.0, 7, 1, 10.0, 1.0)
    other = one._replace(widths=widths | {"crack_width_max": 1e-3}, reaction=0.99, cracked=9, work=20.0, seconds=3.0)
    assert RUN["row"]("wall", "explicit", [one, other]) == [
        *("wall", "explicit", "0", "50 %", "0", "0", "1 %", "7 to 9", "1", "15", "3.00 s")
    ]


def test_stiffnesses_change_by_the_last_digits() -> None:
    (scene,) = RUN["scenes"]([SMALL]).values()
    still, changed = (RUN["changed_stiffness"](scene, number) for number in (0, 1))
    assert set(changed) == {f"{table}.{k}_stiffness" for table in ("joint", "dpc") for k in ("normal", "shear")}
    for name, values in changed.items():
        off = np.abs(values / still[name] - 1.0)
        assert 0.5e-12 < off.max() < 1.1e-12


def test_both_solvers_determine_a_small_wall_on_a_dpc() -> None:
    """Before damping turned with the motion, the explicit opening differed by up to a half."""
    (scene,) = RUN["scenes"]([SMALL]).values()
    for method, allowed in (("explicit", 5e-4), ("quasi_static", 1e-9)):
        found = [RUN["outputs"](scene, method, number) for number in range(3)]
        openings = [f.widths["dpc_opening_max"] for f in found]
        assert RUN["spread"](openings, 1e-5) < allowed
        assert np.mean(openings) == pytest.approx(7.56e-3, rel=2e-3)


@pytest.mark.thorough
def test_the_quick_form(capsys: pytest.CaptureFixture[str]) -> None:
    """The dry wall: single joints move, its crack band and category do not."""
    RUN["main"](["--quick"])
    rows = [line.split(" | ") for line in capsys.readouterr().out.splitlines()[2:]]
    assert [row[1] for row in rows[2:]] == ["explicit", "quasi_static"] * 2
    assert {len(row) for row in rows if len(row) > 1} == {len(RUN["HEAD"])}
    dry = dict(zip(RUN["HEAD"], rows[3], strict=True))
    assert (dry["widest joint"], dry["crack band"], dry["category"]) == ("< 1e-4 %", "< 1e-4 %", "1")
