"""Parameters of the joint law: one record of one joint for the explicit, the quasi-static and the dynamic solver."""

from typing import NamedTuple

import numpy as np

from damagepred.kernels.jit import law
from damagepred.kernels.joint.softening import TINY, mean_integrity


class JointParameters(NamedTuple):
    """Parameters of one joint, with derived values; laws accept this tuple or a record with the same fields."""

    # k_n, k_s (Pa/m) and 1 / k_s (m/Pa)
    normal_stiffness: float
    shear_stiffness: float
    shear_compliance: float
    # f_t, C (Pa), tan(phi) (1) of the intact joint, and its slip per shear stress beyond the limit (m/Pa)
    tensile_strength: float
    cohesion: float
    friction: float
    slip_compliance: float
    # the same values of a joint without bond
    residual_tensile_strength: float
    residual_cohesion: float
    residual_friction: float
    residual_slip_compliance: float
    # w_c (m), 0 for a brittle bond, and 1 / (w_c - kappa_0) (1/m)
    critical_opening: float
    damage_rate: float
    softening_shape: float  # a of the softening curve (1), 0 if it is linear
    # beta of mixed-mode softening (1), 0 where slip does not weaken the bond; a joint with beta > 0 does not dilate
    slip_weight: float
    dilation: float  # tan(psi) (1)
    brittle_shear: bool  # whether the first slip breaks the bond
    # f_c (Pa), infinite without cap, and 1 / C_ss (1); a joint with a cap does not dilate
    compressive_strength: float
    cap_compliance: float
    gap: float  # closing of an interface without bond before it is pressed (m)


JOINT_PARAMETERS = np.dtype(
    [(name, np.bool_ if kind is bool else np.float64) for name, kind in JointParameters.__annotations__.items()],
    align=True,
)
"""Record type of the joints: a kernel receives one array instead of one per parameter."""


def joint_parameters(properties):
    """Parameters of all joints, records (m,), from ``damagepred.assembly.model.JointProperties``."""
    k_n, k_s, psi = properties.normal_stiffness, properties.shear_stiffness, properties.dilation
    w_c, s_c = properties.critical_opening, properties.critical_slip
    kappa_0 = properties.tensile_strength / k_n
    linear_range = np.maximum(w_c - kappa_0, TINY)
    # a curve has another range than a line of the same fracture energy
    softening_range = linear_range / (2.0 * mean_integrity(properties.softening_shape))
    derived = {
        "shear_compliance": 1.0 / k_s,
        "slip_compliance": 1.0 / (k_s + k_n * properties.friction * psi),
        "residual_slip_compliance": 1.0 / (k_s + k_n * properties.residual_friction * psi),
        "critical_opening": np.where((w_c > 0.0) & (properties.softening_shape > 0.0), kappa_0 + softening_range, w_c),
        "damage_rate": 1.0 / softening_range,
        "slip_weight": (s_c > 0.0) * linear_range / np.maximum(s_c, TINY),
        "cap_compliance": 1.0 / properties.cap_shear,
    }
    joints = np.empty(len(k_n), JOINT_PARAMETERS)
    for name in JointParameters._fields:
        joints[name] = derived[name] if name in derived else getattr(properties, name)
    return joints


@law
def of_lane(tile, i):
    """Parameters of the joint in a lane of a tile."""
    return JointParameters(
        tile.normal_stiffness[i],
        tile.shear_stiffness[i],
        tile.shear_compliance[i],
        tile.tensile_strength[i],
        tile.cohesion[i],
        tile.friction[i],
        tile.slip_compliance[i],
        tile.residual_tensile_strength[i],
        tile.residual_cohesion[i],
        tile.residual_friction[i],
        tile.residual_slip_compliance[i],
        tile.critical_opening[i],
        tile.damage_rate[i],
        tile.softening_shape[i],
        tile.slip_weight[i],
        tile.dilation[i],
        tile.brittle_shear[i],
        tile.compressive_strength[i],
        tile.cap_compliance[i],
        tile.gap[i],
    )
