"""Dense matrices by SciPy's BLAS and LAPACK: products, LU factors, and inverses by blocks of columns.

Matrices lie in flat arrays, column by column. The routines take their arguments by reference.
"""

from __future__ import annotations

import ctypes
from functools import cache
from typing import Any

import numpy as np
from numba import types
from numba.extending import get_cython_function_address

from damagepred.kernels.jit import law, phase, rule
from damagepred.kernels.structures import FLOATS, INTEGERS_32, LETTERS, Structure

NOT_TRANSPOSED_THEN_TRANSPOSED = np.frombuffer(b"NT", dtype=np.uint8).copy()
ARGUMENTS = {"dgemm": 13, "dgetrf": 6, "dgetri": 7, "dgetrs": 9}
"""Number of arguments of each routine."""
INVERSION_PANEL = 16
"""Columns that are inverted at a time."""
SINGULAR_PIVOT_RATIO = 1e-12
"""Smallest pivot over the largest below which a matrix counts as nearly singular (1)."""
_SIGNATURES = {name: types.void(*[types.voidptr] * count) for name, count in ARGUMENTS.items()}


class Routine(types.WrapperAddressProtocol):  # type: ignore[misc]
    """A routine of SciPy's BLAS or LAPACK, as a first-class function."""

    def __init__(self, name: str) -> None:
        module = "scipy.linalg.cython_blas" if name == "dgemm" else "scipy.linalg.cython_lapack"
        self._address, self._signature = int(get_cython_function_address(module, name)), _SIGNATURES[name]
        self._routine = ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * ARGUMENTS[name])(self._address)

    def __wrapper_address__(self) -> int:
        """Entry point."""
        return self._address

    def signature(self) -> Any:
        """Types of result and arguments."""
        return self._signature

    def __call__(self, *arguments: Any) -> None:
        """Run from Python."""
        self._routine(*arguments)


class Dense(Structure):
    """BLAS and LAPACK, and their workspace."""

    dgemm = types.FunctionType(_SIGNATURES["dgemm"])
    dgetrf = types.FunctionType(_SIGNATURES["dgetrf"])
    dgetri = types.FunctionType(_SIGNATURES["dgetri"])
    dgetrs = types.FunctionType(_SIGNATURES["dgetrs"])
    integers = INTEGERS_32
    reals = FLOATS
    letters = LETTERS
    pivots = INTEGERS_32
    work = FLOATS
    blocks = FLOATS


@cache
def _routines() -> dict[str, Routine]:
    return {name: Routine(name) for name in ARGUMENTS}


def dense_workspace(largest: int) -> Dense:
    """Workspace for matrices up to a number of rows and columns."""
    return Dense(
        **_routines(),
        integers=np.zeros(8, dtype=np.int32),
        reals=np.zeros(2),
        letters=NOT_TRANSPOSED_THEN_TRANSPOSED,
        pivots=np.zeros(largest, dtype=np.int32),
        work=np.zeros(INVERSION_PANEL * largest),
        blocks=np.empty(INVERSION_PANEL * (3 * largest + INVERSION_PANEL)),
    )


@law
def multiply(dense, transposed, rows, columns, inner, sign, left, left_rows, right, right_rows, share, product):
    """Product sign A B + share C (dgemm), with B transposed or not; C is overwritten.

    ``left_rows`` and ``right_rows`` lie between columns of A and B.
    """
    integers, reals, letters = dense.integers, dense.reals, dense.letters
    if rows == 0 or columns == 0:
        return
    integers[0], integers[1], integers[2], integers[3], integers[4] = rows, columns, inner, left_rows, right_rows
    reals[0], reals[1] = sign, share
    m = integers.ctypes
    dense.dgemm(
        letters.ctypes,
        letters[(1 if transposed else 0) :].ctypes,
        m,
        integers[1:].ctypes,
        integers[2:].ctypes,
        reals.ctypes,
        left.ctypes,
        integers[3:].ctypes,
        right.ctypes,
        integers[4:].ctypes,
        reals[1:].ctypes,
        product.ctypes,
        m,
    )


