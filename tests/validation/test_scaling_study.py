"""studies/benchmarks/scaling: exponents are found, cases measured, time-outs listed."""

import importlib
from types import ModuleType
from typing import Any

import pytest

pytestmark = pytest.mark.thorough

OURS = ("cases", "run", "summary")


@pytest.fixture(scope="module")
def room() -> dict[str, ModuleType]:
    return {name: importlib.import_module(f"studies.benchmarks.scaling.{name}") for name in OURS}


def measured(room: dict[str, ModuleType], *case: Any) -> dict[str, Any]:
    return room["run"].measure(*case)


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
