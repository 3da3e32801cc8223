"""Forces and tangent stiffness of joints, memory of earlier equilibria given: what the quasi-static solver asks.

Given what a contact remembers (slip, dilation, bond), its stresses are a piecewise linear function of its opening
and shear: the *live* law. Next to it stands a *frozen* one whose largest shear stress and dilation are numbers that do
not follow the opening. It has an energy, convex in the displacements, whose minimum can be found from anywhere:

    sigma = k_n (u_n - d), only compression once cracked;   tau = k_s (u_s - s) cut to +/- bound

Where the frozen numbers agree with the live law, so do the two.
"""

import numpy as np

from damagepred.kernels.interface.contact import interface_displacement, scatter_interface_force
from damagepred.kernels.jit import kernel, law, rule
from damagepred.kernels.joint.law import capped, degraded, slip_weight_of

NO_LIMIT = 1e30
"""Shear stress that no joint reaches (Pa)."""
SOFT_STEPS = 6
"""Newton steps for the slip of a joint that dilates while it softens."""
STEEPEST = 1e-3
"""Shear stress over f_c from which on the slope of the cap is taken as it is."""
WEAR_STEPS, WORN, SNAPS = 40, 1e-13, 1e-6
"""Newton steps for the slip of a joint that wears, share of the stress to which it is found, and share of the shear
stiffness below which what is left lets go at once."""
AT_LIMIT = 1.0 - 1e-9
"""Share of its limit from which a shear stress counts as sliding when the tangent is asked for."""


@law
def integrity_of(kappa, strength, k_n, critical):
    """Return what is left of a softening bond (1 whole, 0 none) after it was open by ``kappa``."""
    first = strength / k_n
    return min(max((critical - kappa) / (critical - first), 0.0), 1.0)


@law
def normal_law(e, cracked, kappa, k_n, strength, left, critical, coulomb):
    """Return normal stress, its slope, the bond left and the slope of that, at an opening less dilation e.

    Parameters
    ----------
    e : float
        Opening less dilation (m).
    cracked, opened
        Whether the bond is broken; how far open it was (m), of which a softening joint remembers the largest, and a
        brittle one only whether it has parted (infinity) or still touches (0). Infinity also where slip has broken
        a softening bond.
    k_n, strength, left, critical : float
        Stiffness (Pa/m), tensile strength and residual tensile strength (Pa), opening at which a softening bond is
        gone (m), 0 for a brittle one.
    coulomb : bool
        Whether a softening bond softens further; if not it is a spring with its present stiffness.
    """
    if not cracked:
        return k_n * e, k_n, 1.0, 0.0
    if critical > 0.0:
        first = strength / k_n
        known = max(kappa, first)
        if e > known and coulomb:
            integrity = integrity_of(e, strength, k_n, critical)
            softens = 1.0 / (critical - first) if integrity > 0.0 else 0.0
            return strength * integrity, -strength * softens, integrity, -softens
        integrity = integrity_of(known, strength, k_n, critical)
        stiffness = strength * integrity / known if e > 0.0 else k_n
        return stiffness * e, stiffness, integrity, 0.0
    if e <= 0.0 or (left > 0.0 and kappa == 0.0):
        return k_n * e, k_n, 0.0, 0.0
    return 0.0, 0.0, 0.0, 0.0


@law
def shear_limit(properties, i, cracked, integrity, sigma, slope, softens, is_open):
    """Return the largest shear stress (Pa) of a contact of interface i, and how it falls with the opening (Pa/m).

    The limit may be negative beyond the apex of the friction cone. ``slope`` and ``softens`` are those of normal stress
    and bond with the opening.
    """
    if cracked and is_open:
        return 0.0, 0.0
    if not cracked:
        limit, falls = properties.cohesion[i] - sigma * properties.friction[i], properties.friction[i] * slope
    else:
        cohesion, friction = properties.residual_cohesion[i], properties.residual_friction[i]
        more_cohesion, more_friction = properties.cohesion[i] - cohesion, properties.friction[i] - friction
        cohesion, friction = cohesion + integrity * more_cohesion, friction + integrity * more_friction
        limit, falls = cohesion - sigma * friction, friction * slope - softens * (more_cohesion - sigma * more_friction)
    if properties.brittle_shear[i] and integrity > 0.0:
        limit, falls = NO_LIMIT, 0.0  # it breaks there, and does not slide
    strongest = properties.compressive_strength[i]
    if strongest < np.inf:
        ellipse = capped(NO_LIMIT, sigma, strongest, 1.0 / properties.cap_shear[i])
        if ellipse < limit:
            # steep where the cap ends: not quite as steep, for the tangent's sake
            return ellipse, min(sigma, 0.0) * slope / (properties.cap_shear[i] * max(ellipse, STEEPEST * strongest))
    return limit, falls


