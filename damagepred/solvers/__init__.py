"""From a model to the path of its equilibria."""

from __future__ import annotations

from collections.abc import Iterator

from damagepred.assembly import Model
from damagepred.scene import Solver
from damagepred.solvers.increment import ContactState, Increment

__all__ = ["ContactState", "Increment", "solve_path"]


def solve_path(model: Model, settings: Solver, increments: int) -> Iterator[Increment]:
    """Follow the movement with the solver that the settings name.

    Parameters
    ----------
    model : Model
        The wall.
    settings : Solver
        Method and its parameters.
    increments : int
        Number of equal steps of the movement.

    Yields
    ------
    Increment
        First the state under dead load, then one each step; whoever takes them may stop at any.
    """
    if settings.method == "quasi_static":
        from damagepred.solvers.quasi_static import quasi_static_path

        yield from quasi_static_path(model, settings, increments)
        return
    from damagepred.solvers.explicit import explicit_path

    yield from explicit_path(model, settings, increments)
