"""Fixed work of several kinds, without damagepred; it may not change, as baselines hold for it alone."""

import subprocess
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from tempfile import TemporaryDirectory

import netCDF4
import numba
import numpy as np
from scipy.linalg import lapack

Work = Callable[[], object]


@numba.njit(nogil=True, error_model="numpy")
def _law(opening, slip, stress, shear):
    """Stresses of springs that break and slide: arithmetic that the compiler can vectorise."""
    for i in range(len(opening)):
        normal = 1.3 * opening[i]
        normal = normal if normal < 0.4 else 0.0
        most = max(0.3 - 0.7 * normal, 0.0)
        trial = 0.9 * slip[i]
        shear[i] = min(max(trial, -most), most)
        stress[i] = normal / (1.0 + np.sqrt(np.abs(trial) + 1.0))


@numba.njit(nogil=True, error_model="numpy")
def _collect(at, stress, shear, force):
    """Scattered sums, which cannot be vectorised, because each may depend on the last."""
    force[:] = 0.0
    for i in range(len(at)):
        force[at[i]] += stress[i] - shear[i]
        force[at[i] + 1] -= stress[i]


@numba.njit(nogil=True, error_model="numpy")
def _stream(a, b, c):
    """Read and write more than the nearest caches hold."""
    for i in range(len(a)):
        a[i] = b[i] + 0.5 * c[i]


def _compiled() -> Work:
    random = np.random.default_rng(1)
    opening, slip = random.standard_normal(8192), random.standard_normal(8192)
    stress, shear, force = np.empty(8192), np.empty(8192), np.zeros(3001)
    at = random.integers(0, 3000, 8192)
    far = [np.ones(160_000) for _ in range(3)]

    def work() -> None:
        for _ in range(40):
            _law(opening, slip, stress, shear)
            _collect(at, stress, shear, force)
        for _ in range(4):
            _stream(*far)

    return work


class _Thing:
    def __init__(self, number: int, name: str) -> None:
        self.number, self.name = number, name

    def doubled(self) -> int:
        return 2 * self.number


def _interpreter() -> Work:
    small = np.linspace(0.0, 1.0, 50)

    def work() -> None:
        things = {f"thing {i}": _Thing(i, "name") for i in range(1500)}
        sum(thing.doubled() for thing in things.values() if thing.name == "name")
        sorted(things, key=lambda key: things[key].number % 97)
        total = small
        for i in range(400):
            total = np.where(total > 0.5, total * 0.5, total + small[i % 50])
            np.flatnonzero(total > 0.3)

    return work


def _lapack() -> Work:
    random = np.random.default_rng(2)
    matrix = random.standard_normal((90, 90)) + 90.0 * np.eye(90)

    def work() -> None:
        for _ in range(8):
            factors, pivots, _ = lapack.dgetrf(matrix)
            inverse, _ = lapack.dgetri(factors, pivots)
            matrix @ inverse

    return work


def _files() -> Work:
    folder = TemporaryDirectory()
    file = Path(folder.name) / "yardstick.nc"
    values = np.random.default_rng(3).standard_normal((50, 20))

    def work(_kept: TemporaryDirectory[str] = folder) -> None:
        with netCDF4.Dataset(file, "w") as ds:
            ds.createDimension("row", 50)
            ds.createDimension("column", 20)
            for i in range(12):
                variable = ds.createVariable(f"v{i}", "f8", ("row", "column"), zlib=True)
                variable.units = "m"
                variable[:] = values
        with netCDF4.Dataset(file) as ds:
            for variable in ds.variables.values():
                variable[:]

    return work


def _process() -> Work:
    command = [sys.executable, "-c", "import argparse, asyncio, decimal, email.message, json, numpy, unittest"]
    return lambda: subprocess.run(command, check=True)


def _compiler() -> Work:
    def kernel(x, y, at, out):
        for i in range(len(x)):
            a = x[i] - y[at[i]]
            if a > 0.5:
                out[at[i]] += a * a
            elif a < -0.5:
                out[i] -= np.sqrt(-a)
            else:
                out[i] += min(a, 0.25)
        return out.sum()

    def work() -> None:
        numba.njit("float64(float64[::1], float64[::1], int64[::1], float64[::1])")(kernel)

    return work


MAKERS: dict[str, Callable[[], Work]] = {
    "compiled": _compiled,
    "interpreter": _interpreter,
    "lapack": _lapack,
    "files": _files,
    "process": _process,
    "compiler": _compiler,
}
"""Kinds of work."""

_MADE: dict[str, Work] = {}


def yardstick(times: Mapping[str, int]) -> Work:
    """Return work of several kinds, each with a number of repetitions."""
    for kind in times:
        if kind not in _MADE:
            _MADE[kind] = MAKERS[kind]()
            _MADE[kind]()  # compiles

    def work() -> None:
        for kind, count in times.items():
            for _ in range(count):
                _MADE[kind]()

    return work
