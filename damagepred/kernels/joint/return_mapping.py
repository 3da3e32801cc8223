"""Implicit return mapping of a joint with its consistent tangent (Simo and Hughes 1998), and its Tresca counterpart.

With the history variables of the last equilibrium, stresses are a piecewise smooth function of opening and shear.
Multi-surface plasticity: tension softens along the secant (damage), shear slips at the Coulomb limit or the cap with
the dilatancy of a non-associated flow rule, compression is cut off at f_c.

In the Tresca problem the shear limit and the dilatant opening are given numbers. It has a convex energy in the
displacements, so its solution can be found from anywhere; at a fixed point of ``update_tresca_bounds`` the two laws
agree (Haslinger; Wriggers 2006, ch. 10).
"""

import numpy as np

from damagepred.kernels.jit import law, rule
from damagepred.kernels.joint.limits import (
    NO_LIMIT,
    YIELD_TOLERANCE,
    cap_slope,
    capped,
    coulomb_limit,
    cut_off_compression,
    shear_limit,
)
from damagepred.kernels.joint.softening import (
    degraded,
    integrity_of,
    kappa_before_slip,
    secant_stiffness,
    softening_slope,
)

MAX_ITERATIONS = 40
"""Newton iterations for the slip of a joint that softens by slip."""
RELATIVE_TOLERANCE = 1e-13
"""Residual of that iteration over the shear stress (1)."""
SNAP_BACK_RATIO = 1e-6
"""Tangent stiffness over k_s below which the bond snaps back: it breaks at once (1)."""
DILATANT_ITERATIONS = 6
"""Newton iterations for the slip of a joint that dilates while it softens."""


@law
def normal_law(parameters, cracked, kappa, e, damage_grows):
    """Normal stress, its slope, integrity and its slope: tension cut-off, mode I softening, linear compression.

    ``e`` is the opening less dilatant opening (m).
    """
    k_n, f_t, w_c = parameters.normal_stiffness, parameters.tensile_strength, parameters.critical_opening
    if not cracked and (w_c == 0.0 or e <= f_t / k_n):
        return k_n * e, k_n, 1.0, 0.0
    if w_c > 0.0:
        reached = max(kappa, f_t / k_n)
        if e > reached and damage_grows:
            integrity = integrity_of(parameters, e)
            slope = softening_slope(parameters, e)
            return f_t * integrity, f_t * slope, integrity, slope
        integrity = integrity_of(parameters, reached)
        stiffness = secant_stiffness(parameters, reached, integrity) if e > 0.0 else k_n
        return stiffness * e, stiffness, integrity, 0.0
    if e <= 0.0 or (parameters.residual_tensile_strength > 0.0 and kappa == 0.0):
        return k_n * e, k_n, 0.0, 0.0
    return 0.0, 0.0, 0.0, 0.0