@rule
def return_mapping(properties, i, cracked, kappa, e, shear):
    """Return a contact's stresses, their slopes and its slip at an opening e and a shear, both less what is remembered.

    Returns
    -------
    sigma, tau : float
        Stresses (Pa).
    nn, ns, sn, ss : float
        Slope of sigma with opening and shear, of tau with opening and shear (Pa/m).
    slip, dilatancy : float
        How far it slides (m), with sign, and opens by that, or closes as it is crushed; an open contact follows the
        shear.
    limit : float
        Largest shear stress (Pa).
    """
    k_n, k_s, psi = properties.normal_stiffness[i], properties.shear_stiffness[i], properties.dilation[i]
    strength, left = properties.tensile_strength[i], properties.residual_tensile_strength[i]
    critical, closing = properties.critical_opening[i], 0.0
    sigma, slope, integrity, softens = normal_law(e, cracked, kappa, k_n, strength, left, critical, True)
    if sigma <= -properties.compressive_strength[i] * AT_LIMIT:
        closing = min(e + properties.compressive_strength[i] / k_n, 0.0)
        sigma, slope = max(sigma, -properties.compressive_strength[i]), 0.0
    tau = k_s * shear
    size = abs(tau)
    gone = cracked and e > 0.0 and sigma == 0.0
    if gone and psi > 0.0 and critical == 0.0 and kappa == 0.0:
        # it touched before: climbing as it slides it may touch still
        pressed, friction = k_n * e, properties.residual_friction[i]
        dilatancy = psi * (size - properties.residual_cohesion[i] + pressed * friction) / (k_s + k_n * friction * psi)
        if dilatancy >= e:
            sigma, slope, gone = pressed, k_n, False
    limit, falls = shear_limit(properties, i, cracked, integrity, sigma, slope, softens, gone)
    if size < limit * AT_LIMIT:
        return sigma, tau, slope, 0.0, 0.0, k_s, 0.0, closing, limit
    if properties.critical_slip[i] > 0.0 and not gone and (cracked or e <= strength / k_n):
        return mixed_mode_return(properties, i, cracked, kappa, e, shear, closing)
    sign = 1.0 if tau >= 0.0 else -1.0
    if gone:
        psi = 0.0  # what is open does not climb
    compliance = 1.0 / (k_s + falls * psi)
    travelled = (size - limit) * compliance
    if psi > 0.0 and cracked and critical > 0.0:
        # what climbs is pressed, and softens less: the limit is no straight line
        for _ in range(SOFT_STEPS):
            closer = e - psi * min(travelled, size / k_s)
            sigma, slope, integrity, softens = normal_law(closer, cracked, kappa, k_n, strength, left, critical, True)
            limit, falls = shear_limit(properties, i, cracked, integrity, sigma, slope, softens, False)
            compliance = 1.0 / (k_s + falls * psi)
            travelled += (size - k_s * travelled - limit) * compliance
        sigma += slope * psi * travelled  # as if at e, along the tangent
    if gone or k_s * travelled >= size:  # beyond the apex: no shear is left
        dilatancy = psi * size / k_s
        return sigma - slope * dilatancy, 0.0, slope, -slope * psi * sign, 0.0, 0.0, tau / k_s, dilatancy + closing, 0.0
    travelled = max(travelled, 0.0)  # at the limit, about to slide
    return (
        sigma - slope * psi * travelled,
        tau - sign * k_s * travelled,
        slope * (1.0 - psi * compliance * falls),
        -sign * slope * psi * compliance * k_s,
        -sign * k_s * compliance * falls,
        k_s * (1.0 - k_s * compliance),
        sign * travelled,
        psi * travelled + closing,
        size - k_s * travelled,
    )


@law
def kappa_before_slip(cracked, kappa, e, first):
    """Return how far a softening bond has been open at an opening e (m), before it slides on; ``first`` if never."""
    return max(kappa, e, first) if cracked else first


