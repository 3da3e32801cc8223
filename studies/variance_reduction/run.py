"""How many walls do Sobol points and a coarse wall save? Measured, not promised.

    python studies/variance_reduction/run.py [--wall small|bryant] [--replicates 16] [--samples 32] [--pilot 64]

Sobol points: a study of several independent scrambles. What random walls would scatter follows from the walls
themselves; how much the scrambles' means scatter is seen. The ratio of the two variances is the ratio of the numbers of
walls for the same error. Coarse walls: a pilot run of each kind beside the same fine walls.
The same call goes on where an interrupted one stopped.
"""

from __future__ import annotations

import argparse
import tomllib
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import NDArray
from scipy import stats

from damagepred.study import Study, open_study
from damagepred.study.settings import StudySettings
from damagepred.study.two_level import levels
from damagepred.uq.control_variate import read_pilot
from damagepred.uq.exceedance import shares, walls

HERE = Path(__file__).resolve().parent
DATA = HERE.parents[1] / "data"
FloatArray = NDArray[np.float64]

COARSE = {
    "ten increments": {"movement": {"increments": 10}},
    "two contacts an interface": {"solver": {"contacts_per_interface": 2}},
    "blocks twice as large": {"wall": {"block_length": 0.48, "block_height": 0.15}},
}
"""Coarse walls, by what makes them coarse."""

SMALL = """
[study]
title = "small wall, doming to 9 mm"
seed = 7
[scene.wall]
length = 1.44
height = 0.45
[scene.joint]
tensile_strength = "0.1 MPa"
cohesion = "0.1 MPa"
[scene.movement]
kind = "doming"
central_deflection = "9 mm"
increments = 40
[scene.loads]
roof = "2 kN"
[variables."joint.tensile_strength"]
distribution = "lognormal"
mean = "0.1 MPa"
cov = 0.3
field = { course_correlation = 0.4 }
[variables."joint.friction"]
distribution = "lognormal"
mean = 0.75
cov = 0.15
[variables."joint.normal_stiffness"]
distribution = "lognormal"
mean = "82 N/mm3"
cov = 0.3
[variables."scene.roof"]
distribution = "lognormal"
mean = "2 kN"
cov = 0.3
""".replace("scene.roof", "loads.roof")


def settings_of(wall: str) -> StudySettings:
    if wall == "bryant":
        whole = StudySettings.from_toml(DATA / "bryant_study.toml")
        # to 10 mm and category 2: an eighth of the path, in steps half as long
        movement = replace(whole.scene.movement, central_deflection=0.01, increments=20)
        variables = {k: v for k, v in whole.variables.items() if not k.startswith("movement")}
        return replace(
            whole,
            scene=replace(whole.scene, movement=movement),
            variables=variables,
            study=replace(whole.study, stop_at_category=2),
        )
    return StudySettings.from_dict(tomllib.loads(SMALL))


def quantities(ds: xr.Dataset) -> Iterator[tuple[str, FloatArray]]:
    """Yield one number a wall: the movement at which a category is reached, and whether it is by their median."""
    for category in range(1, int(ds.attrs["highest_category"]) + 1):
        known = walls(ds, category)
        reached = np.isfinite(known.upper)
        if reached.mean() > 0.99:
            middle = np.where(reached, (known.lower + np.where(reached, known.upper, known.lower)) / 2, known.lower)
            yield f"movement at category {category}", middle
        at = float(np.median(np.where(reached, known.upper, known.end.max())))
        if reached.mean() > 0.1:
            hits = shares(known.lower, known.upper, at)
            if 0.05 < hits.mean() < 0.95:
                yield f"P(category >= {category} at {1e3 * at:.3g} mm)", hits


def sobol(settings: StudySettings, folder: Path, replicates: int, samples: int, workers: int) -> pd.DataFrame:
    """Return the variance of random walls' means over that of the scrambles' means, with a 90 % interval."""
    how = replace(settings.study, replicates=replicates, sampler="sobol")
    Study(replace(settings, study=how)).run(folder, replicates * samples, workers)
    ds = open_study(folder)
    label = np.arange(replicates * samples) % replicates
    rows = []
    for name, values in quantities(ds):
        if len(values) == len(label):  # no wall failed
            rows.append({"quantity": name, **saved(values, label)})
    return pd.DataFrame(rows)


