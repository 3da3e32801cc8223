"""The results page agrees with the data; one command runs, records and ends all benchmarks."""

import subprocess
import sys
import time
from pathlib import Path

import pandas as pd
import pytest

from studies.benchmarks import run
from studies.benchmarks.probabilities.summary import seconds_to
from tests.conftest import ROOT

HERE = ROOT / "studies" / "benchmarks"
COMMAND = [sys.executable, str(HERE / "run.py")]


def test_the_page_agrees_with_the_data() -> None:
    text = run.text(run.measured())
    assert text == (HERE / "RESULTS.md").read_text(encoding="utf-8"), f"the data have changed: {run.ALL} --from-data"
    assert all(f"`{room.shell}`" in text for room in run.ROOMS.values())


def test_no_row_is_without_a_version() -> None:
    assert set(run.measured()["room"]) == set(run.ROOMS)
    tables = [run.measured()]
    tables += [pd.read_csv(HERE / name) for name in ("scaling/data.csv", "skips/data.csv", "work_precision/data.csv")]
    tables += [pd.read_csv(HERE / "beside_others" / "runs.csv")]
    tables += [pd.read_csv(HERE / "probabilities" / f"{name}.csv") for name in ("data", "floors", "costs")]
    for table in tables:
        assert table["version"].str.startswith("0.").all()
        assert pd.to_datetime(table["date"]).notna().all()


def test_a_changed_datum_changes_the_page(tmp_path: Path) -> None:
    room = run.ROOMS["skips"]
    rows = pd.read_csv(room.folder / "data.csv")
    rows.loc[rows["skip"] == rows["skip"][0], "seconds_off"] *= 100.0
    rows.to_csv(tmp_path / "data.csv", index=False)
    assert run.section(room, tmp_path) != run.section(room)
    assert "data.csv is missing" in run.section(room, tmp_path / "nowhere")


def test_seconds_to_an_error() -> None:
    seconds, error = pd.Series([1.0, 4.0, 16.0, 64.0]), pd.Series([0.4, 0.2, 0.3, 0.05])
    assert seconds_to(seconds, 0.4 / seconds**0.5, 0.1) == "16"
    assert seconds_to(seconds, error, 0.3 / 6**0.5) == "32"  # halfway, and not the dip before
    assert (seconds_to(seconds, error, 0.5), seconds_to(seconds, error, 0.04)) == ("< 1", "> 64")


def test_a_wrong_name_is_named() -> None:
    done = subprocess.run([*COMMAND, "--rooms", "skip"], capture_output=True, text=True)
    assert done.returncode == 2
    assert "'skip'" in done.stderr
    assert "skips" in done.stderr


def test_a_measurement_is_recorded_and_ended(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(run, "MEASURED", tmp_path / "measured.csv")
    toy = run.Room("toy", "does it end", 1.0, tmp_path, ["-c", "pass"], [])
    assert run.measure(toy) == "complete"
    assert run.measure(toy._replace(command=["-c", "raise SystemExit(3)"])) == "failed (3)"
    began = time.perf_counter()
    assert run.measure(toy._replace(minutes=0.005, command=["-c", "import time; time.sleep(60)"])) == "stopped"
    assert time.perf_counter() - began < 30.0
    (row,) = run.measured().to_dict("records")
    assert (row["room"], row["end"]) == ("toy", "stopped")
    assert "cores" in row["machine"]


def test_measurements_of_two_versions_are_named() -> None:
    row = {"version": "1, commit a", "date": "2000-01-02", "machine": "1 core", "minutes": 1.0, "end": "complete"}
    rows = pd.DataFrame([{"room": name} | row for name in run.ROOMS])
    assert run.whence(rows) == "On 1 core. All with damagepred 1, commit a, 2000-01-02."
    assert "Not all figures" in run.whence(rows.assign(version=["2", *rows["version"][1:]]))
    assert "Not all figures" in run.whence(rows.assign(machine=["2 cores", *rows["machine"][1:]]))
    assert "Not complete: work_precision." in run.whence(rows.assign(end=["stopped", *rows["end"][1:]]))
