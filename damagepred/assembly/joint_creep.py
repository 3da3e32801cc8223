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

    def viscous_displacement(self, start: Pair, stresses: Pair, years: float) -> Pair:
        """Return the displacement of the Kelvin units after some years at constant opening and slip (m).

        The stress then decays exponentially, and the viscous displacement d approaches phi / (1 + phi) times that of
        spring and unit together, with the retardation time t_r (exponential algorithm for a standard linear solid;
        Taylor, Pister and Goudreau 1970; Simo and Hughes 1998, ch. 10) ::

            d += (1 - e^(-t (1 + phi) / t_r)) (phi / (1 + phi) (stress / k + d) - d)

        Parameters
        ----------
        start : (array (m, q), array (m, q))
            Displacement of the units at the start (m).
        stresses : (array (m, q), array (m, q))
            Normal and shear stress there (Pa).
        years : float
            Duration.
        """

        def after(d: FloatArray, stress: FloatArray, phi: FloatArray, stiffness: FloatArray) -> FloatArray:
            approach = -np.expm1(-years * (1.0 + phi) / self.retardation_time)
            return np.asarray(d + approach * (phi / (1.0 + phi) * (stress / stiffness + d) - d))

        normal, shear = (after(*of) for of in zip(start, stresses, self.coefficients, self.stiffness))
        return normal, shear
