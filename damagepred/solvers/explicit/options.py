"""Tolerances, budgets and factors of the explicit solver: time stepping, jacks, test of a mechanism, load path."""

from __future__ import annotations

from pydantic import Field

from damagepred.scene.described import described
from damagepred.scene.quantity import Count


@described
class ExplicitOptions:
    """Convergence, collapse and divergence on the explicit load path.

    Attributes
    ----------
    check_interval : int
        Cycles between two checks of the unbalanced force.
    passed_checks : int
        Checks in a row below the tolerance; an oscillation passes through balance without rest.
    """

    check_interval: Count = Field(default=50, ge=1)
    passed_checks: Count = Field(default=3, ge=1)