@law
def factorise_dense(dense, size, matrix, pivots):
    """LU factors (dgetrf), in place of the matrix; whether it is regular."""
    integers = dense.integers
    integers[0] = size
    n, failed = integers.ctypes, integers[1:].ctypes
    dense.dgetrf(n, n, matrix.ctypes, n, pivots.ctypes, failed)
    return integers[1] == 0


@law
def solve_dense(dense, size, columns, factors, pivots, force):
    """Solve with LU factors (dgetrs) for right-hand sides one after the other; solutions overwrite them."""
    integers = dense.integers
    integers[0], integers[1] = size, columns
    n, loads, failed = integers.ctypes, integers[1:].ctypes, integers[2:].ctypes
    dense.dgetrs(dense.letters.ctypes, n, loads, factors.ctypes, n, pivots.ctypes, force.ctypes, n, failed)


@rule
def _invert_with_exchanges(dense, size, matrix):
    """Invert a matrix in place by LU factors; its smallest and its largest pivot, or 0 and 1 without inverse."""
    integers, work, pivots = dense.integers, dense.work, dense.pivots
    n, failed, room = integers.ctypes, integers[1:].ctypes, integers[2:].ctypes
    integers[0], integers[2] = size, work.size
    dense.dgetrf(n, n, matrix.ctypes, n, pivots.ctypes, failed)
    if integers[1] != 0:
        return 0.0, 1.0
    smallest, largest = np.inf, 0.0
    for i in range(size):
        pivot = abs(matrix[i * size + i])
        smallest, largest = min(smallest, pivot), max(largest, pivot)
    dense.dgetri(n, matrix.ctypes, n, pivots.ctypes, work.ctypes, room, failed)
    return smallest, largest


@law
def _invert_by_blocks(dense, size, width, matrix):
    """Invert a matrix in place by Gauss-Jordan elimination of blocks of columns; its ratio of pivots.

    Most of the work is in products of matrices, several times as fast. Rows are exchanged inside a block only.
    """
    if width == size:
        smallest, largest = _invert_with_exchanges(dense, size, matrix)
        return smallest / largest
    scratch, smallest, largest = dense.blocks, np.inf, 0.0
    column, row, product = scratch, scratch[size * width :], scratch[2 * size * width :]
    block = scratch[3 * size * width :]
    for first in range(0, size, width):
        n = min(width, size - first)
        for c in range(n):
            for r in range(size):
                column[c * size + r] = matrix[(first + c) * size + r]
                matrix[(first + c) * size + r] = 0.0
            for r in range(n):
                block[c * n + r] = column[c * size + first + r]
                column[c * size + first + r] = 0.0
        least, most = _invert_with_exchanges(dense, n, block)
        if least == 0.0:
            return 0.0
        smallest, largest = min(smallest, least), max(largest, most)
        for c in range(size):
            for r in range(n):
                row[c * n + r] = matrix[c * size + first + r]
        for c in range(n):
            row[(first + c) * n + c] = 1.0
        multiply(dense, False, n, size, n, 1.0, block, n, row, n, 0.0, product)
        multiply(dense, False, size, size, n, -1.0, column, size, product, n, 1.0, matrix)
        for c in range(size):
            for r in range(n):
                matrix[c * size + first + r] = product[c * n + r]
    return smallest / largest


INVERT = types.float64(Dense.kind, types.int64, types.int64, FLOATS, types.boolean, FLOATS)


@phase(INVERT)
def invert(dense, size, rows, matrix, symmetric, inverse):
    """Invert the first rows and columns of a matrix: by blocks, or where nearly singular by LU factors.

    Returns the smallest pivot over the largest; without inverse it is 0, and the inverse NaN. The inverse of a matrix
    that is ``symmetric`` except for rounding becomes symmetric to the last bit.
    """
    ratio, width = 0.0, min(INVERSION_PANEL, size)
    while not ratio > SINGULAR_PIVOT_RATIO:
        for c in range(size):
            for r in range(size):
                inverse[c * size + r] = matrix[c * rows + r]
        ratio = _invert_by_blocks(dense, size, width, inverse)
        if width == size:
            break
        width = size
    if ratio == 0.0:
        inverse[: size * size] = np.nan
    if symmetric:
        for c in range(size):
            for r in range(c):
                mean = 0.5 * (inverse[c * size + r] + inverse[r * size + c])
                inverse[c * size + r] = inverse[r * size + c] = mean
    return ratio
