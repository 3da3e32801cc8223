"""Parameters of one joint, for tests that call the joint law itself."""

from typing import NamedTuple

import numpy as np

from damagepred.assembly.model import JointProperties
from damagepred.kernels.joint.parameters import JointParameters, joint_parameters

Strength = tuple[float, float, float]


class Bounds(NamedTuple):
    """Fields of ``TrescaBounds``, for laws that tests compile themselves."""

    bound: np.ndarray
    dilatant_opening: np.ndarray
    kappa: np.ndarray


def one_joint(
    k_n: float,
    k_s: float,
    strength: Strength,
    residual_strength: Strength,
    *,
    w_c: float = 0.0,
    slip_weight: float = 0.0,
    psi: float = 0.0,
    brittle: bool = False,
    cap: tuple[float, float] = (np.inf, 1.0),
    shape: float = 0.0,
) -> JointParameters:
    """Return parameters from f_t, C, tan(phi) of the intact joint and of one without bond, w_c, beta, f_c and C_ss."""
    s_c = (w_c - strength[0] / k_n) / slip_weight if slip_weight else 0.0
    values = (k_n, k_s, *strength, psi, *residual_strength, brittle, *cap, shape, w_c, s_c, 0.0)
    return JointParameters(*joint_parameters(JointProperties(*(np.array([value]) for value in values)))[0])
