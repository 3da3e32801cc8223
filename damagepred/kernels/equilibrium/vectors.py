"""Operations on vectors that make no new arrays."""

from damagepred.kernels.jit import law


@law
def copy(source, target):
    """Copy a vector."""
    for i in range(source.size):
        target[i] = source[i]


@law
def move_along(start, length, step, end):
    """Fill start + length step."""
    for i in range(start.size):
        end[i] = start[i] + length * step[i]


@law
def dot(a, b):
    """Scalar product."""
    total = 0.0
    for i in range(a.size):
        total += a[i] * b[i]
    return total
