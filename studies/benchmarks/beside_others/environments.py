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
SOLVERS = ("pymunk", "lmgc90", "openseespy", "exudyn")
IMPORTED = {
    "pymunk": "pymunk",
    "lmgc90": "compas_lmgc90._lmgc90",
    "openseespy": "openseespy.opensees",
    "exudyn": "exudyn",
}
LIBRARIES = ("libblas3", "liblapack3", "libgfortran5", "libquadmath0")


def default_folder() -> Path:
    """Return the default folder of the environments."""
    cache = os.environ.get("XDG_CACHE_HOME")
    return Path(cache or tempfile.gettempdir()) / "damagepred-beside-others"


def python_of(solver: str, folder: Path) -> Path:
    return folder / solver / "bin" / "python"


def variables(solver: str, folder: Path) -> dict[str, str]:
    """Return the environment variables of a solver: one thread, and the folder of unpacked libraries."""
    known = {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    known.pop("PYTHONPATH", None)
    places = sorted({str(found.parent) for found in (folder / solver / "libraries").rglob("*.so.*")})
    if places:
        known["LD_LIBRARY_PATH"] = os.pathsep.join(places)
    return known


def works(solver: str, folder: Path) -> bool:
    """Return whether a solver is installed and can be imported."""
    python = python_of(solver, folder)
    if not python.exists():
        return False
    command = [str(python), "-c", f"import {IMPORTED[solver]}"]
    return subprocess.run(command, env=variables(solver, folder), capture_output=True, check=False).returncode == 0


def made(solver: str, folder: Path) -> bool:
    """Make the environment of a solver where it is missing; return whether the solver can be imported."""
    if works(solver, folder):
        return True
    place = folder / solver
    subprocess.run([sys.executable, "-m", "venv", str(place)], check=True)
    pip = [str(python_of(solver, folder)), "-m", "pip", "install", "--quiet", "--only-binary", ":all:"]
    pip += ["--no-deps"] if solver == "lmgc90" else []
    subprocess.run([*pip, "-r", str(HERE / "requirements" / f"{solver}.txt")], check=False)
    if solver == "openseespy" and not works(solver, folder):
        unpack(place / "libraries")
    return works(solver, folder)


def unpack(place: Path) -> None:
    """Unpack the libraries that openseespy needs, without installing them."""
    place.mkdir(parents=True, exist_ok=True)
    subprocess.run(["apt-get", "download", "--quiet", *LIBRARIES], cwd=place, check=False)
    for package in place.glob("*.deb"):
        subprocess.run(["dpkg-deb", "-x", str(package), str(place)], check=True)
