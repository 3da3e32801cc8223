"""Disturbed studies, as in studies/durability: three of its six disturbances."""

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
def test_a_kill_a_full_disk_and_interrupts(study: ModuleType, tmp_path: Path) -> None:
    """Workers that die or hang, and Dask, are in tests/campaign/test_workers.py and test_cluster.py."""
    found = study.mistreat(["kill", "disk", "interrupt"], walls=4, kills=1, place=tmp_path)
    assert set(found) == {"kill", "disk", "interrupt"}
    assert "parts kept" in found["disk"]
