"""Shares of variance of two groups of inputs, from tables in which both are crossed.

Each table has two walls and two fields (all values that vary from joint to joint) in every combination: value [i, j]
is of wall i with field j. Tables are independent. Differences within a table give the main effects of the field and of
the wall and their interaction (analysis of variance with random effects). The three components are unbiased and add up
to the variance; inputs in a group may depend on each other in any way.

Intervals are bootstrap-t from resampled tables (Efron and Tibshirani 1993, ch. 12); that of the interaction, a mean of
squares, is of its logarithm.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from damagepred.arrays import FloatArray
from damagepred.errors import InputError
from damagepred.formatting import options_text
from damagepred.runtime.one_thread import one_blas_thread
from damagepred.uq.random_streams import Stream, generator


@dataclass(frozen=True)
class CrossedOptions:
    """Tables from which there are intervals: of fewer, they cover the truth too rarely (studies/coverage).

    Attributes
    ----------
    fewest_tables : int
        Tables for intervals of the first-order and total shares.
    fewest_tables_interaction : int
        Tables for an interval of the interaction.
    """

    fewest_tables: int = 20
    fewest_tables_interaction: int = 50


DEFAULT = CrossedOptions()

GROUPS = ("wall", "joints")
"""What the rows and columns of a table are."""


@one_blas_thread()
def crossed_shares(
    values: ArrayLike,
    *,
    confidence: float = 0.9,
    resamples: int = 1000,
    seed: int = 0,
    options: CrossedOptions = DEFAULT,
) -> xr.Dataset:
    """Shares of variance of what holds for a wall and of what varies from joint to joint."""
    y = np.asarray(values, dtype=np.float64)
    if y.ndim != 3 or y.shape[1:] != (2, 2) or len(y) < 2:
        raise InputError(f"values: have shape {y.shape}; there must be two or more tables of two walls and two fields.")
    if unknown := int((~np.isfinite(y)).sum()):
        raise InputError(f"{unknown} of {y.size} values are not finite: shares of variance need them all.")
    if np.ptp(y) == 0:
        raise InputError(
            f"all {y.size} values are {y.flat[0]:g}: an output that does not vary has no shares of variance."
        )
    if not 0 < confidence < 1:
        raise InputError(f"confidence = {confidence!r}: must lie between 0 and 1.")
    parts = _variance_components(y)
    best, stated = (value[0] for value in _variance_shares(parts, np.full((1, len(y)), 1.0 / len(y))))
    error, low, high = np.full((3, len(best)), np.nan)
    if resamples > 1:
        random = generator(seed, Stream.BOOTSTRAP, 0)
        drawn = random.multinomial(len(y), np.full(len(y), 1 / len(y)), size=resamples) / len(y)
        again, errors = _variance_shares(parts, drawn)
        error = np.nanstd(again, axis=0, ddof=1)
        low, high = _bootstrap_t(best, stated, again, errors, confidence)
    for few, which in (
        (options.fewest_tables, slice(4)),
        (options.fewest_tables_interaction, slice(4, 5)),
    ):
        if len(y) < few:
            low[which] = high[which] = np.nan
    columns: dict[str, tuple[str | tuple[()], FloatArray, dict[str, str]]] = {}
    for end, value in (("", best), ("_error", error), ("_lower", low), ("_upper", high)):
        columns[f"first_order{end}"] = ("group", value[:2], {"units": "1"})
        columns[f"total{end}"] = ("group", value[2:4], {"units": "1"})
        columns[f"interaction{end}"] = ((), value[4], {"units": "1"})
    attrs = {
        "tables": len(y),
        "confidence": confidence,
        "bootstrap_samples": resamples,
        "options": options_text(options),
    }
    return xr.Dataset(columns, {"group": list(GROUPS)}, attrs)


def _variance_components(y: FloatArray) -> FloatArray:
    """Return each table's estimates of the total of the wall, the total of the joints and the interaction."""
    wall = 0.25 * ((y[:, 0] - y[:, 1]) ** 2).sum(axis=1)
    joints = 0.25 * ((y[:, :, 0] - y[:, :, 1]) ** 2).sum(axis=1)
    both = 0.25 * (y[:, 0, 0] - y[:, 0, 1] - y[:, 1, 0] + y[:, 1, 1]) ** 2
    return np.column_stack((wall, joints, both))


def _variance_shares(parts: FloatArray, drawn: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return first order and total of wall and joints and the interaction, (resamples, 5), with delta-method errors."""
    each = parts @ np.array([[1, 0, 1, 0, 0], [0, 1, 0, 1, 0], [-1, -1, 0, 0, 1]])
    variance = parts @ np.array([1, 1, -1])
    mean, whole = drawn @ each, (drawn @ variance)[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where(whole > 0, mean / whole, np.nan)
        square = drawn @ each**2 - 2 * share * (drawn @ (each * variance[:, None]))
        square += share**2 * (drawn @ variance**2)[:, None]
        return share, np.sqrt(np.maximum(square, 0.0) / len(parts)) / whole


def _bootstrap_t(
    best: FloatArray, error: FloatArray, again: FloatArray, errors: FloatArray, confidence: float
) -> tuple[FloatArray, FloatArray]:
    """Return the ends of bootstrap-t intervals of estimates with their resamples, the last one by its logarithm."""
    tails = [0.5 * (1 - confidence), 0.5 * (1 + confidence)]
    ends = np.full((2, len(best)), np.nan)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        t = (again - best) / errors
        t[:, -1] = again[:, -1] / errors[:, -1] * np.log(again[:, -1] / best[-1])
        for k, column in enumerate(t.T):
            if (known := column[np.isfinite(column)]).size:
                ends[:, k] = best[k] - error[k] * np.quantile(known, tails)[::-1]
        ends[:, -1] = best[-1] * np.exp(ends[:, -1] / best[-1] - 1.0)
    return ends[0], np.minimum(ends[1], np.append(np.full(len(best) - 1, np.inf), 1.0))
