"""Variance reduction by Sobol points and coarse walls, measured.

    python studies/variance_reduction/run.py --wall small|solid|window [--part sobol split coarse] [--replicates 16]
        [--samples 64] [--pairs 128] [--pilot 96]

Sobol points: a study of several independent scrambles. The variance of the mean of random walls follows from the
variance between walls, that of Sobol points from the means of the scrambles. The ratio of the two variances is the
ratio of the numbers of walls for the same error. The first points of a scramble are a scramble, too, so one study gives
all sizes. Split: pairs of walls with the same values for the whole wall and resampled joints give the largest share of
the variance that points can remove. Coarse walls: a pilot run of each kind with the same fine walls. The same call
resumes an interrupted one; the tables are written to the output folder.
"""

from __future__ import annotations

import argparse
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import xarray as xr
from scipy import stats

from damagepred.analyses.two_level import levels
from damagepred.arrays import FloatArray, IntArray
from damagepred.campaign.settings import StudySettings
from damagepred.study import Study, open_study
from damagepred.uq.capacity import probability_reached
from damagepred.uq.control_variate import read_pilot
from damagepred.uq.exceedance import category_capacities

HERE = Path(__file__).resolve().parent
DATA = HERE.parents[1] / "data"

LIMITS = {"solid": 4e-3}
"""Opening of the dpc (m) whose movement is estimated, for walls that reach no category."""

COARSE = {
    "ten increments": {"movement": {"increments": 10}},
    "two contacts an interface": {"solver": {"contacts_per_interface": 2}},
    "blocks twice as large": {"wall": {"block_length": 0.48, "block_height": 0.15}},
}
"""Coarse walls, by kind of coarsening."""

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
    if wall == "small":
        return StudySettings.from_dict(tomllib.loads(SMALL))
    tables = tomllib.loads((DATA / "bryant_study.toml").read_text(encoding="utf-8"))
    del tables["variables"]["movement.central_deflection"]
    tables["study"] |= {"seed": 1993}
    if wall == "solid":
        scene = tomllib.loads((DATA / "bryant_dishing.toml").read_text(encoding="utf-8"))
    else:  # to 10 mm and category 2
        scene = tomllib.loads((DATA / "bryant_window_dishing.toml").read_text(encoding="utf-8"))
        scene["movement"] |= {"central_deflection": "10 mm", "increments": 20}
        tables["study"] |= {"stop_at_category": 2}
    return StudySettings.from_dict({**tables, "scene": scene})


Quantity = tuple[str, float]
"""What is asked of a wall, such as ("category 1", nan) for the movement at which it is reached, or with a movement (m)
for whether it is reached by that."""


def reached(ds: xr.Dataset, what: str) -> tuple[FloatArray, FloatArray]:
    """Return the movements (m) between which a category, or an opening of the dpc, is reached by each wall.

    NaN for failed walls.
    """
    kind, value = what.split(" ", 1)
    if kind == "category":
        known = category_capacities(ds, int(value))
        found = np.full((2, ds.sizes["sample"]), np.nan)
        found[:, known.sample] = known.lower, known.upper
        return found[0], found[1]
    limit, moved = 1e-3 * float(value.split()[-2]), ds["central_deflection"].values
    opening = np.maximum.accumulate(ds["dpc_opening_max"].values, axis=1)
    first = (opening >= limit).argmax(axis=1)
    rows = np.arange(len(opening))
    before, after = opening[rows, first - 1], opening[rows, first]
    at = moved[rows, first - 1] + (limit - before) / (after - before) * (moved[rows, first] - moved[rows, first - 1])
    at = np.where(opening[:, -1] >= limit, at, np.inf)
    return at, at


def values_of(ds: xr.Dataset, quantity: Quantity) -> FloatArray:
    """Return one number a wall: the logarithm of a movement, or a share."""
    lower, upper = reached(ds, quantity[0])
    if np.isnan(quantity[1]):
        end = ds["central_deflection"].values[:, -1]
        middle = np.where(np.isinf(upper), end, (lower + np.where(np.isinf(upper), 0.0, upper)) / 2)
        return np.log(middle)
    return np.where(np.isnan(upper), np.nan, probability_reached(lower, upper, quantity[1]))


