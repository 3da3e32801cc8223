"""A small fixed job: solve, study of four walls, fragility, report, pictures, replay.

python .ci/small_job.py
"""

from __future__ import annotations

import importlib.metadata
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

STUDY = """
[study]
title = "small wall that cracks"
samples = 4
seed = 7

[scene.wall]
length = 1.44
height = "0.45 m"

[scene.joint]
tensile_strength = "0.1 MPa"
cohesion = "0.1 MPa"

[scene.loads]
roof = "2 kN"

[scene.movement]
kind = "doming"
central_deflection = "6 mm"
increments = 6

[variables."joint.tensile_strength"]
distribution = "lognormal"
mean = "0.1 MPa"
cov = 0.3
field = { course_correlation = 0.4 }

[variables."joint.friction"]
distribution = "truncated_normal"
mean = 0.75
cov = 0.15
lower = 0.4
upper = 1.2
"""
SCENE = """
[wall]
length = 1.44
height = 0.45

[solver]
blocks = "deformable"

[movement]
central_deflection = "3 mm"
increments = 2
"""
COMMANDS = (
    "solve wall.toml -o wall.nc --plot wall",
    "cracks wall.nc --csv cracks.csv",
    "report wall.nc -o wall.html",
    "check house.toml",
    "study house.toml -n 4 -j 2 -o house.dp",
    "status house.dp",
    "fragility house.dp --plot curves.png --csv curves.csv -o curves.nc",
    "judge house.dp --table bre251 -o again.nc",
    "plot house.dp -o study",
    "report house.dp -o house.html",
    "replay house.dp 1 -o one.nc --plot one",
)


def main() -> int:
    """Run the commands one after the other; stop at the first that fails."""
    names = (
        "numpy",
        "numba",
        "scipy",
        "pandas",
        "xarray",
        "netCDF4",
        "matplotlib",
        "pydantic",
        "pint",
        "typer",
        "rich",
    )
    print("Python", sys.version.split()[0], *(f"{name} {importlib.metadata.version(name)}" for name in names))
    with TemporaryDirectory() as folder:
        (Path(folder) / "house.toml").write_text(STUDY, encoding="utf-8")
        (Path(folder) / "wall.toml").write_text(SCENE, encoding="utf-8")
        for command in COMMANDS:
            print(f"$ damagepred {command}", flush=True)
            words = [sys.executable, "-m", "damagepred", *command.split()]
            run = subprocess.run(words, cwd=folder, capture_output=True, text=True, check=False)
            said = run.stdout + run.stderr
            if run.returncode or "Traceback" in said or (command.startswith("replay") and "bit for bit" not in said):
                print(said, file=sys.stderr)
                return 1
        for made in ("wall.html", "house.html", "curves.png", "curves.csv", "cracks.csv", "one.nc", "again.nc"):
            assert (Path(folder) / made).stat().st_size > 0, made
    return 0


if __name__ == "__main__":
    sys.exit(main())
