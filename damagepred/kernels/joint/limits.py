"""Limits of the shear stress of a joint: Coulomb, and the elliptic compression cap of Lourenco and Rots (1997)."""

import numpy as np
from numpy import sqrt

from damagepred.kernels.jit import law

NO_LIMIT = 1e30
"""Shear stress that no joint reaches (Pa)."""


@law
def capped(limit, sigma, strongest, compliance):
    """Return the smaller of a limit of the shear stress and that of the cap, sqrt((f_c^2 - sigma^2) / C_ss) (Pa).

    Parameters
    ----------
    limit, sigma : float
        Limit of the shear stress, and normal stress (Pa).
    strongest, compliance : float
        f_c (Pa) and 1 / C_ss.
    """
    pressed = sigma if sigma < 0.0 else 0.0
    squared = (strongest - pressed) * (strongest + pressed)
    ellipse = sqrt((squared if squared > 0.0 else 0.0) * compliance)
    return ellipse if ellipse < limit else limit


@law
def slip_compliance(k_n, k_s, friction, psi):
    """Return the plastic slip for each unit of shear stress beyond the limit (m/Pa).

    Parameters
    ----------
    k_n, k_s : float
        Stiffness (Pa/m).
    friction, psi : float
        tan(phi) and tan(psi) (1).
    """
    return 1.0 / (k_s + k_n * friction * psi)


@law
def shear_limit(properties, i, cracked, integrity, sigma, sigma_e, damage_e, is_open, options):
    """Return the shear limit L (Pa), and -dL/de, its decrease with the opening (Pa/m).

    L may be negative beyond the apex of the friction cone.

    Parameters
    ----------
    properties, i
        Of the joints, and the interface.
    cracked : bool
        Whether the bond is broken or softens.
    integrity, sigma : float
        b (1), and normal stress (Pa).
    sigma_e, damage_e : float
        Derivatives of sigma (Pa/m) and b (1/m) with the opening e.
    is_open : bool
        Whether the contact is open and without bond.
    options : ReturnMapping
        See ``damagepred.kernels.joint.return_mapping``.
    """
    if cracked and is_open:
        return 0.0, 0.0
    if not cracked:
        limit, decrease = properties.cohesion[i] - sigma * properties.friction[i], properties.friction[i] * sigma_e
    else:
        cohesion, friction = properties.residual_cohesion[i], properties.residual_friction[i]
        more_cohesion, more_friction = properties.cohesion[i] - cohesion, properties.friction[i] - friction
        cohesion, friction = cohesion + integrity * more_cohesion, friction + integrity * more_friction
        limit = cohesion - sigma * friction
        decrease = friction * sigma_e - damage_e * (more_cohesion - sigma * more_friction)
    if properties.brittle_shear[i] and integrity > 0.0:
        limit, decrease = NO_LIMIT, 0.0  # the bond breaks there, and does not slide
    strongest = properties.compressive_strength[i]
    if strongest < np.inf:
        ellipse = capped(NO_LIMIT, sigma, strongest, 1.0 / properties.cap_shear[i])
        if ellipse < limit:
            return ellipse, -cap_slope(properties, i, ellipse, sigma, sigma_e, options)
    return limit, decrease


@law
def cap_slope(properties, i, ellipse, sigma, sigma_e, options):
    """Return the derivative of the cap's shear limit with the opening (Pa/m), bounded at the tip of the ellipse.

    Parameters
    ----------
    properties, i, sigma, sigma_e, options
        As ``shear_limit``.
    ellipse : float
        Shear limit of the cap (Pa).
    """
    least = options.cap_slope_ratio * properties.compressive_strength[i]
    return -min(sigma, 0.0) * sigma_e / (properties.cap_shear[i] * max(ellipse, least))
