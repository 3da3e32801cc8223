"""Shares of variance of two groups of inputs, from tables in which both are crossed.

Each table has two walls and two fields (all that varies from joint to joint) in every combination: value [i, j] is of
wall i with field j. Tables are independent. Differences within a table show what changing the field alone does, the
wall alone, and what both do together beyond that (interaction): analysis of variance with random effects. The three
parts are unbiased and add up to the variance; inputs in a group may depend on each other in any way.

Intervals come from a bootstrap of tables: Student's for the shares, and for the interaction, a mean of squares,
bootstrap-t of its logarithm (Efron and Tibshirani 1993, ch. 12).
"""

from __future__ import annotations

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from damagepred.arrays import FloatArray
from damagepred.errors import InputError
from damagepred.one_thread import one_blas_thread
from damagepred.uq.estimate import student_factor
from damagepred.uq.samplers import Stream, generator

FEWEST = 20
"""Tables from which on there are intervals."""

FEWEST_TOGETHER = 50
"""Tables from which on there is one of the interaction."""

GROUPS = ("wall", "joints")
"""What the rows and columns of a table are."""


@one_blas_thread()
def crossed_shares(values: ArrayLike, *, confidence: float = 0.9, resamples: int = 1000, seed: int = 0) -> xr.Dataset:
    """Return the shares of variance of what holds for a wall and of what varies from joint to joint.

    Parameters
    ----------
    values : array (tables, 2, 2)
        Output of wall i with field j in [table, i, j].
    confidence : float
        Of the intervals.
    resamples, seed : int
        Of the bootstrap of tables.

    Returns
    -------
    xarray.Dataset
        ``first_order`` (by itself) and ``total`` (with the interaction) on (group,), "wall" and "joints", and
        ``interaction``; each with ``_error``, ``_lower`` and ``_upper``. Of fewer than 20 tables there are no
        intervals, of fewer than 50 none of the interaction: they would hold less than they say (studies/coverage).

    Raises
    ------
    InputError
        If a value is not finite, or the output does not vary.
    """
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
    parts = _parts(y)
    best = _shares(parts.mean(axis=0))
    error, limits = np.full_like(best, np.nan), (np.nan, np.nan)
    if resamples > 1:
        random = generator(seed, Stream.BOOTSTRAP, 0)
        drawn = random.multinomial(len(y), np.full(len(y), 1 / len(y)), size=resamples) / len(y)
        error = np.nanstd([_shares(row) for row in drawn @ parts], axis=0, ddof=1)
        if len(y) >= FEWEST_TOGETHER:
            limits = _interaction_limits(parts, drawn, confidence)
    reach = student_factor(confidence, len(y) - 1) * error
    if len(y) < FEWEST:
        reach = np.full_like(reach, np.nan)
    low, high = best - reach, best + reach
    low[4], high[4] = limits
    columns: dict[str, tuple[str | tuple[()], FloatArray, dict[str, str]]] = {}
    for end, value in (("", best), ("_error", error), ("_lower", low), ("_upper", high)):
        columns[f"first_order{end}"] = ("group", value[:2], {"units": "1"})
        columns[f"total{end}"] = ("group", value[2:4], {"units": "1"})
        columns[f"interaction{end}"] = ((), value[4], {"units": "1"})
    attrs = {"tables": len(y), "confidence": confidence, "bootstrap_samples": resamples}
    return xr.Dataset(columns, {"group": list(GROUPS)}, attrs)


def _parts(y: FloatArray) -> FloatArray:
    """Return each table's estimates of the total of the wall, the total of the joints and the interaction."""
    wall = 0.25 * ((y[:, 0] - y[:, 1]) ** 2).sum(axis=1)
    joints = 0.25 * ((y[:, :, 0] - y[:, :, 1]) ** 2).sum(axis=1)
    both = 0.25 * (y[:, 0, 0] - y[:, 0, 1] - y[:, 1, 0] + y[:, 1, 1]) ** 2
    return np.column_stack((wall, joints, both))


def _interaction_limits(parts: FloatArray, drawn: FloatArray, confidence: float) -> tuple[float, float]:
    """Return the interval of the interaction's share by bootstrap-t of its logarithm.

    Parameters
    ----------
    parts : array (tables, 3)
        As ``_parts`` returns them.
    drawn : array (resamples, tables)
        Share of each table in each resample.
    confidence : float
        Level of the interval.
    """
    one, error = (value[0] for value in _log_interaction(parts, np.full((1, len(parts)), 1.0 / len(parts))))
    again, errors = _log_interaction(parts, drawn)
    with np.errstate(divide="ignore", invalid="ignore"):
        t = (again - one) / errors
    if not np.isfinite(one) or not np.isfinite(t).any():
        return np.nan, np.nan
    low, high = np.quantile(t[np.isfinite(t)], [0.5 * (1 - confidence), 0.5 * (1 + confidence)])
    return float(np.exp(one - high * error)), min(float(np.exp(one - low * error)), 1.0)


def _log_interaction(parts: FloatArray, drawn: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the logarithm of the interaction's share and its standard error (delta method), arrays (resamples,)."""
    both, total = parts[:, 2], parts[:, 0] + parts[:, 1] - parts[:, 2]
    mean, variance = drawn @ both, drawn @ total
    with np.errstate(divide="ignore", invalid="ignore"):
        square = (
            drawn @ both**2 / mean**2 + drawn @ total**2 / variance**2 - 2 * drawn @ (both * total) / (mean * variance)
        )
        return np.log(mean / variance), np.sqrt(np.maximum(square, 0.0) / len(parts))


def _shares(parts: FloatArray) -> FloatArray:
    wall, joints, both = parts
    variance = wall + joints - both
    if variance <= 0:
        return np.full(5, np.nan)
    return np.array([wall - both, joints - both, wall, joints, both]) / variance
