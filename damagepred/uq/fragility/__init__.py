"""Fragility curves: the probability that a category of damage is reached at a given movement.

Each wall's path brackets its capacity for a category (``damagepred.uq.capacity``). Curves are fitted to those intervals
by maximum likelihood; walls that were not yet damaged count as such (censored), for leaving them out biases the curve
to too small capacities.
"""

from damagepred.uq.capacity import Capacities, read_capacities
from damagepred.uq.fragility.curves import fit_fragility
from damagepred.uq.fragility.estimators import fit_lognormal
from damagepred.uq.fragility.fit import Fit, normalised_weights
from damagepred.uq.fragility.surface import fit_surface
from damagepred.uq.fragility.turnbull import turnbull
from damagepred.uq.intensity import MEASURES, movement_measure

__all__ = [
    "MEASURES",
    "Capacities",
    "Fit",
    "fit_fragility",
    "fit_lognormal",
    "fit_surface",
    "movement_measure",
    "normalised_weights",
    "read_capacities",
    "turnbull",
]
