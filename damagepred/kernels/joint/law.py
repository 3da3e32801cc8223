"""The law of one contact of a mortar joint: elastic, cracks in tension, Coulomb with cohesion in shear.

Equations 1-4 of the paper (Zhuge et al.), with tension and opening positive:

    sigma = k_n u,   u = u_n - d,   sigma <= f_t,   tau = k_s (u_s - s),   |tau| <= C - sigma tan(phi)

where s is the plastic slip and d = tan(psi) times the slip travelled is the opening by dilation. The law is written
in total displacement with s and d as memory, which is the paper's incremental law without its rounding drift.

A bond that passes f_t breaks at once, as the paper has it, or softens: its tension falls with the opening, linearly
from f_t at u_0 = f_t / k_n to nothing at w_c = 2 G_f / f_t, so that opening a crack takes the work G_f. What is left
of the bond follows from the largest opening kappa that the cracked contact has reached,

    b = (w_c - kappa) / (w_c - u_0),   sigma = u b f_t / kappa  for 0 < u <= kappa,   sigma = k_n u  for u <= 0

so tension goes to and from the origin along the secant. Cohesion and tan(phi) go from their values to the residual
ones with b.

A joint with a cap carries no more pressure than f_c and closes for good beyond (d falls: it crushes), and near it less
shear than Coulomb's, the ellipse of Lourenco and Rots:

    sigma >= -f_c,   |tau| <= sqrt((f_c^2 - sigma^2) / C_ss)

Slip may wear off a bond that softens, as opening does: kappa then grows with the slip, too, by (w_c - u_0) / s_c for
each unit of it, so that a slip of s_c leaves nothing.

There is no branch in it, only choices between two values, so that the compiler can work on many contacts at a time.
What no joint of a wall needs is left out when compiling.
"""

from numpy import copysign, maximum, sqrt

from damagepred.kernels.jit import law

THINNEST = 1e-100
"""Keeps what divides by an opening from dividing by nothing (m)."""
APEX = 1e-6
"""Share of the cohesion below which no shear stress breaks a softening bond: at the apex of the cone rounding would."""
NO_LIMIT = 1e300
"""Stress that no joint reaches (Pa)."""


