"""Implicit return mapping of a joint with its consistent tangent (Simo and Hughes 1998), and its Tresca counterpart.

With the history variables of the last equilibrium, stresses are a piecewise smooth function of opening and shear.
Multi-surface plasticity: tension softens along the secant (damage), shear slips at the Coulomb limit or the cap with
the dilatancy of a non-associated flow rule, compression is cut off at f_c.

In the Tresca problem the shear limit and the dilatant opening are given numbers. It has a convex energy in the
displacements, so its solution can be found from anywhere; at a fixed point of ``update_tresca_bounds`` the two laws
agree (Haslinger; Wriggers 2006, ch. 10).
"""

from typing import NamedTuple

import numpy as np

from damagepred.kernels.jit import law, rule
from damagepred.kernels.joint.limits import NO_LIMIT, cap_slope, capped, shear_limit
from damagepred.kernels.joint.softening import kappa_before_slip, slip_weight_of, softened_integrity


class ReturnMapping(NamedTuple):
    """Parameters of the return mapping; meaning and defaults: ``ReturnMappingOptions`` of the quasi-static solver."""

    max_iterations: int
    relative_tolerance: float
    snap_back_ratio: float
    dilatant_iterations: int
    cap_slope_ratio: float
    yield_tolerance: float


@law
def normal_law(e, cracked, kappa, k_n, f_t, residual, w_c, damage_grows):
    """Return normal stress, its derivative, integrity and its derivative, at an opening less dilatant opening.

    Parameters
    ----------
    e : float
        Opening less dilatant opening (m).
    cracked : bool
        Whether the bond is broken or softens.
    kappa : float
        History variable (m); infinite where slip has broken a softening bond. Of a brittle bond: infinite where it has
        parted, 0 where it still touches.
    k_n, f_t, residual, w_c : float
        Stiffness (Pa/m), tensile strength and its residual (Pa), critical opening (m), 0 of a brittle bond.
    damage_grows : bool
        Whether a softening bond softens further; if not it is a spring of the secant stiffness.
    """
    if not cracked:
        return k_n * e, k_n, 1.0, 0.0
    if w_c > 0.0:
        kappa_0 = f_t / k_n
        reached = max(kappa, kappa_0)
        if e > reached and damage_grows:
            integrity = softened_integrity(e, kappa_0, w_c)
            rate = 1.0 / (w_c - kappa_0) if integrity > 0.0 else 0.0
            return f_t * integrity, -f_t * rate, integrity, -rate
        integrity = softened_integrity(reached, kappa_0, w_c)
        secant = f_t * integrity / reached if e > 0.0 else k_n
        return secant * e, secant, integrity, 0.0
    if e <= 0.0 or (residual > 0.0 and kappa == 0.0):
        return k_n * e, k_n, 0.0, 0.0
    return 0.0, 0.0, 0.0, 0.0


