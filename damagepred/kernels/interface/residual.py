"""External and residual forces on all degrees of freedom."""

import numpy as np

from damagepred.kernels.jit import kernel


@kernel
def free_residual(force, free, per_weight, residual):
    """Fill the residual force on free degrees of freedom, 0 elsewhere; return its largest ratio, inf if any is NaN."""
    largest, finite = 0.0, True
    residual[:] = 0.0
    for j in range(free.size):
        i = free[j]
        residual[i] = force[i]
        ratio = abs(force[i] * per_weight[i])
        finite &= ratio < np.inf  # false for NaN
        largest = max(largest, ratio)
    return largest if finite else np.inf


@kernel
def within_limit(displacement, free, arms, limit):
    """Whether the displacements of all free degrees of freedom are below a limit; false for NaN."""
    within = True
    for j in range(free.size):
        i = free[j]
        within &= abs(displacement[i] * arms[i]) < limit  # false for NaN
    return within
