"""Stresses in the wall of the full-scale test as it dishes, in more than 50 000 zones.

    python studies/bryant_1993/stress_contours/run.py [--footing] [--explicit]

The wall of data/bryant_dishing.toml, its bricks cut into 51 200 zones, is solved at 1 mm and up to 6 mm of dishing, in
steps of 1 mm, by the quasi-static or the explicit solver. With ``--footing`` it stands on a footing of zones whose
underside follows the movement. Contours of the stress along the wall are drawn at both deflections; tables give the
changes of the stresses, and the times.
"""

from __future__ import annotations

import argparse
import resource
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import xarray as xr

import damagepred
from damagepred.archive.files import write_dataset
from damagepred.arrays import BoolArray, FloatArray
from damagepred.one_wall.judged_path import Step
from damagepred.plotting.geometry import Zones
from damagepred.plotting.pictures import stress_sheet
from damagepred.plotting.stress import block_stress, zone_stress
from damagepred.scene import Scene, Solver

HERE = Path(__file__).resolve().parent
DATA = HERE.parents[2] / "data"
EARLY, LATE = 1, 6
"""Increments that are compared, of 1 mm each."""
FINE = 0.0375
"""Largest edge of the cells (m): 64 zones a brick."""


def scene(increments: int = LATE, zone_size: float = FINE, footing: bool = False, explicit: bool = False) -> Scene:
    """Return the test wall with deformable bricks, dishing by 1 mm an increment."""
    test = Scene.from_toml(DATA / "bryant_dishing.toml")
    solver = Solver(
        blocks="deformable",
        zone_size=zone_size,
        zone_size_footing=test.footing.depth / 4,
        footing="deformable" if footing else "none",
    )
    if explicit:
        # in brick weights: many zones converge slowly
        solver = replace(solver, method="explicit", tolerance=1e-2, maximum_cycles=1_000_000)
    return replace(
        test,
        movement=replace(test.movement, central_deflection=1e-3 * increments, increments=increments),
        solver=solver,
    )


def solve(wall: Scene) -> xr.Dataset:
    """Solve the wall; print the time of each increment."""
    began = time.perf_counter()

    def tell(step: Step) -> None:
        i, seconds = step.increment, time.perf_counter() - began
        spent = i.counters.newton_iterations + i.counters.cycles
        print(
            f"  increment {i.number}: {spent} steps, {seconds:.0f} s so far",
            file=sys.stderr,
            flush=True,
        )

    return damagepred.solve(wall, on_step=tell, on_failure="return")


def parts(ds: xr.Dataset) -> dict[str, BoolArray]:
    """Return the zones above the dpc, those of them away from its ends, those below, and those of the footing."""
    course = ds["block_course"].values[ds["zone_block"].values]
    zones = Zones.of(ds)
    x = zones.points[zones.corners].mean(axis=1)[:, 0]
    above = course >= 2
    inside = (x > 0.6) & (x < ds.attrs["span"] - 0.6)
    found = {
        "above the dpc": above,
        "- of it, 0.6 m and more from the ends": above & inside,
        "two courses below the dpc": (course >= 0) & ~above,
        "footing": course < 0,
    }
    return {name: chosen for name, chosen in found.items() if chosen.any()}


def table(ds: xr.Dataset) -> list[str]:
    """Return the stresses along the wall at both increments, part by part."""
    weight = Zones.of(ds).area
    early, late = (1e-6 * zone_stress(ds, i)[:, 0] for i in (EARLY, LATE))
    lines = [
        f"| zones | stress along the wall at {EARLY} mm, MPa | at {LATE} mm, MPa | change, MPa |",
        "|---|---|---|---|",
    ]
    for name, chosen in parts(ds).items():
        cells = [f"{_middle(s[chosen], weight[chosen])}" for s in (early, late, late - early)]
        lines.append(f"| {name} | {' | '.join(cells)} |")
    return lines


