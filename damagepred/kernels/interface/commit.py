"""Commit of the history variables at an equilibrium, and the energy that the joints store and dissipate."""

import numpy as np

from damagepred.kernels.interface.kinematics import ground_at, interface_displacement
from damagepred.kernels.jit import kernel, law
from damagepred.kernels.joint.return_mapping import coulomb_return, is_plain
from damagepred.kernels.joint.softening import (
    integrity_of,
    kappa_before_slip,
    secant_stiffness,
    softening_work,
    updated_kappa,
)


@law
def _soften(general, p, cracked, kappa, e, slip, dilatancy):
    """Kappa and cracking after an equilibrium, and the work of softening (J/m2).

    If slip softens the bond, the work is of tension since the last commit; otherwise all work since it was intact.
    """
    if general is None:
        return kappa, cracked, 0.0, 0.0
    after, softens = updated_kappa(p, cracked, kappa, e, slip, dilatancy)
    kappa_0, work, softened = p.tensile_strength / p.normal_stiffness, 0.0, 0.0
    if softens and p.slip_weight > 0.0:
        opened = kappa_before_slip(p, kappa, e)
        work = softening_work(p, opened) - softening_work(p, max(kappa, kappa_0))
        drop = secant_stiffness(p, opened, integrity_of(p, opened))
        drop -= secant_stiffness(p, after, integrity_of(p, after))
        work += 0.5 * max(e, 0.0) ** 2 * drop
    elif softens and p.slip_weight == 0.0 and after < np.inf:
        softened = softening_work(p, max(after, kappa_0))
    return after, softens, work, softened


@law
def commit_joint_history(listed, joints, general, ground, history, displacement, never_opened, on_ground):
    """Update the history of the contacts of listed interfaces to an equilibrium, in place.

    Returns work since the last commit: friction, crushing, and tension of bonds that slip softens; then energy from
    rest: stored, and work of all other softening bonds (J). ``never_opened`` becomes False at contacts that open;
    ``on_ground`` takes normal and shear forces of the contacts on the ground (N).
    """
    edges, offsets, areas, properties = joints.edge, joints.contact_offset, joints.contact_area, joints.properties
    slips, openings, cracks, kappas = history.slip, history.dilatant_opening, history.cracked, history.kappa
    elastic, on_normal, on_shear = joints.elastic, ground.normal, ground.shear
    first_ground = edges.size - on_normal.shape[0]
    friction, crushing, mode_1_dissipation, stored, softened = 0.0, 0.0, 0.0, 0.0, 0.0
    for i in listed:
        opening_i, shear_i, turn_i = interface_displacement(edges[i], elastic, displacement, i)
        p = properties[i]
        plain = is_plain(p, general)
        w_c = p.critical_opening
        for k in range(areas.shape[1]):
            area, kappa = areas[i, k], kappas[i, k]
            u_n = opening_i + offsets[i, k] * turn_i - ground_at(on_normal, first_ground, i, k)
            u_s = shear_i - slips[i, k] - ground_at(on_shear, first_ground, i, k)
            cracked, e = cracks[i, k], u_n - openings[i, k]
            sigma, tau, _, _, _, _, slip, dilatancy, _ = coulomb_return(p, general, plain, cracked, kappa, e, u_s)
            never_opened[i, k] &= e <= 0.0
            if slip != 0.0 or dilatancy != 0.0:
                slips[i, k] += slip
                openings[i, k] += dilatancy
                friction += area * tau * slip
                normal_work = area * sigma * dilatancy
                if p.dilation > 0.0:
                    friction += normal_work
                else:
                    crushing += normal_work
            if cracked and w_c == 0.0 and p.residual_tensile_strength == 0.0:
                kappas[i, k] = np.inf if sigma == 0.0 and e > 0.0 else 0.0
            if not plain and w_c > 0.0:
                after, softens, work, total = _soften(general, p, cracked, kappa, e, slip, dilatancy)
                mode_1_dissipation += area * work
                softened += area * total
                kappas[i, k], cracks[i, k] = after, softens
            stored += 0.5 * area * (sigma * (e - dilatancy) + tau * tau / p.shear_stiffness)
            if i >= first_ground:
                on_ground[0][i - first_ground, k] = -area * sigma
                on_ground[1][i - first_ground, k] = -area * tau
    return friction, crushing, mode_1_dissipation, stored, softened


@kernel
def break_in_shear(broken, interfaces, history):
    """Set the integrity of softening bonds to 0 where slip breaks them; return their dissipated work (J)."""
    dissipated = 0.0
    for i in range(broken.shape[0]):
        p = interfaces.properties[i]
        for k in range(broken.shape[1]):
            if broken[i, k]:
                if history.cracked[i, k]:
                    kappa = max(history.kappa[i, k], p.tensile_strength / p.normal_stiffness)
                    dissipated += interfaces.contact_area[i, k] * softening_work(p, kappa)
                history.cracked[i, k] = True
                history.kappa[i, k] = np.inf
    return dissipated
