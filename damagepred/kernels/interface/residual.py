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
