"""The law of one contact of a mortar joint: elastic, brittle in tension, Coulomb with cohesion in shear.

Equations 1-4 of the paper (Zhuge et al.), with tension and opening positive:

    sigma = k_n (u_n - d),   sigma <= f_t,   tau = k_s (u_s - s),   |tau| <= C - sigma tan(phi)

where s is the plastic slip and d = tan(psi) times the slip travelled is the opening by dilation. The law is written
in total displacement with s and d as memory, which is the paper's incremental law without its rounding drift.

There is no branch in it, only choices between two values, so that the compiler can work on many contacts at a time.
"""

from numpy import copysign

from damagepred.kernels.jit import law


@law
def joint_law(opening, shear, slip, dilated, cracked, stiffness, strength, weakened, psi, brittle_shear):
    """Return (sigma, tau, slip, dilated, cracked) of one contact.

    Parameters
    ----------
    opening, shear : float
        Relative displacement normal (opening positive) and along the joint (m).
    slip, dilated : float
        Plastic slip and opening by dilation so far (m).
    cracked : bool
        Whether the bond is broken.
    stiffness : tuple of float
        (k_n, k_s, 1 / k_s) (Pa/m, Pa/m, m/Pa).
    strength, weakened : tuple of float
        (f_t, C, tan phi, slip compliance) of the intact and of the cracked joint (Pa, Pa, 1, m/Pa).
    psi : float
        tan(psi) (1).
    brittle_shear : bool
        Whether the first slip breaks the bond, too.
    """
    # the stresses if nothing gives way
    k_n, k_s, shear_compliance = stiffness
    sigma = k_n * (opening - dilated)
    tau = k_s * (shear - slip)
    size = abs(tau)

    # does the bond break?
    f_t, cohesion, friction, slip_compliance = strength
    sheared = brittle_shear & (size > cohesion - sigma * friction)
    cracked = cracked | (sigma > f_t) | sheared
    f_t = weakened[0] if cracked else f_t
    cohesion = weakened[1] if cracked else cohesion
    friction = weakened[2] if cracked else friction
    slip_compliance = weakened[3] if cracked else slip_compliance

    # plastic slip returns the stresses to the limit, at the apex of the cone to tau = 0; dilation presses the joint
    excess = size - (cohesion - sigma * friction)
    by_limit, by_apex = excess * slip_compliance, size * shear_compliance
    travelled = by_limit if by_limit < by_apex else by_apex
    travelled = travelled if excess > 0.0 else 0.0

    # an open joint carries nothing and slides freely
    is_open = sigma > f_t
    sigma = 0.0 if is_open else sigma - k_n * psi * travelled
    slip = shear if is_open else slip + copysign(travelled, tau)
    tau = 0.0 if is_open else tau - copysign(k_s * travelled, tau)
    dilated = dilated if is_open else dilated + psi * travelled
    return sigma, tau, slip, dilated, cracked


@law
def slip_compliance(k_n, k_s, friction, psi):
    """Return the plastic slip for each unit of shear stress above the limit (m/Pa)."""
    return 1.0 / (k_s + k_n * friction * psi)
