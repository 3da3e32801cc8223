"""Check that pelicun and OpenQuake read exported curves correctly.

    python studies/exports/run.py [--only pelicun|openquake] [--output studies/exports/results]

It makes a separate environment for each program in the output folder (the first time: a few minutes, 2 GB), exports
curves with known medians and dispersions, reads them there, and compares the probabilities. It exits with 1 if a
difference is larger than allowed.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import venv
from pathlib import Path

import numpy as np
import xarray as xr
from scipy import special

from damagepred.exports import export_curves

HERE = Path(__file__).resolve().parent

NEEDED = {
    "pelicun": ["pelicun==3.10.0", "pandas<3"],
    # only the requirements that the engine's reader imports; the others are for maps and servers
    "openquake": [
        "numpy",
        "scipy",
        "pandas<3",
        "h5py",
        "psutil",
        "decorator",
        "toml",
        "numba",
        "requests",
        "docutils",
        "shapely",
        "pyproj",
        "h3",
        "alpha_shapes",
        "pyzmq",
        "django<5",
        "fiona",
        "geopandas",
    ],
}
WITHOUT_DEPENDENCIES = {"openquake": ["openquake.engine==3.26.2"]}

CASES = {
    "deflection_ratio": ("1", "unitless", 1.0, (1 / 900, 1 / 500, 1 / 320, 1 / 220), 0.42),
    "central_deflection": ("m", "m", 100.0, (6.5e-3, 12e-3, 18.5e-3, 27e-3), 0.42),
}
"""Unit here, unit in pelicun, factor to OpenQuake's unit; medians; dispersion."""


def known_curves(measure: str) -> xr.Dataset:
    """Return curves with known medians and one dispersion, as ``damagepred.fit_fragility`` would."""
    unit, _, _, medians, dispersion = CASES[measure]
    median, grid = np.array(medians), np.linspace(0.0, 2.0 * medians[-1], 201)
    with np.errstate(divide="ignore"):
        probability = special.ndtr((np.log(grid) - np.log(median)[:, None]) / dispersion)
    per_category = ("category",)
    return xr.Dataset(
        {
            "probability": (("category", "intensity"), probability),
            "median": (per_category, median),
            "dispersion": (per_category, np.full(len(median), dispersion)),
            "fit_status": (per_category, np.array(["fitted"] * len(median))),
        },
        coords={
            "category": np.arange(1, len(median) + 1),
            "category_name": (per_category, np.array(["very_slight", "slight", "moderate", "severe"])),
            "intensity": ("intensity", grid, {"units": unit}),
        },
        attrs={"title": "known curves", "intensity_measure": measure},
    )


def environment(program: str, folder: Path) -> Path:
    """Make a program's environment if it is missing; return its interpreter."""
    place = folder / program
    python, done = place / "bin" / "python", place / "done"
    if not done.exists():
        print(f"making an environment for {program} in {place}", flush=True)
        venv.create(place, clear=True, with_pip=True)
        install = [str(python), "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
        for package in WITHOUT_DEPENDENCIES.get(program, []):
            subprocess.run([*install, "--no-deps", package], check=True)
        # pip's warning about missing requirements of the engine is no error
        subprocess.run([*install, *NEEDED[program]], check=True)
        done.touch()
    return python


def read(python: Path, script: str, *arguments: object) -> dict:
    run = subprocess.run([str(python), str(HERE / script), *map(str, arguments)], capture_output=True, text=True)
    if run.returncode:
        sys.exit(f"{script} failed:\n{run.stderr[-2000:]}")
    return json.loads(run.stdout.strip().splitlines()[-1])


def compare(program: str, python: Path, folder: Path) -> float:
    """Print each difference; return the largest ratio to the allowed one."""
    worst = 0.0
    for measure, (_, unit, factor, medians, dispersion) in CASES.items():
        curves = known_curves(measure)
        levels = np.array(medians)[0] * np.array([0.5, 0.8, 1.0, 1.5, 2.5, 4.0, 6.0])
        ours = special.ndtr((np.log(levels) - np.log(medians)[:, None]) / dispersion)
        for kind in ["pelicun"] if program == "pelicun" else ["openquake", "openquake-discrete"]:
            file = export_curves(curves, kind, folder / f"{measure}.nc")[0]
            if program == "pelicun":
                found = read(python, "read_pelicun.py", file, unit, *levels)
                parameters = np.abs(np.array(found["median"]) / medians - 1).max()
                # its Latin hypercube has one realisation in each 200 000th of the capacity's distribution
                allowed = np.full_like(ours, 2 / 200_000)
            else:
                found = read(python, "read_openquake.py", file, *(factor * levels))
                parameters = 0.0
                # given to 1e-6; linear interpolation between the levels of a discrete function
                allowed = np.full_like(ours, 2e-6 if kind == "openquake" else 5e-3)
            difference = np.abs(np.array(found["probability"]) - ours)
            worst = max(worst, float((difference / allowed).max()), parameters / 1e-12)
            print(
                f"{kind:19} {measure:19} largest difference of a probability {difference.max():.1e}, "
                f"at most {(difference / allowed).max():.2f} of what is allowed"
            )
    return worst


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", choices=NEEDED, help="one program alone")
    parser.add_argument("--output", type=Path, default=HERE / "results", help="folder for environments and exports")
    options = parser.parse_args()
    options.output.mkdir(parents=True, exist_ok=True)
    worst = 0.0
    for program in [options.only] if options.only else NEEDED:
        python = environment(program, options.output / "environments")
        worst = max(worst, compare(program, python, options.output))
    print("same" if worst <= 1 else "NOT the same")
    return int(worst > 1)


if __name__ == "__main__":
    sys.exit(main())
