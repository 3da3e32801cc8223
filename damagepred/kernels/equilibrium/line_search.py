"""Line search along a step: root of the work of the residual, by safeguarded regula falsi (Crisfield 1991, ch. 9)."""

import numpy as np

from damagepred.kernels.equilibrium.vectors import dot, move_along
from damagepred.kernels.jit import rule

MAXIMUM_STEP = 64.0
"""Largest multiple of a step in a Tresca problem, or of one along which the residual stays the same (1)."""
MAX_TRIALS = 30
"""Trial steps."""
SAFEGUARD = 0.05
"""Least distance of a trial step from the ends of its bracket, over the bracket's length (1)."""


@rule
def line_search(
    steps, wall, state, jack, jack_step, start, step, slope, ratio, slope_tolerance, maximum_step, coulomb, end, force
):
    """Step length at which the work of the residual along the step is small, and the unbalanced force ratio there.

    On entry ``end``, ``force`` and ``ratio`` belong to the full step, and ``slope`` is the work at its start. On return
    ``end`` and ``force`` belong to the returned length. ``coulomb``: Coulomb law or Tresca problem.
    """
    low, high, slope_low, slope_high, length = 0.0, 1.0, slope, np.nan, 1.0
    for _ in range(MAX_TRIALS):
        slope_here = dot(force, step) if ratio < np.inf else -np.inf
        if abs(slope_here) <= slope_tolerance * slope or (slope_here > 0.0 and length >= maximum_step):
            break
        if slope_here > 0.0:
            if slope_high == -np.inf:
                break  # twice as far there is no residual
            low, slope_low = length, slope_here
        else:
            high, slope_high = length, slope_here
        if np.isnan(slope_high):
            length *= 2.0
        elif slope_high == -np.inf:
            length = 0.5 * (low + high)
        else:
            # false position, kept away from the ends
            root = slope_low / (slope_low - slope_high)
            length = low + (high - low) * min(max(root, SAFEGUARD), 1.0 - SAFEGUARD)
        move_along(start, length, step, end)
        ratio = steps.residual(wall, state, jack + length * jack_step, end, coulomb, force)
    return length, ratio
