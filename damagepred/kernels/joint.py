"""The law of one contact of a mortar joint: elastic, brittle in tension, Coulomb with cohesion in shear.

Equations 1-4 of the paper (Zhuge et al.), with tension and opening positive:

    sigma = k_n (u_n - d),   sigma <= f_t,   tau = k_s (u_s - s),   |tau| <= C - sigma tan(phi)

where s is the plastic slip and d = tan(psi) times the slip travelled is the opening by dilation. The law is written
in total displacement with s and d as memory, which is the paper's incremental law without its rounding drift.
"""

from damagepred.kernels.jit import law


@law
def joint_law(opening, shear, slip, dilated, cracked, k_n, k_s, strength, weakened, psi, brittle_shear):
    """Return (sigma, tau, slip, dilated, cracked) of one contact.

    Parameters
    ----------
    opening, shear : float
        Relative displacement normal (opening positive) and along the joint (m).
    slip, dilated : float
        Plastic slip and opening by dilation so far (m).
    cracked : bool
        Whether the bond is broken.
    k_n, k_s : float
        Stiffness (Pa/m).
    strength, weakened : tuple of float
        (f_t, C, tan phi) of the intact and of the cracked joint (Pa, Pa, 1).
    psi : float
        tan(psi) (1).
    brittle_shear : bool
        Whether the first slip breaks the bond, too.
    """
    f_t, cohesion, friction = weakened if cracked else strength
    sigma = k_n * (opening - dilated)
    if sigma > f_t:
        cracked = True
        f_t, cohesion, friction = weakened
        if sigma > f_t:
            return 0.0, 0.0, shear, dilated, cracked  # open: carries nothing, slides freely
    tau = k_s * (shear - slip)
    excess = abs(tau) - max(cohesion - sigma * friction, 0.0)
    if excess > 0.0 and brittle_shear and not cracked:
        cracked = True
        f_t, cohesion, friction = weakened
        if sigma > f_t:
            return 0.0, 0.0, shear, dilated, cracked
        excess = abs(tau) - max(cohesion - sigma * friction, 0.0)
    if excess > 0.0:
        # plastic slip returns (sigma, tau) to the limit; with dilation it also presses the joint
        travelled = excess / (k_s + k_n * friction * psi)
        direction = 1.0 if tau > 0.0 else -1.0
        tau -= direction * k_s * travelled
        slip += direction * travelled
        dilated += psi * travelled
        sigma -= k_n * psi * travelled
    return sigma, tau, slip, dilated, cracked
