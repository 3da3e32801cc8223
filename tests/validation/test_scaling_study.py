"""studies/benchmarks/scaling: exponents are found, cases measured, time-outs listed."""

import importlib
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pandas as pd
import pytest

OURS = ("cases", "run", "summary")


@pytest.fixture(scope="module")
def room() -> dict[str, ModuleType]:
    return {name: importlib.import_module(f"studies.benchmarks.scaling.{name}") for name in OURS}


def measured(room: dict[str, ModuleType], *case: Any) -> dict[str, Any]:
    return room["run"].measure(*case)


def test_exponents_of_made_up_times_are_found(room: dict[str, ModuleType]) -> None:
    blocks = np.array([100, 400, 800, 1600, 3200])
    seconds = 1e-6 * blocks**2.0
    seconds[0] = 1.0  # below where it is fitted
    rows = pd.DataFrame(
        {
            "grows": "blocks",
            "curve": "quasi-static, dpc",
            "size": blocks,
            "blocks": blocks,
            "contacts": 9 * blocks,
            "zones": 0,
            "increments": 20,
            "seconds": seconds,
            "iterations": blocks**0.5,
            "memory_before": 100.0,
            "memory": 100.0 + 1e-3 * blocks**1.5,
            "end": "complete",
            "round": 1,
            "message": "",
            "cholesky": 1e-7 * blocks**2.0,
        }
    )
    late = pd.DataFrame(
        [
            {
                "grows": "blocks",
                "curve": "quasi-static, dpc",
                "size": 6400,
                "end": "time-out",
                "message": "more than 9 s",
                "round": 1,
            },
        ]
    )
    both = pd.concat([rows, late], ignore_index=True)
    line = room["summary"].exponents(both).iloc[0]
    assert (line["time"], line["steps"], line["memory"]) == ("2.00", "0.50", "1.50")
    assert line["fitted over"] == "400 to 3200"
    assert line["its time in Cholesky factorisations"] == pytest.approx(10.0)
    assert room["summary"].left_out(both) == ["- blocks, quasi-static, dpc, 6400: time-out (more than 9 s)"]


def test_paths_are_measured_with_their_work(room: dict[str, ModuleType]) -> None:
    explicit = [measured(room, "blocks", "explicit, own weight", blocks) for blocks in (30, 480)]
    assert all(row["end"] == "complete" for row in explicit)
    # a wave has four times as many courses to go
    assert explicit[1]["iterations"] > 1.5 * explicit[0]["iterations"]
    found = measured(room, "blocks", "quasi-static, dpc", 60)
    assert found["end"] == "complete"
    assert found["factorisations"] > 0
    assert found["seconds"] > 0.0
    assert found["bandwidth"] < found["dofs"] / 2
    assert 0.0 < found["cholesky"] < found["seconds"]
    assert 0.0 <= found["memory"] - found["memory_before"] < 50.0


def test_what_takes_too_long_is_listed_and_what_is_larger_is_not_tried(
    room: dict[str, ModuleType], tmp_path: Path
) -> None:
    case = room["cases"].Case
    curve = [case("blocks", "quasi-static, dpc", size) for size in (800, 1600)]
    data = tmp_path / "data.csv"
    room["run"].run_all(curve, data, limit=0.05)
    rows = pd.read_csv(data)
    assert list(rows["end"]) == ["time-out", "not run"]
    assert set(rows["version"].str[:2]) == {"0."}
    before = data.read_bytes()
    room["run"].run_all(curve, data, limit=0.05)  # nothing is left to do
    assert data.read_bytes() == before
