"""Correlated variables by the Gaussian copula; the stated correlation is of the variables themselves (Nataf)."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence

import numpy as np
import scipy
from numpy.typing import ArrayLike
from scipy import special

from damagepred.arrays import BoolArray, FloatArray
from damagepred.errors import InputError
from damagepred.runtime.one_thread import one_blas_thread
from damagepred.uq.marginals import Marginal, breaks, from_normal

_TERMS = 300  # terms of the series in the correlation of the normals
_LARGEST_NORMAL = 12.0  # end of the integrals over standard normals
_NO_VARIANCE = 1e-8
"""Variance beside other variables (1) below which a variable follows from them; the Nataf solution leaves 1e-12."""


@one_blas_thread()
def gaussian_correlation(first: Marginal, second: Marginal, correlation: float) -> float:
    """Correlation of the standard normals that gives two variables their stated correlation."""
    if correlation == 0.0:
        return 0.0
    reached = NatafCurve(first, second)
    if not reached.low < correlation < reached.high:
        if min(abs(correlation - reached.high), abs(correlation - reached.low)) <= 1e-6:
            return 1.0 if abs(correlation - reached.high) < abs(correlation - reached.low) else -1.0
        raise ValueError(
            f"these two distributions can only be correlated between {_within(reached.low, 1)} and "
            f"{_within(reached.high, -1)}"
        )
    return float(scipy.optimize.brentq(lambda rho: float(reached(rho)) - correlation, -1.0, 1.0, xtol=1e-12))


class NatafCurve:
    """Correlation of two variables as a function of the correlation of the standard normals behind them.

    Nataf's integral as Mehler's series: with a_k and b_k the coefficients of the variables in normalised Hermite
    polynomials of their normals, the correlation is the sum of a_k b_k rho^k, monotone in rho. It holds for variables
    that take single values, too: their terms fall off as k^(-3/2) only, so the rest of the sum at either end, where it
    is known, is taken to be spread like that. ``low`` and ``high``: the range that the variables can have. A
    distribution without a finite standard deviation raises ValueError.
    """

    def __init__(self, first: Marginal, second: Marginal) -> None:
        z, weight = _nodes(np.union1d(breaks(first), breaks(second)))
        x = _standardised(first, z)
        y = x if second is first else _standardised(second, z)
        self.high = float(np.sum(weight * x * y))
        mirrored, mirror_weight = _nodes(np.union1d(breaks(first), -breaks(second)))
        self.low = float(np.sum(mirror_weight * _standardised(first, mirrored) * _standardised(second, -mirrored)))
        terms = _coefficients(z, weight * x)
        self._terms = terms * (terms if second is first else _coefficients(z, weight * y))
        sign = (-1.0) ** np.arange(1, _TERMS + 1)
        self._rest = self.high - self._terms.sum(), self.low - (sign * self._terms).sum()

    def __call__(self, rho: ArrayLike) -> FloatArray:
        """Correlation of the variables for a correlation of the normals."""
        normal = np.asarray(rho, dtype=np.float64)
        with np.errstate(divide="ignore"):
            decay = np.minimum(-(_TERMS + 0.5) * np.log(np.abs(normal)), 700.0)
        # share of the terms left out: the integral of k^(-3/2) rho^k from there on, over that at rho = 1
        share = np.exp(-decay) * (1.0 - np.sqrt(np.pi * decay) * special.erfcx(np.sqrt(decay)))
        rest = np.where(normal >= 0, *self._rest) * share
        return np.polynomial.polynomial.polyval(normal, np.append(0.0, self._terms)) + rest


def _nodes(extra: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Points and weights for integrals over a standard normal: Gauss-Legendre in panels between breaks."""
    edges = np.union1d(np.linspace(-_LARGEST_NORMAL, _LARGEST_NORMAL, 241), extra[np.abs(extra) < _LARGEST_NORMAL])
    point, weight = np.polynomial.legendre.leggauss(8)
    half = 0.5 * np.diff(edges)[:, None]
    z = (edges[:-1, None] + half * (1.0 + point)).ravel()
    return z, (half * weight).ravel() * np.exp(-0.5 * z**2) / np.sqrt(2.0 * np.pi)


def _coefficients(z: FloatArray, weighted: FloatArray) -> FloatArray:
    """Coefficients of order 1, 2, ... in normalised Hermite polynomials: array (terms,)."""
    before, now = np.zeros_like(z), np.ones_like(z)
    terms = np.empty(_TERMS)
    for k in range(_TERMS):
        before, now = now, (z * now - np.sqrt(k) * before) / np.sqrt(k + 1.0)
        terms[k] = now @ weighted
    return terms


