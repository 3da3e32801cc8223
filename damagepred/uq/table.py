"""Samples that the user brings: a table with one column a variable and one row a wall."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from damagepred.arrays import FloatArray
from damagepred.errors import InputError, nearest
from damagepred.scene.number_table import read_number_table

WEIGHT = "weight"
"""Column that is no number of the scene."""


def read_table(path: str | Path, unit_of: Callable[[str], str], known: Sequence[str]) -> dict[str, FloatArray]:
    """Read samples (SI) by place from a table.

    Parameters
    ----------
    path : str or Path
        The first line names the columns by place, with a unit in brackets if they are not in SI:
        ``joint.tensile_strength [MPa],dpc.friction``. A cell may carry its own unit instead. A column ``weight`` has
        the weight of each sample, for samples from another distribution (importance sampling).
    unit_of : callable
        Returns a place's SI unit.
    known : sequence of str
        Places that may stand in the header.
    """
    try:
        table = read_number_table(path)
    except InputError as error:
        raise InputError(f"study.table: {error}") from None
    found: dict[str, FloatArray] = {}
    for k, place in enumerate(table.names):
        if place not in (*known, WEIGHT):
            hint = nearest(place, [*known, WEIGHT])
            raise InputError(f"{path}: column {table.headers[k]!r}: the scene has no such number.{hint}")
        if place in found:
            raise InputError(f"{path}: a column is named twice: {', '.join(table.names)}.")
        found[place] = table.numbers(k, "1" if place == WEIGHT else unit_of(place), cell_units=True)
    if WEIGHT in found and (found[WEIGHT] < 0).any():
        first = table.cells.index[found[WEIGHT] < 0][0]
        raise InputError(f"{path}, line {first}, weight = {found[WEIGHT].min():g}: must not be negative.")
    return found
