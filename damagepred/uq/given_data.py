"""Sensitivity from walls that were run for something else: rank correlation, and shares of variance.

- Rank correlation (Spearman): whether capacity rises or falls with an input, from -1 to 1; censored capacities have the
  scores of ``damagepred.uq.ranks.interval_ranks``. Partial: with what the other inputs explain taken out of both, as
  inputs that are correlated need it.
- First-order share: the variance of the output's conditional mean given the input, over its variance, also where the
  mean is not monotone. It comes from slices of equally many walls along the input, corrected for the share that so many
  slices explain by chance.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
import xarray as xr

from damagepred.arrays import FloatArray
from damagepred.errors import InputError
from damagepred.formatting import options_text
from damagepred.runtime.one_thread import one_blas_thread
from damagepred.uq.estimate import effective_samples, normal_factor
from damagepred.uq.random_streams import Stream, generator
from damagepred.uq.ranks import interval_ranks, ranks


@dataclass(frozen=True)
class GivenDataOptions:
    """Numbers of walls of given-data sensitivity.

    Attributes
    ----------
    fewest_walls : int
        Walls below which it is refused.
    bootstrap_walls : int
        Walls in a resample at most; the error of more walls is scaled by the root of their number.
    """

    fewest_walls: int = 10
    bootstrap_walls: int = 20_000


DEFAULT = GivenDataOptions()


@one_blas_thread()
def rank_correlation(
    inputs: Mapping[str, FloatArray],
    output: FloatArray,
    *,
    weight: FloatArray | None = None,
    confidence: float = 0.9,
    resamples: int = 500,
    seed: int = 0,
    options: GivenDataOptions = DEFAULT,
) -> xr.Dataset:
    """Spearman's and the partial rank correlation of an output with each input, on (variable,).

    The output is one number per wall, or (2, walls): lower and upper ends of intervals that hold capacities, infinite
    where a wall was not damaged. Intervals are even in Fisher's arctanh, with the error of bootstrap resamples.
    """
    names, x, y, w = _checked(inputs, output, weight, confidence, options.fewest_walls)

    def both(x: FloatArray, y: FloatArray, w: FloatArray) -> FloatArray:
        return np.arctanh(np.clip(_correlations(x, y, w), -1 + 1e-12, 1 - 1e-12))

    best, error = _bootstrap_errors(both, x, y, w, resamples, seed, options)
    reach = normal_factor(confidence) * error
    columns = {
        name: ("variable", np.tanh(value), {"units": "1", "long_name": words})
        for k, (what, words) in enumerate((("spearman", "rank correlation"), ("partial", "partial rank correlation")))
        for name, value in ((what, best[k]), (f"{what}_lower", (best - reach)[k]), (f"{what}_upper", (best + reach)[k]))
    }
    attrs = {"confidence": confidence, "walls": y.shape[-1], "options": options_text(options)}
    return xr.Dataset(columns, {"variable": names}, attrs)


@one_blas_thread()
def first_order(
    inputs: Mapping[str, FloatArray],
    output: FloatArray,
    *,
    weight: FloatArray | None = None,
    confidence: float = 0.9,
    resamples: int = 500,
    seed: int = 0,
    options: GivenDataOptions = DEFAULT,
) -> xr.Dataset:
    """Share of an output's variance that each input brings about by itself; arguments as of ``rank_correlation``."""
    names, x, y, w = _checked(inputs, output, weight, confidence, options.fewest_walls)
    count = y.shape[-1]
    best, error = _bootstrap_errors(_sliced_first_order, x, y, w, resamples, seed, options)
    reach = normal_factor(confidence) * error
    words = {"units": "1", "long_name": "share of variance that the input brings about by itself"}
    columns = (("", best), ("_error", error), ("_lower", best - reach), ("_upper", best + reach))
    return xr.Dataset(
        {f"first_order{end}": ("variable", value[0], words) for end, value in columns},
        {"variable": names},
        {"confidence": confidence, "walls": count, "slices": _slices(count), "options": options_text(options)},
    )


