"""The results page agrees with the data; one command runs, records and ends all studies."""

import subprocess
import sys
import time
from pathlib import Path

import pandas as pd
import pytest

from studies import run as all_studies
from studies.benchmarks import run
from studies.benchmarks.probabilities.summary import seconds_to
from tests.conftest import ROOT

HERE = ROOT / "studies" / "benchmarks"


@pytest.mark.thorough
def test_the_page_agrees_with_the_data() -> None:
    text = run.text(all_studies.runs())
    assert text == (HERE / "RESULTS.md").read_text(encoding="utf-8"), "changed data: run studies/benchmarks/run.py"


def test_no_row_is_without_a_version() -> None:
    tables = [all_studies.runs()]
    tables += [pd.read_csv(HERE / name) for name in ("scaling/data.csv", "work_precision/data.csv")]
    tables += [pd.read_csv(HERE / "beside_others" / "runs.csv")]
    tables += [pd.read_csv(HERE / "probabilities" / f"{name}.csv") for name in ("data", "floors")]
    for table in tables:
        assert table["version"].str.startswith("0.").all()
        assert pd.to_datetime(table["date"]).notna().all()


def test_a_changed_datum_changes_the_page(tmp_path: Path) -> None:
    rows = pd.read_csv(HERE / "scaling" / "data.csv")
    rows["seconds"] *= 100.0
    rows.to_csv(tmp_path / "data.csv", index=False)
    assert run.section("scaling", tmp_path) != run.section("scaling")


def test_seconds_to_an_error() -> None:
    seconds, error = pd.Series([1.0, 4.0, 16.0, 64.0]), pd.Series([0.4, 0.2, 0.3, 0.05])
    assert seconds_to(seconds, 0.4 / seconds**0.5, 0.1) == "16"
    assert seconds_to(seconds, error, 0.3 / 6**0.5) == "32"  # halfway, and not the dip before
    assert (seconds_to(seconds, error, 0.5), seconds_to(seconds, error, 0.04)) == ("< 1", "> 64")


def test_the_list_of_studies_has_their_commands_and_prices() -> None:
    """Every study with a page is listed once, its program exists, its page names its command, and the sum is said."""
    known = all_studies.studies()
    pages = {str(page.parent.relative_to(ROOT / "studies")) for page in (ROOT / "studies").glob("*/README.md")}
    assert pages - set(known.index) == {"notebooks"}
    assert known.index.is_unique
    assert 0 < known["minutes"].sum() <= 160
    for name, command in known["command"].items():
        script = command.split()[1]
        assert (ROOT / script).is_file()
        page = HERE.parent / (name if (HERE.parent / name).is_dir() else Path(name).parent) / "README.md"
        text = page.read_text(encoding="utf-8")
        assert text.startswith("# ")
        assert text.splitlines()[0].endswith("?"), name
        assert name == "benchmarks" or f"python {script}" in text, name


def test_a_wrong_name_is_named() -> None:
    done = subprocess.run([sys.executable, str(HERE.parent / "run.py"), "skip"], capture_output=True, text=True)
    assert done.returncode == 2
    assert "skip" in done.stderr
    assert "brick_models" in done.stderr


def test_a_run_is_recorded_resumed_and_ended(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Results of another package are deleted, those of an interrupted run stay; what is complete is not run again."""
    monkeypatch.setattr(all_studies, "HERE", tmp_path)
    (tmp_path / "runs.csv").write_text("study,package,version,date,machine,minutes,end\ntoy,old,0,0,0,1,complete\n")
    (tmp_path / "toy" / "results").mkdir(parents=True)
    (tmp_path / "fail.py").write_text("raise SystemExit(2)")
    (tmp_path / "wait.py").write_text("import time; time.sleep(60)")
    (tmp_path / "pass.py").write_text("pass")
    assert all_studies.measure("toy", f"python {tmp_path / 'fail.py'}", 1.0) == "failed (2)"
    assert not (tmp_path / "toy" / "results").exists()
    (tmp_path / "toy" / "results").mkdir()
    began = time.perf_counter()
    assert all_studies.measure("toy", f"python {tmp_path / 'wait.py'}", 0.005) == "stopped"
    assert time.perf_counter() - began < 30.0
    assert all_studies.measure("toy", f"python {tmp_path / 'pass.py'}", 1.0) == "complete"
    assert all_studies.measure("toy", f"python {tmp_path / 'fail.py'}", 1.0) == "complete"
    assert (tmp_path / "toy" / "results").exists()
    (row,) = all_studies.runs().to_dict("records")
    assert row["end"] == "complete"
    assert "cores" in row["machine"]


def test_measurements_of_two_versions_are_named() -> None:
    row = {"version": "1, commit a", "date": "2000-01-02", "machine": "1 core", "minutes": 1.0, "end": "complete"}
    names = [f"benchmarks/{name}" for name in run.NAMES]
    rows = pd.DataFrame([row] * len(names), index=names)
    assert run.provenance(rows) == "On 1 core. All with damagepred 1, commit a, 2000-01-02."
    assert "Not all figures" in run.provenance(rows.assign(version=["2", *rows["version"][1:]]))
    assert "Not all figures" in run.provenance(rows.assign(machine=["2 cores", *rows["machine"][1:]]))
    assert "Not complete: benchmarks/work_precision." in run.provenance(rows.assign(end=["stopped", *rows["end"][1:]]))
