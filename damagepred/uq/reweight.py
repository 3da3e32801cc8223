"""Reweighting: estimates under other distributions from the same walls, without running any again.

Uncertainty about the distributions themselves, above all about an assumed scatter, is no Monte Carlo error: more walls
do not reduce it. It is reported apart, as the estimate under each alternative with its own error.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from scipy import special

from damagepred.arrays import BoolArray, FloatArray
from damagepred.errors import InputError
from damagepred.runtime.one_thread import one_blas_thread
from damagepred.uq.correlation import independent_normals, varying
from damagepred.uq.design import Design


@one_blas_thread()
def density_ratio(stated: Design, other: Design, values: Mapping[str, FloatArray]) -> FloatArray:
    """Return, for each wall, the density of other distributions over that of the stated ones, array (samples,)."""
    return np.exp(_log_density(other, values) - _log_density(stated, values))


def _log_density(design: Design, values: Mapping[str, FloatArray]) -> FloatArray:
    total = np.zeros(len(next(iter(values.values()))))
    normal = np.empty((len(total), len(design.wall)))
    for k, place in enumerate(design.wall):
        marginal, x = design.marginals[place], values[place]
        if not hasattr(marginal, "logpdf"):
            raise InputError(
                f'[variables."{place}"]: a distribution without a density cannot be weighted anew; run the alternative '
                "as a study of its own."
            )
        low, high = np.asarray(marginal.cdf(x)), np.asarray(marginal.sf(x))
        normal[:, k] = np.where(low < high, special.ndtri(low), -special.ndtri(high))
        if varying(design.wall_factor)[k]:
            with np.errstate(divide="ignore"):
                total = total + marginal.logpdf(x)
    # the Gaussian copula: density of correlated standard normals over that of independent ones
    inside: BoolArray = np.asarray(np.isfinite(normal).all(axis=1))
    normal = np.where(inside[:, None], normal, 0.0)
    own = varying(design.wall_factor)
    try:
        independent = independent_normals(normal, design.wall_factor)
    except ValueError:
        raise InputError(
            "[correlation]: a variable that follows from others (correlation 1 or -1) has other values under the "
            "alternative, which no wall of this study has; change all of them alike, or run the alternative as a study."
        ) from None
    copula = 0.5 * (np.compress(own, normal, axis=1) ** 2 - independent**2).sum(axis=1)
    copula = copula - np.log(np.diag(design.wall_factor)[own]).sum()
    return np.where(inside, total + copula, -np.inf)
