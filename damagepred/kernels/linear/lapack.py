"""LAPACK and BLAS called from kernels by the addresses of their routines, and the inverse of a dense matrix with them.

Matrices lie in flat arrays, column by column.
"""

import numpy as np
from llvmlite import ir
from numba.core import cgutils, types
from numba.extending import intrinsic

from damagepred.kernels.jit import Unit, law
from damagepred.kernels.linear.table import system_at
from damagepred.kernels.table import address_of, bytes_of, floats, integers, integers32

LOWER, PLAIN, TRANSPOSED = 0, 1, 2
LETTERS = np.frombuffer(b"LNT", dtype=np.uint8).copy()


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
def solve_dense(system, size, columns, matrix, force):
    """Solve dense equations (dgesv); return whether the matrix is regular.

    Parameters
    ----------
    system : SYSTEM
        Addresses of the routines, and room for their arguments, which are passed by reference.
    size, columns : int
        Of the matrix, and number of right-hand sides.
    matrix : array
        Flat; overwritten by its factors.
    force : array
        Flat, one right-hand side after the other; overwritten by the solutions.
    """
    count, pivots = integers32(system.lapack_integers), integers32(system.pivots)
    count[0], count[1] = size, columns
    n = address_of(count, 0)
    _call(
        system.dgesv,
        (
            n,
            address_of(count, 1),
            address_of(matrix, 0),
            n,
            address_of(pivots, 0),
            address_of(force, 0),
            n,
            address_of(count, 2),
        ),
    )
    return count[2] == 0


@Unit
def invert(address):
    """Invert the stiffness of front ``k``: by Cholesky's factors, in half the time, if symmetric, else by LU.

    Parameters
    ----------
    address : int
        Of the table of the tangent equations: the matrix is the first ``matrix_size`` rows and columns of that of
        ``matrix_rows`` in ``scratch``, and is overwritten; its inverse is put into ``inverses``. If it is
        ``symmetric``, but for rounding, only one half counts, and the inverse is symmetric to the last bit if the
        factors are Cholesky's. ``pivot_ratio`` becomes the smallest pivot over the largest; where there is no inverse
        it is 0, and the inverse NaN.
    """
    system = system_at(address)
    size, rows, matrix = system.matrix_size, system.matrix_rows, floats(system.scratch)
    inverses = floats(system.inverses)[integers(system.inverse_start)[system.k] :]
    count, work = integers32(system.lapack_integers), floats(system.lapack_work)
    n, failed, lower = address_of(count, 0), address_of(count, 1), address_of(bytes_of(system.lapack_letters), LOWER)
    a, exchanges, apart = address_of(matrix, 0), address_of(integers32(system.pivots), 0), address_of(count, 3)
    smallest, largest, count[0], count[3] = np.inf, 0.0, size, rows
    if system.symmetric != 0:
        for i in range(size):
            work[i] = matrix[i * rows + i]
        _call(system.dpotrf, (lower, n, a, apart, failed))
        if count[1] == 0:
            for i in range(size):
                pivot = matrix[i * rows + i] * matrix[i * rows + i]
                smallest, largest = min(smallest, pivot), max(largest, pivot)
            _call(system.dpotri, (lower, n, a, apart, failed))
            tile = 32
            for top in range(0, size, tile):
                for left in range(top, size, tile):
                    for r in range(top, min(top + tile, size)):
                        for c in range(max(left, r), min(left + tile, size)):
                            inverses[r * size + c] = inverses[c * size + r] = matrix[r * rows + c]
            system.pivot_ratio = smallest / largest
            return
        # not positive definite: softening joints. The lower half is untouched but for its diagonal
        for r in range(size):
            matrix[r * rows + r] = work[r]
            for c in range(r):
                matrix[c * rows + r] = matrix[r * rows + c]
    _call(system.dgetrf, (n, n, a, apart, exchanges, failed))
    singular = count[1] != 0
    if not singular:
        for i in range(size):
            pivot = abs(matrix[i * rows + i])
            smallest, largest = min(smallest, pivot), max(largest, pivot)
        count[2] = work.size
        _call(system.dgetri, (n, a, apart, exchanges, address_of(work, 0), address_of(count, 2), failed))
    for c in range(size):
        for r in range(size):
            inverses[c * size + r] = np.nan if singular else matrix[c * rows + r]
    system.pivot_ratio = 0.0 if singular else smallest / largest
