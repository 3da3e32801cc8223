"""Creep of the joints: stiffness after a long time, or a Maxwell branch beside a spring."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from damagepred.arrays import BoolArray, FloatArray

if TYPE_CHECKING:
    from damagepred.assembly.model import JointProperties
    from damagepred.scene import Creep

Pair = tuple[FloatArray, FloatArray]
"""Along normal and tangent of each contact, arrays (m, q)."""


class JointCreep(NamedTuple):
    """Creep of the joints as a standard linear solid: a spring in series with a Kelvin unit.

    Attributes
    ----------
    coefficients : (array (m, 1), array (m, 1))
        Displacement of the Kelvin units after a long time over that of the springs, along normal and tangent (1); 0
        where nothing creeps. Springs hold the elasticity of the blocks, too, which do not creep.
    stiffness : (array (m, 1), array (m, 1))
        Of the springs (Pa/m).
    retardation_time : float
        Of the Kelvin units (years): the relaxation time of a joint times 1 + its creep coefficient.
    relaxation_time : float
        Of a joint between stiff blocks (years).
    """

    coefficients: Pair
    stiffness: Pair
    retardation_time: float
    relaxation_time: float

    @classmethod
    def of(
        cls, creep: Creep | None, mortar: BoolArray, joints: JointProperties, lumped: JointProperties
    ) -> JointCreep | None:
        """Return the creep of the joints over time; None without a relaxation time.

        Parameters
        ----------
        creep : Creep or None
            Of the scene.
        mortar : array of bool (m,)
            Interfaces that creep.
        joints, lumped : JointProperties
            Joints alone, and with the elasticity of the blocks in series.
        """
        if creep is None or creep.relaxation_time is None:
            return None
        phi = np.where(mortar, creep.coefficient, 0.0)
        names = ("normal_stiffness", "shear_stiffness")
        own, whole = ([getattr(law, name) for name in names] for law in (joints, lumped))
        normal, shear = ((phi * k / k_own)[:, None] for k, k_own in zip(whole, own))
        time = creep.relaxation_time
        springs = whole[0][:, None], whole[1][:, None]
        return cls((normal, shear), springs, time * (1.0 + creep.coefficient), time)

    def ahead(self, start: Pair, stresses: Pair, years: float) -> Pair:
        """Return the displacement of the Kelvin units after a step at constant opening and slip (m).

        Parameters
        ----------
        start : (array (m, q), array (m, q))
            Displacement of the units at the start (m).
        stresses : (array (m, q), array (m, q))
            Normal and shear stress there (Pa).
        years : float
            Duration.
        """
        normal, shear = (units.at_rest() for units in self._units(start, stresses, years))
        return normal, shear

    def after(self, start: Pair, stresses: Pair, stresses_after: Pair, years: float) -> Pair:
        """Return the displacement of the Kelvin units after a step, by the stresses at both of its ends (m).

        Spring and unit together move by w = stress / k + d, which is taken as linear in the step. The equation
        t_r d' = phi w - (1 + phi) d of the unit then has the solution ::

            d_1 = d_0 e^-x + phi / (1 + phi) (w_0 (1 - e^-x) + (w_1 - w_0) (1 - (1 - e^-x) / x)),  x = t (1 + phi) / t_r

        With w_1 = stress_1 / k + d_1 it is a linear equation in d_1 (recursion for a standard linear solid; Taylor,
        Pister and Goudreau 1970; Simo and Hughes 1998, ch. 10). It is exact at constant w, and of second order else.

        Parameters
        ----------
        start : (array (m, q), array (m, q))
            Displacement of the units at the start (m).
        stresses, stresses_after : (array (m, q), array (m, q))
            Normal and shear stress at the start and at the end (Pa).
        years : float
            Duration.
        """
        units = self._units(start, stresses, years)
        normal, shear = (one.with_stress(stress) for one, stress in zip(units, stresses_after))
        return normal, shear

    def _units(self, start: Pair, stresses: Pair, years: float) -> list[_KelvinUnits]:
        """Return the Kelvin units along normal and tangent in a step."""
        return [
            _KelvinUnits(d, stress / stiffness + d, stiffness, phi, years * (1.0 + phi) / self.retardation_time)
            for d, stress, stiffness, phi in zip(start, stresses, self.stiffness, self.coefficients)
        ]


class _KelvinUnits(NamedTuple):
    """Kelvin units in a step: displacement d at its start, w with their springs (m), stiffness of these, phi and x."""

    start: FloatArray
    moved: FloatArray
    stiffness: FloatArray
    phi: FloatArray
    duration: FloatArray

    def at_rest(self) -> FloatArray:
        """Return their displacement at the end, at constant w (m)."""
        final = self.phi / (1.0 + self.phi) * self.moved
        return self.start - np.expm1(-self.duration) * (final - self.start)

    def with_stress(self, stress: FloatArray) -> FloatArray:
        """Return their displacement at the end, where w has gone on linearly to a stress (Pa)."""
        late = self.phi / (1.0 + self.phi) * (1.0 + np.expm1(-self.duration) / self.duration)
        return (self.at_rest() + late * (stress / self.stiffness - self.moved)) / (1.0 - late)