@law
def joint_law(
    opening,
    shear,
    slip,
    dilatant_opening,
    cracked,
    kappa,
    stiffness,
    strength,
    residual_strength,
    softening,
    psi,
    brittle_shear,
    cap=None,
    slip_weight=None,
):
    """Return (sigma, tau, slip, dilated, cracked, opened) of one contact.

    Parameters
    ----------
    opening, shear : float
        Relative displacement normal (opening positive) and along the joint (m).
    slip, dilatant_opening : float
        Plastic slip and opening by dilation so far (m); less what the joint was crushed by.
    cracked : bool
        Whether tensile strength was passed, or the bond broken by slip.
    kappa : float
        kappa, if the joint softens: the largest u of the cracked contact so far (m), at least w_c once slip has
        broken the bond, and more if slip wears it. Otherwise 0.
    stiffness : tuple of float
        (k_n, k_s, 1 / k_s) (Pa/m, Pa/m, m/Pa).
    strength, residual_strength : tuple of float
        (f_t, C, tan phi, slip compliance) of the intact joint and of one without bond (Pa, Pa, 1, m/Pa).
    softening : tuple of float or None
        (w_c, what ``damage_rate`` makes of it) (m, 1/m), w_c = 0 if this bond breaks at once; None if all do: what
        softening needs is then left out when compiling.
    psi : float
        tan(psi) (1).
    brittle_shear : bool
        Whether the first slip breaks the bond, too.
    cap : tuple of float or None
        (f_c, f_c / k_n, 1 / C_ss) (Pa, m, 1), infinite where this joint has no cap; None if none has, to leave out when
        compiling what it needs. A joint with a cap does not dilate.
    slip_weight : float or None
        By how much kappa grows for each unit of slip (1), 0 where slip leaves the bond as it is; None if it does in all
        joints, or no bond softens. A joint that wears does not dilate.
    """
    # the stresses if nothing gives way
    k_n, k_s, shear_compliance = stiffness
    u = opening - dilatant_opening
    if cap is not None:
        strongest, farthest, cap_compliance = cap
        crushed = u + farthest
        crushed = crushed if crushed < 0.0 else 0.0
        u -= crushed
        dilatant_opening += crushed
    elastic = k_n * u
    tau = k_s * (shear - slip)
    size = abs(tau)

    # does the bond break, or how much of it is left?
    f_t, cohesion, friction, slip_compliance = strength
    if softening is None:
        pull, sigma = k_n, elastic
        sheared = brittle_shear & (size > cohesion - sigma * friction)
        if cap is not None:
            sheared = sheared & (capped(NO_LIMIT, sigma, strongest, cap_compliance) >= cohesion - sigma * friction)
        cracked = cracked | (elastic > f_t) | sheared
        carried = residual_strength[0] if cracked else f_t
        cohesion = residual_strength[1] if cracked else cohesion
        friction = residual_strength[2] if cracked else friction
        slip_compliance = residual_strength[3] if cracked else slip_compliance
    else:
        w_c, slope = softening
        cracked = cracked | (elastic > f_t)
        kappa = u if cracked & (u > kappa) & (w_c > 0.0) else kappa
        integrity = integrity_of(kappa, cracked, w_c, slope)
        pull = f_t * integrity / (kappa if kappa > THINNEST else THINNEST)
        pull = pull if cracked & (w_c > 0.0) else k_n
        sigma = (k_n if u < 0.0 else pull) * u
        held = degraded(integrity, cohesion, residual_strength[1]) - sigma * degraded(
            integrity, friction, residual_strength[2]
        )
        sheared = brittle_shear & (size > held) & ((size > APEX * cohesion) | (w_c == 0.0))
        if cap is not None:
            sheared = sheared & (capped(NO_LIMIT, sigma, strongest, cap_compliance) >= held)
        cracked = cracked | sheared
        kappa = w_c if sheared & (w_c > kappa) else kappa
        integrity = 0.0 if sheared else integrity
        # tension has no other limit than its secant while there is some bond
        carried = residual_strength[0] if integrity == 0.0 else NO_LIMIT
        cohesion = degraded(integrity, cohesion, residual_strength[1])
        friction = degraded(integrity, friction, residual_strength[2])
        # in between, the smaller of the two: what is left to slide follows in the next cycle, and nothing overshoots
        less = (integrity < 1.0) & (residual_strength[3] < slip_compliance)
        slip_compliance = residual_strength[3] if less | (integrity == 0.0) else slip_compliance

    # plastic slip returns the stresses to the limit, at the apex of the cone to tau = 0; dilation presses the joint
    limit = cohesion - sigma * friction
    if cap is not None:
        limit = capped(limit, sigma, strongest, cap_compliance)
    excess = size - limit
    by_limit, by_apex = excess * slip_compliance, size * shear_compliance
    travelled = by_limit if by_limit < by_apex else by_apex
    travelled = travelled if excess > 0.0 else 0.0

    # an open joint carries nothing and slides freely
    is_open = elastic > carried
    u -= psi * travelled
    sigma = 0.0 if is_open else (k_n if u < 0.0 else pull) * u
    slip = shear if is_open else slip + copysign(travelled, tau)
    tau = 0.0 if is_open else tau - copysign(k_s * travelled, tau)
    dilatant_opening = dilatant_opening if is_open else dilatant_opening + psi * travelled
    if softening is not None and slip_weight is not None:
        worn = (slip_weight > 0.0) & (travelled > 0.0) & (not is_open)
        first = w_c - 1.0 / slope
        kappa = (kappa if kappa > first else first) + slip_weight * travelled if worn else kappa
        cracked = cracked | worn
    return sigma, tau, slip, dilatant_opening, cracked, kappa


@law
def capped(limit, sigma, strongest, compliance):
    """Return the smaller of a limit of the shear stress and that of the cap (Pa).

    Parameters
    ----------
    limit, sigma : float
        Limit of the shear stress, and normal stress (Pa).
    strongest, compliance : float
        f_c (Pa) and 1 / C_ss.
    """
    pressed = sigma if sigma < 0.0 else 0.0
    left = (strongest - pressed) * (strongest + pressed)
    ellipse = sqrt((left if left > 0.0 else 0.0) * compliance)
    return ellipse if ellipse < limit else limit


@law
def integrity_of(kappa, cracked, critical_opening, slope):
    """Return b, the share of the bond that is left: 1 while intact, 0 where it broke at once.

    Parameters
    ----------
    kappa : float
        kappa (m).
    cracked : bool
        As ``joint_law`` has it.
    critical_opening, slope : float
        w_c (m), and what ``damage_rate`` makes of it (1/m).
    """
    integrity = (critical_opening - kappa) * slope
    integrity = integrity if integrity > 0.0 else 0.0
    return integrity if cracked & (integrity < 1.0) else 1.0


@law
def damage_rate(k_n, f_t, critical_opening):
    """Return the share of the bond that is lost for each unit of opening beyond u_0 (1/m)."""
    return 1.0 / maximum(critical_opening - f_t / k_n, THINNEST)


@law
def slip_weight_of(properties, i):
    """Return by how much kappa grows for each unit of slip of interface i (1)."""
    if properties.critical_slip[i] == 0.0:
        return 0.0
    first = properties.tensile_strength[i] / properties.normal_stiffness[i]
    return (properties.critical_opening[i] - first) / properties.critical_slip[i]


@law
def degraded(integrity, whole, left):
    """Return the value between that of the intact joint and that of one without bond."""
    return integrity * whole + (1.0 - integrity) * left


@law
def slip_compliance(k_n, k_s, friction, psi):
    """Return the plastic slip for each unit of shear stress above the limit (m/Pa)."""
    return 1.0 / (k_s + k_n * friction * psi)
