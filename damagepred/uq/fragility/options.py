"""Numbers that fits of fragility curves and their bands depend on, with their defaults."""

from __future__ import annotations

from dataclasses import fields

from pydantic import Field

from damagepred.scene.described import described
from damagepred.scene.quantity import Count, Pure


@described
class FragilityOptions:
    """Limits from which a kind of band is taken, and resolution of the posterior and of the profile likelihood.

    The limits are those at which intervals of 90 % hold the truth in 85 % of the cases of studies/coverage or more.

    Attributes
    ----------
    posterior_below : int
        Effective walls that reached the category below which quantiles of the posterior stand in for BCa.
    fewest_resampled : int
        Such walls below which there is no band by percentiles or profile likelihood.
    fewest_common : int
        Such walls of each category below which curves with a common dispersion have no band.
    fewest_common_walls : int
        Effective walls in all below which these have none; a limit on those above alone would pick unusual studies.
    fitted_share : float
        Share of the resamples that can be fitted below which the profile band is taken (1).
    caution_below : int
        Walls that reached the category below which the curve carries a caution.
    criterion_walls : int
        Walls beyond which every second, third ... is taken for Akaike's criterion.
    profile_directions : int
        Points on the contour of the likelihood.
    posterior_points : int
        Dispersions to either side of the estimate at which the posterior density is computed.
    posterior_drop : float
        Fall of the logarithm of that density from its maximum at which it ends (1).
    posterior_draws : int
        Draws from the posterior.
    """

    posterior_below: Count = Field(default=100, ge=0)
    fewest_resampled: Count = Field(default=30, ge=0)
    fewest_common: Count = Field(default=15, ge=0)
    fewest_common_walls: Count = Field(default=30, ge=0)
    fitted_share: Pure = Field(default=0.95, ge=0, le=1)
    caution_below: Count = Field(default=10, ge=0)
    criterion_walls: Count = Field(default=50_000, ge=2)
    profile_directions: Count = Field(default=128, ge=8)
    posterior_points: Count = Field(default=60, ge=5)
    posterior_drop: Pure = Field(default=25.0, gt=0)
    posterior_draws: Count = Field(default=1500, ge=10)

    def text(self) -> str:
        """Return all options in one line, for the attributes of a dataset."""
        return ", ".join(f"{field.name} = {getattr(self, field.name):g}" for field in fields(self))


DEFAULT = FragilityOptions()
