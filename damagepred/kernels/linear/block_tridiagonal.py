"""Direct solution of block tridiagonal equations: Schur complements, forward elimination and back substitution.

Levels are ordered by their distance from the ground. Elimination runs from the farthest level to the nearest, so a
change in one level leaves the factors of all farther ones as they are. Inverses are stored transposed: a product with
one is then a sum of its rows, which the compiler vectorises.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from damagepred.kernels.jit import kernel, kernel_making_arrays, law


class Levels(NamedTuple):
    """Factors of all levels, and where they act.

    Attributes
    ----------
    start : array of int (levels + 1,)
        Where each level starts in the order of the levels.
    inverses, inverse_start : array
        Inverse of each level's stiffness, transposed, one after the other, row by row; and where each begins.
    first_coupling : array of int (levels + 1,)
        Coupled pairs between levels k and k - 1 are ``first_coupling[k]`` to ``first_coupling[k + 1]``.
    far_index, near_index : array of int (b, w / 2)
        Indices in their levels of the degrees of freedom of a pair's sides, -1 where prescribed.
    near_far, far_near : array (b, w / 2, w / 2)
        See ``assemble_couplings``.
    """

    start: NDArray[np.int64]
    inverses: NDArray[np.float64]
    inverse_start: NDArray[np.int64]
    first_coupling: NDArray[np.int64]
    far_index: NDArray[np.int64]
    near_index: NDArray[np.int64]
    near_far: NDArray[np.float64]
    far_near: NDArray[np.float64]


@kernel
def schur_complement(levels, k, inverse, work, complement):
    """Compute what eliminating level k subtracts from the next level: K_nf K_ff^-1 K_fn.

    Parameters
    ----------
    levels : Levels
        All levels.
    k : int
        The farther level.
    inverse : array (size, size)
        K_ff^-1, farther levels eliminated; transposed.
    work : array (nearer size, size)
        Scratch.
    complement : array (nearer size, nearer size)
        Filled, transposed.
    """
    first, last = levels.first_coupling[k], levels.first_coupling[k + 1]
    far_index, near_index = levels.far_index, levels.near_index
    near_far, far_near = levels.near_far, levels.far_near
    side = far_index.shape[1]
    work[:] = 0.0
    for e in range(first, last):
        for r in range(side):
            if far_index[e, r] < 0:
                continue
            row = inverse[far_index[e, r]]
            for c in range(side):
                if near_index[e, c] >= 0:
                    add_row(far_near[e, r, c], row, work[near_index[e, c]])
    complement[:] = 0.0
    for m in range(complement.shape[0]):
        for e in range(first, last):
            for r in range(side):
                if near_index[e, r] < 0:
                    continue
                total = 0.0
                for c in range(side):
                    if far_index[e, c] >= 0:
                        total += near_far[e, r, c] * work[m, far_index[e, c]]
                complement[m, near_index[e, r]] += total


@kernel
def mirror(half, whole):
    """Fill a symmetric matrix from its upper triangle, tile by tile.

    Parameters
    ----------
    half, whole : array (s, s)
        Upper triangle, and the matrix.
    """
    size, tile = half.shape[0], 32
    for top in range(0, size, tile):
        for left in range(top, size, tile):
            for r in range(top, min(top + tile, size)):
                for c in range(max(left, r), min(left + tile, size)):
                    whole[r, c] = whole[c, r] = half[r, c]


@law
def add_row(amount, row, total):
    """Add a multiple of a row to another (axpy).

    Parameters
    ----------
    amount : float
        The multiple.
    row, total : array (n,)
        The rows.
    """
    for j in range(row.size):
        total[j] += amount * row[j]


@law
def _multiply(inverses, at, size, force, from_start, displacement, to_start):
    """Add the product of a level's inverse, ``inverses`` from ``at`` on, and its forces to displacements, all rows."""
    rest = size % 4
    for i in range(0, size - rest, 4):  # four rows of the inverse at a time
        first, second = inverses[at + i * size :], inverses[at + (i + 1) * size :]
        third, fourth = inverses[at + (i + 2) * size :], inverses[at + (i + 3) * size :]
        for j in range(force.shape[0]):
            a, b = force[j, from_start + i], force[j, from_start + i + 1]
            c, d = force[j, from_start + i + 2], force[j, from_start + i + 3]
            total = displacement[j][to_start : to_start + size]
            for k in range(size):
                total[k] += a * first[k] + b * second[k] + c * third[k] + d * fourth[k]
    for i in range(size - rest, size):
        for j in range(force.shape[0]):
            add_row(
                force[j, from_start + i],
                inverses[at + i * size : at + (i + 1) * size],
                displacement[j][to_start : to_start + size],
            )


