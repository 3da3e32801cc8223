"""Correlated variables by the Gaussian copula, with the stated correlation that of the variables (Nataf)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import scipy
from numpy.typing import ArrayLike
from scipy import special

from damagepred.arrays import FloatArray
from damagepred.errors import InputError
from damagepred.one_thread import one_blas_thread
from damagepred.uq.marginals import Marginal, breaks, from_normal

_TERMS = 300
"""Terms of the series in the correlation of the normals."""

_LARGEST_NORMAL = 12.0
"""End of the integrals over standard normals."""


@one_blas_thread()
def gaussian_correlation(first: Marginal, second: Marginal, correlation: float) -> float:
    """Return the correlation of the standard normals that gives two variables their stated correlation.

    Parameters
    ----------
    first, second : Marginal
        Frozen scipy.stats distributions, tables or mixtures.
    correlation : float
        Wanted correlation of the variables, between -1 and 1.

    Raises
    ------
    ValueError
        If the marginals cannot have this correlation; the message gives the range they can.
    """
    if correlation == 0.0:
        return 0.0
    reached = NatafCurve(first, second)
    if not reached.low < correlation < reached.high:
        if min(abs(correlation - reached.high), abs(correlation - reached.low)) <= 1e-6:
            return float(np.sign(correlation))
        raise ValueError(
            f"these two distributions can only be correlated between {reached.low:.3f} and {reached.high:.3f}"
        )
    return float(scipy.optimize.brentq(lambda rho: float(reached(rho)) - correlation, -1.0, 1.0, xtol=1e-12))


class NatafCurve:
    """Correlation of two variables as a function of that of the standard normals behind them.

    Parameters
    ----------
    first, second : Marginal
        Their distributions.

    Attributes
    ----------
    low, high : float
        Correlations that the variables can have: those of their fully dependent normals.

    Raises
    ------
    ValueError
        If a distribution has no finite standard deviation.

    Notes
    -----
    Nataf's integral as Mehler's series: with a_k and b_k the coefficients of the variables in normalised Hermite
    polynomials of their normals, the correlation is the sum of a_k b_k rho^k, monotone in rho. It holds for variables
    that take single values, too: their terms fall off as k^(-3/2) only, so what the sum leaves at either end, where it
    is known, is taken to be spread like that.
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
        """Return the correlation of the variables for that of the normals."""
        at = np.asarray(rho, dtype=np.float64)
        with np.errstate(divide="ignore"):
            decay = np.minimum(-(_TERMS + 0.5) * np.log(np.abs(at)), 700.0)
        # share of the terms left out: the integral of k^(-3/2) rho^k from there on, over that at rho = 1
        share = np.exp(-decay) * (1.0 - np.sqrt(np.pi * decay) * special.erfcx(np.sqrt(decay)))
        rest = np.where(at >= 0, *self._rest) * share
        return np.polynomial.polynomial.polyval(at, np.append(0.0, self._terms)) + rest


def _nodes(extra: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return points and weights for integrals over a standard normal: Gauss-Legendre in panels between breaks."""
    edges = np.union1d(np.linspace(-_LARGEST_NORMAL, _LARGEST_NORMAL, 241), extra[np.abs(extra) < _LARGEST_NORMAL])
    point, weight = np.polynomial.legendre.leggauss(8)
    half = 0.5 * np.diff(edges)[:, None]
    z = (edges[:-1, None] + half * (1.0 + point)).ravel()
    return z, (half * weight).ravel() * np.exp(-0.5 * z**2) / np.sqrt(2.0 * np.pi)


def _coefficients(z: FloatArray, weighted: FloatArray) -> FloatArray:
    """Return the coefficients of order 1, 2, ... in normalised Hermite polynomials: array (terms,)."""
    before, now = np.zeros_like(z), np.ones_like(z)
    found = np.empty(_TERMS)
    for k in range(_TERMS):
        before, now = now, (z * now - np.sqrt(k) * before) / np.sqrt(k + 1.0)
        found[k] = now @ weighted
    return found


def _standardised(marginal: Marginal, z: FloatArray) -> FloatArray:
    mean, std = float(marginal.mean()), float(marginal.std())
    if not (np.isfinite(mean) and np.isfinite(std)):
        raise ValueError("a distribution without a finite standard deviation has no correlation")
    if std == 0.0:
        raise ValueError("a distribution that is one single value has no correlation")
    return (from_normal(marginal, z) - mean) / std


def cholesky(
    names: Sequence[str], marginals: Mapping[str, Marginal], wanted: Mapping[frozenset[str], float]
) -> FloatArray:
    """Return the lower factor that turns independent standard normals into correlated ones.

    Parameters
    ----------
    names : sequence of str
        Variables in order, k of them.
    marginals : mapping of str to Marginal
        Their distributions.
    wanted : mapping of pairs to float
        Correlation of the variables, pair by pair; pairs not given are uncorrelated.

    Returns
    -------
    array (k, k)

    Raises
    ------
    InputError
        If a correlation cannot be had, or the matrix is not positive definite.
    """
    matrix = np.eye(len(names))
    for pair, value in wanted.items():
        a, b = sorted(pair, key=list(names).index)
        i, j = list(names).index(a), list(names).index(b)
        try:
            matrix[i, j] = matrix[j, i] = gaussian_correlation(marginals[a], marginals[b], value)
        except ValueError as error:
            raise InputError(f'[correlation] "{a}" with "{b}" = {value:g}: {error}.') from None
    try:
        return np.asarray(np.linalg.cholesky(matrix), dtype=np.float64)
    except np.linalg.LinAlgError:
        raise InputError(
            "[correlation]: the correlations contradict each other (the matrix is not positive definite); weaken some."
        ) from None