def _checked(
    inputs: Mapping[str, FloatArray], output: FloatArray, weight: FloatArray | None, confidence: float, fewest: int
) -> tuple[list[str], FloatArray, FloatArray, FloatArray]:
    if not 0 < confidence < 1:
        raise InputError(f"confidence = {confidence!r}: must lie between 0 and 1.")
    y = np.asarray(output, dtype=np.float64)
    walls, known = y.shape[-1], y if y.ndim == 1 else y[0]
    w = np.ones(walls) if weight is None else np.asarray(weight, dtype=np.float64)
    columns = {name: np.asarray(v, dtype=np.float64) for name, v in inputs.items()}
    for name, values in {**columns, "the output": known, "weight": w}.items():
        if values.shape != known.shape:
            raise InputError(f"{name}: has {values.size} values for {walls} walls.")
        if unknown := int((~np.isfinite(values)).sum()):
            raise InputError(
                f"{name}: {unknown} of {walls} values are not finite, and leaving walls out would falsify what the "
                "others say; choose an output that all walls have."
            )
    varying = {name: v for name, v in columns.items() if np.ptp(v) > 0}
    if not varying:
        raise InputError("inputs: none of them varies.")
    if walls < fewest or not (scores := _scores(y, w)).size or np.ptp(scores) == 0:
        raise InputError(
            f"the output: has {walls} values, from {known.min():g} to {known.max():g}; "
            f"sensitivity takes at least {fewest} walls that differ."
        )
    return list(varying), np.array(list(varying.values())), y, w


def _bootstrap_errors(
    of: Callable[[FloatArray, FloatArray, FloatArray], FloatArray],
    x: FloatArray,
    y: FloatArray,
    w: FloatArray,
    resamples: int,
    seed: int,
    options: GivenDataOptions,
) -> tuple[FloatArray, FloatArray]:
    """Return a statistic of all walls and its bootstrap standard error."""
    best = of(x, y, w)
    if resamples < 2:
        return best, np.full_like(best, np.nan)
    random = generator(seed, Stream.BOOTSTRAP, 0)
    walls = y.shape[-1]
    size = min(walls, options.bootstrap_walls)
    some = random.permutation(walls)[:size] if size < walls else np.arange(walls)
    again = []
    for _ in range(resamples):
        drawn = some[random.integers(size, size=size)]
        if np.ptp(_scores(y[..., drawn], w[drawn])) > 0:
            again.append(of(x[:, drawn], y[..., drawn], w[drawn]))
    return best, np.std(again, axis=0, ddof=1) * np.sqrt(size / walls)


def _correlations(x: FloatArray, y: FloatArray, w: FloatArray) -> FloatArray:
    """Rank correlations and partial ones, array (2, inputs), from inputs (inputs, walls)."""
    table = np.array([*(ranks(row, w) for row in x), ranks(y, w) if y.ndim == 1 else _scores(y, w)])
    table -= (table @ w / w.sum())[:, None]
    covariance = (table * w) @ table.T
    scale = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
    matrix = covariance / np.outer(scale, scale)
    inverse = np.linalg.pinv(matrix, hermitian=True)
    partial = -inverse[:-1, -1] / np.sqrt(np.maximum(np.diag(inverse)[:-1] * inverse[-1, -1], 1e-300))
    return np.array([matrix[:-1, -1], partial])


def _scores(y: FloatArray, w: FloatArray) -> FloatArray:
    """Numbers as they are, scores of the capacities in intervals (2, walls)."""
    return y if y.ndim == 1 else interval_ranks(y[0], y[1], w)


def _slices(walls: int) -> int:
    """Return in how many slices walls are put along an input: bias by their width and by chance fall alike."""
    return int(np.clip(round(1.5 * walls ** (1 / 3)), 2, walls // 3))


def _sliced_first_order(x: FloatArray, y: FloatArray, w: FloatArray) -> FloatArray:
    """Return the share of variance between slices along each input, array (1, inputs), corrected for chance."""
    y = _scores(y, w)
    count = _slices(len(y))
    centred = y - w @ y / w.sum()
    found = []
    for row in x:
        slot = np.minimum((ranks(row, w) * count).astype(np.int64), count - 1)
        weight = np.bincount(slot, w, count)
        there = weight > 0
        mean = np.bincount(slot, w * centred, count)[there] / weight[there]
        groups, alike = int(there.sum()), effective_samples(w)
        total = w @ centred**2
        within = total - weight[there] @ mean**2
        # the corrected share (epsilon squared): mean squares instead of sums
        found.append(1.0 - (within / max(alike - groups, 1.0)) / (total / (alike - 1.0)))
    return np.array([found])
