"""Slow strains of the bricks: growth, shrinkage, temperature."""

from __future__ import annotations

from pydantic import Field

from damagepred.scene.described import described
from damagepred.scene.quantity import Pure


@described
class Strain:
    """Strain that bricks would have if nothing held them, at the end of the movement (``[strain]``).

    It grows in proportion to the movement, from nothing under the dead load. Bricks expand in all directions alike, and
    the footing does not. Where joints, ground and footing hold them, stresses come of it.

    Attributes
    ----------
    growth : float
        Growth of clay bricks with moisture (1), such as ``"0.7 mm/m"``: mostly 0.5 to 1.0 mm/m over 15 years
        (secondary, ``data/statistics/masonry.toml``). Shrinkage of concrete and calcium silicate bricks is negative.
    temperature_change : float
        Warmer by so many kelvin than when the wall was built.
    thermal_expansion : float
        Strain per kelvin (1). Clay brickwork: 8e-6 (secondary).

    Examples
    --------
    >>> from damagepred import scene
    >>> round(scene.Strain(growth="0.7 mm/m", temperature_change=-20).total, 7)
    0.00054
    """

    growth: Pure = Field(default=0.0, ge=-0.01, le=0.01)
    temperature_change: Pure = Field(default=0.0, ge=-100.0, le=100.0)
    thermal_expansion: Pure = Field(default=8e-6, ge=0.0, le=1e-4)

    @property
    def total(self) -> float:
        """All of it together (1)."""
        return self.growth + self.thermal_expansion * self.temperature_change
