"""Provenance of a result: program, machine and libraries, which may change its last bits."""

from __future__ import annotations

import json
import platform
import subprocess
from collections import Counter
from collections.abc import Mapping
from functools import lru_cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from damagepred.enumerations import SOLVED
from damagepred.errors import DamagedError
from damagepred.runtime.one_thread import blas_libraries
from damagepred.runtime.version import __version__, source_hash

Environment = Mapping[str, str]

KEYS = {
    "machine": "machine",
    "damagepred_version": "version",
    "damagepred_commit": "commit",
    "kernel_hash": "kernel hash",
    "libraries": "libraries",
    "blas": "BLAS core",
}
"""Recorded properties of an environment, and their words in messages."""

TABLE = "environments"
"""Attribute of the variable ``environment``: the distinct environments of a file's samples, as a JSON list."""

GIVEN = "scene_given"  # attribute with the keys of the user's file; all other values are defaults
UNITS = "scene_units"  # attribute with the units that the user wrote, by key, as JSON


def given_values(given: Mapping[str, str] | None) -> dict[str, str]:
    """Attributes with the keys that were given and their units (``Scene.given``); empty if unknown."""
    if given is None:
        return {}
    units = {key: unit for key, unit in given.items() if unit}
    return {GIVEN: " ".join(sorted(given)), **({UNITS: json.dumps(units)} if units else {})}


@lru_cache(maxsize=1)
def package_commit() -> str:
    """Commit of the checkout this package runs from, with ``+`` if changed since, or ``"unknown"``."""
    root = Path(__file__).resolve().parents[2]
    if not (root / ".git").exists():
        return "unknown"
    command = ["git", "-C", str(root), "describe", "--always", "--abbrev=12", "--dirty=+", "--exclude=*"]
    try:
        run = subprocess.run(command, capture_output=True, text=True, timeout=10, check=True)
    except (OSError, subprocess.SubprocessError):
        return "unknown"
    return run.stdout.strip() or "unknown"


@lru_cache(maxsize=1)
def machine() -> str:
    """Model of the processor, on which compilers and libraries base the order of sums."""
    model = ""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
        model = next((line.partition(":")[2].strip() for line in lines if line.startswith("model name")), "")
    except OSError:  # not Linux
        model = platform.processor()
    return f"{model or 'unknown processor'}, {platform.machine()}, {platform.system()}"


@lru_cache(maxsize=1)
def blas() -> str:
    """BLAS libraries of numpy and scipy, each with the processor core of its kernels."""
    libraries = sorted(
        " ".join(filter(None, (lib.internal_api, lib.version, getattr(lib, "architecture", None))))
        for lib in blas_libraries()
    )
    return ", ".join(libraries) or "unknown"


@lru_cache(maxsize=1)
def environment() -> dict[str, str]:
    """Program, machine and libraries: all that may change the last bits of a result."""
    libraries = ", ".join(f"{name} {version(name)}" for name in ("numpy", "scipy", "numba"))
    return {
        "damagepred_version": __version__,
        "damagepred_commit": package_commit(),
        "kernel_hash": source_hash("kernels", "solvers"),
        "machine": machine(),
        "libraries": f"Python {platform.python_version()}, {libraries}",
        "blas": blas(),
    }


def provenance() -> dict[str, Any]:
    """Global attributes with program and machine of a result."""
    return {"source": f"damagepred {__version__}", **environment()}


def as_table(environments: list[Environment]) -> dict[str, str]:
    """Distinct environments as an attribute of the variable ``environment``."""
    return {TABLE: json.dumps([dict(environment) for environment in environments])}


def from_table(attributes: Mapping[str, Any], source: str = "environment") -> list[Environment]:
    """Distinct environments from the attributes of the variable ``environment``."""
    try:
        table = json.loads(attributes.get(TABLE, "[]"))
    except (ValueError, TypeError, RecursionError):
        table = None
    if not isinstance(table, list) or not all(isinstance(row, dict) for row in table):
        raise DamagedError(f"{source}: is damaged: its table of environments is no list.")
    return table


PROGRAM = ("damagepred_version", "damagepred_commit", "kernel_hash")
"""Properties of an environment that identify the program."""


def program(environment: Environment) -> str:
    """Version, commit and kernel hash, for messages."""
    return ", ".join(f"{KEYS[key]} {environment.get(key, 'unknown')}" for key in PROGRAM)


def programs(ds: xr.Dataset) -> dict[str, int]:
    """Number of solved samples of a study per program."""
    solved = np.isin(ds["status"].values, SOLVED)
    table: list[Environment] = []
    rows = np.full(int(solved.sum()), -1)
    if "environment" in ds:
        table, rows = from_table(ds["environment"].attrs), ds["environment"].values[solved]
    words = [*map(program, table), "an older version that did not record itself"]
    return dict(Counter(words[row] for row in rows.tolist()))


def mixture(ds: xr.Dataset) -> list[str]:
    """A sentence if several programs solved samples of a study."""
    counts = programs(ds)
    each = "; ".join(f"{count} by {words}" for words, count in counts.items())
    return [f"samples were solved by {len(counts)} programs, which may differ: {each}"] if len(counts) > 1 else []


def why_bits_differ(recorded: Environment | None, now: Environment) -> str:
    """Possible causes of a difference between a recorded and a repeated result, in a sentence."""
    if recorded is None:
        return "The archive is of an older version, which did not record where this sample was solved."
    words = {
        key: f"{word} ({recorded.get(key, 'unknown')}, here {now.get(key, 'unknown')})" for key, word in KEYS.items()
    }
    if different := [words[key] for key in KEYS if recorded.get(key) != now.get(key)]:
        return f"It was solved with another {'; another '.join(different)}."
    *first, last = KEYS.values()
    same = f"The {', '.join(first)} and {last} are the same"
    if now.get("damagepred_commit", "").endswith("+"):
        return f"{same}, but the checkout has changes that are not committed, then or now."
    return f"{same}: this is a bug in damagepred."
