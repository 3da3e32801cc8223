"""Timings; run with ``pytest -m benchmark``."""

import runpy
from pathlib import Path

import pytest

BENCHMARKS = Path(__file__).parents[2] / "studies" / "benchmarks"
SCRIPT = BENCHMARKS / "explicit_cycle.py"


@pytest.mark.benchmark
@pytest.mark.parametrize("wall", ["intact", "cracked"])
def test_a_contact_and_cycle_take_at_most_ten_nanoseconds(wall):
    bench = runpy.run_path(str(SCRIPT))
    run = bench[wall]()
    bench["nanoseconds"](run, cycles=10, repeats=1)  # compile
    assert bench["nanoseconds"](run) <= 10.0


@pytest.mark.benchmark
@pytest.mark.parametrize("material", ["STRONG", "WEAK"])
def test_a_zone_and_cycle_take_at_most_eight_nanoseconds_alone_and_25_in_all(material):
    bench = runpy.run_path(str(BENCHMARKS / "zone_cycle.py"))
    run = bench["bent"](bench[material])
    zones, _ = bench["alone"](run)
    count = len(run.model.mesh.zones)
    assert count > 50_000
    zones(1)  # compile
    assert bench["nanoseconds"](zones)[1] <= 8.0 * count
    assert bench["nanoseconds"](bench["whole"](run))[1] <= 25.0 * count
