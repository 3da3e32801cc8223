"""Disturbed studies, as in studies/durability: two of its six disturbances."""

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def study() -> ModuleType:
    spec = importlib.util.spec_from_file_location("durability_run", ROOT / "studies" / "durability" / "run.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


@pytest.mark.slow
def test_a_kill_and_a_full_disk(study: ModuleType, tmp_path: Path) -> None:
    """The others are in tests/campaign/test_workers.py and test_cluster.py, and in tests/cli/test_commands.py."""
    found = study.mistreat(["kill", "disk"], walls=4, kills=1, place=tmp_path)
    assert set(found) == {"kill", "disk"}
    assert "parts kept" in found["disk"]