@rule
def mixed_mode_return(properties, i, cracked, kappa, e, shear, closing):
    """Return what ``return_mapping`` does for a joint that slides and whose bond wears by it.

    Slip t uses up the bond as the opening kappa = kappa_0 + wear t does, and the limit L follows:
    k_s (|shear| - t) = L(e, t), solved by Newton's method; where L falls by slip alone it is a straight line.

    Parameters
    ----------
    closing : float
        How far it is crushed (m).
    """
    k_n, k_s = properties.normal_stiffness[i], properties.shear_stiffness[i]
    strength, critical = properties.tensile_strength[i], properties.critical_opening[i]
    strongest, c_ss = properties.compressive_strength[i], properties.cap_shear[i]
    slip_weight, first = slip_weight_of(properties, i), strength / k_n
    begun = kappa_before_slip(cracked, kappa, e, first)
    follows = 1.0 if cracked and e >= begun else 0.0  # whether kappa follows the opening
    sign, size = 1.0 if shear >= 0.0 else -1.0, abs(k_s * shear)
    most = size / k_s
    all_gone = max((critical - begun) / slip_weight, 0.0) * (1.0 + 1e-12)  # so that rounding leaves nothing
    cohesion, friction = properties.residual_cohesion[i], properties.residual_friction[i]
    more_cohesion, more_friction = properties.cohesion[i] - cohesion, properties.friction[i] - friction
    t = 0.0
    for _ in range(WEAR_STEPS):
        kappa = begun + slip_weight * t
        integrity = min(max((critical - kappa) / (critical - first), 0.0), 1.0)
        softens = -1.0 / (critical - first) if integrity > 0.0 else 0.0
        if e > 0.0:
            sigma, along = strength * integrity * e / kappa, strength * integrity / kappa
            across = strength * e * (softens * kappa - integrity) / (kappa * kappa)  # with kappa
        else:
            sigma, along, across = max(k_n * e, -strongest), k_n if closing == 0.0 else 0.0, 0.0
            if sigma <= -strongest * AT_LIMIT:
                along = 0.0
        angle = friction + integrity * more_friction
        limit = cohesion + integrity * more_cohesion - sigma * angle
        by_kappa = softens * (more_cohesion - sigma * more_friction) - angle * across
        by_opening = -angle * along + follows * by_kappa
        if strongest < np.inf:
            ellipse = capped(NO_LIMIT, sigma, strongest, 1.0 / c_ss)
            if ellipse < limit:
                limit, by_kappa = ellipse, 0.0
                by_opening = -min(sigma, 0.0) * along / (c_ss * max(ellipse, STEEPEST * strongest))
        by_slip = slip_weight * by_kappa
        gap = size - k_s * t - limit
        if abs(gap) <= WORN * (size + abs(limit)):
            break
        if k_s + by_slip < SNAPS * k_s:
            t = all_gone  # it lets go at once
        else:
            t = min(max(t + gap / (k_s + by_slip), 0.0), most)
            # beyond the kink where nothing is left to wear
            if softens != 0.0 and t > all_gone:
                t = all_gone
    if e > 0.0 and integrity == 0.0:  # it has let go, and is open
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, shear, 0.0, 0.0
    if limit <= 0.0 or t >= most:
        return sigma, 0.0, along + follows * across, 0.0, 0.0, 0.0, shear, closing, 0.0
    stiff = k_s + by_slip
    t_shear, t_opening = k_s / stiff, -by_opening / stiff
    return (
        sigma,
        sign * (size - k_s * t),
        along + follows * across + slip_weight * across * t_opening,
        sign * slip_weight * across * t_shear,
        -sign * k_s * t_opening,
        k_s * (1.0 - t_shear),
        sign * t,
        closing,
        size - k_s * t,
    )


@law
def coulomb_return(k_n, k_s, cohesion, friction, open_carries_nothing, e, shear):
    """Return stresses and slopes (nn, sn, ss) of a joint without dilation, softening, cap or gap.

    Parameters
    ----------
    k_n, k_s, cohesion, friction : float
        Of the joint as it is now, intact or cracked.
    open_carries_nothing : bool
        Whether it is cracked.
    e, shear : float
        Opening, and shear less slip (m).
    """
    if open_carries_nothing and e > 0.0:
        return 0.0, 0.0, 0.0, 0.0, 0.0
    sigma, tau = k_n * e, k_s * shear
    limit = cohesion - sigma * friction
    if abs(tau) < limit * AT_LIMIT:
        return sigma, tau, k_n, 0.0, k_s
    if limit <= 0.0:
        return sigma, 0.0, k_n, 0.0, 0.0
    sign = 1.0 if tau >= 0.0 else -1.0
    return sigma, sign * min(abs(tau), limit), k_n, -sign * friction * k_n, 0.0


