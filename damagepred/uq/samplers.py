"""Samples of the values of a whole wall: points in the unit cube, or a table of the user.

Point i depends on the seed and i alone, except in a Latin hypercube. A table has one column per variable and one row
per wall.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from damagepred.arrays import FloatArray
from damagepred.errors import InputError, nearest
from damagepred.scene.number_table import read_number_table
from damagepred.uq.random_streams import RandomStream, generator


def unit_points(sampler: str, dimensions: int, samples: int, seed: int, replicates: int = 1) -> FloatArray:
    """Points in the open unit cube."""
    if sampler not in ("sobol", "lhs", "random"):
        raise InputError(f"study.sampler = {sampler!r}: must be 'sobol', 'lhs' or 'random'.")
    if dimensions == 0:
        return np.empty((samples, 0))
    if sampler == "random":
        return np.array([generator(seed, RandomStream.WALL, i).random(dimensions) for i in range(samples)])
    from scipy.stats import qmc

    if sampler == "lhs":
        cube = qmc.LatinHypercube(dimensions, rng=generator(seed, RandomStream.SCRAMBLE, 0))
        return np.asarray(cube.random(samples))
    points = np.empty((samples, dimensions))
    for scramble in range(min(replicates, samples)):
        turn = points[scramble::replicates]
        sobol = qmc.Sobol(dimensions, scramble=True, rng=generator(seed, RandomStream.SCRAMBLE, scramble))
        # the sequence is made for powers of two; the first points stay the same
        turn[:] = sobol.random(1 << max(len(turn) - 1, 1).bit_length())[: len(turn)]
    return np.clip(points, 2.0**-53, 1.0 - 2.0**-53)


WEIGHT = "weight"  # column that is no number of the scene


def read_table(path: str | Path, unit_of: Callable[[str], str], places: Sequence[str]) -> dict[str, FloatArray]:
    """Read samples (SI) by place from a table."""
    try:
        table = read_number_table(path)
    except InputError as error:
        raise InputError(f"study.table: {error}") from None
    columns: dict[str, FloatArray] = {}
    for k, place in enumerate(table.names):
        if place not in (*places, WEIGHT):
            hint = nearest(place, [*places, WEIGHT])
            raise InputError(f"{path}: column {table.headers[k]!r}: the scene has no such number.{hint}")
        if place in columns:
            raise InputError(f"{path}: a column is named twice: {', '.join(table.names)}.")
        columns[place] = table.numbers(k, "1" if place == WEIGHT else unit_of(place), cell_units=True)
    if WEIGHT in columns and (columns[WEIGHT] < 0).any():
        first = table.cells.index[columns[WEIGHT] < 0][0]
        raise InputError(f"{path}, line {first}, weight = {columns[WEIGHT].min():g}: must not be negative.")
    return columns
