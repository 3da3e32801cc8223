"""The results page agrees with the data; one command runs all benchmarks, records them, and can be stopped."""

import importlib
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import pandas as pd
import pytest

from studies.benchmarks.probabilities.summary import seconds_to
from tests.conftest import ROOT

HERE = ROOT / "studies" / "benchmarks"
COMMAND = [sys.executable, str(HERE / "run.py")]


@pytest.fixture(scope="module")
def ours() -> dict[str, ModuleType]:
    return {name: importlib.import_module(f"studies.benchmarks.{name}") for name in ("rooms", "run")}


def test_the_page_agrees_with_the_data(ours: dict[str, ModuleType]) -> None:
    text = ours["rooms"].text(ours["rooms"].measured())
    again = f"{ours['rooms'].ALL} --from-data"
    assert text == (HERE / "RESULTS.md").read_text(encoding="utf-8"), f"the data have changed: {again}"
    for room in ours["rooms"].ROOMS.values():
        assert f"`{room.shell}`" in text


def test_no_row_is_without_a_version(ours: dict[str, ModuleType]) -> None:
    rooms = ours["rooms"]
    assert set(rooms.measured()["room"]) == set(rooms.ROOMS)
    tables = [rooms.measured()]
    tables += [pd.read_csv(HERE / name) for name in ("scaling/data.csv", "skips/data.csv", "work_precision/data.csv")]
    tables += [pd.read_csv(HERE / name) for name in ("beside_others/runs.csv",)]
    tables += [pd.read_csv(HERE / "probabilities" / f"{name}.csv") for name in ("data", "floors", "costs")]
    for table in tables:
        assert table["version"].str.startswith("0.").all()
        assert pd.to_datetime(table["date"]).notna().all()
    assert all(" | 0." in line for line in ours["rooms"].markdown(ours["rooms"].in_short(tables[0])).split("\n")[2:])


def test_a_changed_datum_changes_the_page(ours: dict[str, ModuleType], tmp_path: Path) -> None:
    room = ours["rooms"].ROOMS["skips"]
    rows = pd.read_csv(room.folder / "data.csv")
    rows.loc[rows["skip"] == rows["skip"][0], "seconds_off"] *= 100.0
    rows.to_csv(tmp_path / "data.csv", index=False)
    found = ours["rooms"].section(room, tmp_path)
    assert found != ours["rooms"].section(room)
    assert "data.csv is missing" in ours["rooms"].section(room, tmp_path / "nowhere")


def test_every_benchmark_has_an_expected_time(ours: dict[str, ModuleType], capsys: pytest.CaptureFixture) -> None:
    rooms = [*ours["rooms"].ROOMS.values()]
    ours["run"].costs(rooms)
    said = capsys.readouterr().out
    assert "nan" not in said
    assert sum(room.minutes for room in rooms) <= 75
    assert all(f"  {room.name} " in said for room in rooms)


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