@law
def tresca_plain(k_n, k_s, bound, open_carries_nothing, e, shear):
    """Return what ``coulomb_return`` does with a given largest shear stress (Pa), as ``tresca_return``."""
    sigma, slope, tau = k_n * e, k_n, k_s * shear
    if open_carries_nothing and e > 0.0:
        sigma, slope = 0.0, 0.0
    if abs(tau) <= bound:
        return sigma, tau, slope, 0.0, k_s if bound > 0.0 else 0.0
    return sigma, np.copysign(bound, tau), slope, 0.0, 0.0


@law
def is_plain(properties, i):
    """Tell whether ``coulomb_return`` is the law of interface i."""
    return (
        properties.dilation[i] == 0.0
        and properties.critical_opening[i] == 0.0
        and properties.residual_tensile_strength[i] == 0.0
        and not properties.brittle_shear[i]
        and properties.compressive_strength[i] == np.inf
        and properties.gap[i] == 0.0
    )


@law
def tresca_return(properties, i, cracked, kappa, bound, e, shear):
    """Return stresses and slopes (nn, ns, sn, ss) as ``return_mapping``, with a given largest shear stress."""
    k_s = properties.shear_stiffness[i]
    worn = kappa > 0.0 and properties.critical_slip[i] > 0.0
    sigma, slope, _, _ = normal_law(
        e,
        cracked or worn,
        kappa,
        properties.normal_stiffness[i],
        properties.tensile_strength[i],
        properties.residual_tensile_strength[i],
        properties.critical_opening[i],
        False,
    )
    if sigma <= -properties.compressive_strength[i] * AT_LIMIT:
        sigma, slope = max(sigma, -properties.compressive_strength[i]), 0.0
    tau = k_s * shear
    if abs(tau) <= bound:
        return sigma, tau, slope, 0.0, 0.0, k_s if bound > 0.0 else 0.0
    return sigma, np.copysign(bound, tau), slope, 0.0, 0.0, 0.0


@kernel
def joint_forces(active, interfaces, properties, ground, history, tresca, coulomb, displacement, force, stiffness):
    """Add the forces of joints on the blocks to ``force``, and note the stiffness of each interface.

    Parameters
    ----------
    active : array of int
        Interfaces to look at; so for all functions here.
    interfaces, properties, ground, history : NamedTuple of arrays
        Model, displacement of the ground in the present state, and memory of the joints.
    tresca : tuple of array (m, q)
        Largest shear stress (Pa), dilation (m) and largest opening (m) of each contact where they are frozen.
    coulomb : bool
        Whether the live law holds.
    displacement, force : array (3 (n + 1),)
        Of the blocks and the ground.
    stiffness : array (m, 9)
        Filled: slopes of normal force, shear force and moment of an interface with opening and shear at its middle and
        relative rotation, row by row (N/m, N, N m).
    """
    first_ground = interfaces.block_a.size - ground.normal.shape[0]
    bound, dilatant_opening, kappa = tresca
    for i in active:
        opening, shear, turn = interface_displacement(interfaces, displacement, i)
        total_n, total_s, total_m = 0.0, 0.0, 0.0
        nn, ns, nm, sn, ss, sm, mn, ms, mm = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        plain = is_plain(properties, i)
        k_n, k_s = properties.normal_stiffness[i], properties.shear_stiffness[i]
        for k in range(interfaces.contact_area.shape[1]):
            at, area = interfaces.contact_offset[i, k], interfaces.contact_area[i, k]
            u_n, u_s = opening + at * turn, shear - history.slip[i, k]
            if i >= first_ground:
                u_n -= ground.normal[i - first_ground, k]
                u_s -= ground.shear[i - first_ground, k]
            d_ns = 0.0
            if plain and coulomb:
                cracked = history.cracked[i, k]
                cohesion = properties.residual_cohesion[i] if cracked else properties.cohesion[i]
                friction = properties.residual_friction[i] if cracked else properties.friction[i]
                sigma, tau, d_nn, d_sn, d_ss = coulomb_return(k_n, k_s, cohesion, friction, cracked, u_n, u_s)
            elif plain:
                sigma, tau, d_nn, d_sn, d_ss = tresca_plain(
                    k_n, k_s, bound[i, k], history.cracked[i, k], u_n - dilatant_opening[i, k], u_s
                )
            elif coulomb:
                sigma, tau, d_nn, d_ns, d_sn, d_ss, _, _, _ = return_mapping(
                    properties, i, history.cracked[i, k], history.kappa[i, k], u_n - history.dilatant_opening[i, k], u_s
                )
            else:
                sigma, tau, d_nn, d_ns, d_sn, d_ss = tresca_return(
                    properties, i, history.cracked[i, k], kappa[i, k], bound[i, k], u_n - dilatant_opening[i, k], u_s
                )
            total_n += area * sigma
            total_s += area * tau
            total_m += area * at * sigma
            nn += area * d_nn
            ns += area * d_ns
            nm += area * at * d_nn
            sn += area * d_sn
            ss += area * d_ss
            sm += area * at * d_sn
            ms += area * at * d_ns
            mm += area * at * at * d_nn
        mn = nm
        row = stiffness[i]
        row[0], row[1], row[2] = nn, ns, nm
        row[3], row[4], row[5] = sn, ss, sm
        row[6], row[7], row[8] = mn, ms, mm
        scatter_interface_force(interfaces, i, total_n, total_s, total_m, force)


