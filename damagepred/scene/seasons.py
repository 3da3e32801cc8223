"""Movement of reactive clay over years: trend, seasonal swing, and steps such as a leak or a tree."""

from __future__ import annotations

import numpy as np
from pydantic import Field, model_validator

from damagepred.arrays import FloatArray
from damagepred.scene.described import described
from damagepred.scene.quantity import Count, Length, Pure, Years


@described
class SeasonStep:
    """Lasting change of the ground, as by a leak or a tree (``[[movement.seasons.step]]``).

    Examples
    --------
    >>> from damagepred import scene
    >>> leak = scene.SeasonStep(year=12, movement="15 mm", end=14, probability=0.2)
    >>> leak.movement
    0.015
    """

    year: Years = Field(ge=0)
    """Start (years)."""
    movement: Length
    """Size (m); positive on the side of ``movement.kind``."""
    rise: Years = Field(default=1.0, ge=0)
    """Duration of the rise to its size (years)."""
    end: Years | None = Field(default=None, gt=0)
    """End (years), such as the repair of a leak. None: no end."""
    probability: Pure = Field(default=1.0, ge=0, le=1)
    """Share of the samples of a study with this step."""


@described
class Seasons:
    """Movement history of some years, two stages a year (``[movement.seasons]``).

    The movement at the end of half year k, at time t = k / 2 years, is ::

        trend t / years + shift b_j +- (swing / 2) max(1 + swing_cov a_j, 0) + steps

    with + in the first half of a year and - in the second. The yearly numbers a_j and b_j are standard normal and
    correlated from year to year (autoregressive process of first order). They follow from ``seed``; in a study each
    sample has its own seed, from the study's.

    Examples
    --------
    >>> from damagepred import scene
    >>> movement = scene.Movement(seasons=scene.Seasons(years=2, swing="10 mm", swing_cov=0))
    >>> [(stage.kind, stage.central_deflection, stage.time) for stage in movement.stage][:2]
    [('dishing', 0.005, 0.5), ('doming', 0.005, 1.0)]
    """

    years: Count = Field(default=30, ge=1, le=200)
    """Number of years."""
    trend: Length = 0.0
    """Change of the mean over all years (m); positive on the side of ``movement.kind``."""
    swing: Length = Field(default=10e-3, ge=0)
    """Mean movement from the wettest to the driest state of a year (m). A soil log determines it."""
    swing_share: Pure = Field(default=0.6, ge=0)
    """With ``[[soil_layer]]``: mean swing over the surface movement y_s of the log (1). Assumed: 0.6; the widest swing
    of thirty years, with ``swing_cov`` of 0.3, is then y_s on average."""
    swing_cov: Pure = Field(default=0.3, ge=0)
    """Coefficient of variation of the swing from year to year. Assumed."""
    shift: Length = Field(default=0.0, ge=0)
    """Standard deviation of the mean movement of a year (m): wet years and dry years."""
    correlation: Pure = Field(default=0.3, ge=0, lt=1)
    """Correlation of a year with the one before. Assumed."""
    increments: Count = Field(default=4, ge=1)
    """Increments of each half year."""
    step: tuple[SeasonStep, ...] = ()
    """Lasting changes."""
    seed: Count = Field(default=1, ge=0)
    """Seed of the random numbers."""

    @model_validator(mode="after")
    def _something_moves(self) -> Seasons:
        if not np.any(self.movements()):
            raise ValueError("nothing moves: give a trend, a swing or a step")
        return self

    @property
    def times(self) -> FloatArray:
        """Ends of the half years (years)."""
        return np.arange(1, 2 * self.years + 1) / 2.0

    def movements(self) -> FloatArray:
        """Movement at the end of each half year (m), positive on the side of ``movement.kind``.

        Examples
        --------
        >>> from damagepred import scene
        >>> (1e3 * scene.Seasons(years=1, swing="10 mm", swing_cov=0, trend="4 mm").movements()).tolist()
        [7.0, -1.0]
        """
        of_swing, of_mean, of_steps = map(np.random.default_rng, np.random.SeedSequence(self.seed).spawn(3))
        size = np.maximum(1.0 + self.swing_cov * self._yearly(of_swing), 0.0)
        movement = self.trend * self.times / self.years + np.repeat(self.shift * self._yearly(of_mean), 2)
        movement += 0.5 * self.swing * np.repeat(size, 2) * np.tile([1.0, -1.0], self.years)
        for step, drawn in zip(self.step, of_steps.random(len(self.step))):
            since, active = self.times - step.year, self.times >= step.year
            grown = np.minimum(since / step.rise, 1.0) if step.rise else 1.0
            active &= self.times < (np.inf if step.end is None else step.end)
            movement += (drawn < step.probability) * step.movement * np.where(active, grown, 0.0)
        return movement

    def _yearly(self, generator: np.random.Generator) -> FloatArray:
        """Stationary autoregressive process of first order, of variance 1, one value per year."""
        values = generator.standard_normal(self.years)
        for j in range(1, self.years):
            values[j] = self.correlation * values[j - 1] + np.sqrt(1.0 - self.correlation**2) * values[j]
        return values
