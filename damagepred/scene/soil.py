"""Soil under a footing: springs without tension."""

from __future__ import annotations

from pydantic import Field

from damagepred.scene.described import described
from damagepred.scene.movement_stage import Kind
from damagepred.scene.quantity import Pure, Stiffness


@described
class Soil:
    """Soil under the footing (``[soil]``), read with ``[movement] shape = "mound"``: Winkler springs without tension.

    Attributes
    ----------
    swelling_stiffness : float
        Pressure per displacement (Pa/m) of swelling soil, read in heave and in dishing, when the edges heave. AS
        2870-2011 has 100 / m times the mean pressure q on the soil, and at least 1000 kPa/m. (Secondary: manual of
        the design program CORD, FMG Engineering.) Under strip footings of masonry q is about 40 kPa: 4000 kPa/m. The
        least value is for a slab of about 10 kPa. Too small a value is unsafe: the footing sinks into the swelling
        soil, and the wall is bent less (``studies/soil_movement``).
    shrinking_stiffness : float
        Pressure per displacement of shrinking soil, read in settle and in doming, when the edges dry; 5000 kPa/m
        (assumed).
    shear_stiffness : float or None
        Shear stress per displacement along the wall (Pa/m). None: as the normal stiffness.
    friction : float
        tan(phi) (1) between footing and soil, without cohesion.

    Examples
    --------
    >>> from damagepred import Soil
    >>> Soil(swelling_stiffness="1 MPa/m").swelling_stiffness
    1000000.0
    """

    swelling_stiffness: Stiffness = Field(default=4.0e6, gt=0)
    shrinking_stiffness: Stiffness = Field(default=5.0e6, gt=0)
    shear_stiffness: Stiffness | None = Field(default=None, gt=0)
    friction: Pure = Field(default=0.5, ge=0)

    @staticmethod
    def stiffness_key(kind: Kind) -> str:
        """Key of the normal stiffness: swelling soil gets wet, shrinking soil dries."""
        return "swelling_stiffness" if kind in ("dishing", "heave") else "shrinking_stiffness"

    def stiffness(self, kind: Kind) -> float:
        """Normal stiffness (Pa/m)."""
        return float(getattr(self, self.stiffness_key(kind)))

    def stiffness_along(self, kind: Kind) -> float:
        """Shear stiffness (Pa/m), by default the normal stiffness."""
        return self.stiffness(kind) if self.shear_stiffness is None else self.shear_stiffness