@kernel
def update_tresca_bounds(active, interfaces, properties, ground, history, displacement, tresca, share):
    """Bring frozen shear limits, dilations and openings to what the live law says at a displacement.

    Parameters
    ----------
    share : float
        Share of the change of the limits and dilations that is made, 0 to 1.
    """
    first_ground = interfaces.block_a.size - ground.normal.shape[0]
    bound, dilatant_opening, kappa = tresca
    for i in active:
        opening, shear, turn = interface_displacement(interfaces, displacement, i)
        k_n, plain = properties.normal_stiffness[i], is_plain(properties, i)
        for k in range(interfaces.contact_area.shape[1]):
            u_n, u_s = opening + interfaces.contact_offset[i, k] * turn, shear - history.slip[i, k]
            if i >= first_ground:
                u_n -= ground.normal[i - first_ground, k]
                u_s -= ground.shear[i - first_ground, k]
            cracked, e, old = history.cracked[i, k], u_n - history.dilatant_opening[i, k], bound[i, k]
            if plain:
                limit = properties.cohesion[i] - k_n * e * properties.friction[i]
                if cracked:
                    limit = properties.residual_cohesion[i] - k_n * e * properties.residual_friction[i]
                    limit = limit if e <= 0.0 else 0.0
                bound[i, k] = max(limit if old >= 0.5 * NO_LIMIT else old + share * (limit - old), 0.0)
                continue
            _, _, _, _, _, _, slip, dilatancy, limit = return_mapping(
                properties, i, cracked, history.kappa[i, k], e, u_s
            )
            bound[i, k] = max(limit if old >= 0.5 * NO_LIMIT else old + share * (limit - old), 0.0)
            climbs = dilatancy if properties.dilation[i] > 0.0 else 0.0  # crushing is part of the energy
            dilatant_opening[i, k] += share * (history.dilatant_opening[i, k] + climbs - dilatant_opening[i, k])
            first = properties.tensile_strength[i] / k_n
            if properties.critical_slip[i] > 0.0:
                reached = kappa_before_slip(cracked, history.kappa[i, k], e, first) + slip_weight_of(
                    properties, i
                ) * abs(slip)
                if cracked or (slip != 0.0 and e <= first):
                    kappa[i, k] = max(kappa[i, k], reached)
            elif cracked and properties.critical_opening[i] > 0.0:
                kappa[i, k] = max(kappa[i, k], e - dilatancy, first)


