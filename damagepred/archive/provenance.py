"""Where a result comes from: program, machine and libraries, as far as the last bits of a result depend on them."""

from __future__ import annotations

import json
import platform
import subprocess
from collections import Counter
from collections.abc import Collection, Mapping
from functools import lru_cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from damagepred.enumerations import SOLVED
from damagepred.errors import DamagedError
from damagepred.runtime.one_thread import blas_libraries
from damagepred.runtime.version import __version__, kernel_hash

Environment = Mapping[str, str]

KEYS = {
    "machine": "machine",
    "damagepred_version": "version",
    "damagepred_commit": "commit",
    "kernel_hash": "kernel hash",
    "libraries": "libraries",
    "blas": "BLAS core",
}
"""What is recorded of an environment, and its word in messages."""

TABLE = "environments"
"""Attribute of the variable ``environment``: the distinct environments of a file's samples, as a JSON list."""


GIVEN = "scene_given"
"""Attribute with the places of the values that the user's file gives; the others are defaults."""


def given_values(places: Collection[str] | None) -> dict[str, str]:
    """Return the attribute that tells which values of a scene were given; none where that is not known.

    Parameters
    ----------
    places : Collection[str] or None
        As ``Scene.given``.
    """
    return {} if places is None else {GIVEN: " ".join(sorted(places))}


@lru_cache(maxsize=1)
def package_commit() -> str:
    """Return the commit of the checkout this package runs from, with ``+`` if changed since, or ``"unknown"``."""
    root = Path(__file__).resolve().parents[2]
    if not (root / ".git").exists():
        return "unknown"
    try:
        run = subprocess.run(
            ["git", "-C", str(root), "describe", "--always", "--abbrev=12", "--dirty=+", "--exclude=*"],
            capture_output=True,
            text=True,
            timeout=10,
            check=True,
        )
    except (OSError, subprocess.SubprocessError):
        return "unknown"
    return run.stdout.strip() or "unknown"


@lru_cache(maxsize=1)
def machine() -> str:
    """Return the model of the processor, which decides what compilers and libraries make of a sum."""
    model = ""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
        model = next((line.partition(":")[2].strip() for line in lines if line.startswith("model name")), "")
    except OSError:  # not Linux
        model = platform.processor()
    return f"{model or 'unknown processor'}, {platform.machine()}, {platform.system()}"


@lru_cache(maxsize=1)
def blas() -> str:
    """Return the BLAS libraries of numpy and scipy, each with the kind of core it has chosen its kernels for."""
    found = sorted(
        " ".join(filter(None, (lib.internal_api, lib.version, getattr(lib, "architecture", None))))
        for lib in blas_libraries()
    )
    return ", ".join(found) or "unknown"


@lru_cache(maxsize=1)
def environment() -> dict[str, str]:
    """Return what the bits of a result depend on besides its inputs."""
    libraries = ", ".join(f"{name} {version(name)}" for name in ("numpy", "scipy", "numba"))
    return {
        "damagepred_version": __version__,
        "damagepred_commit": package_commit(),
        "kernel_hash": kernel_hash(),
        "machine": machine(),
        "libraries": f"Python {platform.python_version()}, {libraries}",
        "blas": blas(),
    }


def provenance() -> dict[str, Any]:
    """Return the global attributes that say which program made a result, and where."""
    return {"source": f"damagepred {__version__}", **environment()}


def as_table(environments: list[Environment]) -> dict[str, str]:
    """Return distinct environments as an attribute of the variable ``environment``."""
    return {TABLE: json.dumps([dict(one) for one in environments])}


def from_table(attributes: Mapping[str, Any], source: str = "environment") -> list[Environment]:
    """Return the distinct environments that the attributes of the variable ``environment`` hold.

    Parameters
    ----------
    attributes : mapping
        Attributes of the variable ``environment``.
    source : str
        Name of the file, for the message.

    Raises
    ------
    DamagedError
        If they are something else.
    """
    try:
        table = json.loads(attributes.get(TABLE, "[]"))
    except (ValueError, TypeError, RecursionError):
        table = None
    if not isinstance(table, list) or not all(isinstance(one, dict) for one in table):
        raise DamagedError(f"{source}: is damaged: its table of environments is no list.")
    return table


PROGRAM = ("damagepred_version", "damagepred_commit", "kernel_hash")
"""What tells one program from another."""


def program(one: Environment) -> str:
    """Return in words the program that solved a sample."""
    return ", ".join(f"{KEYS[key]} {one.get(key, 'unknown')}" for key in PROGRAM)


def programs(ds: xr.Dataset) -> dict[str, int]:
    """Return how many samples of a study each program has solved.

    Parameters
    ----------
    ds : xarray.Dataset
        With ``status`` and, unless all samples are of older versions, ``environment``.
    """
    solved = np.isin(ds["status"].values, SOLVED)
    table: list[Environment] = []
    rows = np.full(int(solved.sum()), -1)
    if "environment" in ds:
        table, rows = from_table(ds["environment"].attrs), ds["environment"].values[solved]
    words = [*map(program, table), "an older version that did not record itself"]
    return dict(Counter(words[row] for row in rows.tolist()))


def mixture(ds: xr.Dataset) -> list[str]:
    """Return a sentence if samples of a study were solved by several programs, else nothing."""
    found = programs(ds)
    each = "; ".join(f"{count} by {words}" for words, count in found.items())
    return [f"walls were solved by {len(found)} programs, which may differ: {each}"] if len(found) > 1 else []


def differences(recorded: Environment, now: Environment) -> list[str]:
    """Return in words what of two environments differs.

    Parameters
    ----------
    recorded, now : mapping of str to str
        As ``environment`` returns them.
    """
    return [
        f"{word} ({recorded.get(key, 'unknown')}, here {now.get(key, 'unknown')})"
        for key, word in KEYS.items()
        if recorded.get(key) != now.get(key)
    ]


def why_bits_differ(recorded: Environment | None, now: Environment) -> str:
    """Return a sentence: what a difference between a recorded and a repeated result can come from.

    Parameters
    ----------
    recorded : mapping of str to str, or None
        Environment of the recorded result; None where the archive has none.
    now : mapping of str to str
        Environment of the repeated one.
    """
    if recorded is None:
        return "The archive is of an older version, which did not record where this sample was solved."
    if different := differences(recorded, now):
        return f"It was solved with another {'; another '.join(different)}."
    *first, last = KEYS.values()
    same = f"The {', '.join(first)} and {last} are the same"
    if now.get("damagepred_commit", "").endswith("+"):
        return f"{same}, but the checkout has changes that are not committed, then or now."
    return f"{same}: this is a defect of damagepred."
