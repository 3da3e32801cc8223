"""Sensitivity: Sobol's indices, and rank correlations and shares of variance from the walls of any study."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike
from scipy import special

from damagepred.arrays import FloatArray
from damagepred.errors import InputError, require_confidence
from damagepred.formatting import options_text
from damagepred.runtime.one_thread import one_blas_thread
from damagepred.uq.estimate import effective_samples, normal_factor
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
    require_confidence(confidence)
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


@dataclass(frozen=True)
class GivenDataOptions:
    """Numbers of walls of given-data sensitivity."""

    fewest_walls: int = 10  # walls below which it is refused
    # walls in a resample at most; the error of more walls is scaled by the root of their number
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
    require_confidence(confidence)
    y = np.asarray(output, dtype=np.float64)
    walls, finite = y.shape[-1], y if y.ndim == 1 else y[0]
    w = np.ones(walls) if weight is None else np.asarray(weight, dtype=np.float64)
    columns = {name: np.asarray(v, dtype=np.float64) for name, v in inputs.items()}
    for name, values in {**columns, "the output": finite, "weight": w}.items():
        if values.shape != finite.shape:
            raise InputError(f"{name}: has {values.size} values for {walls} walls.")
        if unknown := int((~np.isfinite(values)).sum()):
            raise InputError(
                f"{name}: {unknown} of {walls} values are not finite, and leaving walls out would bias the "
                "result; choose an output that all walls have."
            )
    varying = {name: v for name, v in columns.items() if np.ptp(v) > 0}
    if not varying:
        raise InputError("inputs: all are constant.")
    if walls < fewest or not (scores := _scores(y, w)).size or np.ptp(scores) == 0:
        raise InputError(
            f"the output: has {walls} values, from {finite.min():g} to {finite.max():g}; "
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
    """Statistic of all walls and its bootstrap standard error."""
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
    """Number of slices that balances bias and variance."""
    return int(np.clip(round(1.5 * walls ** (1 / 3)), 2, walls // 3))


def _sliced_first_order(x: FloatArray, y: FloatArray, w: FloatArray) -> FloatArray:
    """Share of variance between slices along each input, array (1, inputs), corrected for chance."""
    y = _scores(y, w)
    count = _slices(len(y))
    centred = y - w @ y / w.sum()
    shares = []
    for row in x:
        slot = np.minimum((ranks(row, w) * count).astype(np.int64), count - 1)
        weight = np.bincount(slot, w, count)
        there = weight > 0
        mean = np.bincount(slot, w * centred, count)[there] / weight[there]
        groups, alike = int(there.sum()), effective_samples(w)
        total = w @ centred**2
        within = total - weight[there] @ mean**2
        # the corrected share (epsilon squared): mean squares instead of sums
        shares.append(1.0 - (within / max(alike - groups, 1.0)) / (total / (alike - 1.0)))
    return np.array([shares])


def ranks(values: FloatArray, weight: FloatArray | None = None) -> FloatArray:
    """Share of samples below each value, equal samples counted half: between 0 and 1."""
    _, rank = np.unique(values, return_inverse=True)
    used = np.bincount(rank, weights=weight)
    upto = np.cumsum(used)
    return ((upto - 0.5 * used) / upto[-1])[rank]


def interval_ranks(lower: FloatArray, upper: FloatArray, weight: FloatArray | None = None) -> FloatArray:
    """Generalised Wilcoxon scores of interval-censored capacities, between 0 and 1 (Peto and Peto 1972).

    A known capacity has its rank, by the product-limit estimate (Kaplan and Meier 1958) at the middles of intervals. A
    wall that was not damaged up to its own end has the expected rank of all capacities beyond that end. Where the
    capacity is independent of the end, the mean score at each end is 1/2: an input that only sets where walls end has
    no correlation with these scores. Ranks of the scores do not have this property; take them as they are.
    """
    heavy = np.ones(len(lower)) if weight is None else weight
    event = np.isfinite(upper)
    time = np.where(event, 0.5 * (lower + upper), lower)
    marks, index = np.unique(time, return_inverse=True)
    damaged, all_ = (np.bincount(index, w, len(marks)) for w in (np.where(event, heavy, 0.0), heavy))
    at_risk = np.maximum(np.cumsum(all_[::-1])[::-1], 1e-300)
    sound = np.cumprod(np.clip(1.0 - damaged / at_risk, 0.0, 1.0))
    before = np.append(1.0, sound)[:-1]
    return 1.0 - 0.5 * np.where(event, (before + sound)[index], sound[index])
