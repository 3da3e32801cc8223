"""The joint law: elastic, tension cut-off or softening, Coulomb friction with cohesion, dilation and cap.

Equations 1-4 of the paper (Zhuge et al.), with tension and opening positive:

    sigma = k_n u,   u = u_n - d,   sigma <= f_t,   tau = k_s (u_s - s),   |tau| <= C - sigma tan(phi)

with the plastic slip s and the dilatant opening d, which grows by tan(psi) for each unit of slip. The law is written in
total displacement with s and d as history variables, so it has no rounding drift, unlike the paper's increments.

A bond that passes f_t breaks at once, as in the paper, or softens from f_t at kappa_0 = f_t / k_n to 0 at w_c, so that
a crack dissipates G_f. Its integrity b follows from the largest opening kappa of the cracked contact (``softening``),

    sigma = u b f_t / kappa  for 0 < u <= kappa,   sigma = k_n u  for u <= 0

so tension unloads to the origin along the secant (damage). Cohesion and tan(phi) go from their intact to their residual
values with b. In mixed-mode softening, slip adds beta = (w_c - kappa_0) / s_c per unit to kappa, so that a slip of s_c
exhausts the bond.

A cap limits compression at f_c, beyond which the joint is crushed (d decreases), and shear by the ellipse of Lourenco
and Rots (1997):

    sigma >= -f_c,   |tau| <= sqrt((f_c^2 - sigma^2) / C_ss)

The explicit update is one pass of the return mapping per cycle, in which bonds also break; the next pass returns
stress that remains beyond a moving limit. ``return_mapping`` is implicit: iterated, with tangent, bonds fixed. The
update selects instead of branching, so that the compiler vectorises it over contacts. ``special`` and ``softening`` are
None if no joint of the wall needs them; the compiler then omits their code.
"""

from numpy import copysign

from damagepred.kernels.jit import law
from damagepred.kernels.joint.limits import NO_LIMIT, capped, coulomb_limit
from damagepred.kernels.joint.softening import TINY, degraded, integrity_of, linear_integrity, secant_stiffness

APEX_ROUNDING = 1e-6
"""Shear stress over cohesion that counts as 0: at the apex of the cone rounding would break a bond by slip."""


@law
def explicit_update(opening, shear, history, parameters, special, softening):
    """Stresses and history (sigma, tau, slip, dilatant_opening, cracked, kappa) of a contact after a cycle."""
    slip, dilatant_opening, cracked, kappa = history
    # elastic predictor
    p = parameters
    k_n, k_s, psi, brittle_shear = p.normal_stiffness, p.shear_stiffness, 0.0, False
    u = opening - dilatant_opening
    if special is not None:
        psi, brittle_shear = p.dilation, p.brittle_shear != 0.0
        crushed = u + p.compressive_strength / k_n
        crushed = crushed if crushed < 0.0 else 0.0
        u -= crushed
        dilatant_opening += crushed
    elastic = k_n * u
    tau = k_s * (shear - slip)
    trial = abs(tau)

    # failure of the bond, or its integrity
    f_t, cohesion, friction, slip_compliance = p.tensile_strength, p.cohesion, p.friction, p.slip_compliance
    if softening is None:
        secant, sigma = k_n, elastic
        coulomb = coulomb_limit(cohesion, friction, sigma)
        sheared = brittle_shear & (trial > coulomb)
        if special is not None:
            sheared = sheared & (capped(NO_LIMIT, sigma, p) >= coulomb)
        cracked = cracked | (elastic > f_t) | sheared
        tensile_limit = p.residual_tensile_strength if cracked else f_t
        cohesion = p.residual_cohesion if cracked else cohesion
        friction = p.residual_friction if cracked else friction
        slip_compliance = p.residual_slip_compliance if cracked else slip_compliance
    else:
        w_c = p.critical_opening
        cracked = cracked | (elastic > f_t)
        kappa = u if cracked & (u > kappa) & (w_c > 0.0) else kappa
        integrity = linear_integrity(p, kappa) if softening.exponential is None else integrity_of(p, kappa)
        integrity = integrity if cracked else 1.0
        secant = secant_stiffness(p, kappa if kappa > TINY else TINY, integrity)
        secant = secant if cracked & (w_c > 0.0) else k_n
        sigma = (k_n if u < 0.0 else secant) * u
        coulomb = coulomb_limit(
            degraded(integrity, cohesion, p.residual_cohesion),
            degraded(integrity, friction, p.residual_friction),
            sigma,
        )
        sheared = brittle_shear & (trial > coulomb) & ((trial > APEX_ROUNDING * cohesion) | (w_c == 0.0))
        if special is not None:
            sheared = sheared & (capped(NO_LIMIT, sigma, p) >= coulomb)
        cracked = cracked | sheared
        kappa = w_c if sheared & (w_c > kappa) else kappa
        integrity = 0.0 if sheared else integrity
        # until b = 0, tension has no other limit than its secant
        tensile_limit = p.residual_tensile_strength if integrity == 0.0 else NO_LIMIT
        cohesion = degraded(integrity, cohesion, p.residual_cohesion)
        friction = degraded(integrity, friction, p.residual_friction)
        # while the bond softens, the smaller compliance does not overshoot; the next cycle adds the remaining slip
        less = (integrity < 1.0) & (p.residual_slip_compliance < slip_compliance)
        slip_compliance = p.residual_slip_compliance if less | (integrity == 0.0) else slip_compliance

    # plastic corrector: slip returns tau to the limit, at the apex of the cone to 0; dilation presses the joint
    limit = coulomb_limit(cohesion, friction, sigma)
    if special is not None:
        limit = capped(limit, sigma, p)
    excess = trial - limit
    to_limit, to_apex = excess * slip_compliance, trial * p.shear_compliance
    slipped = to_limit if to_limit < to_apex else to_apex
    slipped = slipped if excess > 0.0 else 0.0

    # an open joint has no stress, and its slip follows the shear
    is_open = elastic > tensile_limit
    u -= psi * slipped
    sigma = 0.0 if is_open else (k_n if u < 0.0 else secant) * u
    slip = shear if is_open else slip + copysign(slipped, tau)
    tau = 0.0 if is_open else tau - copysign(k_s * slipped, tau)
    dilatant_opening = dilatant_opening if is_open else dilatant_opening + psi * slipped
    if softening is not None and special is not None:
        softens = (p.slip_weight > 0.0) & (slipped > 0.0) & (not is_open)
        kappa_0 = w_c - 1.0 / p.damage_rate
        kappa = (kappa if kappa > kappa_0 else kappa_0) + p.slip_weight * slipped if softens else kappa
        cracked = cracked | softens
    return sigma, tau, slip, dilatant_opening, cracked, kappa