@rule
def return_mapping(parameters, cracked, kappa, e, shear):
    """Return mapping with elastic predictor and plastic corrector (Simo and Hughes 1998).

    Stresses, consistent tangent (nn, ns, sn, ss), slip, dilatancy less crushing (m), shear limit of a contact.
    """
    p = parameters
    k_n, k_s, psi, w_c = p.normal_stiffness, p.shear_stiffness, p.dilation, p.critical_opening
    sigma, sigma_e, integrity, damage_e = normal_law(p, cracked, kappa, e, True)
    sigma, sigma_e = cut_off_compression(p, sigma, sigma_e)
    crushing = min(e + p.compressive_strength / k_n, 0.0)
    tau = k_s * shear  # elastic predictor
    trial = abs(tau)
    is_open = e > 0.0 and sigma == 0.0
    if is_open and psi > 0.0 and w_c == 0.0 and kappa == 0.0:
        # it touched before: with the dilatancy of its slip it may still touch
        excess = trial - coulomb_limit(p.residual_cohesion, p.residual_friction, k_n * e)
        if psi * excess * p.residual_slip_compliance >= e:
            sigma, sigma_e, is_open = k_n * e, k_n, False
    limit, decrease = 0.0, 0.0
    if not is_open:
        limit, decrease = shear_limit(p, integrity, sigma, sigma_e, damage_e)
    if trial < limit * (1.0 - YIELD_TOLERANCE):
        return sigma, tau, sigma_e, 0.0, 0.0, k_s, 0.0, crushing, limit
    if p.slip_weight > 0.0 and not is_open:
        return mixed_mode_return(p, kappa, e, shear, crushing)
    # plastic corrector: k_s (trial / k_s - t) = L(e - psi t)
    sign = 1.0 if tau >= 0.0 else -1.0
    if is_open:
        psi = 0.0  # an open contact does not dilate
    compliance = 1.0 / (k_s + decrease * psi)
    slipped = (trial - limit) * compliance
    if psi > 0.0 and w_c > 0.0 and integrity < 1.0:
        # dilatancy closes the joint, which softens less: L is not linear in the slip
        for _ in range(DILATANT_ITERATIONS):
            closer = e - psi * min(slipped, trial / k_s)
            sigma, sigma_e, integrity, damage_e = normal_law(p, cracked, kappa, closer, True)
            limit, decrease = shear_limit(p, integrity, sigma, sigma_e, damage_e)
            compliance = 1.0 / (k_s + decrease * psi)
            slipped += (trial - k_s * slipped - limit) * compliance
        sigma += sigma_e * psi * slipped  # extrapolated to e along the tangent
    if is_open or k_s * slipped >= trial:  # beyond the apex of the cone: no shear stress
        dilatancy = psi * trial / k_s
        sigma -= sigma_e * dilatancy
        return sigma, 0.0, sigma_e, -sigma_e * psi * sign, 0.0, 0.0, tau / k_s, dilatancy + crushing, 0.0
    slipped = max(slipped, 0.0)  # at the limit within the yield tolerance
    return (
        sigma - sigma_e * psi * slipped,
        tau - sign * k_s * slipped,
        sigma_e * (1.0 - psi * compliance * decrease),
        -sign * sigma_e * psi * compliance * k_s,
        -sign * k_s * compliance * decrease,
        k_s * (1.0 - k_s * compliance),
        sign * slipped,
        psi * slipped + crushing,
        trial - k_s * slipped,
    )


@rule
def mixed_mode_return(parameters, kappa, e, shear, crushing):
    """Mixed-mode softening by slip t: Newton's method for k_s (|shear| - t) = L(e, kappa + beta t).

    Where the shear limit L falls faster with slip than k_s, the bond snaps back: its integrity drops to 0.
    """
    p = parameters
    k_n, k_s, f_t = p.normal_stiffness, p.shear_stiffness, p.tensile_strength
    w_c, beta = p.critical_opening, p.slip_weight
    start = kappa_before_slip(p, kappa, e)
    kappa_e = 1.0 if e >= start else 0.0  # derivative of kappa with the opening
    sign, trial = 1.0 if shear >= 0.0 else -1.0, abs(k_s * shear)
    most = trial / k_s
    exhausting = max((w_c - start) / beta, 0.0) * (1.0 + 1e-12)  # slip that leaves b = 0, rounding included
    t, lower, upper = 0.0, 0.0, most  # the residual is positive at the lower bound
    for _ in range(MAX_ITERATIONS):
        kappa = start + beta * t
        integrity = integrity_of(p, kappa)
        damage_kappa = softening_slope(p, kappa)
        if e > 0.0:
            sigma, sigma_e = f_t * integrity * e / kappa, secant_stiffness(p, kappa, integrity)
            sigma_kappa = f_t * e * (damage_kappa * kappa - integrity) / (kappa * kappa)
        else:
            sigma, sigma_e = cut_off_compression(p, k_n * e, k_n)
            sigma_kappa = 0.0
        tan_phi = degraded(integrity, p.friction, p.residual_friction)
        limit = coulomb_limit(degraded(integrity, p.cohesion, p.residual_cohesion), tan_phi, sigma)
        limit_kappa = damage_kappa * coulomb_limit(
            p.cohesion - p.residual_cohesion, p.friction - p.residual_friction, sigma
        )
        limit_kappa -= tan_phi * sigma_kappa
        limit_e = -tan_phi * sigma_e + kappa_e * limit_kappa
        ellipse = capped(NO_LIMIT, sigma, p)
        if ellipse < limit:
            limit, limit_kappa = ellipse, 0.0
            limit_e = cap_slope(p, ellipse, sigma, sigma_e)
        if limit <= 0.0:  # beyond the apex of the cone
            limit, limit_kappa, limit_e = 0.0, 0.0, 0.0
        limit_t = beta * limit_kappa
        residual = trial - k_s * t - limit
        if abs(residual) <= RELATIVE_TOLERANCE * (trial + abs(limit)):
            break
        lower, upper = (t, upper) if residual > 0.0 else (lower, t)
        if k_s + limit_t < SNAP_BACK_RATIO * k_s:
            t = exhausting if lower < exhausting < upper or p.softening_shape == 0.0 else 0.5 * (lower + upper)
        else:
            t = min(max(t + residual / (k_s + limit_t), 0.0), most)
            if damage_kappa != 0.0 and t > exhausting:  # not beyond the kink at b = 0
                t = exhausting
            if p.softening_shape > 0.0 and not lower <= t <= upper:
                t = 0.5 * (lower + upper)
    if e > 0.0 and integrity == 0.0:  # broken and open
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, shear, 0.0, 0.0
    # consistent tangent: derivatives of t by the implicit function theorem
    stiffness = k_s + limit_t
    t_shear, t_e = k_s / stiffness, -limit_e / stiffness
    return (
        sigma,
        sign * (trial - k_s * t),
        sigma_e + kappa_e * sigma_kappa + beta * sigma_kappa * t_e,
        sign * beta * sigma_kappa * t_shear,
        -sign * k_s * t_e,
        k_s * (1.0 - t_shear),
        sign * t,
        crushing,
        trial - k_s * t,
    )