def _middle(values: FloatArray, weight: FloatArray) -> str:
    """Return the range without 2.5 % of the area at either end, and the root mean square."""
    order = np.argsort(values)
    share = np.cumsum(weight[order]) / weight.sum()
    low, high = values[order][np.searchsorted(share, [0.025, 0.975])]
    size = float(np.sqrt((weight * values**2).sum() / weight.sum()))
    return f"{low:.3f} to {high:.3f}; rms {size:.3f}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--output", type=Path, default=HERE / "results", help="folder for the archive")
    parser.add_argument("--figures", type=Path, default=HERE, help="folder for the pictures")
    parser.add_argument("--zone-size", type=float, default=FINE, help="of the cells (m), to try it with fewer")
    parser.add_argument("--explicit", action="store_true", help="with the explicit solver")
    parser.add_argument("--footing", action="store_true", help="with a footing of zones")
    options = parser.parse_args()
    options.output.mkdir(parents=True, exist_ok=True)
    wall = scene(zone_size=options.zone_size, footing=options.footing, explicit=options.explicit)
    damagepred.solve(small(wall))  # compile
    before = peak()
    began, clock = time.process_time(), time.perf_counter()
    ds = solve(wall)
    seconds, elapsed = time.process_time() - began, time.perf_counter() - clock
    file = options.output / ("footing.nc" if options.footing else "wall.nc")
    write_dataset(ds, file)
    draw(ds, options.figures, "_footing" if options.footing else "")
    what, name = ("cycles", "cycles") if options.explicit else ("Newton iterations", "newton_iterations")
    print("\n".join(table(ds)))
    print(f"\nmean stress of the bricks from joints and from zones: they differ by {100 * two_ways(ds):.2g} % (rms)")
    print(
        f"\n{ds.sizes['zone']} zones, {ds.sizes['gridpoint']} gridpoints, {ds.sizes['contact']} contacts; "
        f"{int(ds[name].sum())} {what} in {seconds:.0f} s of the processor, "
        f"{elapsed:.0f} s by the clock\n"
        f"memory {before:.0f} MB before, {peak():.0f} MB at most; archive {file.stat().st_size / 1e6:.1f} MB\n"
        f"dpc open by {1e3 * float(ds['dpc_opening_max'][EARLY]):.2f} mm at {EARLY} mm and by "
        f"{1e3 * float(ds['dpc_opening_max'][LATE]):.2f} mm at {LATE} mm, more than 1 mm along "
        f"{float(ds['dpc_separation_length'][EARLY]):.2f} and {float(ds['dpc_separation_length'][LATE]):.2f} m; widest "
        f"crack above it {1e3 * float(ds['crack_width_max'][LATE]):.3f} mm, below "
        f"{1e3 * float(ds['base_crack_width_max'][LATE]):.3f} mm"
    )


def two_ways(ds: xr.Dataset) -> float:
    """Return the relative difference of the bricks' mean stresses from joint forces and from zones.

    It is the rms difference of the stress along the wall at the last increment, over its rms.
    """
    zones = Zones.of(ds)
    area = np.bincount(zones.block, zones.area)
    inside = np.bincount(zones.block, zones.area * zone_stress(ds, LATE)[:, 0]) / area
    joints = block_stress(ds, LATE)[:, 0]
    bricks = ds["block_course"].values >= 0
    return float(np.sqrt(np.mean((inside - joints)[bricks] ** 2) / np.mean(joints[bricks] ** 2)))


def draw(ds: xr.Dataset, folder: Path, which: str) -> None:
    """Draw the stress along the wall at both increments."""
    both = [("stress_xx", EARLY), ("stress_xx", LATE)]
    stress_sheet(ds, both).savefig(folder / f"stress_xx{which}.png", dpi=110)


def small(wall: Scene) -> Scene:
    """Return a small wall that uses the same kernels."""
    few = replace(wall.wall, length=0.96, height=0.3)
    return replace(wall, wall=few, movement=replace(wall.movement, central_deflection=1e-4, increments=1))


def peak() -> float:
    """Return the peak memory of this process (MB)."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


if __name__ == "__main__":
    main()