@kernel
def commit_joint_history(active, interfaces, properties, ground, history, displacement, never_opened):
    """Let joints remember an equilibrium: how far they slid, climbed, opened and were crushed.

    Parameters
    ----------
    never_opened : array of bool (m, q)
        Joints without a bond that have never been open; brought up to date.

    Returns
    -------
    friction, crushing, mode_1_dissipation : float
        Dissipated work (J); ``mode_1_dissipation`` is that of the tension of bonds that slip softens, which ``energy``
        cannot tell.
    """
    first_ground = interfaces.block_a.size - ground.normal.shape[0]
    friction, crushing, mode_1_dissipation = 0.0, 0.0, 0.0
    for i in active:
        opening, shear, turn = interface_displacement(interfaces, displacement, i)
        k_n, k_s, plain = properties.normal_stiffness[i], properties.shear_stiffness[i], is_plain(properties, i)
        for k in range(interfaces.contact_area.shape[1]):
            u_n, u_s = opening + interfaces.contact_offset[i, k] * turn, shear - history.slip[i, k]
            if i >= first_ground:
                u_n -= ground.normal[i - first_ground, k]
                u_s -= ground.shear[i - first_ground, k]
            cracked, e = history.cracked[i, k], u_n - history.dilatant_opening[i, k]
            if plain:
                cohesion = properties.residual_cohesion[i] if cracked else properties.cohesion[i]
                rubs = properties.residual_friction[i] if cracked else properties.friction[i]
                sigma, tau, _, _, holds = coulomb_return(k_n, k_s, cohesion, rubs, cracked, e, u_s)
                slip, dilatancy = 0.0, 0.0
                if holds == 0.0:  # open, or at the limit
                    slip = np.copysign(max(abs(u_s) - abs(tau) / k_s, 0.0), u_s)
            else:
                sigma, tau, _, _, _, _, slip, dilatancy, _ = return_mapping(
                    properties, i, cracked, history.kappa[i, k], e, u_s
                )
            never_opened[i, k] &= e <= 0.0
            if slip != 0.0 or dilatancy != 0.0:
                history.slip[i, k] += slip
                history.dilatant_opening[i, k] += dilatancy
                friction += interfaces.contact_area[i, k] * tau * slip
                normal_work = interfaces.contact_area[i, k] * sigma * dilatancy
                if properties.dilation[i] > 0.0:
                    friction += normal_work
                else:
                    crushing += normal_work
            if cracked and properties.critical_opening[i] == 0.0 and properties.residual_tensile_strength[i] == 0.0:
                history.kappa[i, k] = np.inf if sigma == 0.0 and e > 0.0 else 0.0
            strength, critical = properties.tensile_strength[i], properties.critical_opening[i]
            first = strength / k_n
            if properties.critical_slip[i] > 0.0:
                if cracked or (slip != 0.0 and e <= first):
                    before = max(history.kappa[i, k], first)
                    between = kappa_before_slip(cracked, history.kappa[i, k], e, first)
                    after = between + slip_weight_of(properties, i) * abs(slip)
                    taken = softening_work(between, strength, k_n, critical)
                    taken -= softening_work(before, strength, k_n, critical)
                    lost = secant(between, strength, k_n, critical) - secant(after, strength, k_n, critical)
                    mode_1_dissipation += interfaces.contact_area[i, k] * (taken + 0.5 * max(e, 0.0) ** 2 * lost)
                    history.kappa[i, k] = after
                    history.cracked[i, k] = True
            elif cracked and critical > 0.0:
                history.kappa[i, k] = max(history.kappa[i, k], e - dilatancy, first)
    return friction, crushing, mode_1_dissipation


@law
def secant(kappa, strength, k_n, critical):
    """Return the stiffness of a softened bond in tension (Pa/m)."""
    return strength * integrity_of(kappa, strength, k_n, critical) / kappa


@law
def softening_work(kappa, strength, k_n, critical):
    """Return what a bond has taken that softened by opening alone (J/m2): under the curve, less what it gives back."""
    first, reached = strength / k_n, min(kappa, critical)
    holds = strength * integrity_of(reached, strength, k_n, critical)
    return 0.5 * (strength * first + (strength + holds) * (reached - first) - holds * reached)


@law
def softened_bond_load(properties, i, kappa, e, tau, no_strength):
    """Return how far a softened bond is loaded that the first slip breaks: 1 where |tau| is at its limit.

    Beyond, the stress above the limit over the intact cohesion is added. The limit itself falls to nothing as the bond
    opens, so a ratio to it would not tell where on the way it was reached.

    Parameters
    ----------
    kappa, e : float
        kappa of the last equilibrium, and opening less dilation (m).
    tau, no_strength : float
        Shear stress, and stress that breaks a bond without strength (Pa).
    """
    strength, strongest = properties.tensile_strength[i], properties.compressive_strength[i]
    sigma, _, integrity, _ = normal_law(
        e, True, kappa, properties.normal_stiffness[i], strength, 0.0, properties.critical_opening[i], True
    )
    limit = degraded(integrity, properties.cohesion[i], properties.residual_cohesion[i])
    limit -= sigma * degraded(integrity, properties.friction[i], properties.residual_friction[i])
    carried = capped(abs(tau), sigma, strongest, 1.0 / properties.cap_shear[i])
    return 1.0 + (carried - max(limit, 0.0)) / max(properties.cohesion[i], no_strength)


