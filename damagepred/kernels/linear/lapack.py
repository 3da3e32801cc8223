"""LAPACK and BLAS called from kernels by the addresses of their routines, and the inverse of a dense matrix with them.

Matrices lie in flat arrays, row by row and transposed: to LAPACK, which counts by columns, they are the matrices.
"""

import numpy as np
from llvmlite import ir
from numba.core import cgutils, types
from numba.extending import intrinsic

from damagepred.kernels.jit import Unit, law
from damagepred.kernels.linear.table import system_at
from damagepred.kernels.table import address_of, bytes_of, float_rows, floats, integers32

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
    n, s = address_of(count, 0), address_of(count, 1)
    _call(
        system.dgemm,
        (
            address_of(letters, PLAIN),
            address_of(letters, TRANSPOSED),
            n,
            s,
            s,
            address_of(one, 0),
            address_of(force, from_row * rows),
            n,
            address_of(inverses, first),
            s,
            address_of(one, 1),
            address_of(product, to_row * rows),
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
    """Invert a matrix: by Cholesky's factors, in half the time, if symmetric and positive definite, else by LU.

    Parameters
    ----------
    address : int
        Of the table of the tangent equations: ``matrix`` lies flat in the first row of ``scratch``, of size
        ``matrix_size``, and is overwritten; its inverse is put into ``inverses`` from ``inverse_first`` on. If it is
        ``symmetric``, but for rounding, only one half counts, and the inverse is symmetric to the last bit if the
        factors are Cholesky's. ``pivot_ratio`` becomes the smallest pivot over the largest; where there is no inverse
        it is 0, and the inverse NaN.
    """
    system = system_at(address)
    size, first, matrix = system.matrix_size, system.inverse_first, float_rows(system.scratch)[0]
    inverses, count, work = floats(system.inverses), integers32(system.lapack_integers), floats(system.lapack_work)
    n, failed, lower = address_of(count, 0), address_of(count, 1), address_of(bytes_of(system.lapack_letters), LOWER)
    a, exchanges = address_of(matrix, 0), address_of(integers32(system.pivots), 0)
    smallest, largest, count[0] = np.inf, 0.0, size
    if system.symmetric != 0:
        for i in range(size):
            work[i] = matrix[i * size + i]
        _call(system.dpotrf, (lower, n, a, n, failed))
        if count[1] == 0:
            for i in range(size):
                pivot = matrix[i * size + i] ** 2
                smallest, largest = min(smallest, pivot), max(largest, pivot)
            _call(system.dpotri, (lower, n, a, n, failed))
            tile = 32
            for top in range(0, size, tile):
                for left in range(top, size, tile):
                    for r in range(top, min(top + tile, size)):
                        for c in range(max(left, r), min(left + tile, size)):
                            inverses[first + r * size + c] = inverses[first + c * size + r] = matrix[r * size + c]
            system.pivot_ratio = smallest / largest
            return
        # not positive definite: softening joints. The lower half is untouched but for its diagonal
        for r in range(size):
            matrix[r * size + r] = work[r]
            for c in range(r):
                matrix[c * size + r] = matrix[r * size + c]
    _call(system.dgetrf, (n, n, a, n, exchanges, failed))
    singular = count[1] != 0
    if not singular:
        for i in range(size):
            pivot = abs(matrix[i * size + i])
            smallest, largest = min(smallest, pivot), max(largest, pivot)
        count[2] = work.size
        _call(system.dgetri, (n, a, n, exchanges, address_of(work, 0), address_of(count, 2), failed))
    for i in range(size * size):
        inverses[first + i] = np.nan if singular else matrix[i]
    system.pivot_ratio = 0.0 if singular else smallest / largest
