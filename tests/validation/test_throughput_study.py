"""The study of throughput: what it reports hangs together."""

import importlib.util
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.slow
def test_what_it_reports_hangs_together(tmp_path: Path) -> None:
    spec = importlib.util.spec_from_file_location("throughput_run", ROOT / "studies" / "throughput" / "run.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    row = module.measure(12, 1, tmp_path / "one.dp")
    assert 0.0 < row["walls_solved_in_s"] < row["total_s"]
    assert 50.0 < row["processor_ms_a_wall"] < 1e3 * row["worker_processor_s"]
    assert 100.0 < row["peak_MB_a_worker"] < 1000.0
    assert row["bytes_a_wall"]["parts"] < 10_000