def quantities(ds: xr.Dataset, wall: str) -> list[Quantity]:
    """Return the quantities that can be estimated.

    The median movement, which is that of its mean logarithm, where nearly all walls get there; the probability at a
    movement that half of the walls have reached, and at one that a tenth have.
    """
    if wall in LIMITS:
        what = [f"dpc opening {1e3 * LIMITS[wall]:g} mm"]
    else:
        what = [f"category {k}" for k in range(1, int(ds.attrs["highest_category"]) + 1)]
    found: list[Quantity] = []
    for name in what:
        upper = reached(ds, name)[1]
        upper = upper[~np.isnan(upper)]
        there = np.isfinite(upper)
        if there.mean() > 0.99:
            found.append((name, np.nan))
        # for a category, the end of its increment
        marks = [np.sort(upper)[int(share * len(upper))] for share in (0.5, 0.1) if there.mean() > share]
        found += [(name, float(f"{mark:.3g}")) for mark in dict.fromkeys(marks)]
    return [q for q in found if np.isnan(q[1]) or 0.03 < np.nanmean(values_of(ds, q)) < 0.97]


def name_of(quantity: Quantity) -> str:
    what, at = quantity
    return f"median movement at {what}" if np.isnan(at) else f"P({what} by {1e3 * at:.3g} mm)"


def run(study: Study, folder: Path, samples: int, workers: int) -> xr.Dataset:
    summary = study.run(folder, samples, workers)
    if summary.interrupted:
        raise SystemExit(f"{folder}: {summary.done} of {summary.total} walls; the same call resumes")
    return open_study(folder).isel(sample=slice(samples))  # there may be more from another call


# -- Sobol points -----------------------------------------------------------------------------------------------------


def sobol(
    settings: StudySettings, wall: str, folder: Path, replicates: int, samples: int, workers: int
) -> pd.DataFrame:
    """Return the variance of random walls' means over that of the scrambles' means, with a 90 % interval."""
    how = replace(settings.study, replicates=replicates, sampler="sobol")
    ds = run(Study(replace(settings, study=how)), folder, replicates * samples, workers)
    label, turn = np.arange(replicates * samples) % replicates, np.arange(replicates * samples) // replicates
    rows = []
    for quantity in quantities(ds, wall):
        values = values_of(ds, quantity)
        known, length = ~np.isnan(values), min(8, samples)
        while length <= samples:
            used = known & (turn < length)
            found = saved(values[used], label[used])
            rows.append({"quantity": name_of(quantity), "points": length, **found, "failed": int((~known).sum())})
            length *= 2
    return pd.DataFrame(rows)


def saved(values: FloatArray, label: IntArray) -> dict[str, float]:
    """Return the number of random walls that one Sobol wall replaces, with a 90 % interval."""
    groups = int(label.max()) + 1
    means = np.array([values[label == r].mean() for r in range(groups)])
    ratio = float(values.var(ddof=1) / (len(values) / groups) / means.var(ddof=1))
    low, high = (ratio * float(stats.chi2.ppf(q, groups - 1)) / (groups - 1) for q in (0.05, 0.95))
    return {"ratio": ratio, "lower": low, "upper": high}


# -- what points can even out -----------------------------------------------------------------------------------------


def split(settings: StudySettings, wall: str, folder: Path, pairs: int, workers: int) -> pd.DataFrame:
    """Return the share of the variance due to values of the whole wall, from pairs (pick-freeze)."""
    folder.mkdir(parents=True, exist_ok=True)
    design = replace(settings, study=replace(settings.study, sampler="random")).design()
    drawn = pd.DataFrame(design.wall_values(pairs))
    table = folder / "pairs.csv"
    if not table.is_file():
        drawn.loc[drawn.index.repeat(2)].to_csv(table, index=False, float_format="%.17g")
    fields = {place: v for place, v in settings.variables.items() if place in design.joint}
    among = {a: {b: c for b, c in row.items() if b in fields} for a, row in settings.correlation.items() if a in fields}
    how = replace(settings.study, sampler="table", table=str(table), table_columns=tuple(drawn.columns), replicates=1)
    study = Study(replace(settings, variables=fields, correlation=among, study=how))
    ds = run(study, folder / "pairs.dp", 2 * pairs, workers)
    rows = []
    for quantity in quantities(ds, wall):
        values = values_of(ds, quantity)
        both = values.reshape(pairs, 2)
        rows.append({"quantity": name_of(quantity), **common_share(*both[~np.isnan(both).any(axis=1)].T)})
    return pd.DataFrame(rows)


