"""Sobol's indices: which share of an output's variance each input brings about, alone and with the others."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike
from scipy import special

from damagepred.arrays import FloatArray
from damagepred.errors import InputError
from damagepred.uq.random_streams import Stream, generator
from damagepred.uq.samplers import unit_points


def saltelli_points(variables: int, size: int, seed: int) -> FloatArray:
    """Points at which a function is evaluated for Sobol's indices."""
    both = unit_points("sobol", 2 * variables, size, seed)
    return saltelli_rows(both[:, :variables], both[:, variables:])


def saltelli_rows(first: FloatArray, second: FloatArray) -> FloatArray:
    """Put two base samples together as Sobol's indices need them."""
    size, k = first.shape
    rows = np.repeat(first[:, None, :], k + 2, axis=1)
    rows[:, np.arange(1, k + 1), np.arange(k)] = second
    rows[:, -1] = second
    return rows.reshape(size * (k + 2), k)


def sobol_indices(
    values: ArrayLike,
    variables: Sequence[str],
    *,
    confidence: float = 0.9,
    resamples: int = 500,
    seed: int = 0,
) -> xr.Dataset:
    """Sobol's first (Saltelli and others 2010, table 2 b) and total indices (Jansen 1999) of an output."""
    names, y = list(variables), np.asarray(values, dtype=np.float64)
    if y.ndim != 1 or not names or len(y) % (len(names) + 2) or len(y) < 2 * (len(names) + 2):
        raise InputError(
            f"values: {np.shape(values)} of them for {len(names)} variables; there must be {len(names) + 2} for each "
            "of two or more base points, in the order of saltelli_points."
        )
    if not 0 < confidence < 1:
        raise InputError(f"confidence = {confidence!r}: must lie between 0 and 1.")
    unknown = np.flatnonzero(~np.isfinite(y))
    if unknown.size:
        raise InputError(
            f"{unknown.size} of {len(y)} values are not finite, the first in row {unknown[0]}: Sobol's indices need "
            "them all, and leaving walls out would falsify them. Solve those again, or choose an output that failed "
            "walls have."
        )
    if np.ptp(y) == 0:
        raise InputError(f"all {len(y)} values are {y[0]:g}: an output that does not vary has no shares of variance.")
    # centred over all values and scaled, as SALib does
    table = ((y - y.mean()) / y.std()).reshape(-1, len(names) + 2)
    first, total = _indices(table)
    columns: dict[str, FloatArray] = {"first_order": first, "total": total}
    if resamples:
        random = generator(seed, Stream.BOOTSTRAP, 0)
        again = [_indices(table[random.integers(len(table), size=len(table))]) for _ in range(resamples)]
        reach = special.ndtri(0.5 * (1 + confidence))
        for k, (name, value) in enumerate((("first_order", first), ("total", total))):
            error = np.std([indices[k] for indices in again], axis=0, ddof=1)
            columns |= {
                f"{name}_error": error,
                f"{name}_lower": value - reach * error,
                f"{name}_upper": value + reach * error,
            }
    return xr.Dataset(
        {name: ("variable", column, {"units": "1"}) for name, column in columns.items()},
        coords={"variable": names},
        attrs={"base_points": len(table), "confidence": confidence, "bootstrap_samples": resamples},
    )


def _indices(table: FloatArray) -> tuple[FloatArray, FloatArray]:
    """First and total indices from values (base points, k + 2)."""
    a, mixed, b = table[:, :1], table[:, 1:-1], table[:, -1:]
    variance = np.var(np.concatenate((a, b)))
    if variance == 0:  # a resample of few points
        return np.zeros(mixed.shape[1]), np.zeros(mixed.shape[1])
    first = (b * (mixed - a)).mean(axis=0) / variance
    return first, 0.5 * ((a - mixed) ** 2).mean(axis=0) / variance
