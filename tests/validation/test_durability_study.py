"""Disturbed studies, as in studies/durability: a part by default, all in the slow tests."""

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
def test_everything_at_once(study: ModuleType, tmp_path: Path) -> None:
    pytest.importorskip("distributed")
    found = study.mistreat(list(study.TREATMENTS), walls=4, kills=2, place=tmp_path)
    assert set(found) == set(study.TREATMENTS)
    assert "parts kept" in found["disk"]
