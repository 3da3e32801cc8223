"""Very many walls: grouped data give the same result as single walls."""

import re
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from damagepred.uq.fragility import bands, fit_fragility
from damagepred.uq.fragility.describe import lognormal_of
from tests.uq.test_fragility import NAMES

MEDIANS, SCATTER = np.array([2.0, 6.0, 14.0, 30.0]), 0.5
GIB = 2**30


def archive(walls: int, own_movement: bool, seed: int = 1) -> xr.Dataset:
    """A study of known walls with 20 increments to 20 mm, or each to its own 15 to 25 mm."""
    random = np.random.default_rng(seed)
    category = np.empty((walls, 21), dtype=np.int8)
    end = random.uniform(0.015, 0.025, walls) if own_movement else np.full(walls, 0.02)
    movement = end[:, None] * (np.arange(21) / 20)
    for first in range(0, walls, 50_000):
        part = slice(first, first + 50_000)
        factor = np.exp(SCATTER * random.standard_normal(len(end[part])))
        capacity = 1e-3 * MEDIANS * factor[:, None]
        category[part] = (movement[part, :, None] >= capacity[:, None, :]).sum(axis=2)
    both = ("sample", "increment")
    return xr.Dataset(
        {
            "damage_category": (both, category, {"flag_meanings": NAMES}),
            "status": ("sample", np.zeros(walls, dtype=np.int8)),
            "central_deflection": (both, movement, {"units": "m"}),
        }
    )


def check(curves: xr.Dataset, walls: int) -> None:
    form, beyond = lognormal_of(curves), curves["fit_status"].values == "extrapolated"
    assert beyond.tolist() == (float(curves["intensity"][-1]) < 1e-3 * MEDIANS).tolist()
    assert (curves["fit_status"].values[~beyond] == "fitted").all()
    reached = curves["reached"].values / walls
    # standard errors of n walls, larger where few of them reached it; ten of them would be a mistake, not chance
    error = 10 * SCATTER / np.sqrt(walls * np.minimum(reached, 0.3))
    assert (np.abs(np.log(form.median / (1e-3 * MEDIANS))) < error).all()
    assert (np.abs(curves["dispersion"].values / SCATTER - 1) < error / SCATTER).all()
    width = np.log(curves["median_upper"].values / curves["median_lower"].values)[~beyond]
    error = error[~beyond]
    assert (width > 2 * 1.645 * 0.5 * SCATTER / np.sqrt(walls)).all()
    assert (width < 0.5 * error).all()


def test_resamples_by_one_step_have_the_errors_of_fitted_ones(monkeypatch: pytest.MonkeyPatch) -> None:
    ds = archive(3000, True)
    monkeypatch.setattr(bands, "ONE_STEP_GROUPS", 10_000)
    fitted = fit_fragility(ds, categories=[2, 3], bootstrap=150)
    monkeypatch.setattr(bands, "ONE_STEP_GROUPS", 100)
    stepped = fit_fragility(ds, categories=[2, 3], bootstrap=600)
    for name in ("median", "dispersion"):
        widths = [ds[f"{name}_upper"].values - ds[f"{name}_lower"].values for ds in (fitted, stepped)]
        np.testing.assert_allclose(widths[1], widths[0], rtol=0.2)
        assert (stepped[f"{name}_lower"] < fitted[name]).all()
        assert (fitted[name] < stepped[f"{name}_upper"]).all()


def test_resamples_of_a_part_of_the_walls_have_the_errors_of_all(monkeypatch: pytest.MonkeyPatch) -> None:
    """A quarter of the walls is drawn for each resample; its deviation is scaled to the number of walls."""
    ds, widths = archive(3000, True), []
    monkeypatch.setattr(bands, "ONE_STEP_GROUPS", 100)
    for drawn in (3000, 750):
        monkeypatch.setattr(bands, "ONE_STEP_WALLS", drawn)
        curves = fit_fragility(ds, categories=[2], bootstrap=600)
        widths.append(float(curves["median_upper"][0] - curves["median_lower"][0]))
    np.testing.assert_allclose(widths[1], widths[0], rtol=0.15)


@pytest.mark.slow
def test_a_million_walls_in_a_minute_and_two_gibibytes() -> None:
    """In a separate process, to measure its memory; each wall ends at its own movement."""
    code = "from tests.uq.test_fragility_million import report; report(1_000_000)"
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    seconds, size = (float(v) for v in out.split()[-2:])
    assert seconds < 60
    assert size < 2 * GIB


def report(walls: int) -> None:
    """Print seconds and peak memory in bytes, the archive included."""
    ds = archive(walls, True)
    began = time.process_time()
    curves = fit_fragility(ds, bootstrap=200)
    seconds = time.process_time() - began
    check(curves, walls)
    # not ru_maxrss: a child process starts with the peak of its parent
    (peak,) = re.findall(r"VmHWM:\s+(\d+) kB", Path("/proc/self/status").read_text())
    print(seconds, int(peak) * 1024)
