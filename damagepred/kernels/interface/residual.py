"""External and residual forces on all degrees of freedom."""

import numpy as np

from damagepred.kernels.jit import kernel


@kernel
def free_residual(force, free, per_weight, residual):
    """Fill the residual force on free degrees of freedom, 0 elsewhere; return its largest ratio, inf if any is NaN.

    Parameters
    ----------
    force : array (size,)
        On every degree of freedom (N, N m).
    free : array of int
        Free degrees of freedom.
    per_weight : array (size,)
        One over the reference force of each degree of freedom (1/N, 1/(N m)).
    residual : array (size,)
        Filled.
    """
    largest, known = 0.0, True
    for i in range(residual.size):
        residual[i] = 0.0
    for j in range(free.size):
        i = free[j]
        residual[i] = force[i]
        ratio = abs(force[i] * per_weight[i])
        known &= ratio < np.inf  # false for NaN
        largest = max(largest, ratio)
    return largest if known else np.inf


@kernel
def largest_block_resultant(force, block, dof_x, dof_y, arm_x, arm_y, total):
    """Return the largest resultant x, y or moment (N) of the forces on the gridpoints of a block.

    Parameters
    ----------
    force : array (size,)
        On every degree of freedom (N).
    block, dof_x, dof_y : array of int (g,)
        Block of each gridpoint, and its degrees of freedom.
    arm_x, arm_y : array (g,)
        From its block's centroid, over the block's radius of gyration.
    total : array (n, 3)
        Filled with the resultants.
    """
    total[:] = 0.0
    largest = 0.0
    for g in range(block.size):
        x, y = force[dof_x[g]], force[dof_y[g]]
        of_block = total[block[g]]
        of_block[0] += x
        of_block[1] += y
        of_block[2] += arm_x[g] * y - arm_y[g] * x
    for b in range(len(total)):
        for axis in range(3):
            largest = max(largest, abs(total[b, axis]))
    return largest


@kernel
def within_limit(displacement, free, arms, limit):
    """Whether the displacements of all free degrees of freedom are below a limit; false for NaN.

    Parameters
    ----------
    displacement : array (size,)
        Displacements (m) and rotations.
    free : array of int
        Free degrees of freedom.
    arms : array (size,)
        Arms that make rotations comparable to displacements (m), else 1.
    limit : float
        Limit (m).
    """
    within = True
    for j in range(free.size):
        i = free[j]
        within &= abs(displacement[i] * arms[i]) < limit  # false for NaN
    return within
