"""The joint law: elastic, tension cut-off or softening, Coulomb friction with cohesion, dilation and cap.

Equations 1-4 of the paper (Zhuge et al.), with tension and opening positive:

    sigma = k_n u,   u = u_n - d,   sigma <= f_t,   tau = k_s (u_s - s),   |tau| <= C - sigma tan(phi)

with the plastic slip s and the dilatant opening d, which grows by tan(psi) for each unit of slip. The law is written in
total displacement with s and d as history variables: the paper's incremental law without its rounding drift.

A bond that passes f_t breaks at once, as in the paper, or softens linearly from f_t at kappa_0 = f_t / k_n to 0 at
w_c = 2 G_f / f_t, so that a crack dissipates G_f. Its integrity follows from the largest opening kappa of the cracked
contact,

    b = (w_c - kappa) / (w_c - kappa_0),   sigma = u b f_t / kappa  for 0 < u <= kappa,   sigma = k_n u  for u <= 0

so tension unloads to the origin along the secant (damage). Cohesion and tan(phi) go from their intact to their residual
values with b. In mixed-mode softening slip adds to kappa, too: by beta = (w_c - kappa_0) / s_c for each unit of it, so
that a slip of s_c exhausts the bond.

A cap limits compression at f_c, beyond which the joint is crushed (d decreases), and shear by the ellipse of Lourenco
and Rots (1997):

    sigma >= -f_c,   |tau| <= sqrt((f_c^2 - sigma^2) / C_ss)

This file has the explicit update, one cycle at a time; ``return_mapping`` the implicit one with its tangent. The update
has no branches, only selections, so that the compiler vectorises it over contacts; features that no joint of a wall
needs are left out at compile time.
"""

from numpy import copysign

from damagepred.kernels.jit import law
from damagepred.kernels.joint.limits import NO_LIMIT, capped
from damagepred.kernels.joint.softening import TINY, degraded, integrity_of

APEX_TOLERANCE = 1e-6
"""Shear stress over cohesion below which slip breaks no softening bond: at the apex of the cone rounding would."""


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
    """Return (sigma, tau, slip, dilatant_opening, cracked, kappa) of one contact after one cycle.

    Parameters
    ----------
    opening, shear : float
        Relative displacement normal (opening positive) and along the joint (m).
    slip, dilatant_opening : float
        Plastic slip, and opening by dilation less crushing (m).
    cracked : bool
        Whether the tensile strength was passed, or the bond broken by slip.
    kappa : float
        History variable of softening (m), at least w_c once slip has broken the bond; 0 if the joint does not soften.
    stiffness : tuple of float
        (k_n, k_s, 1 / k_s) (Pa/m, Pa/m, m/Pa).
    strength, residual_strength : tuple of float
        (f_t, C, tan phi, slip compliance) of the intact joint and of one without bond (Pa, Pa, 1, m/Pa).
    softening : tuple of float or None
        (w_c, ``damage_rate``) (m, 1/m), w_c = 0 if this bond is brittle; None if all are: softening is then left out
        at compile time.
    psi : float
        tan(psi) (1).
    brittle_shear : bool
        Whether the first slip breaks the bond.
    cap : tuple of float or None
        (f_c, f_c / k_n, 1 / C_ss) (Pa, m, 1), infinite where this joint has no cap; None if none has. A joint
        with a cap does not dilate.
    slip_weight : float or None
        beta (1), 0 where slip leaves the bond as it is; None if it does in all joints, or no bond softens. A joint
        that softens by slip does not dilate.
    """
    # elastic predictor
    k_n, k_s, shear_compliance = stiffness
    u = opening - dilatant_opening
    if cap is not None:
        strongest, elastic_closing, cap_compliance = cap
        crushed = u + elastic_closing
        crushed = crushed if crushed < 0.0 else 0.0
        u -= crushed
        dilatant_opening += crushed
    elastic = k_n * u
    tau = k_s * (shear - slip)
    trial = abs(tau)

    # failure of the bond, or its integrity
    f_t, cohesion, friction, slip_compliance = strength
    if softening is None:
        secant, sigma = k_n, elastic
        sheared = brittle_shear & (trial > cohesion - sigma * friction)
        if cap is not None:
            sheared = sheared & (capped(NO_LIMIT, sigma, strongest, cap_compliance) >= cohesion - sigma * friction)
        cracked = cracked | (elastic > f_t) | sheared
        tensile_limit = residual_strength[0] if cracked else f_t
        cohesion = residual_strength[1] if cracked else cohesion
        friction = residual_strength[2] if cracked else friction
        slip_compliance = residual_strength[3] if cracked else slip_compliance
    else:
        w_c, rate = softening
        cracked = cracked | (elastic > f_t)
        kappa = u if cracked & (u > kappa) & (w_c > 0.0) else kappa
        integrity = integrity_of(kappa, cracked, w_c, rate)
        secant = f_t * integrity / (kappa if kappa > TINY else TINY)
        secant = secant if cracked & (w_c > 0.0) else k_n
        sigma = (k_n if u < 0.0 else secant) * u
        coulomb = degraded(integrity, cohesion, residual_strength[1])
        coulomb -= sigma * degraded(integrity, friction, residual_strength[2])
        sheared = brittle_shear & (trial > coulomb) & ((trial > APEX_TOLERANCE * cohesion) | (w_c == 0.0))
        if cap is not None:
            sheared = sheared & (capped(NO_LIMIT, sigma, strongest, cap_compliance) >= coulomb)
        cracked = cracked | sheared
        kappa = w_c if sheared & (w_c > kappa) else kappa
        integrity = 0.0 if sheared else integrity
        # until b = 0, tension has no other limit than its secant
        tensile_limit = residual_strength[0] if integrity == 0.0 else NO_LIMIT
        cohesion = degraded(integrity, cohesion, residual_strength[1])
        friction = degraded(integrity, friction, residual_strength[2])
        # in between, the smaller of the two does not overshoot; the remaining slip follows in the next cycle
        less = (integrity < 1.0) & (residual_strength[3] < slip_compliance)
        slip_compliance = residual_strength[3] if less | (integrity == 0.0) else slip_compliance

    # plastic corrector: slip returns tau to the limit, at the apex of the cone to 0; dilation presses the joint
    limit = cohesion - sigma * friction
    if cap is not None:
        limit = capped(limit, sigma, strongest, cap_compliance)
    excess = trial - limit
    to_limit, to_apex = excess * slip_compliance, trial * shear_compliance
    slipped = to_limit if to_limit < to_apex else to_apex
    slipped = slipped if excess > 0.0 else 0.0

    # an open joint has no stress, and its slip follows the shear
    is_open = elastic > tensile_limit
    u -= psi * slipped
    sigma = 0.0 if is_open else (k_n if u < 0.0 else secant) * u
    slip = shear if is_open else slip + copysign(slipped, tau)
    tau = 0.0 if is_open else tau - copysign(k_s * slipped, tau)
    dilatant_opening = dilatant_opening if is_open else dilatant_opening + psi * slipped
    if softening is not None and slip_weight is not None:
        softens = (slip_weight > 0.0) & (slipped > 0.0) & (not is_open)
        kappa_0 = w_c - 1.0 / rate
        kappa = (kappa if kappa > kappa_0 else kappa_0) + slip_weight * slipped if softens else kappa
        cracked = cracked | softens
    return sigma, tau, slip, dilatant_opening, cracked, kappa