@kernel
def break_in_shear(broken, interfaces, properties, history):
    """Take from softening bonds all that they have left; return the work that softening has taken of them so far (J).

    Parameters
    ----------
    broken : array of bool (m, q)
        Bonds that slip breaks.
    """
    taken = 0.0
    for i in range(broken.shape[0]):
        strength, k_n = properties.tensile_strength[i], properties.normal_stiffness[i]
        for k in range(broken.shape[1]):
            if broken[i, k]:
                if history.cracked[i, k]:
                    kappa = max(history.kappa[i, k], strength / k_n)
                    work = softening_work(kappa, strength, k_n, properties.critical_opening[i])
                    taken += interfaces.contact_area[i, k] * work
                history.cracked[i, k] = True
                history.kappa[i, k] = np.inf
    return taken


@law
def bond_load(stress, strength, block_stress):
    """Return how far a bond is loaded in tension, 1 at its strength.

    Below the stress of a block's weight, a strength is no measure of its own overload; the overload is then a share of
    that stress.
    """
    return stress / strength if strength >= block_stress else 1.0 + (stress - strength) / block_stress


@kernel
def bond_loads(active, interfaces, properties, ground, history, displacement, no_strength, block_stress, load):
    """Fill how far each bond is loaded, 1 at its strength, 0 where there is none; see ``bond_load``.

    A bond that softens breaks once in tension, and then, if its shear is brittle, once more where it would slide.

    Parameters
    ----------
    no_strength : float
        Stress that breaks a bond without strength (Pa).
    block_stress : float
        Weight of a block over the largest area of a contact (Pa).
    load : array (m, q)
        Filled for active interfaces.

    Returns
    -------
    float
        The largest of these, at least 0.
    """
    first_ground, heaviest = interfaces.block_a.size - ground.normal.shape[0], 0.0
    for i in active:
        opening, shear, turn = interface_displacement(interfaces, displacement, i)
        k_n, k_s = properties.normal_stiffness[i], properties.shear_stiffness[i]
        strength = max(properties.tensile_strength[i], no_strength)
        left, critical = properties.residual_tensile_strength[i], properties.critical_opening[i]
        for k in range(interfaces.contact_area.shape[1]):
            load[i, k] = 0.0
            softened = history.cracked[i, k] and properties.brittle_shear[i] and history.kappa[i, k] < critical
            if history.cracked[i, k] and not softened and (left == 0.0 or history.kappa[i, k] > 0.0 or critical > 0.0):
                continue
            u_n, u_s = opening + interfaces.contact_offset[i, k] * turn, shear - history.slip[i, k]
            if i >= first_ground:
                u_n -= ground.normal[i - first_ground, k]
                u_s -= ground.shear[i - first_ground, k]
            if softened:
                e = u_n - history.dilatant_opening[i, k]
                load[i, k] = softened_bond_load(properties, i, history.kappa[i, k], e, k_s * u_s, no_strength)
                heaviest = max(heaviest, load[i, k])
                continue
            sigma = k_n * (u_n - history.dilatant_opening[i, k])
            if properties.dilation[i] > 0.0:  # what slides on the way climbs, and is pulled less
                sigma, _, _, _, _, _, _, _, _ = return_mapping(
                    properties, i, history.cracked[i, k], history.kappa[i, k], u_n - history.dilatant_opening[i, k], u_s
                )
            if history.cracked[i, k]:
                load[i, k] = bond_load(sigma, left, block_stress)
            else:
                load[i, k] = bond_load(sigma, strength, block_stress)
                if properties.brittle_shear[i]:
                    limit = max(properties.cohesion[i] - sigma * properties.friction[i], no_strength)
                    strongest, compliance = properties.compressive_strength[i], 1.0 / properties.cap_shear[i]
                    load[i, k] = max(load[i, k], capped(abs(k_s * u_s), sigma, strongest, compliance) / limit)
            heaviest = max(heaviest, load[i, k])
    return heaviest


@kernel
def farthest_sliding(listed, level, interfaces, properties, ground, history, displacement):
    """Return the farthest level at which a joint slides, is crushed, or closes its gap; -1 if none does.

    Of those whose bond still holds.

    Parameters
    ----------
    listed : array of int
        Interfaces to look at.
    level : array of int (m,)
        Level of each interface.
    """
    farthest = -1
    first_ground = interfaces.block_a.size - ground.normal.shape[0]
    for i in listed:
        if level[i] <= farthest:
            continue
        opening, shear, turn = interface_displacement(interfaces, displacement, i)
        slides = False
        for k in range(interfaces.contact_area.shape[1]):
            u_n, u_s = opening + interfaces.contact_offset[i, k] * turn, shear - history.slip[i, k]
            if i >= first_ground:
                u_n -= ground.normal[i - first_ground, k]
                u_s -= ground.shear[i - first_ground, k]
            sigma = properties.normal_stiffness[i] * (u_n - history.dilatant_opening[i, k])
            if properties.gap[i] > 0.0:
                slides |= sigma < 0.0  # closed here, whatever the other contacts do
                continue
            if sigma > properties.tensile_strength[i] and properties.dilation[i] == 0.0:
                slides = False  # the bond breaks first; one that dilates may slide instead (see bond_loads)
                break
            limit, _ = shear_limit(properties, i, history.cracked[i, k], 1.0, sigma, 0.0, 0.0, False)
            slides |= abs(properties.shear_stiffness[i] * u_s) > limit
            slides |= sigma < -properties.compressive_strength[i]
        if slides:
            farthest = level[i]
    return farthest


