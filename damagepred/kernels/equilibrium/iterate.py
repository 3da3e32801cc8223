"""The iterations as one compiled kernel, so that the laws of joints and the tangent equations are compiled once."""

from damagepred.kernels.equilibrium.newton import newton, newton_with_line_search
from damagepred.kernels.equilibrium.problem import residual
from damagepred.kernels.equilibrium.tresca import minimise
from damagepred.kernels.equilibrium.vectors import copy
from damagepred.kernels.jit import kernel

RESIDUAL, NEWTON, LINE_SEARCH, TRESCA = range(4)


def interpret(method, problem, jack, start, found, room, tolerance, limit):
    """Run an iteration from start to end; return the unbalanced force ratio, and the load of the jacks (N).

    ``minimise`` leaves the ratio open: it is returned as 0.

    Parameters
    ----------
    method : int
        RESIDUAL, no iteration; NEWTON, ``newton``; LINE_SEARCH, ``newton_with_line_search``; or TRESCA, ``minimise``.
    problem : Problem
        As ``damagepred.kernels.equilibrium.problem.residual``.
    jack : float
        Load of each jack at the start (N).
    start, found : array (size,)
        First displacements, and those found (m, rad); the residual force (N, N m) if only that is wanted.
    room : array (4, size)
        Scratch.
    tolerance, limit : float
        Of ``minimise``.
    """
    if method == RESIDUAL:
        return residual(problem, jack, start, True, found), jack
    if method == NEWTON:
        return newton(problem, jack, start, found, room)
    if method == LINE_SEARCH:
        return newton_with_line_search(problem, jack, start, found, room)
    copy(start, found)
    return 0.0, minimise(problem, jack, tolerance, limit, found, room)


iterate = kernel(interpret)
"""Compiled, for walls of rigid or elastic blocks."""
