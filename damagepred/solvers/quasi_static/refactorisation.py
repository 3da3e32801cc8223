"""Whether refactorisation pays: operation counts of a factorisation and of Woodbury corrections."""

from __future__ import annotations

import numpy as np

from damagepred.arrays import IntArray
from damagepred.solvers.quasi_static.options import LinearSystemOptions


class RefactorisationRule:
    """Ski rental: refactorise once all corrections since the last factorisation cost more than the next factorisation.

    Number and size of later changes are unknown; this rule costs at most twice the best in hindsight.

    Parameters
    ----------
    size : array of int (levels,)
        Degrees of freedom of each level.
    options : LinearSystemOptions
        Weights of operations.

    Attributes
    ----------
    factorisation_cost : array (levels + 1,)
        Cost of the elimination of the first levels (weighted operations).
    spent : float
        Cost of all corrections since the last factorisation.
    """

    def __init__(self, size: IntArray, options: LinearSystemOptions) -> None:
        self._options, self.spent = options, 0.0
        squares, n = size**2, size.astype(np.float64)
        # an inversion takes n^3 operations, the Schur complement about 25 n^2: a block has two couplings of 9 entries
        dense, sparse = options.inversion_weight * n**3, options.elimination_weight * 25.0 * n**2
        self.factorisation_cost = np.concatenate(([0.0], np.cumsum(2.0 * options.call_overhead + dense + sparse)))
        self._size, self._squares = (np.concatenate(([0.0], np.cumsum(values))) for values in (n, squares))

    def correction_cost(self, changed: int, new: int, levels: int) -> float:
        """Return the cost of a Woodbury correction (weighted operations).

        Parameters
        ----------
        changed, new : int
            Changed interfaces, two correction forces p each, and those of them without unit-load responses: three
            solutions each, of 4 operations for the square of the size of each level.
        levels : int
            Number of active levels.
        """
        options, forces = self._options, 2.0 * changed
        size, squares = float(self._size[levels]), float(self._squares[levels])
        responses = options.call_overhead * (new > 0) + options.product_weight * 12.0 * new * squares
        solution = options.solution_weight * 2.0 / 3.0 * forces**3
        return solution + options.vector_weight * (5.0 * forces**2 + 2.0 * forces * size) + responses
