"""External work of a step between two equilibria, by the trapezoidal rule."""

from damagepred.kernels.jit import kernel


@kernel
def external_work(loads, residual, before, after, ground, ground_after, force, force_after):
    """Work of unit dead and live load, work of the ground, and bound of the work of the residual (J).

    ``loads``: dead and live load; ``before``, ``after``: displacements; ``ground`` and ``force``: normal and shear
    displacements of the ground and forces on it, before and after the step.
    """
    dead, live, at_most, by_ground = 0.0, 0.0, 0.0, 0.0
    for i in range(before.size):
        moved = after[i] - before[i]
        dead += loads[0][i] * moved
        live += loads[1][i] * moved
        at_most += residual[i] * abs(moved)
    for i in range(force[0].shape[0]):
        for k in range(force[0].shape[1]):
            by_ground += (force[0][i, k] + force_after[0][i, k]) * (ground_after[0][i, k] - ground[0][i, k])
            by_ground += (force[1][i, k] + force_after[1][i, k]) * (ground_after[1][i, k] - ground[1][i, k])
    return dead, live, 0.5 * by_ground, at_most