@law
def is_plain(parameters, general):
    """Whether ``plain_return`` is the law: no dilation, softening, cap, gap, residual tension or brittle shear."""
    p = parameters
    if general is None:
        return True
    return (
        (p.dilation == 0.0)
        & (p.critical_opening == 0.0)
        & (p.residual_tensile_strength == 0.0)
        & (p.brittle_shear == 0)
        & (p.compressive_strength == np.inf)
        & (p.gap == 0.0)
    )


def all_plain(joints):
    """Whether all joints are plain, records (m,) of ``JOINT_PARAMETERS``."""
    return bool(np.all(is_plain(joints.view(np.recarray), True)))


@law
def plain_return(parameters, cracked, e, shear):
    """Return mapping of a plain joint; the shear limit is not cut off at the apex of the cone."""
    p = parameters
    if cracked and e > 0.0:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, shear, 0.0, 0.0
    k_n, k_s = p.normal_stiffness, p.shear_stiffness
    cohesion = p.residual_cohesion if cracked else p.cohesion
    friction = p.residual_friction if cracked else p.friction
    sigma, tau = k_n * e, k_s * shear
    limit = coulomb_limit(cohesion, friction, sigma)
    if abs(tau) < limit * (1.0 - YIELD_TOLERANCE):
        return sigma, tau, k_n, 0.0, 0.0, k_s, 0.0, 0.0, limit
    if limit <= 0.0:
        return sigma, 0.0, k_n, 0.0, 0.0, 0.0, shear, 0.0, limit
    sign, size = 1.0 if tau >= 0.0 else -1.0, min(abs(tau), limit)
    slip = np.copysign(max(abs(shear) - size / k_s, 0.0), shear)
    return sigma, sign * size, k_n, 0.0, -sign * friction * k_n, 0.0, slip, 0.0, limit


@law
def coulomb_return(parameters, general, plain, cracked, kappa, e, shear):
    """Return mapping in the Coulomb problem, by ``plain_return`` where the joint is plain."""
    if general is None or plain:
        return plain_return(parameters, cracked, e, shear)
    return return_mapping(parameters, cracked, kappa, e, shear)


@law
def tresca_return(parameters, general, plain, cracked, kappa, bound, e, shear):
    """Stresses and tangent (nn, ns, sn, ss) of a contact in the Tresca problem; damage is constant."""
    k_n, k_s = parameters.normal_stiffness, parameters.shear_stiffness
    if general is None or plain:
        sigma, sigma_e = (0.0, 0.0) if cracked and e > 0.0 else (k_n * e, k_n)
    else:
        sigma, sigma_e, _, _ = normal_law(parameters, cracked or kappa > 0.0, kappa, e, False)
        sigma, sigma_e = cut_off_compression(parameters, sigma, sigma_e)
    tau = k_s * shear
    if abs(tau) <= bound:
        return sigma, tau, sigma_e, 0.0, 0.0, k_s if bound > 0.0 else 0.0
    return sigma, np.copysign(bound, tau), sigma_e, 0.0, 0.0, 0.0
