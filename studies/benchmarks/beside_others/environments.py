"""Separate environments for the other solvers: made once, used by ``run.py``.

Each is a virtual environment with the versions that its file in ``requirements/`` pins. openseespy's wheel needs BLAS,
LAPACK and the Fortran library of the machine; where these are not installed, and the machine is a Debian, its packages
are unpacked inside the environment.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
ENVIRONMENTS = "DAMAGEPRED_BENCHMARK_ENVIRONMENTS"
"""Variable of the environment that names the folder of the other solvers' environments."""
SOLVERS = ("pymunk", "lmgc90", "openseespy", "exudyn")
IMPORTED = {
    "pymunk": "pymunk",
    "lmgc90": "compas_lmgc90._lmgc90",
    "openseespy": "openseespy.opensees",
    "exudyn": "exudyn",
}
LIBRARIES = ("libblas3", "liblapack3", "libgfortran5", "libquadmath0")


def folder() -> Path:
    """Return the folder of the environments."""
    cache = os.environ.get("XDG_CACHE_HOME") or tempfile.gettempdir()
    return Path(os.environ.get(ENVIRONMENTS) or Path(cache) / "damagepred-beside-others")


def python_of(solver: str) -> Path:
    return folder() / solver / "bin" / "python"


def variables(solver: str) -> dict[str, str]:
    """Return the environment variables of a solver: one thread, and the folder of unpacked libraries."""
    known = {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    known.pop("PYTHONPATH", None)
    places = sorted({str(found.parent) for found in (folder() / solver / "libraries").rglob("*.so.*")})
    if places:
        known["LD_LIBRARY_PATH"] = os.pathsep.join(places)
    return known


def works(solver: str) -> bool:
    """Return whether a solver is installed and can be imported."""
    python = python_of(solver)
    if not python.exists():
        return False
    command = [str(python), "-c", f"import {IMPORTED[solver]}"]
    return subprocess.run(command, env=variables(solver), capture_output=True, check=False).returncode == 0


def made(solver: str) -> bool:
    """Make the environment of a solver where it is missing; return whether the solver can be imported."""
    if works(solver):
        return True
    place = folder() / solver
    subprocess.run([sys.executable, "-m", "venv", str(place)], check=True)
    pip = [str(python_of(solver)), "-m", "pip", "install", "--quiet", "--only-binary", ":all:"]
    pip += ["--no-deps"] if solver == "lmgc90" else []
    subprocess.run([*pip, "-r", str(HERE / "requirements" / f"{solver}.txt")], check=False)
    if solver == "openseespy" and not works(solver):
        libraries = place / "libraries"  # unpacked without installing them
        libraries.mkdir(parents=True, exist_ok=True)
        subprocess.run(["apt-get", "download", "--quiet", *LIBRARIES], cwd=libraries, check=False)
        for package in libraries.glob("*.deb"):
            subprocess.run(["dpkg-deb", "-x", str(package), str(libraries)], check=True)
    return works(solver)