@kernel
def contact_stresses(interfaces, properties, ground, history, displacement, opening, sigma, tau):
    """Fill opening (m), normal and shear stress (Pa) of all contacts, arrays (m, q), by the live law."""
    first_ground = interfaces.block_a.size - ground.normal.shape[0]
    for i in range(interfaces.block_a.size):
        middle, shear, turn = interface_displacement(interfaces, displacement, i)
        k_n, k_s, plain = properties.normal_stiffness[i], properties.shear_stiffness[i], is_plain(properties, i)
        for k in range(interfaces.contact_area.shape[1]):
            u_n, u_s = middle + interfaces.contact_offset[i, k] * turn, shear - history.slip[i, k]
            if i >= first_ground:
                u_n -= ground.normal[i - first_ground, k]
                u_s -= ground.shear[i - first_ground, k]
            opening[i, k] = u_n
            cracked, e = history.cracked[i, k], u_n - history.dilatant_opening[i, k]
            if plain:
                cohesion = properties.residual_cohesion[i] if cracked else properties.cohesion[i]
                friction = properties.residual_friction[i] if cracked else properties.friction[i]
                sigma[i, k], tau[i, k], _, _, _ = coulomb_return(k_n, k_s, cohesion, friction, cracked, e, u_s)
            else:
                sigma[i, k], tau[i, k], _, _, _, _, _, _, _ = return_mapping(
                    properties, i, cracked, history.kappa[i, k], e, u_s
                )


@kernel
def energy(listed, interfaces, properties, ground, history, displacement, on_ground):
    """Return what the joints store (J) and what softening has taken (J), and fill the forces on the ground.

    Memory must be that of the equilibrium at the displacement; only listed interfaces count. Of bonds that wear by
    slip, and of those that slip has broken, ``commit_joint_history`` and ``break_in_shear`` tell what softening took.

    Parameters
    ----------
    on_ground : NamedTuple of arrays (g, q)
        Normal and shear force that do work on the displacement of the ground, contact by contact (N); filled.
    """
    stored, softened = 0.0, 0.0
    first_ground = interfaces.block_a.size - ground.normal.shape[0]
    for i in listed:
        opening, shear, turn = interface_displacement(interfaces, displacement, i)
        k_n, k_s = properties.normal_stiffness[i], properties.shear_stiffness[i]
        strength, critical = properties.tensile_strength[i], properties.critical_opening[i]
        plain = is_plain(properties, i)
        for k in range(interfaces.contact_area.shape[1]):
            area = interfaces.contact_area[i, k]
            u_n, u_s = opening + interfaces.contact_offset[i, k] * turn, shear - history.slip[i, k]
            if i >= first_ground:
                u_n -= ground.normal[i - first_ground, k]
                u_s -= ground.shear[i - first_ground, k]
            cracked, e = history.cracked[i, k], u_n - history.dilatant_opening[i, k]
            if plain:
                cohesion = properties.residual_cohesion[i] if cracked else properties.cohesion[i]
                friction = properties.residual_friction[i] if cracked else properties.friction[i]
                sigma, tau, _, _, _ = coulomb_return(k_n, k_s, cohesion, friction, cracked, e, u_s)
            else:
                sigma, tau, _, _, _, _, _, _, _ = return_mapping(properties, i, cracked, history.kappa[i, k], e, u_s)
            stored += 0.5 * area * sigma * e
            stored += 0.5 * area * tau * tau / k_s
            if cracked and properties.critical_slip[i] == 0.0 and critical > 0.0 and history.kappa[i, k] < np.inf:
                softened += area * softening_work(max(history.kappa[i, k], strength / k_n), strength, k_n, critical)
            if i >= first_ground:
                on_ground.normal[i - first_ground, k] = -area * sigma
                on_ground.shear[i - first_ground, k] = -area * tau
    return stored, softened
