"""Sensitivity: rank correlations and shares of variance from the walls of any study."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr

from damagepred.arrays import FloatArray
from damagepred.errors import InputError, require_confidence
from damagepred.runtime.one_thread import one_blas_thread
from damagepred.uq.estimate import effective_samples, normal_factor
from damagepred.uq.random_streams import RandomStream, generator

LEAST_WALLS = 10  # walls, and damaged walls, below which sensitivity is refused
BOOTSTRAP_WALLS = 20_000  # walls in a resample at most; the error of more walls is scaled by the root of their number
_INDICES = {
    "spearman": "rank correlation",
    "partial": "partial rank correlation",
    "first_order": "share of variance that the input brings about by itself",
}


@one_blas_thread()
def sensitivity_indices(
    inputs: Mapping[str, FloatArray],
    output: FloatArray,
    *,
    weight: FloatArray | None = None,
    confidence: float = 0.9,
    resamples: int = 500,
    seed: int = 0,
) -> xr.Dataset:
    """Rank correlations and shares of variance of an output, numbers (walls,) or intervals (2, walls), by inputs."""
    names, x, y, w = _checked(inputs, output, weight, confidence)
    best, error = _bootstrap_errors(x, y, w, resamples, seed)
    reach = normal_factor(confidence) * error
    columns: dict[str, FloatArray] = {}
    for k, name in enumerate(_INDICES):
        index = np.tanh if k < 2 else np.asarray
        columns |= {name: index(best[k]), f"{name}_lower": index((best - reach)[k])}
        columns[f"{name}_upper"] = index((best + reach)[k])
    columns["first_order_error"] = error[2]
    words = {name: next(text for index, text in _INDICES.items() if index in name) for name in columns}
    variables = {name: ("variable", v, {"units": "1", "long_name": words[name]}) for name, v in columns.items()}
    return xr.Dataset(variables, {"variable": names}, {"confidence": confidence, "walls": y.shape[-1]})


def _checked(
    inputs: Mapping[str, FloatArray], output: FloatArray, weight: FloatArray | None, confidence: float
) -> tuple[list[str], FloatArray, FloatArray, FloatArray]:
    require_confidence(confidence)
    y = np.asarray(output, dtype=np.float64)
    walls, finite = y.shape[-1], y if y.ndim == 1 else y[0]
    w = np.ones(walls) if weight is None else np.asarray(weight, dtype=np.float64)
    columns = {name: np.asarray(v, dtype=np.float64) for name, v in inputs.items()}
    for name, values in {**columns, "the output": finite, "weight": w}.items():
        if unknown := int((~np.isfinite(values)).sum()):
            raise InputError(
                f"{name}: {unknown} of {walls} values are not finite, and leaving samples out would bias the "
                "result; choose an output that all samples have."
            )
    varying = {name: v for name, v in columns.items() if np.ptp(v) > 0}
    if not varying:
        raise InputError("inputs: all are constant.")
    if walls < LEAST_WALLS or not (scores := _scores(y, w)).size or np.ptp(scores) == 0:
        raise InputError(
            f"the output: has {walls} values, from {finite.min():g} to {finite.max():g}; "
            f"sensitivity takes at least {LEAST_WALLS} samples that differ."
        )
    return list(varying), np.array(list(varying.values())), y, w


def _bootstrap_errors(
    x: FloatArray, y: FloatArray, w: FloatArray, resamples: int, seed: int
) -> tuple[FloatArray, FloatArray]:
    """Arctanh of both correlations and share of variance, (3, inputs), with their bootstrap standard errors."""

    def indices(x: FloatArray, y: FloatArray, w: FloatArray) -> FloatArray:
        return np.vstack((np.arctanh(np.clip(_correlations(x, y, w), -1 + 1e-12, 1 - 1e-12)), _shares(x, y, w)))

    best = indices(x, y, w)
    if resamples < 2:
        return best, np.full_like(best, np.nan)
    random = generator(seed, RandomStream.BOOTSTRAP, 0)
    walls = y.shape[-1]
    size = min(walls, BOOTSTRAP_WALLS)
    some = random.permutation(walls)[:size] if size < walls else np.arange(walls)
    again = []
    for _ in range(resamples):
        drawn = some[random.integers(size, size=size)]
        if np.ptp(_scores(y[..., drawn], w[drawn])) > 0:
            again.append(indices(x[:, drawn], y[..., drawn], w[drawn]))
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


def _shares(x: FloatArray, y: FloatArray, w: FloatArray) -> FloatArray:
    """Share of variance between slices along each input, array (inputs,), corrected for chance."""
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
    return np.array(shares)


def ranks(values: FloatArray, weight: FloatArray | None = None) -> FloatArray:
    """Share of samples below each value, equal samples counted half: between 0 and 1."""
    _, rank = np.unique(values, return_inverse=True)
    used = np.bincount(rank, weights=weight)
    upto = np.cumsum(used)
    return ((upto - 0.5 * used) / upto[-1])[rank]


def interval_ranks(lower: FloatArray, upper: FloatArray, weight: FloatArray | None = None) -> FloatArray:
    """Generalised Wilcoxon scores of interval-censored capacities, between 0 and 1 (Peto and Peto 1972).

    A wall that was not damaged up to its own end has the expected rank of all capacities beyond that end. So an input
    that only sets where walls end has no correlation with these scores; ranks of the scores lack this property.
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
