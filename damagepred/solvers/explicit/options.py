"""Tolerances, budgets and factors of the explicit solver's load path."""

from __future__ import annotations

from pydantic import Field

from damagepred.scene.described import described
from damagepred.scene.quantity import Count, Pure


@described
class ExplicitOptions:
    """Convergence, collapse and divergence on the explicit load path.

    Local damping takes a share of all forces, those of ringing gridpoints included, and then opposes a slow motion of
    the wall like friction. So it is halved from time to time where zones ring between joints that stick and slip.

    Attributes
    ----------
    check_interval : int
        Cycles between two checks of the unbalanced force.
    passed_checks : int
        Checks in a row below the tolerance: an oscillation passes through balance without rest.
    gain_halving_cycles : int
        Cycles after which the gain of the jacks' control is halved where the wall still oscillates.
    gain_halving_time : float
        The same in time constants of the control, if that is longer (1).
    damping_halving_cycles : int
        Cycles after which local damping is halved where zones ring between joints that yield.
    minimum_damping : float
        Least local damping (1).
    trusted_time_step : float
        Share of the largest stable time step up to which it is not suspected where a wall keeps moving (1).
    collapse_bracket : float
        Load factor between the last stable state and collapse under live load (1).
    zero_load_ratio : float
        Load over all dead load that counts as none where a path ends because nothing is carried (1).
    zero_load_bracket : float
        Load factor between two points of the path that count as one in that search (1).
    divergence_displacement : float
        Displacement over the size of the wall from which a run has diverged (1).
    """

    check_interval: Count = Field(default=50, ge=1)
    passed_checks: Count = Field(default=3, ge=1)
    gain_halving_cycles: Count = Field(default=20_000, ge=1)
    gain_halving_time: Pure = Field(default=30.0, gt=0)
    damping_halving_cycles: Count = Field(default=10_000, ge=1)
    minimum_damping: Pure = Field(default=0.1, ge=0, lt=1)
    trusted_time_step: Pure = Field(default=0.9, gt=0, le=1)
    collapse_bracket: Pure = Field(default=1e-3, gt=0)
    zero_load_ratio: Pure = Field(default=1e-4, gt=0)
    zero_load_bracket: Pure = Field(default=1e-4, gt=0)
    divergence_displacement: Pure = Field(default=1e3, gt=1)
