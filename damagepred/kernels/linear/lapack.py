"""LAPACK and BLAS called from kernels by the addresses of their routines, and the inverse of a dense matrix with them.

Matrices lie in flat arrays, row by row and transposed: to LAPACK, which counts by columns, they are the matrices.
"""

import numpy as np
from llvmlite import ir
from numba.core import cgutils, types
from numba.extending import intrinsic

from damagepred.kernels.jit import kernel, law
from damagepred.kernels.table import bytes_of, floats, integers32

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
def at(array, index):
    """Return the address of an element of an array.

    Parameters
    ----------
    array : array
        Contiguous, of one dimension.
    index : int
        Of the element.
    """
    return array[index:].ctypes.data


@law
def multiply(system, rows, size, inverses, first, force, from_row, share, product, to_row):
    """Add K^-1 F to a share of a product, for many columns of forces F; K^-1 lies transposed in a flat array (dgemm).

    Parameters
    ----------
    system : SYSTEM
        Addresses of the routines, and room for their arguments, which are passed by reference.
    rows, size : int
        Number of right-hand sides, and size of the matrix.
    inverses : array
        Flat; the matrix begins at ``first``.
    first : int
        See there.
    force, product : array (degrees of freedom, rows), flat
        Forces, and their product.
    from_row, to_row : int
        First degree of freedom in each.
    share : float
        Of the product so far; 0 if there is none.
    """
    count, one, letters = (
        integers32(system.lapack_integers),
        floats(system.lapack_reals),
        bytes_of(system.lapack_letters),
    )
    count[0], count[1], one[0], one[1] = rows, size, 1.0, share
    n, s = at(count, 0), at(count, 1)
    _call(
        system.dgemm,
        (
            at(letters, PLAIN),
            at(letters, TRANSPOSED),
            n,
            s,
            s,
            at(one, 0),
            at(force, from_row * rows),
            n,
            at(inverses, first),
            s,
            at(one, 1),
            at(product, to_row * rows),
            n,
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
    n = at(count, 0)
    _call(
        system.dgesv,
        (n, at(count, 1), at(matrix, 0), n, at(pivots, 0), at(force, 0), n, at(count, 2)),
    )
    return count[2] == 0


@law
def _mirror(size, half, whole, first):
    """Fill a symmetric matrix from its upper triangle, tile by tile."""
    tile = 32
    for top in range(0, size, tile):
        for left in range(top, size, tile):
            for r in range(top, min(top + tile, size)):
                for c in range(max(left, r), min(left + tile, size)):
                    whole[first + r * size + c] = whole[first + c * size + r] = half[r * size + c]


@kernel
def invert(system, size, symmetric, matrix, inverses, first):
    """Invert a matrix: by Cholesky's factors, in half the time, if symmetric and positive definite, else by LU.

    Parameters
    ----------
    system : SYSTEM
        Addresses of the routines, and room for their arguments, which are passed by reference.
    size : int
        Of the matrix.
    symmetric : bool
        Whether it is symmetric, but for rounding; then only one half counts.
    matrix : array
        Flat; overwritten.
    inverses : array
        Flat; filled from ``first`` on. Symmetric to the last bit if the factors are Cholesky's, NaN if there is none.
    first : int
        See there.

    Returns
    -------
    float
        Smallest pivot over the largest, 0 where there is no inverse.
    """
    count, squared, work = integers32(system.lapack_integers), size * size, floats(system.lapack_work)
    letters, exchanges = bytes_of(system.lapack_letters), integers32(system.pivots)
    count[0] = size
    n, failed, lower, a = at(count, 0), at(count, 1), at(letters, LOWER), at(matrix, 0)
    smallest, largest = np.inf, 0.0
    if symmetric:
        for i in range(size):
            work[i] = matrix[i * size + i]
        _call(system.dpotrf, (lower, n, a, n, failed))
        if count[1] == 0:
            for i in range(size):
                pivot = matrix[i * size + i] ** 2
                smallest, largest = min(smallest, pivot), max(largest, pivot)
            _call(system.dpotri, (lower, n, a, n, failed))
            _mirror(size, matrix, inverses, first)
            return smallest / largest
        # not positive definite: softening joints. The lower half is untouched but for its diagonal
        for r in range(size):
            matrix[r * size + r] = work[r]
            for c in range(r):
                matrix[c * size + r] = matrix[r * size + c]
    pivots = at(exchanges, 0)
    _call(system.dgetrf, (n, n, a, n, pivots, failed))
    if count[1] != 0:
        for i in range(squared):
            inverses[first + i] = np.nan
        return 0.0
    for i in range(size):
        pivot = abs(matrix[i * size + i])
        smallest, largest = min(smallest, pivot), max(largest, pivot)
    count[2] = work.size
    _call(system.dgetri, (n, a, n, pivots, at(work, 0), at(count, 2), failed))
    for i in range(squared):
        inverses[first + i] = matrix[i]
    return smallest / largest
