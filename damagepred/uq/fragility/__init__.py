"""Fragility curves: the probability that a category of damage is reached at a given movement.

Each wall's path brackets its capacity for a category: undamaged at one increment, damaged at the next, or not yet
damaged at the last. Curves are fitted to those intervals by maximum likelihood; walls that were not yet damaged count
as such (censored), for leaving them out biases the curve to too small capacities.

- ``curves``: ``fit_fragility``, curves with bands from a study
- ``damagepred.uq.capacity``: the intervals, read from a study, and the one definition of when a category is reached;
  ``grouped_data``: groups of equal intervals; ``damagepred.uq.intensity``: measures of the movement
- ``likelihood``: of censored capacities, and its maximum
- ``estimators``: separate lognormal curves; a common dispersion, so that curves do not cross; ordinal data
- ``fit``: a fitted curve, or the reason why there is none
- ``turnbull``: the empirical curve (Turnbull, Kaplan-Meier, pooled adjacent violators)
- ``resampling``: the bootstrap; ``bands``: the posterior of few walls, BCa of many
- ``goodness``: goodness of fit, and Akaike's criterion of a common dispersion
- ``posterior``: its draws; ``options``: limits, tolerances and budgets of all of them
- ``stripes``: counts of walls at a few movements; ``surface``: against the movement and a second variable
"""

from damagepred.uq.capacity import Capacities, capacities, read_capacities
from damagepred.uq.fragility.curves import fit_fragility
from damagepred.uq.fragility.estimators import fit_lognormal
from damagepred.uq.fragility.fit import Fit
from damagepred.uq.fragility.grouped_data import normalised_weights
from damagepred.uq.fragility.options import FragilityOptions
from damagepred.uq.fragility.stripes import stripes, stripes_from_counts
from damagepred.uq.fragility.surface import fit_surface
from damagepred.uq.fragility.turnbull import turnbull
from damagepred.uq.intensity import MEASURES, movement_measure

__all__ = [
    "MEASURES",
    "Capacities",
    "Fit",
    "FragilityOptions",
    "capacities",
    "fit_fragility",
    "fit_lognormal",
    "fit_surface",
    "movement_measure",
    "normalised_weights",
    "read_capacities",
    "stripes",
    "stripes_from_counts",
    "turnbull",
]
