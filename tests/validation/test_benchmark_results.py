"""The results page agrees with the data; one command runs all benchmarks, records them, and can be stopped."""

import importlib
import subprocess
import sys
from types import ModuleType

import pandas as pd
import pytest

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


def test_every_benchmark_has_an_expected_time(ours: dict[str, ModuleType], capsys: pytest.CaptureFixture) -> None:
    rooms = [*ours["rooms"].ROOMS.values()]
    ours["run"].costs(rooms)
    said = capsys.readouterr().out
    assert "nan" not in said
    assert sum(room.minutes for room in rooms) <= 75
    assert all(f"  {room.name} " in said for room in rooms)


@pytest.mark.thorough
def test_the_small_form_of_a_benchmark_does_not_change_its_data(ours: dict[str, ModuleType]) -> None:
    room = ours["rooms"].ROOMS["work_precision"]
    before = ours["rooms"].contents(room), ours["rooms"].measured().to_csv()
    done = subprocess.run([*COMMAND, "--quick", "--rooms", room.name], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "relative error against the finest solution" in done.stdout
    assert (ours["rooms"].contents(room), ours["rooms"].measured().to_csv()) == before


# -- a synthetic benchmark, of which each call measures one more-------------------------------------------------------