@law
def _subtract_coupling(first, last, at_here, at_there, coupling, displacement, there, force, here):
    """Subtract the product of a coupling block and the displacements of a neighbour level from forces."""
    side = at_here.shape[1]
    for e in range(first, last):
        for r in range(side):
            if at_here[e, r] < 0:
                continue
            for c in range(side):
                if at_there[e, c] < 0:
                    continue
                for j in range(force.shape[0]):
                    force[j, here + at_here[e, r]] -= coupling[e, r, c] * displacement[j, there + at_there[e, c]]


@kernel
def forward_elimination(levels, farthest, last, force, particular):
    """Eliminate levels from the farthest to ``last``: condense their forces, and solve with nearer levels fixed.

    Parameters
    ----------
    levels : Levels
        All levels.
    farthest, last : int
        First and last level to be eliminated.
    force : array (r, degrees of freedom)
        In the order of the levels; the condensed force is added to the next level.
    particular : array (r, degrees of freedom)
        Zeros; filled with the particular solution, all nearer levels fixed.
    """
    start, coupling = levels.start, levels.first_coupling
    far_index, near_index, near_far = levels.far_index, levels.near_index, levels.near_far
    for k in range(farthest, last - 1, -1):
        a, first, end = start[k], coupling[k], coupling[k + 1]
        _multiply(levels.inverses, levels.inverse_start[k], start[k + 1] - a, force, a, particular, a)
        if k > 0:
            _subtract_coupling(first, end, near_index, far_index, near_far, particular, a, force, start[k - 1])


@kernel
def back_substitution(levels, first, active, particular, displacement, pull):
    """Recover the displacements of levels ``first`` and beyond from those of the nearer ones.

    Parameters
    ----------
    levels : Levels
        All levels.
    first, active : int
        First level to recover, and number of levels; the ground, nearer than level 0, does not move.
    particular, displacement : array (r, degrees of freedom)
        In the order of the levels.
    pull : array (r, degrees of freedom)
        Scratch: forces of the nearer level.
    """
    start, coupling = levels.start, levels.first_coupling
    far_index, near_index, far_near = levels.far_index, levels.near_index, levels.far_near
    for k in range(first, active):
        a, b = start[k], start[k + 1]
        for j in range(displacement.shape[0]):
            for i in range(a, b):
                displacement[j, i] = particular[j, i]
                pull[j, i] = 0.0
        if k > 0:
            _subtract_coupling(
                coupling[k], coupling[k + 1], far_index, near_index, far_near, displacement, start[k - 1], pull, a
            )
            _multiply(levels.inverses, levels.inverse_start[k], b - a, pull, a, displacement, a)


@kernel_making_arrays
def solve_columns(levels, active, farthest, force, particular):
    """Solve for many columns of forces by matrix products: forward elimination and back substitution.

    Parameters
    ----------
    levels : Levels
        All levels.
    active, farthest : int
        Number of active levels, and level beyond which there are no forces.
    force, particular : array (degrees of freedom, r)
        Forces, which become displacements; scratch of the same shape.
    """
    start, coupling, inverse_start = levels.start, levels.first_coupling, levels.inverse_start
    far_index, near_index, near_far, far_near = levels.far_index, levels.near_index, levels.near_far, levels.far_near
    for k in range(farthest, -1, -1):
        a, b, first, last = start[k], start[k + 1], coupling[k], coupling[k + 1]
        inverse = levels.inverses[inverse_start[k] : inverse_start[k + 1]].reshape((b - a, b - a))
        np.dot(inverse.T, force[a:b], particular[a:b])
        if k > 0:
            nearer = force[start[k - 1] : a]
            _subtract_coupling_columns(first, last, near_index, far_index, near_far, particular[a:b], nearer)
    for i in range(start[1]):  # assigning slices compiles messages of errors, too: three seconds
        for j in range(force.shape[1]):
            force[i, j] = particular[i, j]
    for k in range(1, active):
        a, b, first, last = start[k], start[k + 1], coupling[k], coupling[k + 1]
        inverse = levels.inverses[inverse_start[k] : inverse_start[k + 1]].reshape((b - a, b - a))
        pull = np.zeros((b - a, force.shape[1]))
        _subtract_coupling_columns(first, last, far_index, near_index, far_near, force[start[k - 1] : a], pull)
        np.dot(inverse.T, pull, force[a:b])
        if k <= farthest:
            for i in range(a, b):
                add_row(1.0, particular[i], force[i])


@law
def _subtract_coupling_columns(first, last, at_here, at_there, coupling, displacement, force):
    """Subtract as ``_subtract_coupling``, with one column for each right-hand side."""
    side = at_here.shape[1]
    for e in range(first, last):
        for r in range(side):
            if at_here[e, r] < 0:
                continue
            row = force[at_here[e, r]]
            for c in range(side):
                if at_there[e, c] >= 0:
                    add_row(-coupling[e, r, c], displacement[at_there[e, c]], row)
