"""Inverse of the dense matrix of a level."""

from __future__ import annotations

import numpy as np
from scipy.linalg import lapack

from damagepred.arrays import FloatArray
from damagepred.kernels.linear.block_tridiagonal import mirror


def invert(matrix: FloatArray, symmetric: bool, inverse: FloatArray, panel: int = 64) -> float:
    """Invert a matrix: by Cholesky's factors, in half the time, if symmetric and positive definite, else by LU.

    Parameters
    ----------
    matrix : array (s, s)
        Overwritten. Of a symmetric one, which need not be positive definite, only one half counts.
    symmetric : bool
        Whether it is, but for rounding.
    inverse : array (s, s)
        Filled; symmetric to the last bit if the factors are Cholesky's.
    panel : int
        Columns that LAPACK inverts at a time.

    Returns
    -------
    float
        Smallest pivot over the largest, 0 where there is no inverse.
    """
    # LAPACK is column-major: it is given the transposed matrix
    if symmetric:
        diagonal = matrix.diagonal().copy()
        factor, failed = lapack.dpotrf(matrix.T, lower=1, clean=0, overwrite_a=1)
        if not failed:
            pivots = factor.diagonal() ** 2
            half, _ = lapack.dpotri(factor, lower=1, overwrite_c=1)
            mirror(half.T, inverse)
            return float(pivots.min() / pivots.max())
        # not positive definite: softening joints. The lower half is untouched but for its diagonal
        np.fill_diagonal(matrix, diagonal)
        matrix = np.tril(matrix) + np.tril(matrix, -1).T
    lu, order, singular = lapack.dgetrf(matrix.T, overwrite_a=1)
    if singular:
        inverse[:] = np.nan
        return 0.0
    found, _ = lapack.dgetri(lu, order, lwork=panel * len(lu), overwrite_lu=1)
    inverse[:] = found.T
    sizes = np.abs(lu.diagonal())
    return float(sizes.min() / sizes.max())
