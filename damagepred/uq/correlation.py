"""Correlated variables by the Gaussian copula, with the stated correlation that of the variables (Nataf)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import optimize, special

from damagepred.errors import InputError

FloatArray = NDArray[np.float64]

_NODES, _WEIGHTS = np.polynomial.hermite_e.hermegauss(40)
_WEIGHTS = _WEIGHTS / _WEIGHTS.sum()


def gaussian_correlation(first: Any, second: Any, correlation: float) -> float:
    """Return the correlation of the standard normals that gives two variables their stated correlation.

    Parameters
    ----------
    first, second : frozen scipy.stats distribution
        Marginals.
    correlation : float
        Wanted correlation of the variables, between -1 and 1.

    Raises
    ------
    ValueError
        If the marginals cannot have this correlation; the message gives the range they can.

    Notes
    -----
    Nataf's integral equation, by Gauss-Hermite quadrature (40 x 40 points) and Brent's method.
    """
    if correlation == 0.0:
        return 0.0
    x = _standardised(first, _NODES)

    def reached(rho: float) -> float:
        z = rho * _NODES[:, None] + np.sqrt(max(1.0 - rho**2, 0.0)) * _NODES[None, :]
        return float(_WEIGHTS @ (x[:, None] * _standardised(second, z)) @ _WEIGHTS)

    low, high = reached(-1.0), reached(1.0)
    if not low < correlation < high:
        if np.isclose(correlation, high, rtol=0, atol=1e-6) or np.isclose(correlation, low, rtol=0, atol=1e-6):
            return float(np.sign(correlation))
        raise ValueError(f"these two distributions can only be correlated between {low:.3f} and {high:.3f}")
    return float(optimize.brentq(lambda rho: reached(rho) - correlation, -1.0, 1.0, xtol=1e-10))


def _standardised(marginal: Any, z: FloatArray) -> FloatArray:
    return np.asarray((from_normal(marginal, z) - marginal.mean()) / marginal.std())


def from_normal(marginal: Any, z: FloatArray) -> FloatArray:
    """Turn standard normals into values of a marginal, without losing the upper tail to rounding."""
    return np.where(z < 0, marginal.ppf(special.ndtr(z)), marginal.isf(special.ndtr(-z)))


def cholesky(names: Sequence[str], marginals: Mapping[str, Any], wanted: Mapping[frozenset[str], float]) -> FloatArray:
    """Return the lower factor that turns independent standard normals into correlated ones.

    Parameters
    ----------
    names : sequence of str
        Variables in order, k of them.
    marginals : mapping of str to frozen distribution
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
