"""The study of coverage: a few of its cases."""

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def study() -> ModuleType:
    file = ROOT / "studies" / "coverage" / "run.py"
    spec = importlib.util.spec_from_file_location("coverage_run", file)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules["coverage_run"] = module
    spec.loader.exec_module(module)
    return module


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
def test_intervals_have_the_stated_coverage(study: ModuleType, interval: str, samples: str) -> None:
    """Of 60 repetitions 54 expected; 46 or fewer come in 0.3 % of binomial draws of 0.9."""
    rows = study.measure(interval, samples, study.cases()[interval, samples], 60, 2)
    assert rows
    for row in rows:
        assert row["given"] > 0.9, row
        assert row["coverage"] >= 46 / 60, row


def test_the_page_is_that_of_the_table(study: ModuleType) -> None:
    page = (study.HERE / "README.md").read_text(encoding="utf-8")
    assert study.table(study.HERE) in page