def saved(values: FloatArray, label: NDArray[np.int64]) -> dict[str, float]:
    """Return how many random walls one Sobol wall stands for, with a 90 % interval from the number of scrambles."""
    groups = int(label.max()) + 1
    means = np.array([values[label == r].mean() for r in range(groups)])
    ratio = float(values.var(ddof=1) / (len(values) / groups) / means.var(ddof=1))
    low, high = (ratio * float(stats.chi2.ppf(q, groups - 1)) / (groups - 1) for q in (0.05, 0.95))
    return {"ratio": ratio, "lower": low, "upper": high}


def coarse_walls(settings: StudySettings, folder: Path, pilot: int, workers: int) -> pd.DataFrame:
    """Return what a pilot run says of each kind of coarse wall."""
    rows = []
    for name, change in COARSE.items():
        if name.startswith("blocks") and settings.scene.dpc is not None:
            change = change | {"dpc": {"course": settings.scene.dpc.course // 2}}  # at the same height
        how = replace(settings.study, coarse=change)
        fine, coarse = levels(replace(settings, study=how))
        found = []
        for kind, level in (("fine", fine), (name.replace(" ", "_"), coarse)):
            Study(level).run(folder / f"{kind}.dp", pilot, workers)
            found.append(open_study(folder / f"{kind}.dp"))
        cost = [float(np.nanmedian(ds["run_time"].values)) for ds in found]
        for quantity, values in quantities(found[0]):
            other = _same(found[1], quantity)
            if len(other) != len(values):
                continue  # a wall failed
            report = read_pilot(values, other, *cost)
            rows.append({
                "coarse wall": name, "quantity": quantity, "correlation": report.correlation,
                "lower": report.correlation_lower, "upper": report.correlation_upper, "cost ratio": report.cost_ratio,
                "relative cost": report.relative_cost, "at worst": report.relative_cost_worst, "pays": report.pays,
            })  # fmt: skip
    return pd.DataFrame(rows)


def _same(ds: xr.Dataset, quantity: str) -> FloatArray:
    """Return the quantity of another study, by its name."""
    if quantity.startswith("movement"):
        known = walls(ds, int(quantity.split()[-1]))
        upper = np.where(np.isfinite(known.upper), known.upper, known.end)
        return (known.lower + upper) / 2
    words = quantity.removesuffix(" mm)").split()
    known = walls(ds, int(words[2]))
    return shares(known.lower, known.upper, 1e-3 * float(words[4]))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--wall", choices=("small", "bryant"), default="small")
    parser.add_argument("--replicates", type=int, default=16, help="scrambles")
    parser.add_argument("--samples", type=int, default=32, help="walls of each scramble, a power of two")
    parser.add_argument("--pilot", type=int, default=64, help="walls of each pilot run")
    parser.add_argument("--workers", type=int, default=1, help="processes")
    parser.add_argument("--output", type=Path, default=HERE / "results", help="folder")
    options = parser.parse_args()
    settings, out = settings_of(options.wall), options.output / options.wall
    out.mkdir(parents=True, exist_ok=True)
    pd.set_option("display.width", 160, "display.max_columns", 12, "display.precision", 2)
    gained = sobol(settings, out / "sobol.dp", options.replicates, options.samples, options.workers)
    print(f"random walls for each Sobol wall, scrambles of {options.samples} (90 % interval):\n{gained}\n", flush=True)
    gained.to_csv(out / "sobol.csv", index=False)
    beside = coarse_walls(settings, out, options.pilot, options.workers)
    print(f"coarse walls, pilot of {options.pilot}:\n{beside}", flush=True)
    beside.to_csv(out / "coarse.csv", index=False)


if __name__ == "__main__":
    main()