@rule
def return_mapping(properties, i, cracked, kappa, e, shear, options):
    """Return stresses, consistent tangent and plastic increments of a contact.

    Parameters
    ----------
    properties : NamedTuple of arrays (m,)
        Of the joints.
    i : int
        Interface.
    cracked : bool
        Whether the bond is broken or softens.
    kappa : float
        See ``normal_law`` (m).
    e, shear : float
        Opening less dilatant opening, and shear displacement less plastic slip (m).
    options : ReturnMapping
        Parameters of the algorithm.

    Returns
    -------
    sigma, tau : float
        Stresses, tension positive (Pa).
    nn, ns, sn, ss : float
        Derivatives of sigma with opening and shear, of tau with opening and shear (Pa/m).
    slip, dilatancy : float
        Increments of plastic slip, with sign, and of dilatant opening, negative where the contact is crushed (m). The
        slip of an open contact follows the shear.
    limit : float
        Shear limit (Pa).
    """
    k_n, k_s, psi = properties.normal_stiffness[i], properties.shear_stiffness[i], properties.dilation[i]
    f_t, residual = properties.tensile_strength[i], properties.residual_tensile_strength[i]
    w_c, crushing, at_limit = properties.critical_opening[i], 0.0, 1.0 - options.yield_tolerance
    sigma, sigma_e, integrity, damage_e = normal_law(e, cracked, kappa, k_n, f_t, residual, w_c, True)
    if sigma <= -properties.compressive_strength[i] * at_limit:
        crushing = min(e + properties.compressive_strength[i] / k_n, 0.0)
        sigma, sigma_e = max(sigma, -properties.compressive_strength[i]), 0.0
    tau = k_s * shear  # elastic predictor
    trial = abs(tau)
    is_open = cracked and e > 0.0 and sigma == 0.0
    if is_open and psi > 0.0 and w_c == 0.0 and kappa == 0.0:
        # it touched before: with the dilatancy of its slip it may still touch
        pressed, friction = k_n * e, properties.residual_friction[i]
        dilatancy = psi * (trial - properties.residual_cohesion[i] + pressed * friction) / (k_s + k_n * friction * psi)
        if dilatancy >= e:
            sigma, sigma_e, is_open = pressed, k_n, False
    limit, decrease = shear_limit(properties, i, cracked, integrity, sigma, sigma_e, damage_e, is_open, options)
    if trial < limit * at_limit:
        return sigma, tau, sigma_e, 0.0, 0.0, k_s, 0.0, crushing, limit
    if properties.critical_slip[i] > 0.0 and not is_open and (cracked or e <= f_t / k_n):
        return mixed_mode_return(properties, i, cracked, kappa, e, shear, crushing, options)
    # plastic corrector: k_s (trial / k_s - t) = L(e - psi t)
    sign = 1.0 if tau >= 0.0 else -1.0
    if is_open:
        psi = 0.0  # an open contact does not dilate
    compliance = 1.0 / (k_s + decrease * psi)
    slipped = (trial - limit) * compliance
    if psi > 0.0 and cracked and w_c > 0.0:
        # dilatancy closes the joint, which softens less: L is not linear in the slip
        for _ in range(options.dilatant_iterations):
            closer = e - psi * min(slipped, trial / k_s)
            sigma, sigma_e, integrity, damage_e = normal_law(closer, cracked, kappa, k_n, f_t, residual, w_c, True)
            limit, decrease = shear_limit(properties, i, cracked, integrity, sigma, sigma_e, damage_e, False, options)
            compliance = 1.0 / (k_s + decrease * psi)
            slipped += (trial - k_s * slipped - limit) * compliance
        sigma += sigma_e * psi * slipped  # extrapolated to e along the tangent
    if is_open or k_s * slipped >= trial:  # beyond the apex of the cone: no shear stress
        dilatancy = psi * trial / k_s
        return (
            sigma - sigma_e * dilatancy,
            0.0,
            sigma_e,
            -sigma_e * psi * sign,
            0.0,
            0.0,
            tau / k_s,
            dilatancy + crushing,
            0.0,
        )
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
def mixed_mode_return(properties, i, cracked, kappa, e, shear, crushing, options):
    """Return what ``return_mapping`` does, for a joint that slides and whose bond softens by slip.

    Slip t adds beta t to kappa, and the shear limit L follows: k_s (|shear| - t) = L(e, kappa(t)), solved by Newton's
    method. Where L falls faster by slip than k_s the bond snaps back: its integrity goes to 0 at once.

    Parameters
    ----------
    properties, i, cracked, kappa, e, shear, options
        As ``return_mapping``.
    crushing : float
        Closing by crushing (m, negative).
    """
    k_n, k_s = properties.normal_stiffness[i], properties.shear_stiffness[i]
    f_t, w_c = properties.tensile_strength[i], properties.critical_opening[i]
    strongest, c_ss = properties.compressive_strength[i], properties.cap_shear[i]
    beta, kappa_0 = slip_weight_of(properties, i), f_t / k_n
    start = kappa_before_slip(cracked, kappa, e, kappa_0)
    kappa_e = 1.0 if cracked and e >= start else 0.0  # derivative of kappa with the opening
    sign, trial = 1.0 if shear >= 0.0 else -1.0, abs(k_s * shear)
    most = trial / k_s
    exhausting = max((w_c - start) / beta, 0.0) * (1.0 + 1e-12)  # slip that leaves b = 0, rounding included
    cohesion, friction = properties.residual_cohesion[i], properties.residual_friction[i]
    more_cohesion, more_friction = properties.cohesion[i] - cohesion, properties.friction[i] - friction
    t = 0.0
    for _ in range(options.max_iterations):
        kappa = start + beta * t
        integrity = softened_integrity(kappa, kappa_0, w_c)
        damage_kappa = -1.0 / (w_c - kappa_0) if integrity > 0.0 else 0.0
        if e > 0.0:
            sigma, sigma_e = f_t * integrity * e / kappa, f_t * integrity / kappa
            sigma_kappa = f_t * e * (damage_kappa * kappa - integrity) / (kappa * kappa)
        else:
            sigma, sigma_e, sigma_kappa = max(k_n * e, -strongest), k_n if crushing == 0.0 else 0.0, 0.0
            if sigma <= -strongest * (1.0 - options.yield_tolerance):
                sigma_e = 0.0
        tan_phi = friction + integrity * more_friction
        limit = cohesion + integrity * more_cohesion - sigma * tan_phi
        limit_kappa = damage_kappa * (more_cohesion - sigma * more_friction) - tan_phi * sigma_kappa
        limit_e = -tan_phi * sigma_e + kappa_e * limit_kappa
        if strongest < np.inf:
            ellipse = capped(NO_LIMIT, sigma, strongest, 1.0 / c_ss)
            if ellipse < limit:
                limit, limit_kappa = ellipse, 0.0
                limit_e = cap_slope(properties, i, ellipse, sigma, sigma_e, options)
        limit_t = beta * limit_kappa
        residual = trial - k_s * t - limit
        if abs(residual) <= options.relative_tolerance * (trial + abs(limit)):
            break
        if k_s + limit_t < options.snap_back_ratio * k_s:
            t = exhausting
        else:
            t = min(max(t + residual / (k_s + limit_t), 0.0), most)
            if damage_kappa != 0.0 and t > exhausting:  # not beyond the kink at b = 0
                t = exhausting
    if e > 0.0 and integrity == 0.0:  # broken and open
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, shear, 0.0, 0.0
    if limit <= 0.0 or t >= most:
        return sigma, 0.0, sigma_e + kappa_e * sigma_kappa, 0.0, 0.0, 0.0, shear, crushing, 0.0
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
def is_plain(properties, i):
    """Whether ``coulomb_return`` is the law of interface i: no dilation, softening, cap, gap or residual tension.

    Parameters
    ----------
    properties : NamedTuple of arrays (m,)
        Of the joints.
    i : int
        Interface.
    """
    return (
        properties.dilation[i] == 0.0
        and properties.critical_opening[i] == 0.0
        and properties.residual_tensile_strength[i] == 0.0
        and not properties.brittle_shear[i]
        and properties.compressive_strength[i] == np.inf
        and properties.gap[i] == 0.0
    )


