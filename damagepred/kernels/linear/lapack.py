"""LAPACK and BLAS called from kernels by the addresses of their routines, and the inverse of a dense matrix with them.

Matrices lie in flat arrays, column by column.
"""

import numpy as np
from llvmlite import ir
from numba.core import cgutils, types
from numba.extending import intrinsic

from damagepred.kernels.jit import Unit, law, rule
from damagepred.kernels.linear.table import system_at
from damagepred.kernels.table import address_of, bytes_of, floats, integers, integers32

PLAIN, TRANSPOSED = 0, 1
LETTERS = np.frombuffer(b"NT", dtype=np.uint8).copy()


@intrinsic
def _call(typing_context, address, arguments):
    """Call the routine at an address with pointers as arguments."""

    def generate(context, builder, signature, values):
        pointer = ir.IntType(8).as_pointer()
        routine = ir.FunctionType(ir.VoidType(), [pointer] * len(signature.args[1]))
        pointers = [builder.inttoptr(value, pointer) for value in cgutils.unpack_tuple(builder, values[1])]
        builder.call(builder.inttoptr(values[0], routine.as_pointer()), pointers)
        return context.get_dummy_value()

    return types.void(address, arguments), generate


@law
def multiply(system, transposed, rows, columns, inner, sign, left, left_rows, right, right_rows, share, product):
    """Add a product of matrices, or its negative, to a share of another: sign A B + share C (dgemm).

    Parameters
    ----------
    system : SYSTEM
        Addresses of the routines, and room for their arguments, which are passed by reference.
    transposed : bool
        Whether to multiply by the transpose of B.
    rows, columns, inner : int
        Of the product, and columns of A.
    sign, share : float
        See there.
    left, right, product : array
        A, B and C, each column by column from the first entry on.
    left_rows, right_rows : int
        From one column to the next in A and B; the product's columns follow one another.
    """
    count, real, letters = (
        integers32(system.lapack_integers),
        floats(system.lapack_reals),
        bytes_of(system.lapack_letters),
    )
    if rows == 0 or columns == 0:
        return
    count[0], count[1], count[2], count[3], count[4] = rows, columns, inner, left_rows, right_rows
    real[0], real[1] = sign, share
    m = address_of(count, 0)
    _call(
        system.dgemm,
        (
            address_of(letters, PLAIN),
            address_of(letters, TRANSPOSED if transposed else PLAIN),
            m,
            address_of(count, 1),
            address_of(count, 2),
            address_of(real, 0),
            address_of(left, 0),
            address_of(count, 3),
            address_of(right, 0),
            address_of(count, 4),
            address_of(real, 1),
            address_of(product, 0),
            m,
        ),
    )


@law
def factorise_dense(system, size, matrix, pivots):
    """Factorise a dense matrix (dgetrf); return whether it is regular.

    Parameters
    ----------
    system : SYSTEM
        Addresses of the routines, and room for their arguments, which are passed by reference.
    size : int
        Of the matrix.
    matrix, pivots : array
        Flat, overwritten by its factors; filled.
    """
    count = integers32(system.lapack_integers)
    count[0] = size
    n, failed = address_of(count, 0), address_of(count, 1)
    _call(system.dgetrf, (n, n, address_of(matrix, 0), n, address_of(pivots, 0), failed))
    return count[1] == 0


@law
def solve_dense(system, size, columns, factors, pivots, force):
    """Solve dense equations with the factors of their matrix (dgetrs).

    Parameters
    ----------
    system : SYSTEM
        See ``factorise_dense``.
    size, columns : int
        Of the matrix, and number of right-hand sides.
    factors, pivots : array
        Of ``factorise_dense``.
    force : array
        Flat, one right-hand side after the other; overwritten by the solutions.
    """
    count, letters = integers32(system.lapack_integers), bytes_of(system.lapack_letters)
    count[0], count[1] = size, columns
    n, a, exchanges = address_of(count, 0), address_of(factors, 0), address_of(pivots, 0)
    plain, loads, failed = address_of(letters, PLAIN), address_of(count, 1), address_of(count, 2)
    _call(system.dgetrs, (plain, n, loads, a, n, exchanges, address_of(force, 0), n, failed))


@rule
def _invert_with_exchanges(system, size, matrix):
    """Invert a matrix in place by LU factors; return its smallest and its largest pivot, or 0 and 1 without inverse."""
    count, work, exchanges = integers32(system.lapack_integers), floats(system.lapack_work), integers32(system.pivots)
    n, failed, room = address_of(count, 0), address_of(count, 1), address_of(count, 2)
    a, at = address_of(matrix, 0), address_of(exchanges, 0)
    count[0], count[2] = size, work.size
    _call(system.dgetrf, (n, n, a, n, at, failed))
    if count[1] != 0:
        return 0.0, 1.0
    smallest, largest = np.inf, 0.0
    for i in range(size):
        pivot = abs(matrix[i * size + i])
        smallest, largest = min(smallest, pivot), max(largest, pivot)
    _call(system.dgetri, (n, a, n, at, address_of(work, 0), room, failed))
    return smallest, largest


@law
def _invert_by_blocks(system, size, width, matrix):
    """Invert a matrix in place by Gauss-Jordan elimination of blocks of columns; return its ratio of pivots.

    Most of the work is in products of matrices, several times as fast. Rows are exchanged inside a block only.
    """
    if width == size:
        smallest, largest = _invert_with_exchanges(system, size, matrix)
        return smallest / largest
    scratch, smallest, largest = floats(system.block_room), np.inf, 0.0
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
        least, most = _invert_with_exchanges(system, n, block)
        if least == 0.0:
            return 0.0
        smallest, largest = min(smallest, least), max(largest, most)
        for c in range(size):
            for r in range(n):
                row[c * n + r] = matrix[c * size + first + r]
        for c in range(n):
            row[(first + c) * n + c] = 1.0
        multiply(system, False, n, size, n, 1.0, block, n, row, n, 0.0, product)
        multiply(system, False, size, size, n, -1.0, column, size, product, n, 1.0, matrix)
        for c in range(size):
            for r in range(n):
                matrix[c * size + first + r] = product[c * n + r]
    return smallest / largest


@Unit
def invert(address):
    """Invert the stiffness of front ``k``: by blocks, or where they are nearly singular by LU factors.

    Parameters
    ----------
    address : int
        Of the table of the tangent equations: the matrix is the first ``matrix_size`` rows and columns of that of
        ``matrix_rows`` in ``scratch``; its inverse is put into ``inverses``, symmetric to the last bit if it is
        ``symmetric`` but for rounding. ``pivot_ratio`` becomes the smallest pivot over the largest; where there is no
        inverse it is 0, and the inverse NaN.
    """
    system = system_at(address)
    size, rows, matrix = system.matrix_size, system.matrix_rows, floats(system.scratch)
    inverse = floats(system.inverses)[integers(system.inverse_start)[system.k] :]
    system.pivot_ratio, width = 0.0, min(system.inversion_panel, size)
    while not system.pivot_ratio > system.singular_pivot_ratio:
        for c in range(size):
            for r in range(size):
                inverse[c * size + r] = matrix[c * rows + r]
        system.pivot_ratio = _invert_by_blocks(system, size, width, inverse)
        if width == size:
            break
        width = size
    if system.pivot_ratio == 0.0:
        for i in range(size * size):
            inverse[i] = np.nan
    if system.symmetric != 0:
        for c in range(size):
            for r in range(c):
                mean = 0.5 * (inverse[c * size + r] + inverse[r * size + c])
                inverse[c * size + r] = inverse[r * size + c] = mean