def common_share(first: FloatArray, second: FloatArray) -> dict[str, float]:
    """Return the correlation of walls with the same values for the whole wall, and the largest possible gain."""

    def correlation(a: FloatArray, b: FloatArray) -> float:
        both = np.append(a, b)
        return float(((a - both.mean()) * (b - both.mean())).mean() / both.var())

    share = correlation(first, second)
    random = np.random.default_rng(1)
    again = [
        correlation(first[k], second[k]) for k in (random.integers(len(first), size=len(first)) for _ in range(2000))
    ]
    low, high = np.quantile(again, (0.05, 0.95))
    most = [1 / max(1 - s, 1e-3) for s in (share, low, high)]
    return {
        "share": share,
        "lower": low,
        "upper": high,
        "gain at most": most[0],
        "most lower": most[1],
        "most upper": most[2],
    }


# -- coarse walls -----------------------------------------------------------------------------------------------------


def coarse_walls(settings: StudySettings, wall: str, folder: Path, pilot: int, workers: int) -> pd.DataFrame:
    """Return the pilot estimates for each kind of coarse wall."""
    rows = []
    for name, change in COARSE.items():
        if name.startswith("blocks") and settings.scene.dpc is not None:
            change = change | {"dpc": {"course": settings.scene.dpc.course // 2}}  # at the same height
        how = replace(settings.study, coarse=change, sampler="random")
        fine, coarse = levels(replace(settings, study=how))
        found = [
            run(Study(level), folder / f"{kind}.dp", pilot, workers)
            for kind, level in (("fine", fine), (name.replace(" ", "_"), coarse))
        ]
        cost = [float(np.nanmedian(ds["run_time"].values)) for ds in found]
        for quantity in quantities(found[0], wall):
            values, other = (values_of(ds, quantity) for ds in found)
            known = ~np.isnan(values) & ~np.isnan(other)
            report = read_pilot(values[known], other[known], *cost)
            rows.append(
                {
                    "coarse wall": name,
                    "quantity": name_of(quantity),
                    "correlation": report.correlation,
                    "lower": report.correlation_lower,
                    "upper": report.correlation_upper,
                    "cost ratio": report.cost_ratio,
                    "relative cost": report.relative_cost,
                    "at worst": report.relative_cost_worst,
                    "pays": report.pays,
                }
            )
    return pd.DataFrame(rows)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--wall", choices=("small", "solid", "window"), default="small")
    parser.add_argument("--part", nargs="+", choices=("sobol", "split", "coarse"), default=["sobol", "split", "coarse"])
    parser.add_argument("--replicates", type=int, default=16, help="scrambles")
    parser.add_argument("--samples", type=int, default=64, help="walls of each scramble, a power of two")
    parser.add_argument("--pairs", type=int, default=128, help="pairs of walls with the same values for the whole wall")
    parser.add_argument("--pilot", type=int, default=96, help="walls of each pilot run")
    parser.add_argument("--workers", type=int, default=1, help="processes")
    parser.add_argument("--output", type=Path, default=HERE / "results", help="folder")
    options = parser.parse_args()
    settings, out = settings_of(options.wall), options.output / options.wall
    out.mkdir(parents=True, exist_ok=True)
    pd.set_option("display.width", 180, "display.max_columns", 12, "display.precision", 2, "display.max_rows", 100)
    parts = {
        "sobol": (sobol, out / "sobol.dp", options.replicates, options.samples),
        "split": (split, out, options.pairs),
        "coarse": (coarse_walls, out, options.pilot),
    }
    for part in options.part:
        measure, place, *size = parts[part]
        found = measure(settings, options.wall, place, *size, options.workers)  # type: ignore[operator]
        print(f"{options.wall}, {part}:\n{found}\n", flush=True)
        found.to_csv(out / f"{part}.csv", index=False)


if __name__ == "__main__":
    main()
