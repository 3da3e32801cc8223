"""Timings; run with ``pytest -m benchmark``."""

import runpy
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parents[2] / "studies" / "benchmarks" / "explicit_cycle.py"


@pytest.mark.benchmark
@pytest.mark.parametrize("wall", ["intact", "cracked"])
def test_a_contact_and_cycle_take_at_most_ten_nanoseconds(wall):
    bench = runpy.run_path(str(SCRIPT))
    run = bench[wall]()
    bench["nanoseconds"](run, cycles=10, repeats=1)  # compile
    assert bench["nanoseconds"](run) <= 10.0
