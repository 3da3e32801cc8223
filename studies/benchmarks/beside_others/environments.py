"""Separate environments for the other solvers, with the versions that ``requirements`` pins."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
ENVIRONMENTS = "DAMAGEPRED_BENCHMARK_ENVIRONMENTS"
"""Variable of the environment that names the folder of the other solvers' environments."""
IMPORTED = {"pymunk": "pymunk", "lmgc90": "compas_lmgc90._lmgc90"}


def python_of(solver: str) -> Path:
    """Interpreter of a solver's environment."""
    cache = Path(os.environ.get("XDG_CACHE_HOME") or tempfile.gettempdir()) / "damagepred-beside-others"
    return Path(os.environ.get(ENVIRONMENTS) or cache) / solver / "bin" / "python"


def variables() -> dict[str, str]:
    """Environment variables of a solver: one thread."""
    known = {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    known.pop("PYTHONPATH", None)
    return known


def works(solver: str) -> bool:
    """Whether a solver is installed and can be imported."""
    command = [str(python_of(solver)), "-c", f"import {IMPORTED[solver]}"]
    return python_of(solver).exists() and subprocess.run(command, env=variables(), capture_output=True).returncode == 0


def made(solver: str) -> bool:
    """Make the environment of a solver where it is missing; return whether the solver can be imported."""
    if works(solver):
        return True
    subprocess.run([sys.executable, "-m", "venv", str(python_of(solver).parents[1])], check=True)
    pip = [str(python_of(solver)), "-m", "pip", "install", "--quiet", "--only-binary", ":all:"]
    pip += ["--no-deps"] if solver == "lmgc90" else []
    subprocess.run([*pip, "-r", str(HERE / "requirements" / f"{solver}.txt")], check=False)
    return works(solver)
