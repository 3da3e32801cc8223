"""Equilibrium at a given load and movement: Newton's method, then the fixed point of friction."""

from __future__ import annotations

from enum import IntEnum

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
    """How equilibrium is sought: by one form of Newton's method, by both, and after them by Tresca's fixed point."""

    NEWTON = 1
    BOTH_FORMS = 2
    ALL = 3


class Equilibrium(Residual):
    """Finds equilibria of a wall."""

    def __init__(self, model: Model, tolerance: float, options: SolverOptions = DEFAULTS) -> None:
        super().__init__(model, tolerance, options)
        self._failures = self._searches_to_skip = 0

    def find(self, state: State, start: FloatArray | None = None, methods: Methods = Methods.ALL) -> float:
        """Find the equilibrium of a state; condensed fronts are uncondensed where they would slide or yield."""
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
        first, load = self._with_supports_moved(state) if start is None else start, state.jack
        best, ratio, best_jack = first, np.inf, load
        forms = (self.has_potential, not self.has_potential)  # with line search, or with backtracking
        for searching in forms[:1] if methods is Methods.NEWTON else forms:
            state.jack = load
            found, reached = self.newton(state, first, searching)
            if reached < self.tolerance:
                state.displacement[:] = found
                return reached
            if reached < ratio:
                best, ratio, best_jack = found, reached, state.jack
        if methods < Methods.ALL:
            return ratio
        if self._searches_to_skip > 0:
            self._searches_to_skip -= 1
            return ratio
        options, begun = self.options.coulomb, self._with_supports_moved(state)
        max_newton_iterations = options.max_newton_iterations >> self._failures
        if ratio < WARM_START_RESIDUAL:
            state.displacement[:], state.jack = best, best_jack
            ratio = coulomb_fixed_point(self, state, True, max_newton_iterations)
        if ratio >= self.tolerance:
            state.displacement[:], state.jack = begun, load
            ratio = coulomb_fixed_point(self, state, False, max_newton_iterations)
        failed = ratio >= self.tolerance
        self._failures = min(self._failures + 1, MAX_FAILURES) if failed else max(self._failures - 1, 0)
        self._searches_to_skip = 2 ** (self._failures - 1) - 1 if failed else 0
        return ratio

    def _with_supports_moved(self, state: State) -> FloatArray:
        """Return the displacements of a state, supports at their place at its load factor."""
        displacement = state.displacement.copy()
        displacement[self.model.supports.prescribed] = self.model.support_displacement(state.load_factor)
        return displacement

    def find_nearby(self, state: State) -> tuple[float, FloatArray]:
        """Find an equilibrium by Newton iteration from a state; return its unbalanced force ratio and displacements."""
        found, ratio = self.newton(state, state.displacement)
        return ratio, found

    def accept_unconverged(self, state: State) -> float:
        """Take a state that is no equilibrium as one; return its unbalanced force ratio."""
        _, ratio = self.residual(state, state.displacement)
        self.store_tangent(state, state.displacement)
        self.complete(state)
        return ratio
