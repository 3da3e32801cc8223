"""Limits of the stresses of a joint: Coulomb, and the elliptic compression cap of Lourenco and Rots (1997)."""

import numpy as np
from numpy import sqrt

from damagepred.kernels.jit import law
from damagepred.kernels.joint.softening import degraded

NO_LIMIT = 1e30
"""Shear stress that no joint reaches (Pa)."""
YIELD_TOLERANCE = 1e-9
"""Distance from a limit, over the limit, within which a contact counts as yielding (1)."""
CAP_SLOPE_RATIO = 1e-3
"""Shear limit over f_c below which the slope of the cap, infinite at its tip, is bounded (1)."""


@law
def coulomb_limit(cohesion, friction, sigma):
    """Shear limit of Coulomb, C - sigma tan(phi) (Pa), negative beyond the apex of the cone."""
    return cohesion - sigma * friction


@law
def capped(limit, sigma, parameters):
    """Shear limit with the elliptic cap: at most sqrt((f_c^2 - sigma^2) / C_ss) (Pa)."""
    strongest, pressed = parameters.compressive_strength, sigma if sigma < 0.0 else 0.0
    squared = (strongest - pressed) * (strongest + pressed)
    ellipse = sqrt((squared if squared > 0.0 else 0.0) * parameters.cap_compliance)
    return ellipse if ellipse < limit else limit


@law
def cut_off_compression(parameters, sigma, sigma_e):
    """Normal stress cut off at -f_c (Pa), and its derivative with the opening (Pa/m)."""
    strongest = parameters.compressive_strength
    if sigma <= -strongest * (1.0 - YIELD_TOLERANCE):
        return max(sigma, -strongest), 0.0
    return sigma, sigma_e


@law
def shear_limit(parameters, integrity, sigma, sigma_e, damage_e):
    """Shear limit L (Pa), negative beyond the apex of the cone, and its decrease with the opening, -dL/de (Pa/m)."""
    p = parameters
    cohesion, friction, damaging = p.cohesion, p.friction, 0.0
    if integrity < 1.0:
        cohesion = degraded(integrity, p.cohesion, p.residual_cohesion)
        friction = degraded(integrity, p.friction, p.residual_friction)
        damaging = damage_e * coulomb_limit(p.cohesion - p.residual_cohesion, p.friction - p.residual_friction, sigma)
    limit, decrease = coulomb_limit(cohesion, friction, sigma), friction * sigma_e - damaging
    if p.brittle_shear and integrity > 0.0:
        limit, decrease = NO_LIMIT, 0.0  # the bond breaks at its limit and does not slide
    if p.compressive_strength < np.inf:
        ellipse = capped(NO_LIMIT, sigma, p)
        if ellipse < limit:
            return ellipse, -cap_slope(p, ellipse, sigma, sigma_e)
    return limit, decrease


@law
def cap_slope(parameters, ellipse, sigma, sigma_e):
    """Derivative of the cap's shear limit with the opening (Pa/m), bounded at the tip of the ellipse."""
    least = CAP_SLOPE_RATIO * parameters.compressive_strength
    return -min(sigma, 0.0) * sigma_e * parameters.cap_compliance / max(ellipse, least)
