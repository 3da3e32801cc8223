"""Operations on vectors that make no new arrays: NumPy's in Python, loops where they are compiled."""

import numpy as np
from numba.extending import overload

from damagepred.kernels.jit import FLAGS


def copy(source, target):
    """Copy a vector.

    Parameters
    ----------
    source, target : array (n,)
        From and to.
    """
    target[:] = source


@overload(copy, jit_options=FLAGS)
def _copy(source, target):
    def compiled(source, target):
        for i in range(source.size):
            target[i] = source[i]

    return compiled


def move_along(start, length, step, end):
    """Compute start + length step.

    Parameters
    ----------
    start, step, end : array (n,)
        Vectors; ``end`` is filled.
    length : float
        Multiple of the step (1).
    """
    np.add(start, length * step, out=end)


@overload(move_along, jit_options=FLAGS)
def _move_along(start, length, step, end):
    def compiled(start, length, step, end):
        for i in range(start.size):
            end[i] = start[i] + length * step[i]

    return compiled


def dot(a, b):
    """Return the scalar product.

    Parameters
    ----------
    a, b : array (n,)
        Vectors.
    """
    return float(a @ b)


@overload(dot, jit_options=FLAGS)
def _dot(a, b):
    def compiled(a, b):
        total = 0.0
        for i in range(a.size):
            total += a[i] * b[i]
        return total

    return compiled
