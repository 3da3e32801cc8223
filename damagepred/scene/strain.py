"""Slow strains: growth, shrinkage and temperature of the bricks, creep of the joints."""

from __future__ import annotations

from typing import Literal

import numpy as np
from pydantic import Field

from damagepred.arrays import FloatArray
from damagepred.scene.described import described
from damagepred.scene.quantity import Pure, Years


@described
class Strain:
    """Free strain of the bricks (``[strain]``).

    Under one movement it grows in proportion to it, from 0 under the dead load. In a history of stages with times it is
    a function of the time t (years) ::

        growth g(t) / g(growth_years) + thermal_expansion T(t)

    The course of growth g(t) is ln(1 + t / growth_time) or 1 - exp(-t / growth_time). The temperature is ::

        T(t) = temperature_change t / t_end + (temperature_swing / 2) (cos 2 pi (t - warmest) - cos 2 pi warmest)

    The expansion is isotropic, and the footing does not expand. Restraint by joints, ground and footing causes
    stresses.

    Examples
    --------
    >>> from damagepred import scene
    >>> round(scene.Strain(growth="0.7 mm/m", temperature_change=-20).total, 7)
    0.00054
    """

    growth: Pure = Field(default=0.0, ge=-0.01, le=0.01)
    """Growth of clay bricks with moisture (1), such as ``"0.7 mm/m"``: mostly 0.5 to 1.0 mm/m over 15 years (secondary,
    ``data/statistics/masonry.toml``). Shrinkage of concrete and calcium silicate bricks is negative."""
    growth_law: Literal["logarithmic", "exponential"] = "logarithmic"
    """Course of the growth in a history. Assumed: fired clay grows with the logarithm of time, shrinkage has a
    limit."""
    growth_years: Years = Field(default=15.0, gt=0)
    """Time of the given growth in a history (years). Secondary: 15."""
    growth_time: Years = Field(default=1.0, gt=0)
    """Time constant of the growth in a history (years). Assumed."""
    temperature_change: Pure = Field(default=0.0, ge=-100.0, le=100.0)
    """Rise of temperature since the wall was built (K); in a history at its end."""
    temperature_swing: Pure = Field(default=0.0, ge=0.0, le=100.0)
    """Difference of the warmest and the coldest day of a year (K), in a history."""
    warmest: Years = Field(default=0.5, ge=0, le=1)
    """Time of the warmest day (years after the dead load, 0 to 1), in a history. Assumed."""
    thermal_expansion: Pure = Field(default=8e-6, ge=0.0, le=1e-4)
    """Strain per kelvin (1). Clay brickwork: 8e-6 (secondary)."""

    @property
    def total(self) -> float:
        """Total strain at the end of one movement (1)."""
        return self.growth + self.thermal_expansion * self.temperature_change

    def over(self, time: FloatArray) -> FloatArray:
        """Strain (1) at the times of a history (years since the dead load, to its end); 0 at time 0."""

        def course(t: FloatArray | float) -> FloatArray:
            share = np.asarray(t) / self.growth_time
            return np.log1p(share) if self.growth_law == "logarithmic" else -np.expm1(-share)

        swing = 0.5 * self.temperature_swing
        season = np.cos(2.0 * np.pi * (time - self.warmest)) - np.cos(2.0 * np.pi * self.warmest)
        temperature = self.temperature_change * time / time[-1] + swing * season
        return self.growth * course(time) / course(self.growth_years) + self.thermal_expansion * temperature


@described
class Creep:
    """Creep of the mortar joints (``[creep]``): in beds and heads, on a dpc and on the footing.

    Without ``relaxation_time`` the joints have their long-term stiffness from the start: k / (1 + coefficient). With it
    a joint is a spring of this stiffness parallel to a Maxwell branch (standard linear solid). It is stiff under fast
    movements, and its stress at constant opening decays with e^(-t / relaxation_time). Cracks, slip and friction follow
    the remaining stress.

    Examples
    --------
    >>> from damagepred import scene
    >>> scene.Creep(coefficient=1.0, relaxation_time="18 months").relaxation_time
    1.5
    """

    coefficient: Pure = Field(default=1.0, ge=0.0, le=20.0)
    """Creep strain over elastic strain after a long time (1). Joints of clay bricks 0.5 to 1.5, of calcium silicate
    bricks 1 to 2 (assumed, ``data/statistics/masonry.toml``)."""
    relaxation_time: Years | None = Field(default=None, gt=0)
    """Relaxation time of the Maxwell branch (years). Needs a history with times."""
