"""Creep of the joints: stiffness after a long time, or a Maxwell branch beside a spring."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from damagepred.arrays import BoolArray, FloatArray

if TYPE_CHECKING:
    from damagepred.scene import Creep

Pair = tuple[FloatArray, FloatArray]  # along normal and tangent of each contact, arrays (m, q)


class JointCreep(NamedTuple):
    """Creep of the joints as a standard linear solid: a spring in series with a Kelvin unit."""

    # (m, 1) each: long-term displacement of the Kelvin units over the displacement of the springs (1). The
    # springs hold the elasticity of the blocks too, which do not creep.
    coefficients: Pair
    stiffness: Pair  # (m, 1) each: springs (Pa/m)
    retardation_time: float  # Kelvin units (years): relaxation time times 1 + creep coefficient
    relaxation_time: float  # joint between stiff blocks (years)

    @classmethod
    def of(cls, creep: Creep | None, mortar: BoolArray, joints: Pair, lumped: Pair) -> JointCreep | None:
        """Creep over time of the mortar (m,), from stiffnesses (m,) of joints alone and in series with blocks."""
        if creep is None or creep.relaxation_time is None:
            return None
        phi = np.where(mortar, creep.coefficient, 0.0)
        normal, shear = ((phi * k / k_alone)[:, None] for k, k_alone in zip(lumped, joints))
        time = creep.relaxation_time
        springs = lumped[0][:, None], lumped[1][:, None]
        return cls((normal, shear), springs, time * (1.0 + creep.coefficient), time)

    def ahead(self, start: Pair, stresses: Pair, years: float) -> Pair:
        """Displacement of the Kelvin units (m) after a step of some years at constant opening and slip."""
        normal, shear = (units.at_rest() for units in self._units(start, stresses, years))
        return normal, shear

    def after(self, start: Pair, stresses: Pair, stresses_after: Pair, years: float) -> Pair:
        """Displacement of the Kelvin units (m) after a step, by the stresses (Pa) at both of its ends.

        Spring and unit together move by w = stress / k + d, which is taken as linear in the step. The equation
        t_r d' = phi w - (1 + phi) d of the unit then has the solution ::

            d_1 = d_0 e^-x + phi / (1 + phi) (w_0 (1 - e^-x) + (w_1 - w_0) (1 - (1 - e^-x) / x)),  x = t (1 + phi) / t_r

        With w_1 = stress_1 / k + d_1 it is a linear equation in d_1 (recursion for a standard linear solid; Taylor,
        Pister and Goudreau 1970; Simo and Hughes 1998, ch. 10). It is exact at constant w, otherwise of second order.
        """
        units = self._units(start, stresses, years)
        normal, shear = (unit.with_stress(stress) for unit, stress in zip(units, stresses_after))
        return normal, shear

    def _units(self, start: Pair, stresses: Pair, years: float) -> list[_KelvinUnits]:
        """Kelvin units along normal and tangent in a step."""
        return [
            _KelvinUnits(d, stress / stiffness + d, stiffness, phi, years * (1.0 + phi) / self.retardation_time)
            for d, stress, stiffness, phi in zip(start, stresses, self.stiffness, self.coefficients)
        ]


class _KelvinUnits(NamedTuple):
    """Kelvin units in a step: d at its start, w with the springs (m), stiffness of the springs, phi and x."""

    start: FloatArray
    moved: FloatArray
    stiffness: FloatArray
    phi: FloatArray
    duration: FloatArray

    def at_rest(self) -> FloatArray:
        """Displacement at the end of the step, at constant w (m)."""
        final = self.phi / (1.0 + self.phi) * self.moved
        return self.start - np.expm1(-self.duration) * (final - self.start)

    def with_stress(self, stress: FloatArray) -> FloatArray:
        """Displacement at the end of the step (m), where w goes on linearly to a stress (Pa)."""
        late = self.phi / (1.0 + self.phi) * (1.0 + np.expm1(-self.duration) / self.duration)
        return (self.at_rest() + late * (stress / self.stiffness - self.moved)) / (1.0 - late)
