"""Equilibrium at a given load and movement, by methods that are tried in order.

Newton's method with line search (Crisfield 1991, ch. 9), Newton's method with backtracking (first under jacks whose
deflection is given), and the Tresca fixed point (Haslinger 1983). Dynamic relaxation (``snap_through``) stands apart:
it starts from the last equilibrium, moves the blocks and ends with another history, or in collapse. It costs as much
as hundreds of Newton iterations, so that the continuation tries a shorter step first.
"""

from __future__ import annotations

from enum import IntEnum
from typing import NamedTuple

import numpy as np

from damagepred.arrays import FloatArray
from damagepred.assembly import Model
from damagepred.kernels.equilibrium.newton import WARM_START_RESIDUAL
from damagepred.kernels.joint.limits import NO_LIMIT
from damagepred.solvers.options import DEFAULTS, SolverOptions
from damagepred.solvers.quasi_static.residual import Residual
from damagepred.solvers.state.wall_state import State

FIRST_FORCING = 3.0
"""Largest residual tolerance of a Tresca problem, also the tolerance of the first (mean block weights)."""
WARM_START_ITERATIONS = 6
"""Tresca problems of that search."""
FULL_UPDATES = 6
"""Tresca problems after which the bounds are updated in full; later updates are under-relaxed."""
UPDATES_PER_FACTOR = 12
"""Updates with each of them; the last holds from there on."""
MAX_ITERATIONS = 60
"""Tresca problems solved for one equilibrium."""
MAX_NEWTON_ITERATIONS = 400
"""Newton iterations of one search while none has been in vain."""
STAGNATION_LIMIT = 8
"""Iterations in a row that do not halve the least residual, after which the search ends."""
FORCING_SHARE = 0.01
"""Residual tolerance of a Tresca problem over the residual of the Coulomb law with its bounds (1)."""
RELAXATION_FACTORS = (0.5, 0.3, 0.15)
"""Successive factors of under-relaxation (1)."""
MAX_FAILURES = 4
"""Failures of a search by the Tresca fixed point that count."""


class Methods(IntEnum):
    """Methods that are tried: one form of Newton's method, both, or both and then the Tresca fixed point."""

    NEWTON = 1
    BOTH_FORMS = 2
    ALL = 3


class Iterate(NamedTuple):
    """Best iterate of a method: displacements, load of the jacks (N), unbalanced force ratio."""

    displacement: FloatArray
    jack: float
    ratio: float


class Equilibrium(Residual):
    """Finds equilibria of a wall.

    A search by the Tresca fixed point in vain costs more than dynamic relaxation. After each, the next search gets half
    the Newton iterations; after the second, third, ... the following 1, 3, 7 equilibria are sought by Newton's method
    alone. The first takes none away: where joints without a bond slide, half a step mostly finds an equilibrium where
    the whole step does not. A search that succeeds takes one failure back.
    """

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
        begin = best = Iterate(first, state.jack, np.inf)
        forms = (self.has_potential, not self.has_potential)  # whether with line search
        for searching in forms[:1] if methods is Methods.NEWTON else forms:
            state.jack = begin.jack
            displacement, ratio = self.newton(state, first, searching)
            if ratio < self.tolerance:
                state.displacement[:] = displacement
                return ratio
            if ratio < best.ratio:
                best = Iterate(displacement, state.jack, ratio)
        if methods is not Methods.ALL:
            return best.ratio
        if self._searches_to_skip > 0:
            self._searches_to_skip -= 1
            return best.ratio
        ratio = self._tresca_fixed_point(state, begin, best)
        # the second, third, ... failure in a row skips the next 1, 3, 7 searches
        failed = ratio >= self.tolerance
        self._failures = min(self._failures + 1, MAX_FAILURES) if failed else max(self._failures - 1, 0)
        self._searches_to_skip = 2 ** (self._failures - 1) - 1 if failed else 0
        return ratio

    def _tresca_fixed_point(self, state: State, begin: Iterate, best: Iterate) -> float:
        """Unbalanced force ratio of the Tresca fixed point, from the best iterate and from the start."""
        begun, ratio = self.with_supports_moved(state), best.ratio
        if ratio < WARM_START_RESIDUAL:
            state.displacement[:], state.jack = best.displacement, best.jack
            ratio = self.coulomb_fixed_point(state, warm=True)
        if ratio >= self.tolerance:
            state.displacement[:], state.jack = begun, begin.jack
            ratio = self.coulomb_fixed_point(state, warm=False)
        return ratio

    def coulomb_fixed_point(self, state: State, warm: bool) -> float:
        """Coulomb friction by Tresca fixed-point iteration from the displacements of a state (Wriggers 2006, ch. 10).

        Each iteration minimises the potential with fixed bounds (convex), updates these, under-relaxed after the first
        updates, and tries Newton's method on the Coulomb law from there. The minimisation is inexact: its tolerance is
        a share of the residual of the Coulomb law, which remains with frozen bounds (Dembo, Eisenstat and Steihaug
        1982). A warm start takes the first bounds from the present displacements.
        """
        most = self.equations.iterations + (MAX_NEWTON_ITERATIONS >> self._failures)
        bounds, history = self.components.bounds, state.history
        bounds.bound[:], bounds.dilatant_opening[:], bounds.kappa[:] = NO_LIMIT, history.dilatant_opening, history.kappa
        if warm:
            self.update_tresca_bounds(state, 1.0)
        ratio, least, since = np.inf, np.inf, 0
        forcing = self._forcing(state) if warm else FIRST_FORCING
        for attempt in range(WARM_START_ITERATIONS if warm else MAX_ITERATIONS):
            self.minimise(state, forcing)
            if self.has_diverged(state):
                break
            relaxation = 1.0
            if attempt >= FULL_UPDATES:  # bounds that overshoot are under-relaxed
                update = (attempt - FULL_UPDATES) // UPDATES_PER_FACTOR
                relaxation = RELAXATION_FACTORS[min(update, len(RELAXATION_FACTORS) - 1)]
            self.update_tresca_bounds(state, relaxation)
            found, ratio = self.newton(state, state.displacement)
            if ratio < self.tolerance:
                state.displacement[:] = found
                break
            forcing = self._forcing(state)
            since = 0 if ratio < 0.5 * least else since + 1
            least = min(least, ratio)
            if since > STAGNATION_LIMIT or self.equations.iterations > most:
                break
        return ratio

    def _forcing(self, state: State) -> float:
        """Residual tolerance of the next Tresca problem (mean block weights)."""
        ratio = self.residual(state, state.displacement)[1]
        return max(self.tolerance, min(FORCING_SHARE * ratio, FIRST_FORCING))

    def accept_unconverged(self, state: State) -> float:
        """Store the tangent of a state that is no equilibrium, complete it, and return its unbalanced force ratio."""
        _, ratio = self.residual(state, state.displacement)
        self.store_tangent(state, state.displacement)
        self.complete(state)
        return ratio