def test_the_small_form_of_a_benchmark_does_not_change_its_data(ours: dict[str, ModuleType]) -> None:
    room = ours["rooms"].ROOMS["work_precision"]
    before = ours["rooms"].contents(room), ours["rooms"].measured().to_csv()
    done = subprocess.run([*COMMAND, "--quick", "--rooms", room.name], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "relative error against the finest solution" in done.stdout
    assert (ours["rooms"].contents(room), ours["rooms"].measured().to_csv()) == before


# -- a synthetic benchmark, of which each call measures one more-------------------------------------------------------

TOY = """
import sys, time
from pathlib import Path
data = Path(__file__).with_name("data.csv")
data.write_text((data.read_text() if data.exists() else "") + "row\\n")
print("begun", flush=True)
time.sleep(float(sys.argv[1]))
sys.exit(int(sys.argv[2]))
"""


@pytest.fixture
def toy(ours: dict[str, ModuleType], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[object]:
    (tmp_path / "toy.py").write_text(TOY)
    monkeypatch.setattr(ours["rooms"], "MEASURED", tmp_path / "measured.csv")
    call = [str(tmp_path / "toy.py"), "0", "0"]
    return ours["rooms"].Room("toy", "how many rows", 1.0, ["data.csv"], tmp_path, call, call)


def test_measurements_are_recorded(
    ours: dict[str, ModuleType], toy: object, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run, measured = ours["run"], ours["rooms"].measured
    for version in ("0.1", "0.1", "0.2"):
        monkeypatch.setattr(run, "version", lambda version=version: version)
        assert run.measure(toy) == 0
    found = measured()
    assert list(found["version"]) == ["0.1; 0.2"]  # all versions of the data
    assert set(found["end"]) == {"complete"}
    assert "cores" in found["machine"][0]
    assert run.measure(toy._replace(command=[toy.command[0], "0", "3"])) == 3
    assert list(measured()["end"]) == ["failed (3)"]
    nothing = tmp_path / "nothing.py"
    nothing.touch()
    run.measure(toy._replace(command=[str(nothing)]))  # nothing was left to do
    assert list(measured()["end"]) == ["complete"]
    before = measured()
    run.measure(toy._replace(command=[str(nothing)]))
    pd.testing.assert_frame_equal(measured(), before)
    # all of one run: what was there is aside, and no longer recorded
    run.move_aside([toy], tmp_path / "aside")
    assert (tmp_path / "aside" / "toy" / "data.csv").read_text() == 4 * "row\n"
    run.measure(toy)
    assert list(measured()["version"]) == ["0.2"]


def test_a_benchmark_that_takes_too_long_is_stopped_and_resumed(ours: dict[str, ModuleType], toy: object) -> None:
    slow = toy._replace(command=[toy.command[0], "60", "0"])
    began = time.perf_counter()
    assert ours["run"].measure(slow, minutes=0.05) == 1
    assert time.perf_counter() - began < 30.0
    assert list(ours["rooms"].measured()["end"]) == ["stopped"]
    assert ours["run"].measure(toy) == 0
    assert list(ours["rooms"].measured()["end"]) == ["complete"]


def test_benchmarks_of_different_runs_are_reported(ours: dict[str, ModuleType]) -> None:
    results = ours["rooms"]
    row = {"version": "1, commit a", "date": "2000-01-02", "machine": "1 core", "minutes": 1.0, "end": "complete"}
    kept = pd.DataFrame([{"room": name} | row for name in ours["rooms"].ROOMS])
    assert results.whence(kept) == "On 1 core. All with damagepred 1, commit a, 2000-01-02."
    other = kept.assign(version=["2", *kept["version"][1:]])
    assert "Versions differ" in results.whence(other)
    other = kept.assign(machine=["2 cores", *kept["machine"][1:]])
    assert "machines that differ: 2 cores; 1 core" in results.whence(other)
    for other in (kept.assign(end=["stopped", *kept["end"][1:]]), kept[1:]):
        assert "Data of work_precision are of calls" in results.whence(other)


def test_a_benchmark_is_stopped_with_its_child_processes(tmp_path: Path) -> None:
    sleeper = tmp_path / "sleeper.py"
    sleeper.write_text(
        "import subprocess, sys; subprocess.run([sys.executable, '-c', "
        "'import os, time; print(os.getpid(), flush=True); time.sleep(60)'])"
    )
    call = f"from studies.benchmarks import run; run.command([{str(sleeper)!r}])"
    child = subprocess.Popen([sys.executable, "-c", call], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    innermost = int(child.stdout.readline())
    child.send_signal(signal.SIGINT)
    _, errors = child.communicate(timeout=40)
    assert "KeyboardInterrupt" in errors
    time.sleep(0.2)
    assert not _runs(innermost)


def _runs(number: int) -> bool:
    try:
        return "sleep" in Path(f"/proc/{number}/cmdline").read_text()
    except OSError:
        return False
