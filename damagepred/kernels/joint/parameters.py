"""Parameters of the joint law: one record of one joint for the explicit, the quasi-static and the dynamic solver."""

from typing import NamedTuple

from numpy import maximum

from damagepred.kernels.jit import law
from damagepred.kernels.joint.softening import TINY


class JointParameters(NamedTuple):
    """Parameters of one joint, or arrays (m,) of several, with derived values that the law needs again and again.

    A kernel may also hand the laws a record with fields of these names.

    Attributes
    ----------
    normal_stiffness, shear_stiffness, shear_compliance : float
        k_n, k_s (Pa/m) and 1 / k_s (m/Pa).
    tensile_strength, cohesion, friction, slip_compliance : float
        f_t, C (Pa), tan(phi) (1) of the intact joint, and its slip for a unit of shear stress beyond the limit (m/Pa).
    residual_tensile_strength, residual_cohesion, residual_friction, residual_slip_compliance : float
        The same of a joint without bond.
    critical_opening, damage_rate : float
        w_c (m), 0 of a brittle bond, and damage for each unit of kappa beyond kappa_0, 1 / (w_c - kappa_0) (1/m).
    slip_weight : float
        beta of mixed-mode softening (1), 0 where slip leaves the bond as it is. Such a joint does not dilate.
    dilation : float
        tan(psi) (1).
    brittle_shear : bool
        Whether the first slip breaks the bond.
    compressive_strength, elastic_closing, cap_compliance : float
        f_c (Pa), f_c / k_n (m), both infinite without cap, and 1 / C_ss (1). A joint with a cap does not dilate.
    gap : float
        How far an interface without bond closes before it is pressed (m).
    """

    normal_stiffness: float
    shear_stiffness: float
    shear_compliance: float
    tensile_strength: float
    cohesion: float
    friction: float
    slip_compliance: float
    residual_tensile_strength: float
    residual_cohesion: float
    residual_friction: float
    residual_slip_compliance: float
    critical_opening: float
    damage_rate: float
    slip_weight: float
    dilation: float
    brittle_shear: bool
    compressive_strength: float
    elastic_closing: float
    cap_compliance: float
    gap: float


def joint_parameters(properties):
    """Return the parameters of all joints, arrays (m,), from ``damagepred.assembly.model.JointProperties``."""
    k_n, k_s, psi = properties.normal_stiffness, properties.shear_stiffness, properties.dilation
    w_c, s_c = properties.critical_opening, properties.critical_slip
    softening_range = maximum(w_c - properties.tensile_strength / k_n, TINY)
    return JointParameters(
        k_n,
        k_s,
        1.0 / k_s,
        properties.tensile_strength,
        properties.cohesion,
        properties.friction,
        1.0 / (k_s + k_n * properties.friction * psi),
        properties.residual_tensile_strength,
        properties.residual_cohesion,
        properties.residual_friction,
        1.0 / (k_s + k_n * properties.residual_friction * psi),
        w_c,
        1.0 / softening_range,
        (s_c > 0.0) * softening_range / maximum(s_c, TINY),
        psi,
        properties.brittle_shear,
        properties.compressive_strength,
        properties.compressive_strength / k_n,
        1.0 / properties.cap_shear,
        properties.gap,
    )


@law
def of_interface(parameters, i):
    """Return the parameters of the joint of interface i.

    Parameters
    ----------
    parameters : JointParameters or record of arrays
        Of several joints.
    i : int
        Which of them.
    """
    return JointParameters(
        parameters.normal_stiffness[i],
        parameters.shear_stiffness[i],
        parameters.shear_compliance[i],
        parameters.tensile_strength[i],
        parameters.cohesion[i],
        parameters.friction[i],
        parameters.slip_compliance[i],
        parameters.residual_tensile_strength[i],
        parameters.residual_cohesion[i],
        parameters.residual_friction[i],
        parameters.residual_slip_compliance[i],
        parameters.critical_opening[i],
        parameters.damage_rate[i],
        parameters.slip_weight[i],
        parameters.dilation[i],
        parameters.brittle_shear[i],
        parameters.compressive_strength[i],
        parameters.elastic_closing[i],
        parameters.cap_compliance[i],
        parameters.gap[i],
    )