def _standardised(marginal: Marginal, z: FloatArray) -> FloatArray:
    mean, std = float(marginal.mean()), float(marginal.std())
    if not (np.isfinite(mean) and np.isfinite(std)):
        raise ValueError("a distribution without a finite standard deviation has no correlation")
    if std == 0.0:
        raise ValueError("a distribution of one single value has no correlation; leave the correlation out")
    return (from_normal(marginal, z) - mean) / std


def cholesky(
    names: Sequence[str], marginals: Mapping[str, Marginal], wanted: Mapping[frozenset[str], float]
) -> FloatArray:
    """Lower factor (k, k) that turns independent standard normals into correlated ones; pairs not given have none."""
    matrix = np.eye(len(names))
    for pair, value in wanted.items():
        i, j = sorted(map(list(names).index, pair))
        try:
            matrix[i, j] = matrix[j, i] = gaussian_correlation(marginals[names[i]], marginals[names[j]], value)
        except ValueError as error:
            raise InputError(f'[correlation] "{names[i]}" with "{names[j]}" = {value:g}: {error}.') from None
    try:
        return lower_factor(matrix)
    except np.linalg.LinAlgError:
        raise InputError(_contradiction(names, marginals, wanted, matrix)) from None


def lower_factor(matrix: FloatArray) -> FloatArray:
    """Cholesky factor of a positive semi-definite correlation matrix; variables that follow from earlier ones get 0."""
    try:
        return np.asarray(np.linalg.cholesky(matrix), dtype=np.float64)
    except np.linalg.LinAlgError:
        if np.linalg.eigvalsh(matrix)[0] < -_NO_VARIANCE:
            raise
    rest, factor = matrix.copy(), np.zeros_like(matrix)
    for k in range(len(matrix)):
        if rest[k, k] > _NO_VARIANCE:
            factor[k:, k] = rest[k:, k] / np.sqrt(rest[k, k])
            rest -= np.outer(factor[:, k], factor[:, k])
    return factor


def varying(factor: FloatArray) -> BoolArray:
    """Whether each variable has a variance beside the variables before it in a Cholesky factor: array (k,)."""
    return np.asarray(np.diag(factor) ** 2 > _NO_VARIANCE)


def independent_normals(normal: FloatArray, factor: FloatArray) -> FloatArray:
    """Independent normals (n, r) behind correlated ones; ValueError if the other variables do not follow from them."""
    varies = varying(factor)
    independent = np.compress(varies, normal, axis=1) @ np.linalg.inv(factor[np.ix_(varies, varies)]).T
    following = independent @ factor[np.ix_(~varies, varies)].T
    if not np.allclose(following, normal[:, ~varies], rtol=0.0, atol=1e-3):
        raise ValueError
    return np.asarray(independent)


def _contradiction(
    names: Sequence[str], marginals: Mapping[str, Marginal], wanted: Mapping[frozenset[str], float], matrix: FloatArray
) -> str:
    """Three variables whose correlations contradict each other, or the smallest eigenvalue of the matrix."""

    def stated(i: int, j: int) -> str:
        value = wanted.get(frozenset((names[i], names[j])))
        return f'"{names[i]}" with "{names[j]}" ' + ("(not given, thus 0)" if value is None else f"= {value:g}")

    for i, j, k in itertools.combinations(range(len(names)), 3):
        if np.linalg.eigvalsh(matrix[np.ix_((i, j, k), (i, j, k))])[0] < -_NO_VARIANCE:
            product, spread = matrix[i, j] * matrix[i, k], np.sqrt((1 - matrix[i, j] ** 2) * (1 - matrix[i, k] ** 2))
            curve = NatafCurve(marginals[names[j]], marginals[names[k]])
            low, high = (float(curve(np.clip(product + side * spread, -1.0, 1.0))) for side in (-1, 1))
            return (
                f"[correlation]: {stated(i, j)}, {stated(i, k)} and {stated(j, k)} contradict each other: with the "
                f"first two, the third lies between {_within(low, 1)} and {_within(high, -1)}."
            )
    return (
        f"[correlation]: the correlations of {', '.join(names)} contradict each other (their matrix is not positive "
        f"semi-definite, its smallest eigenvalue is {np.linalg.eigvalsh(matrix)[0]:.3g}); weaken some."
    )


def _within(bound: float, side: int) -> str:
    """Text of a bound, rounded up (side 1) or down (-1) so that the written number is accepted."""
    return f"{side * math.ceil(side * bound * 1e4 - 1e-6) / 1e4 + 0.0:g}"
