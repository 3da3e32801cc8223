"""Commit of the history variables at an equilibrium, and the work that the joints dissipate by it."""

import numpy as np

from damagepred.kernels.interface.kinematics import elastic_trial, interface_displacement
from damagepred.kernels.jit import kernel
from damagepred.kernels.joint.return_mapping import coulomb_return, is_plain, return_mapping
from damagepred.kernels.joint.softening import kappa_before_slip, secant_stiffness, slip_weight_of, softening_work


@kernel
def commit_joint_history(active, interfaces, properties, options, ground, history, displacement, never_opened):
    """Update slip, dilatant opening, kappa and cracking of the contacts to an equilibrium.

    Parameters
    ----------
    active, interfaces, properties, options, ground, history, displacement
        As ``damagepred.kernels.interface.internal_force.joint_forces``; ``history`` is updated.
    never_opened : array of bool (m, q)
        Contacts without bond that have never been open; updated.

    Returns
    -------
    friction, crushing, mode_1_dissipation : float
        Dissipated work (J); the last is that of the tension of bonds that soften by slip, which ``energy`` leaves out.
    """
    friction, crushing, mode_1_dissipation = 0.0, 0.0, 0.0
    for i in active:
        middle = interface_displacement(interfaces, displacement, i)
        k_n, k_s, plain = properties.normal_stiffness[i], properties.shear_stiffness[i], is_plain(properties, i)
        f_t, w_c = properties.tensile_strength[i], properties.critical_opening[i]
        kappa_0 = f_t / k_n
        for k in range(interfaces.contact_area.shape[1]):
            area, kappa = interfaces.contact_area[i, k], history.kappa[i, k]
            u_n, u_s = elastic_trial(interfaces, ground, history, middle, i, k)
            cracked, e = history.cracked[i, k], u_n - history.dilatant_opening[i, k]
            if plain:
                sigma, tau, _, _, stiffness = coulomb_return(properties, i, cracked, e, u_s, options)
                slip, dilatancy = 0.0, 0.0
                if stiffness == 0.0:  # open, or at the limit
                    slip = np.copysign(max(abs(u_s) - abs(tau) / k_s, 0.0), u_s)
            else:
                sigma, tau, _, _, _, _, slip, dilatancy, _ = return_mapping(
                    properties, i, cracked, kappa, e, u_s, options
                )
            never_opened[i, k] &= e <= 0.0
            if slip != 0.0 or dilatancy != 0.0:
                history.slip[i, k] += slip
                history.dilatant_opening[i, k] += dilatancy
                friction += area * tau * slip
                normal_work = area * sigma * dilatancy
                if properties.dilation[i] > 0.0:
                    friction += normal_work
                else:
                    crushing += normal_work
            if cracked and w_c == 0.0 and properties.residual_tensile_strength[i] == 0.0:
                history.kappa[i, k] = np.inf if sigma == 0.0 and e > 0.0 else 0.0
            if properties.critical_slip[i] > 0.0:
                if cracked or (slip != 0.0 and e <= kappa_0):
                    before, between = max(kappa, kappa_0), kappa_before_slip(cracked, kappa, e, kappa_0)
                    after = between + slip_weight_of(properties, i) * abs(slip)
                    work = softening_work(between, f_t, k_n, w_c)
                    work -= softening_work(before, f_t, k_n, w_c)
                    drop = secant_stiffness(between, f_t, k_n, w_c) - secant_stiffness(after, f_t, k_n, w_c)
                    mode_1_dissipation += area * (work + 0.5 * max(e, 0.0) ** 2 * drop)
                    history.kappa[i, k] = after
                    history.cracked[i, k] = True
            elif cracked and w_c > 0.0:
                history.kappa[i, k] = max(kappa, e - dilatancy, kappa_0)
    return friction, crushing, mode_1_dissipation


@kernel
def break_in_shear(broken, interfaces, properties, history):
    """Set the integrity of softening bonds to 0 where slip breaks them; return the work they had dissipated (J).

    Parameters
    ----------
    broken : array of bool (m, q)
        Bonds that slip breaks.
    interfaces, properties, history
        As ``damagepred.kernels.interface.internal_force.joint_forces``; ``history`` is updated.
    """
    dissipated = 0.0
    for i in range(broken.shape[0]):
        f_t, k_n = properties.tensile_strength[i], properties.normal_stiffness[i]
        for k in range(broken.shape[1]):
            if broken[i, k]:
                if history.cracked[i, k]:
                    kappa = max(history.kappa[i, k], f_t / k_n)
                    work = softening_work(kappa, f_t, k_n, properties.critical_opening[i])
                    dissipated += interfaces.contact_area[i, k] * work
                history.cracked[i, k] = True
                history.kappa[i, k] = np.inf
    return dissipated