@law
def coulomb_return(properties, i, cracked, e, shear, options):
    """Return stresses and tangent (nn, sn, ss) of a plain joint, as ``return_mapping``.

    Parameters
    ----------
    properties, i, cracked, e, shear, options
        As ``return_mapping``.
    """
    if cracked and e > 0.0:
        return 0.0, 0.0, 0.0, 0.0, 0.0
    cohesion = properties.residual_cohesion[i] if cracked else properties.cohesion[i]
    friction = properties.residual_friction[i] if cracked else properties.friction[i]
    k_n, k_s = properties.normal_stiffness[i], properties.shear_stiffness[i]
    sigma, tau = k_n * e, k_s * shear
    limit = cohesion - sigma * friction
    if abs(tau) < limit * (1.0 - options.yield_tolerance):
        return sigma, tau, k_n, 0.0, k_s
    if limit <= 0.0:
        return sigma, 0.0, k_n, 0.0, 0.0
    sign = 1.0 if tau >= 0.0 else -1.0
    return sigma, sign * min(abs(tau), limit), k_n, -sign * friction * k_n, 0.0


@law
def joint_stress(properties, i, plain, cracked, kappa, e, shear, options):
    """Return normal and shear stress of a contact (Pa) by the law of its joint.

    Parameters
    ----------
    properties, i, cracked, kappa, e, shear, options
        As ``return_mapping``.
    plain : bool
        ``is_plain``.
    """
    if plain:
        sigma, tau, _, _, _ = coulomb_return(properties, i, cracked, e, shear, options)
    else:
        sigma, tau, _, _, _, _, _, _, _ = return_mapping(properties, i, cracked, kappa, e, shear, options)
    return sigma, tau


@law
def tresca_plain(k_n, k_s, bound, cracked, e, shear):
    """Return stresses and tangent (nn, sn, ss) of a plain joint in the Tresca problem.

    Parameters
    ----------
    k_n, k_s : float
        Stiffness (Pa/m).
    bound : float
        Largest shear stress (Pa).
    cracked : bool
        Whether the bond is broken.
    e, shear : float
        As ``return_mapping``.
    """
    sigma, sigma_e, tau = k_n * e, k_n, k_s * shear
    if cracked and e > 0.0:
        sigma, sigma_e = 0.0, 0.0
    if abs(tau) <= bound:
        return sigma, tau, sigma_e, 0.0, k_s if bound > 0.0 else 0.0
    return sigma, np.copysign(bound, tau), sigma_e, 0.0, 0.0


@law
def tresca_return(properties, i, cracked, kappa, bound, e, shear, options):
    """Return stresses and tangent (nn, ns, sn, ss) in the Tresca problem; damage stays as it is.

    Parameters
    ----------
    properties, i, cracked, e, shear, options
        As ``return_mapping``.
    kappa, bound : float
        History variable (m) and largest shear stress (Pa), both given.
    """
    k_s = properties.shear_stiffness[i]
    softens_by_slip = kappa > 0.0 and properties.critical_slip[i] > 0.0
    sigma, sigma_e, _, _ = normal_law(
        e,
        cracked or softens_by_slip,
        kappa,
        properties.normal_stiffness[i],
        properties.tensile_strength[i],
        properties.residual_tensile_strength[i],
        properties.critical_opening[i],
        False,
    )
    if sigma <= -properties.compressive_strength[i] * (1.0 - options.yield_tolerance):
        sigma, sigma_e = max(sigma, -properties.compressive_strength[i]), 0.0
    tau = k_s * shear
    if abs(tau) <= bound:
        return sigma, tau, sigma_e, 0.0, 0.0, k_s if bound > 0.0 else 0.0
    return sigma, np.copysign(bound, tau), sigma_e, 0.0, 0.0, 0.0
