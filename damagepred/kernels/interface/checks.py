"""Checks of the joint law at a displacement: loads of the bonds, inelastic condensed joints, violation by stresses.

Arguments as in ``internal_force``. A bond fails where its load passes 1.
"""

import numpy as np

from damagepred.kernels.interface.kinematics import ground_at, interface_displacement
from damagepred.kernels.jit import law
from damagepred.kernels.joint.limits import capped, coulomb_limit, shear_limit
from damagepred.kernels.joint.return_mapping import coulomb_return, is_plain, normal_law
from damagepred.kernels.joint.softening import degraded, integrity_of


@law
def bond_load(stress, strength, block_stress):
    """Load of a bond in tension, 1 at its strength; ``block_stress`` is the stress of a block's weight (Pa)."""
    # a strength below the stress of a block's weight is no scale for the overload
    return stress / strength if strength >= block_stress else 1.0 + (stress - strength) / block_stress


@law
def softened_bond_load(general, parameters, kappa, e, tau, no_strength):
    """Load of a softening bond that slip breaks: 1 where |tau| is at its limit."""
    # overload over the intact cohesion: the limit itself falls to 0 as the bond opens, and would not locate the event
    p = parameters
    if general is None:
        return 0.0
    sigma, _, integrity, _ = normal_law(p, True, kappa, e, True)
    cohesion = degraded(integrity, p.cohesion, p.residual_cohesion)
    limit = coulomb_limit(cohesion, degraded(integrity, p.friction, p.residual_friction), sigma)
    return 1.0 + (capped(abs(tau), sigma, p) - max(limit, 0.0)) / max(p.cohesion, no_strength)


@law
def _load_of_contact(joints, general, p, plain, cracked, kappa, e, u_s):
    """Load of the bond of a contact, 1 at its strength, 0 without bond or where it softens instead of breaking.

    ``e`` is the opening less dilatant opening, ``u_s`` the shear less slip (m).
    """
    no_strength, block_stress, residual = joints.no_strength, joints.block_stress, p.residual_tensile_strength
    if not plain and p.critical_opening > 0.0:
        breaks = p.brittle_shear and kappa < p.critical_opening
        tau = p.shear_stiffness * u_s
        return softened_bond_load(general, p, kappa, e, tau, no_strength) if breaks else 0.0
    if cracked and (plain or residual == 0.0 or kappa > 0.0):
        return 0.0
    sigma = p.normal_stiffness * e
    if not plain and p.dilation > 0.0:  # the dilatancy of slip along the step reduces the tension
        sigma, _, _, _, _, _, _, _, _ = coulomb_return(p, general, plain, cracked, kappa, e, u_s)
    if cracked:
        return bond_load(sigma, residual, block_stress)
    load = bond_load(sigma, max(p.tensile_strength, no_strength), block_stress)
    if not plain and p.brittle_shear:
        limit = max(coulomb_limit(p.cohesion, p.friction, sigma), no_strength)
        load = max(load, capped(abs(p.shear_stiffness * u_s), sigma, p) / limit)
    return load


@law
def bond_loads(listed, joints, general, ground, history, displacement, load):
    """Fill the load of each bond of listed interfaces, 1 at its strength, 0 without bond; return the largest."""
    edges, offsets, areas, properties = joints.edge, joints.contact_offset, joints.contact_area, joints.properties
    slips, openings, cracks, kappas = history.slip, history.dilatant_opening, history.cracked, history.kappa
    elastic, on_normal, on_shear = joints.elastic, ground.normal, ground.shear
    first_ground = edges.size - on_normal.shape[0]
    heaviest = 0.0
    for i in listed:
        opening_i, shear_i, turn_i = interface_displacement(edges[i], elastic, displacement, i)
        p = properties[i]
        plain = is_plain(p, general)
        for k in range(areas.shape[1]):
            u_n = opening_i + offsets[i, k] * turn_i - ground_at(on_normal, first_ground, i, k)
            u_s = shear_i - slips[i, k] - ground_at(on_shear, first_ground, i, k)
            cracked, kappa, e = cracks[i, k], kappas[i, k], u_n - openings[i, k]
            load[i, k] = _load_of_contact(joints, general, p, plain, cracked, kappa, e, u_s)
            heaviest = max(heaviest, load[i, k])
    return heaviest


@law
def check_elastic(listed, joints, general, ground, history, displacement, slides, load):
    """Mark listed interfaces in ``slides`` that leave the elastic range; fill their bond loads, return the largest."""
    edges, offsets, areas, properties = joints.edge, joints.contact_offset, joints.contact_area, joints.properties
    slips, openings, cracks, kappas = history.slip, history.dilatant_opening, history.cracked, history.kappa
    elastic, on_normal, on_shear = joints.elastic, ground.normal, ground.shear
    first_ground = edges.size - on_normal.shape[0]
    heaviest = 0.0
    for i in listed:
        p, inelastic = properties[i], False
        opening_i, shear_i, turn_i = interface_displacement(edges[i], elastic, displacement, i)
        plain = is_plain(p, general)
        for k in range(areas.shape[1]):
            u_n = opening_i + offsets[i, k] * turn_i - ground_at(on_normal, first_ground, i, k)
            u_s = shear_i - slips[i, k] - ground_at(on_shear, first_ground, i, k)
            cracked, kappa, e = cracks[i, k], kappas[i, k], u_n - openings[i, k]
            load[i, k] = _load_of_contact(joints, general, p, plain, cracked, kappa, e, u_s)
            heaviest, sigma = max(heaviest, load[i, k]), p.normal_stiffness * e
            if p.gap > 0.0:
                inelastic |= sigma < 0.0  # one closed contact is enough
                continue
            limit = coulomb_limit(p.cohesion, p.friction, sigma)
            if general is not None:
                limit, _ = shear_limit(p, 1.0, sigma, 0.0, 0.0)
            inelastic |= abs(p.shear_stiffness * u_s) > limit
            inelastic |= sigma < -p.compressive_strength
            inelastic |= p.critical_opening > 0.0 and sigma > p.tensile_strength
        slides[i] = inelastic
    return heaviest


@law
def joint_law_violation_of(general, properties, cracked, kappa, sigma, tau):
    """Largest violation of the joint law by the stresses (Pa), NaN if a stress is."""
    largest, finite = 0.0, True
    for i in range(sigma.shape[0]):
        p = properties[i]
        for k in range(sigma.shape[1]):
            integrity = 0.0 if cracked[i, k] else 1.0
            if general is not None and cracked[i, k]:
                integrity = integrity_of(p, max(kappa[i, k], p.tensile_strength / p.normal_stiffness))
            tension = sigma[i, k] - degraded(integrity, p.tensile_strength, p.residual_tensile_strength)
            cohesion = degraded(integrity, p.cohesion, p.residual_cohesion)
            friction = degraded(integrity, p.friction, p.residual_friction)
            limit = max(coulomb_limit(cohesion, friction, sigma[i, k]), 0.0)
            if general is not None:
                limit = capped(limit, sigma[i, k], p)
            shear = abs(tau[i, k]) - limit
            finite &= sigma[i, k] == sigma[i, k] and tau[i, k] == tau[i, k]
            largest = max(largest, max(tension, max(shear, -sigma[i, k] - p.compressive_strength)))
    return largest if finite else np.nan
