"""Equilibrium at a given load and movement: methods that are tried in order, and the reasons to skip one.

Newton's method with line search, Newton's method with backtracking (first under jacks whose deflection is given), and
the Tresca fixed point. Dynamic relaxation (``snap_through``) stands apart from this list: it seeks no equilibrium of
the given state. It starts from the last equilibrium, moves the blocks and ends with another history, or in collapse. It
costs as much as hundreds of Newton iterations, so that the continuation tries a shorter step first.
"""

from __future__ import annotations

from collections.abc import Callable
from enum import IntEnum
from typing import NamedTuple

import numpy as np

from damagepred.arrays import FloatArray
from damagepred.assembly import Model
from damagepred.kernels.equilibrium.newton import WARM_START_RESIDUAL
from damagepred.solvers.options import DEFAULTS, SolverOptions
from damagepred.solvers.quasi_static.residual import Residual
from damagepred.solvers.quasi_static.tresca_fixed_point import coulomb_fixed_point
from damagepred.solvers.state.wall_state import State

MAX_FAILURES = 4
"""Failures that count."""


class Methods(IntEnum):
    """Methods that are tried: one form of Newton's method, both, or both and then the Tresca fixed point."""

    NEWTON = 1
    BOTH_FORMS = 2
    ALL = 3


class Found(NamedTuple):
    """Iterate of a method: displacements, load of the jacks (N), unbalanced force ratio."""

    displacement: FloatArray
    jack: float
    ratio: float


def newton_with_line_search(wall: Residual, state: State, start: Found, best: Found, limit: int) -> Found:
    """Best iterate of Newton's method with line search (Crisfield 1991, ch. 9)."""
    return _newton(wall, state, start, searching=True)


def newton_with_backtracking(wall: Residual, state: State, start: Found, best: Found, limit: int) -> Found:
    """Best iterate of Newton's method with backtracking, undamped at first."""
    return _newton(wall, state, start, searching=False)


def _newton(wall: Residual, state: State, start: Found, searching: bool) -> Found:
    state.jack = start.jack
    displacement, ratio = wall.newton(state, start.displacement, searching)
    return Found(displacement, state.jack, ratio)


def tresca_fixed_point(wall: Residual, state: State, start: Found, best: Found, limit: int) -> Found:
    """Last iterate of the Tresca fixed point (Haslinger 1983), from the best iterate before and from the start.

    ``limit``: Newton iterations of each.
    """
    begun, ratio = wall.with_supports_moved(state), best.ratio
    if ratio < WARM_START_RESIDUAL:
        state.displacement[:], state.jack = best.displacement, best.jack
        ratio = coulomb_fixed_point(wall, state, True, limit)
    if ratio >= wall.tolerance:
        state.displacement[:], state.jack = begun, start.jack
        ratio = coulomb_fixed_point(wall, state, False, limit)
    return Found(state.displacement, state.jack, ratio)


Method = Callable[[Residual, State, Found, Found, int], Found]
METHODS: tuple[Method, ...] = newton_with_line_search, newton_with_backtracking, tresca_fixed_point
METHODS_UNDER_JACKS: tuple[Method, ...] = newton_with_backtracking, newton_with_line_search, tresca_fixed_point


class Equilibrium(Residual):
    """Finds equilibria of a wall."""

    def __init__(self, model: Model, tolerance: float, options: SolverOptions = DEFAULTS) -> None:
        super().__init__(model, tolerance, options)
        self._failures = self._searches_to_skip = 0

    def find(self, state: State, start: FloatArray | None = None, methods: Methods = Methods.ALL) -> float:
        """Find the equilibrium at the loads and history of a state, whose displacements and jack load it sets.

        Returns the unbalanced force ratio; below the tolerance the state is in equilibrium and completed. The search
        begins at ``start`` (N displacements), or at the displacements of the state. Condensed fronts whose joints would
        slide or blocks yield become active.
        """
        while True:
            ratio = self._find_active(state, start, methods)
            if ratio >= self.tolerance:
                self.complete(state)
                return ratio
            inelastic, start = self.inelastic_fronts(state), None
            if inelastic is None:
                return ratio
            if self.condensed:
                self.uncondense(inelastic)

    def _find_active(self, state: State, start: FloatArray | None, methods: Methods) -> float:
        """Find the equilibrium with the present active fronts."""
        if self.jacks is not None:
            state.jack = self.jacks.load_at(state.load_factor, state.jack)
        first = self.with_supports_moved(state) if start is None else start
        begin = best = Found(first, state.jack, np.inf)
        order = METHODS if self.has_potential else METHODS_UNDER_JACKS
        for method in order:
            if self._reason_to_skip(method, order[0], methods):
                continue
            found = method(self, state, begin, best, self.options.coulomb.max_newton_iterations >> self._failures)
            if method is tresca_fixed_point:
                self._count_failure(found.ratio >= self.tolerance)
                return found.ratio
            if found.ratio < self.tolerance:
                state.displacement[:] = found.displacement
                return found.ratio
            if found.ratio < best.ratio:
                best = found
        return best.ratio

    def _reason_to_skip(self, method: Method, first: Method, sought: Methods) -> str:
        """Reason to skip a method, "" to try it."""
        if sought is Methods.NEWTON and method is not first:
            return "a shorter step comes first"
        if sought is Methods.BOTH_FORMS and method is tresca_fixed_point:
            return "a smaller load or dynamic relaxation comes first"
        if method is tresca_fixed_point and self._searches_to_skip > 0:
            self._searches_to_skip -= 1
            return "it has failed in equilibria before"
        return ""

    def _count_failure(self, failed: bool) -> None:
        """Count failures of the Tresca fixed point; the second, third, ... in a row skips the next 1, 3, 7 searches."""
        self._failures = min(self._failures + 1, MAX_FAILURES) if failed else max(self._failures - 1, 0)
        self._searches_to_skip = 2 ** (self._failures - 1) - 1 if failed else 0

    def find_nearby(self, state: State) -> tuple[float, FloatArray]:
        """Unbalanced force ratio and displacements of the best iterate of Newton's method from a state."""
        found, ratio = self.newton(state, state.displacement)
        return ratio, found

    def accept_unconverged(self, state: State) -> float:
        """Store the tangent of a state that is no equilibrium, complete it, and return its unbalanced force ratio."""
        _, ratio = self.residual(state, state.displacement)
        self.store_tangent(state, state.displacement)
        self.complete(state)
        return ratio
