"""Solvers: from a model to its path of equilibria."""

from __future__ import annotations

from collections.abc import Iterator

from damagepred.assembly import Model
from damagepred.errors import SolverError
from damagepred.runtime.one_thread import each_with_one_blas_thread
from damagepred.scene import Solver
from damagepred.solvers.state.increment import Increment

__all__ = ["Increment", "solve_path"]

SMALL_WALL = 200
"""Blocks up to which the quasi-static solver applies dead load to the whole wall, faster than symmetry is detected."""


@each_with_one_blas_thread
def solve_path(model: Model, settings: Solver, increments: int) -> Iterator[Increment]:
    """State under dead load, then the state after each of equal steps of the movement."""
    half = None
    if settings.symmetric_half and not (settings.method == "quasi_static" and _cheaper_as_a_whole(model)):
        from damagepred.solvers.symmetry import reduce_by_symmetry

        half = reduce_by_symmetry(model)
    if half is None:
        yield from _path(model, settings, increments)
        return
    try:
        for increment in _path(half, settings, increments):
            yield half.expand(increment)
    except SolverError as error:
        raise half.renumber(error) from None


def _cheaper_as_a_whole(model: Model) -> bool:
    """Whether dead load on a small wall is solved faster than symmetry is detected."""
    supports = model.supports
    still = model.jacks is None and not model.ground.moves
    still = still and not (supports.prescribed_displacement.any() or supports.live_load.any())
    return still and model.live_edge_load is None and model.n_blocks <= SMALL_WALL


def _path(model: Model, settings: Solver, increments: int) -> Iterator[Increment]:
    if settings.method == "quasi_static":
        from damagepred.solvers.quasi_static.stepper import quasi_static_path

        return quasi_static_path(model, settings, increments)
    from damagepred.solvers.explicit.stepper import explicit_path

    return explicit_path(model, settings, increments)
