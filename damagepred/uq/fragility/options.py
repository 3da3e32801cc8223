"""Tolerances, limits and budgets of fragility fits and of their bands."""

from __future__ import annotations

from dataclasses import fields

from pydantic import Field

from damagepred.scene.described import described
from damagepred.scene.quantity import Count, Pure


@described
class FragilityOptions:
    """Options of maximum likelihood, bootstrap, posterior and the empirical curve.

    With the default numbers of walls for each kind of band, intervals of 90 % hold the truth in 85 % of the cases of
    studies/coverage or more.

    Attributes
    ----------
    fewest_reached : int
        Walls that must have reached a category for a curve to be fitted to it.
    posterior_below : int
        Effective walls that reached the category below which bands are quantiles of the posterior, not BCa.
    fitted_share : float
        Share of the resamples that can be fitted below which bands are of the posterior (1).
    caution_below : int
        Walls that reached the category below which the curve carries a caution.
    posterior_draws : int
        Draws from the posterior.
    one_step_groups : int
        Groups of equal walls beyond which a resample is fitted by one Newton step from the estimate.
    one_step_walls : int
        Walls drawn for such a step at most; its scatter is scaled by the root of their number.
    """

    fewest_reached: Count = Field(default=3, ge=1)
    posterior_below: Count = Field(default=100, ge=0)
    fitted_share: Pure = Field(default=0.95, ge=0, le=1)
    caution_below: Count = Field(default=10, ge=0)
    posterior_draws: Count = Field(default=1500, ge=10)
    one_step_groups: Count = Field(default=2000, ge=1)
    one_step_walls: Count = Field(default=20_000, ge=10)

    def __repr__(self) -> str:
        """Options that differ from the defaults: signatures stay short."""
        values = {field.name: getattr(self, field.name) for field in fields(self)}
        others = (f"{name}={value!r}" for name, value in values.items() if value != getattr(type(self), name))
        return f"FragilityOptions({', '.join(others)})"


DEFAULT = FragilityOptions()

RETIRED = (
    *("coarse_start_rows", "criterion_walls", "curve_resamples", "empirical_bounds", "empirical_iterations"),
    *("empirical_tolerance", "fewest_common", "fewest_common_walls", "fewest_resampled", "goodness_walls"),
    *("largest_count", "largest_dispersion", "likelihood_rows", "median_resamples", "posterior_drop"),
    *("posterior_points", "profile_directions", "smallest_dispersion", "stored_draws"),
)
"""Options of older files that have no effect any more: constants now, or of bands that are gone."""
