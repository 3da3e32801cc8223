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
    smallest_dispersion, largest_dispersion : float
        Dispersions beyond which there is no curve (1).
    coarse_start_rows : int
        Rows of the likelihood from which the maximum is first sought with a fifth of this number of rows.
    likelihood_rows : int
        Rows of the likelihood evaluated at a time: they fit into the processor's cache.
    posterior_below : int
        Effective walls that reached the category below which bands are quantiles of the posterior, not BCa.
    fewest_common : int
        Such walls of each category below which curves with a common dispersion have no band.
    fewest_common_walls : int
        Effective walls in all below which these have none; a limit on those above alone would pick unusual studies.
    fitted_share : float
        Share of the resamples that can be fitted below which bands are of the posterior (1).
    caution_below : int
        Walls that reached the category below which the curve carries a caution.
    criterion_walls : int
        Walls beyond which every second, third ... is taken for Akaike's criterion.
    posterior_points : int
        Dispersions to either side of the estimate at which the posterior density is computed.
    posterior_drop : float
        Fall of the logarithm of that density from its maximum at which it ends (1).
    posterior_draws : int
        Draws from the posterior.
    one_step_groups : int
        Groups of equal walls beyond which a resample is fitted by one Newton step from the estimate.
    one_step_walls : int
        Walls drawn for such a step at most; its scatter is scaled by the root of their number.
    stored_draws : int
        Counts of groups in resamples that are kept in memory at a time.
    median_resamples : int
        Resamples for the error of a median (``median_movement``).
    curve_resamples : int
        Resamples for the error of a probability that is read from a curve (``exceedance``).
    empirical_bounds : int
        Distinct bounds of intervals beyond which the empirical curve rounds them to as many equal steps.
    empirical_tolerance : float
        Distance of the empirical curve's log-likelihood from its maximum, for each wall, at which iteration ends (1).
    empirical_iterations : int
        Iterations of the empirical curve.
    largest_count : int
        Resamples, and points of a curve, beyond which they are refused as a slip.
    goodness_walls : int
        Walls beyond which the fit is not judged: no form fits as closely as they can tell.
    """

    fewest_reached: Count = Field(default=3, ge=1)
    smallest_dispersion: Pure = Field(default=1e-4, gt=0)
    largest_dispersion: Pure = Field(default=20.0, gt=0)
    coarse_start_rows: Count = Field(default=50_000, ge=5)
    likelihood_rows: Count = Field(default=200_000, ge=1)
    posterior_below: Count = Field(default=100, ge=0)
    fewest_common: Count = Field(default=15, ge=0)
    fewest_common_walls: Count = Field(default=30, ge=0)
    fitted_share: Pure = Field(default=0.95, ge=0, le=1)
    caution_below: Count = Field(default=10, ge=0)
    criterion_walls: Count = Field(default=50_000, ge=2)
    posterior_points: Count = Field(default=60, ge=5)
    posterior_drop: Pure = Field(default=25.0, gt=0)
    posterior_draws: Count = Field(default=1500, ge=10)
    one_step_groups: Count = Field(default=2000, ge=1)
    one_step_walls: Count = Field(default=20_000, ge=10)
    stored_draws: Count = Field(default=4_000_000, ge=1)
    median_resamples: Count = Field(default=100, ge=2)
    curve_resamples: Count = Field(default=300, ge=2)
    empirical_bounds: Count = Field(default=1000, ge=2)
    empirical_tolerance: Pure = Field(default=1e-8, gt=0)
    empirical_iterations: Count = Field(default=2000, ge=1)
    largest_count: Count = Field(default=1_000_000, ge=2)
    goodness_walls: Count = Field(default=20_000, ge=0)

    def __repr__(self) -> str:
        """Options that differ from the defaults: signatures stay short."""
        values = ((field.name, getattr(self, field.name), getattr(type(self), field.name)) for field in fields(self))
        return (
            f"FragilityOptions({', '.join(f'{name}={value!r}' for name, value, default in values if value != default)})"
        )


DEFAULT = FragilityOptions()

RETIRED = ("fewest_resampled", "profile_directions")
"""Options of percentile and profile bands, which have no effect any more."""
