"""Inverse of the dense matrix of a level."""

from __future__ import annotations

import numpy as np
from scipy.linalg import lapack

from damagepred.arrays import FloatArray
from damagepred.kernels.linear.block_tridiagonal import mirror

PANEL = 64
"""Columns that LAPACK inverts at a time; with the workspace that SciPy gives it by itself it goes three by three."""


def invert(matrix: FloatArray, symmetric: bool, inverse: FloatArray) -> float:
    """Fill an inverse; that of a symmetric matrix, which takes half the work, is symmetric to the last bit.

    Parameters
    ----------
    matrix : array (s, s)
        Used up. Of a symmetric one, which need not be positive, only one half counts.
    symmetric : bool
        Whether it is, but for rounding.
    inverse : array (s, s)
        Filled.

    Returns
    -------
    float
        Smallest pivot over the largest, 0 where there is no inverse.
    """
    # LAPACK counts along columns: to it, what stands in rows here is transposed
    if symmetric:
        diagonal = matrix.diagonal().copy()
        factor, failed = lapack.dpotrf(matrix.T, lower=1, clean=0, overwrite_a=1)
        if not failed:
            pivots = factor.diagonal() ** 2
            half, _ = lapack.dpotri(factor, lower=1, overwrite_c=1)
            mirror(half.T, inverse)
            return float(pivots.min() / pivots.max())
        # not positive: softening joints. The other half is as it was
        np.fill_diagonal(matrix, diagonal)
        matrix = np.tril(matrix) + np.tril(matrix, -1).T
    lu, order, singular = lapack.dgetrf(matrix.T, overwrite_a=1)
    if singular:
        inverse[:] = np.nan
        return 0.0
    found, _ = lapack.dgetri(lu, order, lwork=PANEL * len(lu), overwrite_lu=1)
    inverse[:] = found.T
    sizes = np.abs(lu.diagonal())
    return float(sizes.min() / sizes.max())
