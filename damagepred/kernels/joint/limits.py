"""Limits of the stresses of a joint: Coulomb, and the elliptic compression cap of Lourenco and Rots (1997)."""

import numpy as np
from numpy import sqrt

from damagepred.kernels.jit import law
from damagepred.kernels.joint.softening import degraded

NO_LIMIT = 1e30
"""Shear stress that no joint reaches (Pa)."""


@law
def coulomb_limit(cohesion, friction, sigma):
    """Return the shear limit of Coulomb, C - sigma tan(phi) (Pa), negative beyond the apex of the cone.

    Parameters
    ----------
    cohesion, friction, sigma : float
        C (Pa), tan(phi) (1), and normal stress (Pa).
    """
    return cohesion - sigma * friction


@law
def capped(limit, sigma, parameters):
    """Return the smaller of a limit of the shear stress and that of the cap, sqrt((f_c^2 - sigma^2) / C_ss) (Pa).

    Parameters
    ----------
    limit, sigma : float
        Limit of the shear stress, and normal stress (Pa).
    parameters : JointParameters
        Of the joint.
    """
    strongest, pressed = parameters.compressive_strength, sigma if sigma < 0.0 else 0.0
    squared = (strongest - pressed) * (strongest + pressed)
    ellipse = sqrt((squared if squared > 0.0 else 0.0) * parameters.cap_compliance)
    return ellipse if ellipse < limit else limit


@law
def cut_off_compression(parameters, sigma, sigma_e, options):
    """Return a normal stress, not below -f_c (Pa), and its derivative with the opening, 0 there (Pa/m).

    Parameters
    ----------
    parameters : JointParameters
        Of the joint.
    sigma, sigma_e : float
        Normal stress and its derivative without the cap.
    options : ReturnMapping
        See ``damagepred.kernels.joint.return_mapping``.
    """
    strongest = parameters.compressive_strength
    if sigma <= -strongest * (1.0 - options.yield_tolerance):
        return max(sigma, -strongest), 0.0
    return sigma, sigma_e


@law
def shear_limit(parameters, cracked, integrity, sigma, sigma_e, damage_e, options):
    """Return the shear limit L (Pa), and -dL/de, its decrease with the opening (Pa/m).

    L may be negative beyond the apex of the friction cone.

    Parameters
    ----------
    parameters : JointParameters
        Of the joint.
    cracked : bool
        Whether the bond is broken or softens.
    integrity, sigma : float
        b (1), and normal stress (Pa).
    sigma_e, damage_e : float
        Derivatives of sigma (Pa/m) and b (1/m) with the opening e.
    options : ReturnMapping
        See ``damagepred.kernels.joint.return_mapping``.
    """
    p = parameters
    cohesion, friction, damaging = p.cohesion, p.friction, 0.0
    if cracked:
        cohesion = degraded(integrity, p.cohesion, p.residual_cohesion)
        friction = degraded(integrity, p.friction, p.residual_friction)
        damaging = damage_e * coulomb_limit(p.cohesion - p.residual_cohesion, p.friction - p.residual_friction, sigma)
    limit, decrease = coulomb_limit(cohesion, friction, sigma), friction * sigma_e - damaging
    if p.brittle_shear and integrity > 0.0:
        limit, decrease = NO_LIMIT, 0.0  # the bond breaks there, and does not slide
    if p.compressive_strength < np.inf:
        ellipse = capped(NO_LIMIT, sigma, p)
        if ellipse < limit:
            return ellipse, -cap_slope(p, ellipse, sigma, sigma_e, options)
    return limit, decrease


@law
def cap_slope(parameters, ellipse, sigma, sigma_e, options):
    """Return the derivative of the cap's shear limit with the opening (Pa/m), bounded at the tip of the ellipse.

    Parameters
    ----------
    parameters, sigma, sigma_e, options
        As ``shear_limit``.
    ellipse : float
        Shear limit of the cap (Pa).
    """
    least = options.cap_slope_ratio * parameters.compressive_strength
    return -min(sigma, 0.0) * sigma_e * parameters.cap_compliance / max(ellipse, least)
